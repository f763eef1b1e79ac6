//! The verdict on a plan, in words.

use maud::Markup;

use super::{PlanFacts, PlannedBead, rms};
use crate::report::html::{self, VerdictLevel};

/// Relative error of the planned width (RMS) above which the verdict mentions it.
const FAR_OFF_ERROR: f64 = 0.05;

/// The verdict of the page, with the planner's warnings.
pub fn verdict(beads: &[PlannedBead], facts: &PlanFacts, warnings: &[String]) -> Markup {
    let far_off = rms(beads, |bead| &bead.planned) > FAR_OFF_ERROR;
    let level = VerdictLevel::with_caution(far_off || !warnings.is_empty());
    html::verdict(level, &sentences(beads, facts, far_off), warnings)
}

fn sentences(beads: &[PlannedBead], facts: &PlanFacts, far_off: bool) -> String {
    let planned = rms(beads, |bead| &bead.planned);
    let unplanned = rms(beads, |bead| &bead.constant).min(rms(beads, |bead| &bead.proportional));
    let added_s: f64 = beads.iter().map(|bead| bead.plan.added_s).sum::<f64>().max(0.0);
    let mut less = String::new();
    if planned > 0.0 && unplanned > planned {
        let ratio = unplanned / planned;
        less = format!(", {ratio:.1} times less than without a plan, for {added_s:.2} s more");
    }
    let mut words = vec![format!(
        "The predicted width error is {:.2} mm RMS ({:.1} %){less}.",
        planned * facts.width_mm,
        100.0 * planned
    )];
    words.extend(worst(beads).map(|(bead, path_mm, error)| {
        format!(
            "It is furthest off by {:+.2} mm, {path_mm:.0} mm {}.",
            error * facts.width_mm,
            bead.name.to_lowercase()
        )
    }));
    if far_off {
        let more = "More time (--budget-s), a wider range of commands or a slower job brings it \
                    nearer.";
        words.push(more.to_owned());
    }
    words.join(" ")
}

/// The largest error of the planned width: bead, path \[mm\] and relative error.
fn worst(beads: &[PlannedBead]) -> Option<(&PlannedBead, f64, f64)> {
    let all = beads
        .iter()
        .flat_map(|bead| bead.planned.width.iter().map(move |(at, share)| (bead, *at, *share)));
    all.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
}
