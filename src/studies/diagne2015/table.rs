//! Diagne et al. 2015: the curves of the paper as numbers and plots.

use maud::{Markup, html};

use super::experiment::{Examined, SLOPES_PER_M, settles};
use super::robustness::{MISMATCHES, RobustnessOutcome, run_mismatched};
use super::run::RunError;
use super::{CASES, PlugResponse, PlugSample, SETPOINT, paper_controller, saturated};
use crate::extruder::screw::control::Scheme;
use crate::extruder::screw::feasible::Feasibility;
use crate::extruder::screw::{FillFeedback, TurnUnit};
use crate::io::progress::Progress;
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::palette::{self, Ink};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::CurvePoint;
use crate::studies::error::ReproduceError;
use crate::studies::plot::{Line, legend_of, plot, plot_with_legend};
use crate::studies::publication::Publication;
use crate::studies::study::{Effort, Reproduced, Section, TableRows};

/// Steps of the progress bar. Derived: the three [`CASES`] and the mismatches.
pub const EXPERIMENTS: u64 = 4;
/// Time range of most plots: until all predictors have settled \[s\].
const BEGINNING: Range = Range::new(0.0, 3.0);
/// Time range of the whole run \[s\].
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
        rows.compare("parameters", (quantity, unit), value, value);
    }
    Ok(())
}

