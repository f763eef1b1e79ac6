//! Example logs of a simulated extruder.

use std::path::Path;

use anyhow::{Context, Result};

use crate::rows::output::{make_folder, write_whole};
use crate::sim::flow_log;
use crate::sim::melt::MeltParameters;
use crate::sim::melt_log::{example as plan, record, to_csv};

/// Names of the logs.
const LOGS: [&str; 3] = ["log.csv", "other.csv", "starts.csv"];

/// Seed of the starts and stops.
const STARTS_SEED: u64 = 1;

/// Writes the logs of a simulated extruder.
pub fn write(folder: &Path) -> Result<()> {
    if let Some(taken) = LOGS.map(|name| folder.join(name)).iter().find(|path| path.exists()) {
        refuse!(
            "{} is there already and would be lost; name another folder with --example",
            taken.display()
        );
    }
    make_folder(folder)?;
    let log = flow_log::binary().context("the example")?;
    let other = flow_log::gaussian().context("the example")?;
    write_whole(folder, LOGS[0], log.to_csv().as_bytes())?;
    write_whole(folder, LOGS[1], other.to_csv().as_bytes())?;
    let recorded = record(MeltParameters::TYPICAL, STARTS_SEED, &plan());
    write_whole(folder, LOGS[2], to_csv(&recorded).as_bytes())?;
    let truth = flow_log::truth().context("the example")?;
    let [log, other, starts] = LOGS.map(|name| folder.join(name).display().to_string());
    say!("example    {log}: a binary sequence of the screw's speed, and the flow");
    say!("           {other}: random levels, to validate with");
    say!("           {starts}: starts after pauses of half a second to minutes, and stops");
    say!(
        "truth      gain {:.2} mm³/s per rpm, damping 0.6, period 0.81 s, dead time {} s",
        truth.dc_gain(),
        truth.dead_time_s()
    );
    let voids = MeltParameters::TYPICAL.voids.map(|(mm3, s)| format!("{mm3} mm³ within {s} s"));
    say!("           starts: melt recedes while the screw stands, {}", voids.join(" and "));
    say!(
        "try        truebead extruder identify {log} --input screw_rpm --output flow_mm3_per_s --validate {other}"
    );
    say!("           truebead extruder starts {starts} --input screw_rpm --output flow_mm3_per_s");
    Ok(())
}
