//! Diagne et al. 2015: what the paper shows as curves, as numbers and plots.

use maud::{Markup, html};

use super::experiment::{Examined, SLOPES_PER_M, settles};
use super::robustness::{MISMATCHES, RobustnessOutcome, run_mismatched};
use super::run::RunError;
use super::{
    CASES, PlugResponse, PlugSample, PulsationCase, SETPOINT, paper_controller, saturated,
};
use crate::extruder::screw::control::Scheme;
use crate::extruder::screw::feasible::Feasibility;
use crate::extruder::screw::{FillFeedback, Screw, TurnUnit};
use crate::io::progress::Progress;
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette;
use crate::report::chart::palette::Ink;
use crate::report::chart::plot::{Plot, PlotLayer as Drawn, y_range};
use crate::report::chart::range::Range;
use crate::report::chart::series::Curve;
use crate::studies::error::ReproduceError;
use crate::studies::publication::Publication;
use crate::studies::study::{Effort, Reproduced, Section, TableRows};

/// What progress is told of.
pub const EXPERIMENTS: u64 = 4;
/// How much of a run is drawn: until all predictors have settled, and all \[s\].
const BEGINNING: Range = Range::new(0.0, 3.0);
const ALL: Range = Range::new(0.0, 60.0);
const ABOUT: &str = "The paper prints curves and no numbers of them, so that nothing stands under \
    published. Simulated: plant, delay and predictor in the paper's scheme, Euler steps of 1 ms. \
    Ours: the predictor of high order on a plant that is integrated to high order; where a controller is \
    named, on that controller. Settled means within 1.2 mm, 2 % of the step from 100 to 160 mm, for good. \
    The largest fill is 0.9; the paper does not print its own.";

/// Runs the experiments.
pub fn run(_: Effort, progress: &mut Progress) -> Result<Reproduced, ReproduceError> {
    let mut rows = TableRows::of(Publication::Diagne2015);
    let mut sections = Vec::new();
    controller_rows(&mut rows)?;
    sections.push(feasibility(&mut rows)?);
    for case in CASES {
        let found = Examined::run(case)?;
        case_rows(&mut rows, &found);
        sections.push(case_section(&found));
        progress.advance();
    }
    robustness_rows(&mut rows)?;
    progress.advance();
    let title = "Diagne et al. 2015";
    Ok(Reproduced { title, about: ABOUT.to_owned(), rows: rows.into_vec(), sections })
}

fn controller_rows(rows: &mut TableRows) -> Result<(), RunError> {
    let [case, ..] = CASES;
    let screw = case.screw(TurnUnit::RadPerS)?;
    let turns = case.screw(TurnUnit::RevPerS)?;
    let controller = paper_controller(&screw)?;
    let (left, right) = controller.gains_per_m();
    for (quantity, unit, value) in [
        ("θ1, speed read in rad/s", "m/s", screw.theta1_m_per_s),
        ("θ1, speed read in rev/s", "m/s", turns.theta1_m_per_s),
        ("θ2", "1/m", screw.theta2_per_m),
        ("flattest slope S_min", "1/m", SETPOINT.min_slope(&screw)?),
        ("slope S", "1/m", controller.slope_per_m()),
        ("gain to the left a_l", "1/m", left),
        ("gain to the right a_r", "1/m", right),
    ] {
        rows.push("parameters", (quantity, unit), [None, Some(value), Some(value)]);
    }
    Ok(())
}

fn feasibility(rows: &mut TableRows) -> Result<Section, RunError> {
    let mut judged = Vec::new();
    for (unit, name) in [(TurnUnit::RadPerS, "rad/s"), (TurnUnit::RevPerS, "rev/s")] {
        for case in CASES.iter().filter(|case| case.pulsation.relative_amplitude > 0.0) {
            let verdict = Feasibility::judge(&case.screw(unit)?);
            let title = format!("{}, speed read in {name}", case.name);
            let (printed, sharp) = (verdict.paper, verdict.exact);
            for (what, theirs, ours) in [
                (("bound of sin/(1 + ε·cos)²", ""), printed.factor, sharp.factor),
                (("largest growth of the delay", "s/s"), printed.growth, sharp.growth),
                (
                    ("ε·ω with that bound", "rad/s"),
                    printed.pulsation_rad_per_s,
                    sharp.pulsation_rad_per_s,
                ),
                (
                    ("what it must be below", "rad/s"),
                    verdict.thresholds.reach,
                    verdict.thresholds.reach,
                ),
            ] {
                rows.push(&title, what, [None, Some(theirs), Some(ours)]);
            }
            judged.push((title, verdict));
        }
    }
    let drawing = html! { table {
        thead { tr { th { "case" } th { "with the exact bound" } th { "as printed" } } }
        tbody { @for (title, verdict) in &judged { tr {
            td { (title) }
            td { (verdict) }
            td {
                (verdict.paper.condition.map_or("no condition is met".to_owned(), |met| {
                    format!("{met} is met")
                }))
            }
        } } }
    } };
    let heading = "Does what is fed always reach the plug?".to_owned();
    let hint = "The delay must never grow by a second a second. The paper bounds its growth with \
                1/(1 − ε)², the exact bound is the largest sin/(1 + ε·cos)² of a turn."
        .to_owned();
    Ok(Section { heading, hint, drawing })
}

