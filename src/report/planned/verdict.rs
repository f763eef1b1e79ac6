//! What is to be thought of a plan, in words.

use maud::{Markup, html};

use super::{PlanFacts, PlannedBead, rms};

/// Error of the planned width, as a share of it, from which on it is worth a word.
const FAR_OFF_ERROR: f64 = 0.05;

/// The verdict of a page. `warnings` are what the plan's caller has to say.
pub fn verdict(beads: &[PlannedBead], facts: &PlanFacts, warnings: &[String]) -> Markup {
    let far_off = rms(beads, |bead| &bead.planned) > FAR_OFF_ERROR;
    let (class, word) = if far_off || !warnings.is_empty() {
        ("caution", "Look closer.")
    } else {
        ("good", "Good.")
    };
    html! {
        div class={ "verdict " (class) } {
            b { (word) }
            (sentences(beads, facts, far_off))
            @if !warnings.is_empty() {
                ul { @for warning in warnings { li { (warning) } } }
            }
        }
    }
}

fn sentences(beads: &[PlannedBead], facts: &PlanFacts, far_off: bool) -> String {
    let planned = rms(beads, |bead| &bead.planned);
    let unplanned = rms(beads, |bead| &bead.constant).min(rms(beads, |bead| &bead.proportional));
    let added_s: f64 = beads.iter().map(|bead| bead.plan.added_s).sum::<f64>().max(0.0);
    let less = if planned > 0.0 && unplanned > planned {
        format!(
            ", {:.1} times less than without a plan, for {added_s:.2} s more",
            unplanned / planned
        )
    } else {
        String::new()
    };
    let mut words = vec![format!(
        "The width is predicted to stray by {:.2} mm RMS ({:.1} %){less}.",
        planned * facts.width_mm,
        100.0 * planned
    )];
    words.extend(worst(beads).map(|(bead, path_mm, share)| {
        format!(
            "It is furthest off by {:+.2} mm, {path_mm:.0} mm {}.",
            share * facts.width_mm,
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

/// Where the planned width is furthest off: bead, path \[mm\] and share of the width.
fn worst(beads: &[PlannedBead]) -> Option<(&PlannedBead, f64, f64)> {
    let all = beads
        .iter()
        .flat_map(|bead| bead.planned.width.iter().map(move |(at, share)| (bead, *at, *share)));
    all.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
}
