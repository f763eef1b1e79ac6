//! Starts, stops and drool, which the thesis leaves open (sections 1.3.3 and 1.3.4): fixed dwell
//! times compared with times from a model of the extruder that is fitted to a recording.

mod draw;

use crate::sim::melt::MeltParameters;
use crate::studies::bcs_thesis::start_stop::bench::PAUSES_S;
use crate::studies::bcs_thesis::start_stop::experiment::{MIN_SPEED_FRACTION, run, sum};
use crate::studies::error::ReproduceError;
use crate::studies::study::{Section, TableRows};

/// Runs the experiment. The table's column "simulated" has the best fixed dwell times.
pub fn section(seeds: u64, rows: &mut TableRows) -> Result<Section, ReproduceError> {
    let found = run(MeltParameters::TYPICAL, seeds)?;
    for (case, theirs, ours) in [
        ("starts and stops, robot follows", &found.fixed, &found.follows),
        ("starts and stops, robot keeps its speed", &found.fixed, &found.keeps),
        ("starts and stops, no dwell at all", &found.naive, &found.follows),
    ] {
        let [theirs, ours] = [theirs, ours].map(|losses| sum(losses));
        rows.compare(case, ("void volume", "mm³"), theirs.void_mm3, ours.void_mm3);
        rows.compare(case, ("drool volume", "mm³"), theirs.drool_mm3, ours.drool_mm3);
        let [theirs, ours] = [theirs, ours].map(|losses| losses.sum_mm3());
        rows.compare(case, ("both", "mm³"), theirs, ours);
        rows.ours(case, ("both, simulated over ours", "1"), theirs / ours);
    }
    let hint = format!(
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
    );
    Ok(Section::new("Starts and stops", hint, draw::all(&found)))
}
