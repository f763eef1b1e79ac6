//! `truebead lab accuracy`: how well widths are measured in pictures whose truth is
//! known.

mod arguments;
mod random;
mod roughness;

use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use rayon::prelude::*;

pub use self::arguments::AccuracyArgs;
use crate::cli::arguments::WrongArguments;
use crate::cli::print::Verbosity;
use crate::io::progress::Progress;
use crate::rows::output;
use crate::studies::accuracy::calibration_table::CalibrationFigures;
use crate::studies::accuracy::calibrations;
use crate::studies::accuracy::calibrations::{CalibrationBench, CalibrationCase, CornerSource};
use crate::studies::accuracy::sets;
use crate::studies::accuracy::sets::Set;
use crate::studies::accuracy::studio::SetStudio;
use crate::studies::accuracy::table::{markdown, table};
use crate::studies::accuracy::{SetFigures, WidthError};
use crate::vision::Measurer;

/// Frames of a set where nothing else is said.
const FRAMES: u64 = 3_000;
/// Frames that one measurer measures after each other, as in a cell.
const FRAMES_PER_MEASURER: u64 = 250;

/// Runs the command.
pub fn run(args: &AccuracyArgs, voice: Verbosity) -> Result<ExitCode> {
    if args.calibration {
        return judge_calibrations(args, voice);
    }
    if args.roughness {
        return roughness::judge(args, voice);
    }
    if !args.random.is_empty() {
        return random::judge(args, voice);
    }
    let sets = chosen(&args.sets, sets::all(), |set| set.name)?;
    if let Some(out) = &args.out {
        output::make_folder(out)?;
    }
    let frames = args.frames.unwrap_or(FRAMES);
    let count = |set: &Set| if set.limits_silent() { args.silent_frames } else { frames };
    let total = sets.iter().map(count).sum();
    let progress = Mutex::new(Progress::new("measuring", "frames", Some(total), voice.quiet));
    let figures: Result<Vec<SetFigures>> =
        sets.iter().map(|set| judge(set, count(set), &progress)).collect();
    progress.into_inner().unwrap_or_else(PoisonError::into_inner).finish();
    let figures = figures?;
    if let Some(out) = &args.out {
        let json = serde_json::to_vec_pretty(&figures).context("accuracy.json")?;
        output::write_whole(out, "accuracy.json", &json)?;
        output::write_whole(out, "accuracy.md", markdown(&figures).as_bytes())?;
    }
    say!("{}", table(&figures).trim_end());
    let missed = figures.iter().any(|figures| figures.kept == Some(false));
    Ok(if missed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn judge_calibrations(args: &AccuracyArgs, voice: Verbosity) -> Result<ExitCode> {
    let rigs =
        chosen(&args.sets, calibrations::cases().context("the rigs' boards")?, |rig| rig.name)?;
    if let Some(out) = &args.out {
        output::make_folder(out)?;
    }
    let corners = rigs.iter().map(|rig| (rig, CornerSource::Corners, args.trials));
    let rendered = rigs.iter().filter(|rig| rig.rendered);
    let pictures = rendered.map(|rig| (rig, CornerSource::Images, args.rendered_trials));
    let all: Vec<_> = corners.chain(pictures).filter(|(.., trials)| *trials > 0).collect();
    let total = all.iter().map(|(.., trials)| trials).sum();
    let progress = Mutex::new(Progress::new("calibrating", "trials", Some(total), voice.quiet));
    let figures: Vec<CalibrationFigures> = all
        .into_iter()
        .map(|(rig, source, trials)| judge_rig(rig, source, trials, &progress))
        .collect();
    progress.into_inner().unwrap_or_else(PoisonError::into_inner).finish();
    if let Some(out) = &args.out {
        let json = serde_json::to_vec_pretty(&figures).context("calibrations.json")?;
        output::write_whole(out, "calibrations.json", &json)?;
        output::write_whole(out, "calibrations.md", markdown(&figures).as_bytes())?;
    }
    say!("{}", table(&figures).trim_end());
    let missed = figures.iter().any(|figures| !figures.missed.is_empty());
    Ok(if missed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn judge_rig(
    rig: &CalibrationCase,
    source: CornerSource,
    trials: u64,
    progress: &Mutex<Progress>,
) -> CalibrationFigures {
    let bench = CalibrationBench::new(rig.clone(), source);
    let outcomes: Vec<_> = (0..trials)
        .into_par_iter()
        .map(|trial| {
            let outcomes = bench.calibrate(trial);
            progress.lock().unwrap_or_else(PoisonError::into_inner).advance();
            outcomes
        })
        .collect();
    CalibrationFigures::of(rig, source, &outcomes)
}

/// Those that were named, or all.
fn chosen<T>(names: &[String], all: Vec<T>, name_of: impl Fn(&T) -> &str) -> Result<Vec<T>> {
    if let Some(unknown) = names.iter().find(|name| all.iter().all(|one| name_of(one) != **name)) {
        let known: Vec<&str> = all.iter().map(&name_of).collect();
        let what = format!("--set {unknown}: there is none; one of {}", known.join(", "));
        return Err(WrongArguments::new(what).into());
    }
    let wanted = |one: &T| names.is_empty() || names.iter().any(|name| name == name_of(one));
    Ok(all.into_iter().filter(wanted).collect())
}

/// Renders and measures the frames of a set. Which measurer measures which
/// frames does not depend on the machine.
fn judge(set: &Set, frames: u64, progress: &Mutex<Progress>) -> Result<SetFigures> {
    let studio = SetStudio::new(set)?;
    let runs: Result<Vec<Vec<Option<WidthError>>>> = (0..frames.div_ceil(FRAMES_PER_MEASURER))
        .into_par_iter()
        .map(|run| {
            let mut measurer = Measurer::new(studio.gauge(), None);
            (run * FRAMES_PER_MEASURER..frames.min((run + 1) * FRAMES_PER_MEASURER))
                .map(|frame| {
                    let outcome = measure(&studio, &mut measurer, frame);
                    progress.lock().unwrap_or_else(PoisonError::into_inner).advance();
                    outcome
                })
                .collect()
        })
        .collect();
    Ok(SetFigures::of(set, studio.mm_per_px(), &runs?.concat()))
}

/// `None` for a frame that is refused.
fn measure(studio: &SetStudio, measurer: &mut Measurer, frame: u64) -> Result<Option<WidthError>> {
    let rendered = studio.take(frame)?;
    let truth = rendered.truth.context("a bead that runs through its gauge has a truth")?;
    let found = measurer.measure(&rendered.frame, studio.surface()).ok();
    Ok(found.map(|found| WidthError {
        error_mm: found.width.get() - truth.width_mm,
        sigma_mm: found.sigma.get(),
    }))
}
