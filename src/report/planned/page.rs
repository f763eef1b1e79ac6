//! The page of a plan.

use maud::{Markup, html};

use super::verdict::verdict;
use super::{PlanFacts, PlannedBead, rms};
use crate::plan::{SpeedProfile, WidthPrediction};
use crate::report::chart::{
    Ink, PlotCurve, PlotLayer, ValueRange, XAxis, legend, palette, wide_plot, y_range,
};
use crate::report::html;

/// Largest number of beads that are drawn: those with the largest errors.
const DRAWN: usize = 12;
/// Number of points of a curve over path.
const POINTS: u32 = 2000;

/// A curve, its name, its colour, and whether it is a demand.
type NamedCurve = (PlotCurve, &'static str, Ink, bool);

/// The page, with facts under its title, and with warnings.
pub fn page(
    beads: &[PlannedBead],
    facts: &PlanFacts,
    about: &[(&str, String)],
    warnings: &[String],
) -> String {
    let mut drawn: Vec<&PlannedBead> = beads.iter().collect();
    if drawn.len() > DRAWN {
        let error = |bead: &PlannedBead| rms([bead], |bead| &bead.planned);
        drawn.sort_by(|a, b| error(b).total_cmp(&error(a)));
        drawn.truncate(DRAWN);
    }
    let body = html! {
        (html::about(about.iter().map(|(name, value)| (name, value))))
        (verdict(beads, facts, warnings))
        @if drawn.len() < beads.len() {
            p.hint { "Of " (beads.len()) " beads the " (DRAWN) " with the largest errors are drawn." }
        }
        @for bead in drawn { (section(bead, facts)) }
    };
    let note = ". Every moment of the plan is in plan.csv.";
    html::titled_page("A job that is planned ahead", &body, note)
}

fn section(bead: &PlannedBead, facts: &PlanFacts) -> Markup {
    let path = XAxis::path(ValueRange::new(bead.nominal.start_mm(), bead.nominal.end_mm()));
    let speed = &bead.plan.speed;
    let at_time = |of: &dyn Fn(f64) -> f64| along(speed, |path_mm| of(speed.time_at(path_mm)));
    let speeds = [
        (along(&bead.nominal, |s| bead.nominal.speed_at(s)), "nominal", palette::DEMAND, true),
        (along(speed, |s| speed.speed_at(s)), "planned", palette::SPEED, false),
    ];
    let wanted = |path_mm: f64| speed.speed_at(path_mm) * facts.area_mm2;
    let flows = [
        (along(speed, wanted), "what the planned speed takes", palette::DEMAND, true),
        (at_time(&|t| bead.planned.flow_at(t)), "predicted", palette::FLOW, false),
    ];
    let command = at_time(&|t| bead.plan.command_at(t) + facts.idle);
    let commands = [(command, "command", palette::SCREW, false)];
    let width = |of: &WidthPrediction| widths_about(facts.width_mm, of, facts);
    let widths = [
        (
            width(&bead.proportional),
            "not planned, in proportion to the speed",
            palette::HOLDING,
            false,
        ),
        (width(&bead.constant), "not planned, constant command", palette::PAPER, false),
        (width(&bead.planned), "planned", palette::OURS, false),
    ];
    let planned = [(widths_about(0.0, &bead.planned, facts), "planned", palette::OURS, false)];
    html! {
        section {
            h2 { (bead.name) }
            p.hint { "Predicted by the model, as the mean over the nozzle's length; unmodelled flow \
                comes on top. Dips of the speed a nozzle's length apart count on that length; \
                a larger --nozzle-sigma has fewer of them." }
            (plot("width [mm]", &path, &widths, Some(facts.width_mm)))
            (plot("width error [mm]", &path, &planned, Some(0.0)))
            (plot("speed [mm/s]", &path, &speeds, None))
            (plot("flow [mm³/s]", &path, &flows, None))
            (plot(&format!("command [{}]", facts.unit), &path, &commands, None))
        }
    }
}

/// Predicted width over path, with its error about `middle_mm` \[mm\].
fn widths_about(middle_mm: f64, of: &WidthPrediction, facts: &PlanFacts) -> PlotCurve {
    of.width.iter().map(|(at, error)| (*at, middle_mm + facts.width_mm * error)).collect()
}

/// A quantity along the path of a speed profile.
fn along(speed: &SpeedProfile, of: impl Fn(f64) -> f64) -> PlotCurve {
    let (start, length) = (speed.start_mm(), speed.end_mm() - speed.start_mm());
    let even = (0..=POINTS).map(|k| start + length * f64::from(k) / f64::from(POINTS));
    // The nodes of the profile are included, so that no extremum is between two points.
    let mut positions: Vec<f64> = even.chain(speed.path().iter().copied()).collect();
    positions.sort_by(f64::total_cmp);
    positions.into_iter().map(|position| (position, of(position))).collect()
}

fn plot(y_title: &str, x: &XAxis, curves: &[NamedCurve], target: Option<f64>) -> Markup {
    let shown: Vec<&PlotCurve> = curves.iter().map(|curve| &curve.0).collect();
    let levels: Vec<f64> = target.into_iter().collect();
    let mut layers: Vec<PlotLayer<'_>> =
        levels.iter().map(|level| PlotLayer::Level(*level, palette::TARGET, "")).collect();
    layers.extend(curves.iter().map(|(series, _, ink, demand)| {
        if *demand { PlotLayer::Demand(series, *ink) } else { PlotLayer::Curve(series, *ink) }
    }));
    let mut names: Vec<(&str, Ink, &str)> = curves
        .iter()
        .map(|(_, name, ink, demand)| (*name, *ink, if *demand { "dash" } else { "" }))
        .collect();
    names.extend(levels.iter().map(|_| ("target", palette::TARGET, "dash")));
    html! {
        (legend(&names))
        (wide_plot(x, y_title, 220.0, y_range(&shown, &levels), layers))
    }
}
