//! `truebead check`: whether a cell file is sound, and what it suffices for.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::cell::LoadedCell;
use crate::calib::Calibration;
use crate::config::Cell;
use crate::config::cell::{Purpose, RunPart, Source};

/// Validates a cell file and all it refers to.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead check cells/barjuei2022.toml

Every violation is reported at once, with its line. Exit status 2 if there is
one.")]
pub struct CheckArgs {
    /// Cell file
    cell: PathBuf,
}

/// Runs the command; the findings go to standard output.
pub fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let loaded = LoadedCell::read(&args.cell, Purpose::Measure)?;
    say!("{}: sound", args.cell.display());
    say!("  calibration  {}", loaded.calibration_words());
    if let Calibration::Full { image_size_px: [width, height], .. } = loaded.calibration {
        let roi = loaded.cell.gauge.roi;
        say!("  images       {width}x{height} px");
        if !roi.fits((width as usize, height as usize)) {
            say!(
                "  WARNING      gauge.roi_px reaches beyond the calibration's {width}x{height} px"
            );
        }
    }
    say!("  suffices for process, render");
    match Cell::parse(&args.cell, &loaded.text, Purpose::Run) {
        Ok(cell) => {
            say!("  suffices for run, simulate");
            if let Some(run) = &cell.run {
                about_run(run);
            }
        }
        Err(missing) => {
            say!("  not for run, simulate; these need besides:");
            for problem in &missing.list {
                say!("    {}: {}", problem.key, problem.expected);
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn about_run(run: &RunPart) {
    if let Source::Path(path) = &run.camera.source
        && !path.exists()
    {
        say!("  WARNING      camera.source: {} is not there now", path.display());
    }
    let seconds = run.robot.start_length.get() / run.robot.start_speed.get();
    say!(
        "  control      begins {:.0} mm into the bead, after {seconds:.1} s at {}",
        run.robot.start_length.get(),
        run.robot.start_speed
    );
    let delay = run.camera.offset.get() / run.robot.start_speed.get();
    say!("  dead time    {delay:.2} s at that speed, from nozzle to gauge");
}
