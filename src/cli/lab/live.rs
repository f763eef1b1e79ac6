//! `truebead lab live`: beads that are laid live, over sockets, judged by what the robot did.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;

use super::case_rows;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::cli::live_cell::{Folders, Until, live};
use crate::cli::print::Verbosity;
use crate::core::{Mm, RobotState, Span, Stamp};
use crate::io::clock::RunClock;
use crate::io::progress::Progress;
use crate::link::{PrintJob, RobotParams};
use crate::rows::output;
use crate::simulators::robot::{RobotOptions, RobotSim};
use crate::studies::control::bead_figures::{BeadFigures, late_rows, rows};
use crate::studies::control::live::{BEAD_MM, cell_text, laid};
use crate::studies::control::plant::LoopCell;

/// Duration of a run \[s\]. Derived: the bead at the 77 mm/s for 42 mm of Shojaei Barjuei et al. 2022,
/// table 2, of which the last 600 mm are quicker.
const DURATION_S: f64 = 18.0;

/// Lays beads live, against a simulated robot behind a socket.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead lab live --out live --runs 2

Prints a table and leaves control.json and a folder of every run. A run takes some 20 s, and there
are four cells. Every figure is that of the bead's true width, from the robot's own states.
Status 1 if a figure is above what is required.")]
pub struct LiveArgs {
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Runs in each of the four cells
    #[arg(long, value_name = "N", default_value_t = 20,
        value_parser = clap::value_parser!(u64).range(1..=1000))]
    runs: u64,
}

/// Runs the command.
pub fn run(args: &LiveArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    output::make_folder(&args.out)?;
    let total = args.runs.checked_mul(4);
    let mut progress = Progress::new("laying", "beads", total, voice.quiet);
    let (mut all, mut every) = (Vec::new(), Vec::new());
    for (number, cell) in LoopCell::ALL.into_iter().enumerate() {
        let mut beads = Vec::new();
        for seed in 1..=args.runs {
            let folder = args.out.join(format!("cell-{}-run-{seed}", number + 1));
            beads.push(lay(cell, seed, &folder)?);
            progress.advance();
        }
        all.extend(rows(cell, "live", &beads)?);
        every.extend(beads.into_iter().map(|bead| (cell, bead)));
    }
    all.extend(late_rows("all cells", "live", &every));
    progress.finish();
    case_rows::write(&all, &args.out)?;
    Ok(case_rows::print(&all, &args.out))
}

/// Lays one bead with the program's own live run.
fn lay(cell: LoopCell, seed: u64, folder: &Path) -> anyhow::Result<BeadFigures> {
    let clock = RunClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").context("cannot listen on this machine")?;
    let robot = RobotSim::spawn(listener, clock, robot_options(), Box::new(|_, _| {}))?;
    let text = cell_text(cell, &robot.local_addr().to_string(), seed);
    let loaded = LoadedCell::from_text(Path::new("live.toml"), text, Purpose::Run)?;
    let simulated = loaded.cell.clone();
    let folders = Folders { recording: folder, log: folder };
    let until = Until { duration_s: Some(DURATION_S), ends_with_steps: false };
    live(loaded, folders, "Live".into(), until, clock, Verbosity { quiet: true })?;
    let states: Vec<(Stamp, RobotState)> =
        robot.history().into_iter().map(|one| (one.at, one.state.into())).collect();
    robot.stop();
    let trial = laid(&simulated, &states)
        .with_context(|| format!("control of the bead in {} never began", folder.display()))?;
    Ok(BeadFigures::of(cell, &trial))
}

fn robot_options() -> RobotOptions {
    let params = RobotParams { bead: Mm::new(BEAD_MM).ok(), ..RobotParams::default() };
    let job = PrintJob::new(1, Mm::ZERO, params.z, Span::from_millis(300));
    RobotOptions { params, job, state_period: Span::from_millis(20) }
}