fn case_rows(rows: &mut TableRows, found: &Examined) {
    let name = found.case.name;
    let target = SETPOINT.plug.get();
    let mut push = |(quantity, unit), theirs: Option<f64>, ours: Option<f64>| {
        rows.push(name, (quantity, unit), [None, theirs, ours]);
    };
    let first = Some(found.first_effect_s);
    push(("first effect of the control", "s"), first, first);
    push(("open loop settles", "s"), settles(&found.open), None);
    let swing = found.cycle();
    let peaks = swing.map(|swing| swing.peak_to_peak_mm);
    push(("no predictor: oscillation, peak to peak", "mm"), peaks, None);
    push(("no predictor: period of the oscillation", "s"), swing.map(|swing| swing.period_s), None);
    let (informed, uninformed) = (&found.informed, &found.uninformed);
    for (quantity, pair) in [
        ("predictor (time and state) settles", informed),
        ("predictor (state only) settles", uninformed),
    ] {
        push((quantity, "s"), settles(&pair.paper), settles(&pair.exact));
    }
    for (quantity, pair) in [
        ("predictor (time and state) overshoots by", informed),
        ("predictor (state only) overshoots by", uninformed),
    ] {
        let beyond = |course: &PlugResponse| Some(course.overshoot_mm(target));
        push((quantity, "mm"), beyond(&pair.paper), beyond(&pair.exact));
    }
    let [theirs, ours] = found.max_deviation_mm.map(Some);
    push(("farthest from the delay-free loop", "mm"), theirs, ours);
    let steeper = ["saturated controller, 60/m, settles", "… 100/m, settles", "… 200/m, settles"];
    for (quantity, course) in steeper.into_iter().zip(&found.straight) {
        push((quantity, "s"), None, settles(course));
    }
    push(("soonest that the largest feed allows", "s"), Some(found.soonest_s), None);
}

fn robustness_rows(rows: &mut TableRows) -> Result<(), RunError> {
    let [_, _, case] = CASES;
    let screw: Screw = case.screw(TurnUnit::RadPerS)?;
    let paper = FillFeedback::Exponential(paper_controller(&screw)?);
    let ours = saturated(&screw, SLOPES_PER_M[0])?;
    for (name, trouble) in MISMATCHES {
        let theirs = run_mismatched(&case, trouble, paper, Scheme::Paper)?;
        let same = run_mismatched(&case, trouble, paper, Scheme::Exact)?;
        let ours = run_mismatched(&case, trouble, ours, Scheme::Exact)?;
        let title = format!("b at 200 Hz: {name}");
        let mut push =
            |what, of: fn(&RobustnessOutcome) -> Option<f64>, ours: &RobustnessOutcome| {
                rows.push(&title, what, [None, of(&theirs), of(ours)]);
            };
        push(("settles, paper's controller", "s"), |found| found.settles_s, &same);
        push(("settles, saturated controller", "s"), |found| found.settles_s, &ours);
        push(("overshoots by, paper's controller", "mm"), |found| Some(found.overshoot_mm), &same);
        push(("overshoots by, saturated controller", "mm"), |f| Some(f.overshoot_mm), &ours);
        push(("RMS error at the end", "mm"), |found| Some(found.steady_error_mm), &ours);
        push(("RMS change of the feed at the end", ""), |found| Some(found.feed_change), &ours);
    }
    Ok(())
}

/// A run that is drawn.
struct Line<'a> {
    name: &'a str,
    ink: Ink,
    course: &'a PlugResponse,
}

fn case_section(found: &Examined) -> Section {
    let line = |name, ink, course| Line { name, ink, course };
    let open = line("open loop", palette::DEMAND, &found.open);
    let bare = line("no predictor", palette::SPEED, &found.uncompensated);
    let lines = [
        line("predictor, state only", palette::FLOW, &found.uninformed.paper),
        line("predictor, time and state", palette::PAPER, &found.informed.paper),
        line("ours, saturated controller", palette::OURS, &found.straight[0]),
    ];
    let short: Vec<&Line<'_>> = [&open, &bare].into_iter().chain(&lines).collect();
    let (plug, fill, delay): (Of, Of, Of) = (|s| s.plug_mm, |s| s.fill, |s| s.delay_s);
    let drawing = html! {
        (names(&short))
        (draw(&short, BEGINNING, ("filled length x [mm]", plug), Some(SETPOINT.plug.get())))
        (draw(&short, BEGINNING, ("fill U", fill), Some(SETPOINT.max_fill)))
        (draw(&short, BEGINNING, ("delay D [s]", delay), None))
        (names(&[&open, &bare]))
        (draw(&[&open, &bare], ALL, ("filled length x [mm]", plug), Some(SETPOINT.plug.get())))
        (draw_prediction(found))
        (draw_misses(found))
    };
    let hint = match found.case.pulsation.relative_amplitude {
        0.0 => "The conveying speed is steady: both predictors are the same.",
        _ => "The conveying speed pulsates; the predictor of the state only takes it for steady.",
    };
    let heading = format!("Conveying speed {}", heading(&found.case));
    Section { heading, hint: hint.to_owned(), drawing }
}

