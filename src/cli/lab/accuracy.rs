//! `truebead lab accuracy`: errors of widths in images with known true widths.

mod arguments;
mod publish;
mod random;
mod roughness;

use std::process::ExitCode;

use anyhow::{Context, Result};
use rayon::prelude::*;

pub use self::arguments::AccuracyArgs;
use self::publish::{Texts, make_folder};
use crate::cli::print::Verbosity;
use crate::io::progress::SharedProgress;
use crate::studies::accuracy::calibration_table::CalibrationFigures;
use crate::studies::accuracy::calibrations::{
    self, CalibrationBench, CalibrationCase, CornerSource,
};
use crate::studies::accuracy::sets::{self, Set};
use crate::studies::accuracy::studio::SetStudio;
use crate::studies::accuracy::table::{markdown, table};
use crate::studies::accuracy::{SetFigures, WidthError};
use crate::vision::Measurer;

/// Default number of frames of a set. Derived: a standard deviation from n frames has a relative
/// error of 1/√(2n), 1.3 % here (reference/accuracy.md).
const FRAMES: u64 = 3_000;
/// Number of consecutive frames of one measurer, which keeps a state from frame to frame as in a
/// cell.
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
    make_folder(args)?;
    let frames = args.frames.unwrap_or(FRAMES);
    let count = |set: &Set| if set.limits_silent() { args.silent_frames } else { frames };
    let total = sets.iter().map(count).sum();
    let progress = SharedProgress::new("measuring", "frames", total, voice.quiet);
    let figures: Result<Vec<SetFigures>> =
        sets.iter().map(|set| judge(set, count(set), &progress)).collect();
    progress.finish();
    let figures = figures?;
    let texts = Texts { table: table(&figures), markdown: markdown(&figures) };
    let missed = figures.iter().any(|figures| figures.kept == Some(false));
    texts.publish(args, "accuracy", &figures, missed)
}

fn judge_calibrations(args: &AccuracyArgs, voice: Verbosity) -> Result<ExitCode> {
    let cases = calibrations::cases().context("the boards of the test benches")?;
    let cases = chosen(&args.sets, cases, |case| case.name)?;
    make_folder(args)?;
    let corners = cases.iter().map(|case| (case, CornerSource::Corners, args.trials));
    let rendered = cases.iter().filter(|case| case.rendered);
    let images = rendered.map(|case| (case, CornerSource::Images, args.rendered_trials));
    let all: Vec<_> = corners.chain(images).filter(|(.., trials)| *trials > 0).collect();
    let total = all.iter().map(|(.., trials)| trials).sum();
    let progress = SharedProgress::new("calibrating", "trials", total, voice.quiet);
    let figures: Vec<CalibrationFigures> = all
        .into_iter()
        .map(|(case, source, trials)| judge_case(case, source, trials, &progress))
        .collect();
    progress.finish();
    let (table, markdown) = (table(&figures), markdown(&figures));
    let missed = figures.iter().any(|figures| !figures.missed.is_empty());
    Texts { table, markdown }.publish(args, "calibrations", &figures, missed)
}

fn judge_case(
    case: &CalibrationCase,
    source: CornerSource,
    trials: u64,
    progress: &SharedProgress,
) -> CalibrationFigures {
    let bench = CalibrationBench::new(case.clone(), source);
    let outcomes: Vec<_> = (0..trials)
        .into_par_iter()
        .map(|trial| {
            let outcomes = bench.calibrate(trial);
            progress.advance();
            outcomes
        })
        .collect();
    CalibrationFigures::of(case, source, &outcomes)
}

/// The named items, or all without names. Fails for an unknown name.
fn chosen<T>(names: &[String], all: Vec<T>, name_of: impl Fn(&T) -> &str) -> Result<Vec<T>> {
    if let Some(unknown) = names.iter().find(|name| all.iter().all(|one| name_of(one) != **name)) {
        let known: Vec<&str> = all.iter().map(&name_of).collect();
        refuse!("--set {unknown}: there is none; one of {}", known.join(", "));
    }
    let wanted = |one: &T| names.is_empty() || names.iter().any(|name| name == name_of(one));
    Ok(all.into_iter().filter(wanted).collect())
}

/// Renders and measures the frames of a set. The assignment of frames to measurers does not depend
/// on the machine.
fn judge(set: &Set, frames: u64, progress: &SharedProgress) -> Result<SetFigures> {
    let studio = SetStudio::new(set)?;
    let runs: Result<Vec<Vec<Option<WidthError>>>> = (0..frames.div_ceil(FRAMES_PER_MEASURER))
        .into_par_iter()
        .map(|run| {
            let mut measurer = Measurer::new(studio.gauge(), None);
            (run * FRAMES_PER_MEASURER..frames.min((run + 1) * FRAMES_PER_MEASURER))
                .map(|frame| {
                    let outcome = measure(&studio, &mut measurer, frame);
                    progress.advance();
                    outcome
                })
                .collect()
        })
        .collect();
    Ok(SetFigures::of(set, studio.mm_per_px(), &runs?.concat()))
}

/// Error of a frame's width; `None` for a rejected frame.
fn measure(studio: &SetStudio, measurer: &mut Measurer, frame: u64) -> Result<Option<WidthError>> {
    let rendered = studio.take(frame)?;
    let truth = rendered.truth.context("a bead that runs through its gauge has a truth")?;
    let found = measurer.measure(&rendered.frame, studio.surface()).ok();
    Ok(found.map(|found| WidthError {
        error_mm: found.width.get() - truth.width_mm,
        sigma_mm: found.sigma.get(),
    }))
}