fn feasibility(rows: &mut TableRows) -> Result<Section, RunError> {
    let mut judged = Vec::new();
    for (unit, name) in [(TurnUnit::RadPerS, "rad/s"), (TurnUnit::RevPerS, "rev/s")] {
        for case in CASES.iter().filter(|case| case.pulsation.relative_amplitude > 0.0) {
            let verdict = Feasibility::judge(&case.screw(unit)?);
            let title = format!("{}, speed read in {name}", case.name);
            let (paper, exact, reach) = (verdict.paper, verdict.exact, verdict.thresholds.reach);
            let growth = ("largest growth of the delay", "s/s");
            let pulsation = ("ε·ω with that bound", "rad/s");
            rows.compare(&title, ("bound of sin/(1 + ε·cos)²", ""), paper.factor, exact.factor);
            rows.compare(&title, growth, paper.growth, exact.growth);
            let (theirs, ours) = (paper.pulsation_rad_per_s, exact.pulsation_rad_per_s);
            rows.compare(&title, pulsation, theirs, ours);
            rows.compare(&title, ("what it must be below", "rad/s"), reach, reach);
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
    let hint = "The delay must never grow by a second a second. The paper bounds its growth with \
                1/(1 − ε)², the exact bound is the largest sin/(1 + ε·cos)² of a turn.";
    Ok(Section::new("Does what is fed always reach the plug?", hint, drawing))
}

fn case_rows(rows: &mut TableRows, found: &Examined) {
    let name = found.case.name;
    let target = SETPOINT.plug.get();
    let mut push =
        |what, theirs: Option<f64>, ours: Option<f64>| rows.compare(name, what, theirs, ours);
    let first = Some(found.first_effect_s);
    push(("first effect of the control", "s"), first, first);
    push(("open loop settles", "s"), settles(&found.open), None);
    let cycle = found.cycle();
    let peaks = cycle.map(|cycle| cycle.peak_to_peak_mm);
    push(("no predictor: oscillation, peak to peak", "mm"), peaks, None);
    push(("no predictor: period of the oscillation", "s"), cycle.map(|cycle| cycle.period_s), None);
    let pairs = [&found.informed, &found.uninformed];
    let names = ["predictor (time and state) settles", "predictor (state only) settles"];
    for (quantity, pair) in names.into_iter().zip(pairs) {
        push((quantity, "s"), settles(&pair.paper), settles(&pair.exact));
    }
    let names =
        ["predictor (time and state) overshoots by", "predictor (state only) overshoots by"];
    for (quantity, pair) in names.into_iter().zip(pairs) {
        let overshoot = |response: &PlugResponse| Some(response.overshoot_mm(target));
        push((quantity, "mm"), overshoot(&pair.paper), overshoot(&pair.exact));
    }
    let [theirs, ours] = found.max_deviation_mm.map(Some);
    push(("farthest from the delay-free loop", "mm"), theirs, ours);
    let steeper = ["saturated controller, 60/m, settles", "… 100/m, settles", "… 200/m, settles"];
    for (quantity, response) in steeper.into_iter().zip(&found.straight) {
        push((quantity, "s"), None, settles(response));
    }
    push(("soonest that the largest feed allows", "s"), Some(found.soonest_s), None);
}

fn robustness_rows(rows: &mut TableRows) -> Result<(), RunError> {
    let [_, _, case] = CASES;
    let screw = case.screw(TurnUnit::RadPerS)?;
    let paper = FillFeedback::Exponential(paper_controller(&screw)?);
    let ours = saturated(&screw, SLOPES_PER_M[0])?;
    for (name, mismatch) in MISMATCHES {
        let theirs = run_mismatched(&case, mismatch, paper, Scheme::Paper)?;
        let same = run_mismatched(&case, mismatch, paper, Scheme::Exact)?;
        let ours = run_mismatched(&case, mismatch, ours, Scheme::Exact)?;
        let title = format!("b at 200 Hz: {name}");
        let mut push =
            |what, of: fn(&RobustnessOutcome) -> Option<f64>, ours: &RobustnessOutcome| {
                rows.compare(&title, what, of(&theirs), of(ours));
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

/// Name, colour and response of a curve.
type Drawn<'a> = (&'a str, Ink, &'a PlugResponse);

fn case_section(found: &Examined) -> Section {
    let open = ("open loop", palette::DEMAND, &found.open);
    let bare = ("no predictor", palette::SPEED, &found.uncompensated);
    let all = [
        open,
        bare,
        ("predictor, state only", palette::FLOW, &found.uninformed.paper),
        ("predictor, time and state", palette::PAPER, &found.informed.paper),
        ("ours, saturated controller", palette::OURS, &found.straight[0]),
    ];
    let (target, max_fill) = (SETPOINT.plug.get(), SETPOINT.max_fill);
    let drawing = html! {
        (legend_of(&lines(&all, BEGINNING, |s| s.plug_mm)))
        (draw(&all, BEGINNING, "filled length x [mm]", |s| s.plug_mm, Some(target)))
        (draw(&all, BEGINNING, "fill U", |s| s.fill, Some(max_fill)))
        (draw(&all, BEGINNING, "delay D [s]", |s| s.delay_s, None))
        (legend_of(&lines(&[open, bare], ALL, |s| s.plug_mm)))
        (draw(&[open, bare], ALL, "filled length x [mm]", |s| s.plug_mm, Some(target)))
        (draw_prediction(found))
        (draw_deviations(found))
    };
    let steady = found.case.pulsation.relative_amplitude == 0.0;
    let hint = if steady {
        "The conveying speed is steady: both predictors are the same."
    } else {
        "The conveying speed pulsates; the predictor of the state only takes it for steady."
    };
    let of = if steady { "" } else { "of case " };
    Section::new(format!("Conveying speed {of}{}", found.case.name), hint, drawing)
}

type Of = fn(&PlugSample) -> f64;

fn lines<'a>(drawn: &[Drawn<'a>], range: Range, of: Of) -> Vec<Line<'a>> {
    let line = |(name, ink, run): &Drawn<'a>| Line::curve(name, *ink, during(run, range, of));
    drawn.iter().map(line).collect()
}

fn draw(drawn: &[Drawn<'_>], range: Range, y_title: &str, of: Of, level: Option<f64>) -> Markup {
    let label = level.map(|level| level.to_string()).unwrap_or_default();
    let mut lines = lines(drawn, range, of);
    lines.extend(level.map(|level| Line::level("", palette::TARGET, level, &label)));
    plot(Area::wide(200.0), &XAxis::time(range), y_title, &lines, &[])
}

fn during(response: &PlugResponse, range: Range, of: Of) -> Vec<CurvePoint> {
    let points = response.samples.iter().map(|sample| (sample.at_s, of(sample)));
    points.filter(|(at_s, _)| (range.min..=range.max).contains(at_s)).collect()
}

/// Points of a curve within [`BEGINNING`].
fn beginning(points: impl Iterator<Item = CurvePoint>) -> impl Iterator<Item = CurvePoint> {
    points.filter(|(at_s, _)| *at_s <= BEGINNING.max)
}

/// The prediction, drawn at the time for which it is made, and the plug at that time.
fn draw_prediction(found: &Examined) -> Markup {
    let response = &found.informed.exact;
    let predicted = response.samples.iter().filter_map(|s| s.predicted);
    let predicted = beginning(predicted.map(|(mm, at_s)| (at_s, mm)));
    let plug = during(response, BEGINNING, |sample| sample.plug_mm);
    let lines = [
        Line::curve("plug, paper's controller with our predictor", palette::OURS, plug),
        Line::curve("predicted, drawn at the time predicted for", palette::MODEL, predicted),
        Line::demand(
            "delay-free loop from the first effect on",
            palette::TARGET,
            beginning(found.oracle.iter().copied()),
        ),
    ];
    plot_with_legend(200.0, &XAxis::time(BEGINNING), "filled length x [mm]", &lines)
}

/// Deviation of both schemes' loops from the delay-free loop.
fn draw_deviations(found: &Examined) -> Markup {
    let deviation = |response: &PlugResponse| -> Vec<CurvePoint> {
        let first = response.samples.partition_point(|sample| sample.at_s < found.first_effect_s);
        let samples = response.samples.get(first..).unwrap_or_default();
        let pairs = samples.iter().zip(&found.oracle);
        beginning(pairs.map(|(sample, (at_s, plug))| (*at_s, sample.plug_mm - plug))).collect()
    };
    let lines = [
        Line::curve("the paper's Euler steps", palette::PAPER, deviation(&found.informed.paper)),
        Line::curve(
            "high order over the exact delay",
            palette::OURS,
            deviation(&found.informed.exact),
        ),
    ];
    let (area, axis) = (Area::wide(160.0), XAxis::time(BEGINNING));
    html! {
        (legend_of(&lines))
        (plot(area, &axis, "plug less delay-free [mm]", &lines, &[0.1, -0.1]))
    }
}
