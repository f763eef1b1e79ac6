//! Starts, stops and drool, which the thesis names as wanted and leaves open
//! (sections 1.3.3 and 1.3.4): fixed dwell times beside times that are foretold
//! from what a recording told of the extruder.

mod draw;

use crate::sim::melt::MeltParameters;
use crate::studies::bcs_thesis::start_stop::bench::{PAUSES_S, StartStopScore};
use crate::studies::bcs_thesis::start_stop::experiment::{Losses, MIN_SPEED_FRACTION, run, sum};
use crate::studies::error::ReproduceError;
use crate::studies::study::{Section, TableRows};

const CASES: [&str; 3] = [
    "starts and stops, robot follows",
    "starts and stops, robot keeps its speed",
    "starts and stops, no dwell at all",
];
/// A volume of a score, with what it is called.
type Volume = (&'static str, fn(&StartStopScore) -> f64);
const VOLUMES: [Volume; 3] = [
    ("void volume", |score| score.void_mm3),
    ("drool volume", |score| score.drool_mm3),
    ("both", StartStopScore::sum_mm3),
];

/// Runs the experiment. In the table, what is simulated of the source's own are
/// the best fixed dwell times.
pub fn section(seeds: u64, rows: &mut TableRows) -> Result<Section, ReproduceError> {
    let found = run(MeltParameters::TYPICAL, seeds)?;
    let [follows, keeps, none] = CASES;
    push(follows, [&found.fixed, &found.follows], rows);
    push(keeps, [&found.fixed, &found.keeps], rows);
    push(none, [&found.naive, &found.follows], rows);
    Ok(Section {
        heading: "Starts and stops".to_owned(),
        hint: format!(
            "{} pauses of 0 to 300 s between beads of 400 mm³/s at 40 mm/s, means over {seeds} \
             seeds. Void is what the path lacks while the robot travels it; drool is what is too \
             much, and all that comes while the robot stands. Fixed: the two dwell times with \
             which void and drool together are least, {:.2} s after the command to run and {:.2} s \
             before the end of the bead; no dwell: the drive's dead time at the start, nothing at \
             the end. Ours: the delay by the pause before, and the fall of the flow, fitted to a \
             recording of other pauses of the same machine. A robot that follows goes down to \
             {:.0} % of its speed with the flow; one that keeps its speed lays the flow's own rise \
             and fall as void and as surplus, whatever is known of them. The machine knows more \
             than the model: a void that opens in two parts and varies by 3 %, melt that is stored \
             under pressure, drips, a flow that drifts.",
            PAUSES_S.len(),
            found.dwell.start_s,
            found.dwell.stop_s,
            100.0 * MIN_SPEED_FRACTION
        ),
        drawing: draw::all(&found),
    })
}

fn push(case: &'static str, [theirs, ours]: [&Losses; 2], rows: &mut TableRows) {
    let [theirs, ours] = [theirs, ours].map(|losses| sum(losses));
    for (name, of) in VOLUMES {
        rows.push(case, (name, "mm³"), [None, Some(of(&theirs)), Some(of(&ours))]);
    }
    let ratio = theirs.sum_mm3() / ours.sum_mm3();
    rows.push(case, ("both, simulated over ours", "1"), [None, None, Some(ratio)]);
}