fn heading(case: &PulsationCase) -> String {
    if case.pulsation.relative_amplitude > 0.0 {
        format!("of case {}", case.name)
    } else {
        case.name.to_owned()
    }
}

type Of = fn(&PlugSample) -> f64;

fn names(lines: &[&Line<'_>]) -> Markup {
    let entries: Vec<_> = lines.iter().map(|line| (line.name, line.ink, "")).collect();
    legend(&entries)
}

fn draw(
    lines: &[&Line<'_>],
    range: Range,
    (y_title, of): (&str, Of),
    level: Option<f64>,
) -> Markup {
    let curves: Vec<(Curve, Ink)> =
        lines.iter().map(|line| (during(line.course, range, of), line.ink)).collect();
    let name = level.map(|level| level.to_string()).unwrap_or_default();
    let mut layers: Vec<Drawn<'_>> =
        curves.iter().map(|(curve, ink)| Drawn::Curve(curve, *ink)).collect();
    layers.extend(level.map(|level| Drawn::Level(level, palette::TARGET, &name)));
    let axis = XAxis::time(range);
    let shown: Vec<&Curve> = curves.iter().map(|(curve, _)| curve).collect();
    let levels: Vec<f64> = level.into_iter().collect();
    let y_range = y_range(&shown, &levels);
    Plot { area: Area::wide(200.0), x: &axis, y_title, y_range, layers }.draw()
}

fn during(course: &PlugResponse, range: Range, of: Of) -> Curve {
    let inside =
        course.samples.iter().filter(|sample| (range.min..=range.max).contains(&sample.at_s));
    inside.map(|sample| (sample.at_s, of(sample))).collect()
}

/// What was foretold, at the moment for which it was, beside what came.
fn draw_prediction(found: &Examined) -> Markup {
    let course = &found.informed.exact;
    let until = |points: Vec<(f64, f64)>| {
        points.into_iter().filter(|(at_s, _)| *at_s <= BEGINNING.max).collect::<Curve>()
    };
    let predicted = course.samples.iter().filter_map(|s| s.predicted.map(|(mm, at_s)| (at_s, mm)));
    let predicted = until(predicted.collect());
    let oracle = until(found.oracle.clone());
    let came = during(course, BEGINNING, |sample| sample.plug_mm);
    let axis = XAxis::time(BEGINNING);
    let plot = Plot {
        area: Area::wide(200.0),
        x: &axis,
        y_title: "filled length x [mm]",
        y_range: y_range(&[&predicted, &oracle, &came], &[]),
        layers: vec![
            Drawn::Curve(&came, palette::OURS),
            Drawn::Curve(&predicted, palette::MODEL),
            Drawn::Demand(&oracle, palette::TARGET),
        ],
    };
    html! {
        (legend(&[
            ("plug, paper's controller with our predictor", palette::OURS, ""),
            ("predicted, drawn at the time predicted for", palette::MODEL, ""),
            ("delay-free loop from the first effect on", palette::TARGET, "dash"),
        ]))
        (plot.draw())
    }
}

/// How far either scheme's loop is from the delay-free one.
fn draw_misses(found: &Examined) -> Markup {
    let miss = |course: &PlugResponse| {
        let first = course.samples.partition_point(|sample| sample.at_s < found.first_effect_s);
        let late = course.samples.get(first..).unwrap_or_default();
        let pairs = late.iter().zip(&found.oracle);
        let points = pairs.map(|(sample, (at_s, plug))| (*at_s, sample.plug_mm - plug));
        points.filter(|(at_s, _)| *at_s <= BEGINNING.max).collect::<Curve>()
    };
    let (paper, exact) = (miss(&found.informed.paper), miss(&found.informed.exact));
    let axis = XAxis::time(BEGINNING);
    let plot = Plot {
        area: Area::wide(160.0),
        x: &axis,
        y_title: "plug less delay-free [mm]",
        y_range: y_range(&[&paper, &exact], &[0.1, -0.1]),
        layers: vec![Drawn::Curve(&paper, palette::PAPER), Drawn::Curve(&exact, palette::OURS)],
    };
    html! {
        (legend(&[
            ("the paper's Euler steps", palette::PAPER, ""),
            ("high order over the exact delay", palette::OURS, ""),
        ]))
        (plot.draw())
    }
}
