//! `truebead replay`: whether the current controller gives the recorded steps.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::arguments::WrongArguments;
use super::recorded::{attached_cell, open, refuse_foreign, warn_of_damage};
use super::status::WITH_LOSS;
use crate::assembly::extruder;
use crate::cell::file::{ExtruderPart, Purpose};
use crate::control::{Controller, Step};
use crate::io::recorder::{ExtruderFile, format::PROGRAM_VERSION};
use crate::io::recording::{RecordedEntry, Recording};
use crate::io::replay::{Difference, ReplayReport, replay};

/// Entries between two updates of the progress display.
const PROGRESS_EVERY: u64 = 4096;

const EXAMPLE: &str = "\
Example:
  truebead replay out/recording.mcap

The controller is set up from the files that are attached to the recording: the
cell, and a model or a profile that the cell names for its extruder.
A recording that was cut short (recording.mcap.partial) is replayed as far as
it goes.

Exit status: 0 all steps are the same, 1 a step differs, 2 the file is not a
recording that this version can replay, 3 events are missing from its middle.";

/// Feeds recorded events to the controller and compares its steps bit for bit.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLE)]
pub struct ReplayArgs {
    /// A recording of this program
    #[arg(value_name = "RECORDING.mcap")]
    recording: PathBuf,
    /// Compare although another version of truebead made the recording
    #[arg(long)]
    any_version: bool,
}

/// Runs the command.
pub fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    let mut recording = open(&args.recording)?;
    refuse_foreign(&recording)?;
    if !args.any_version {
        refuse_other_version(&recording)?;
    }
    let mut controller = recorded_controller(&recording)?;
    let progress = progress_bar();
    let report =
        replay(with_progress(&mut recording, &progress), |now, event| controller.step(now, event));
    progress.finish_and_clear();
    let report = report.context("the replay ends here")?;
    warn_of_damage(&recording);
    let status = tell(&report);
    if report.compared == 0 && report.gap.is_none() {
        bail!("{}: nothing to compare, it holds no steps", recording.file());
    }
    Ok(status)
}

/// Refuses a recording of another version: its controller may take other steps, and be right.
fn refuse_other_version(recording: &Recording) -> Result<(), WrongArguments> {
    let Some(run) = recording.run().filter(|run| run.program_version != PROGRAM_VERSION) else {
        return Ok(());
    };
    refuse!(
        "{}: recorded by truebead {}, and this is {PROGRAM_VERSION}, whose steps may differ; replay it \
         with the version that recorded it, or with --any-version to see the first step that differs",
        recording.file(),
        run.program_version
    );
}

/// The controller in its state at the start of the run.
fn recorded_controller(recording: &Recording) -> anyhow::Result<Controller> {
    let file = recording.file();
    let (cell, calibration) = attached_cell(recording, Purpose::Run)
        .context("the controller cannot be set up")
        .map_err(WrongArguments::new)?;
    let Some(run) = cell.run.clone() else {
        refuse!("cell.toml in {file}: it lacks tables that a run needs");
    };
    let controller = Controller::new(cell.controller_setup(&run, &calibration));
    let Some(part) = &run.extruder else { return Ok(controller) };
    let files = recorded_files(recording, part)?;
    let cell = format!("cell.toml in {}", recording.file());
    let setup = extruder::setup(&run, part, &cell, &files)?;
    Ok(controller.with_extruder(setup, part.demand))
}

/// The attached files of the extruder side.
fn recorded_files(recording: &Recording, part: &ExtruderPart) -> anyhow::Result<Vec<ExtruderFile>> {
    let from = recording.file();
    let file = |name| {
        let Some(text) = recording.attachment(name) else {
            refuse!(
                "{from}: the attachment {name} is missing, so the extruder side cannot be set up"
            );
        };
        Ok(ExtruderFile { name, source: format!("{name} in {from}"), text: text.to_owned() })
    };
    extruder::attachments(&part.extruder).into_iter().map(file).collect()
}

fn progress_bar() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{spinner} replaying, {pos} entries, {elapsed}");
    ProgressBar::new_spinner()
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
}

fn with_progress<'a, E>(
    entries: impl Iterator<Item = Result<RecordedEntry, E>> + 'a,
    progress: &'a ProgressBar,
) -> impl Iterator<Item = Result<RecordedEntry, E>> + 'a {
    (1u64..).zip(entries).map(|(count, entry)| {
        if count.is_multiple_of(PROGRESS_EVERY) {
            progress.set_position(count);
            progress.tick();
        }
        entry
    })
}

/// Prints the result and returns the exit status.
fn tell(report: &ReplayReport) -> ExitCode {
    if let Some(difference) = &report.difference {
        print_difference(report.compared, difference);
        return ExitCode::FAILURE;
    }
    say!("{} steps replayed, all the same bit for bit", report.compared);
    if let Some(n) = report.unanswered {
        say!("event {n} is the last; its step was not recorded any more");
    }
    if let Some(gap) = report.gap {
        say!(
            "the record of event {} is incomplete (event {} comes next), so the rest cannot be \
             compared",
            gap.expected,
            gap.found
        );
        return ExitCode::from(WITH_LOSS);
    }
    ExitCode::SUCCESS
}

fn print_difference(compared: u64, difference: &Difference) {
    say!(
        "step {} differs, {:.6} s after the start; the {} before it are the same",
        difference.n,
        difference.now.secs(),
        compared.saturating_sub(1)
    );
    let json = |value: Result<String, serde_json::Error>| value.unwrap_or_else(|e| e.to_string());
    say!("event    {}", json(serde_json::to_string(&difference.event)));
    say!("recorded {}", step_json(&difference.recorded));
    say!("replayed {}", step_json(&difference.replayed));
}

fn step_json(step: &Step) -> String {
    serde_json::to_string(step).unwrap_or_else(|error| error.to_string())
}
