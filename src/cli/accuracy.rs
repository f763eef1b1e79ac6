//! `truebead accuracy`: how well widths are measured in pictures whose truth is
//! known.

mod random;
mod roughness;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use clap::Args;
use rayon::prelude::*;

use super::{Voice, WrongArguments};
use crate::io::progress::Progress;
use crate::rows::output;
use crate::studies::accuracy::calibration_table;
use crate::studies::accuracy::calibration_table::RigFigures;
use crate::studies::accuracy::calibrations;
use crate::studies::accuracy::calibrations::{Bench, Rig, Source};
use crate::studies::accuracy::sets;
use crate::studies::accuracy::sets::Set;
use crate::studies::accuracy::studio::Studio;
use crate::studies::accuracy::{Outcome, SetFigures, markdown, table};
use crate::vision::Measurer;

/// Frames of a set where nothing else is said.
const FRAMES: u64 = 3_000;
/// Frames that one measurer measures after each other, as in a cell.
const RUN: u64 = 250;

/// Measures rendered sets of pictures and says how far off the widths are.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead accuracy --set blur-1.5 --set grains-6-dark --out accuracy

Every set is rendered and measured like the frames of a cell with defaults.
Silent: widths that are more than half a pixel off, as a share of all frames.
Bound: the smallest standard deviation that the width of a straight bead can
have in a picture that nothing disturbs; free bound: the same where its
direction is not known. The last column names the limits that are missed; the
status is 1 where there are any. ACCURACY.md says what every set is.

  truebead accuracy --calibration

calibrates cameras whose truth is known, from corners with noise and from
rendered pictures of boards, and compares the scatter of widths with what the
calibrations foretell.

  truebead accuracy --random torn,grooves --frames 3000 --keep-frames 20 --out random

renders frames whose every parameter is drawn, uniformly in its logarithm, from
the ranges of each set, and measures each of them alone.

  truebead accuracy --roughness

lets long torn beads pass through a gauge frame by frame, and compares the roughness
that successive frames give with that of the bead.")]
pub struct AccuracyArgs {
    /// Frames of each set [default: 3000, with --random 30000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    frames: Option<u64>,
    /// Frames of each set whose silently wrong widths are limited
    #[arg(long, value_name = "M", default_value = "30000", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    silent_frames: u64,
    /// Only this set, or with --calibration only this camera; may be given more than once
    #[arg(long = "set", value_name = "NAME")]
    sets: Vec<String>,
    /// Frames whose parameters are drawn at random: all of these sets, or some by name;
    /// `ribs` names both `ribs-weak` and `ribs-strong`
    #[arg(long, value_name = "all|NAME[,NAME…]", value_delimiter = ',', conflicts_with_all = ["calibration", "sets"])]
    random: Vec<String>,
    /// With --random: number of the first frame, for frames on which nothing was tuned
    #[arg(long, value_name = "N", default_value = "0", requires = "random", value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
    first_frame: u64,
    /// With --random: keep the first so many frames of each set as frames/SET-NUMBER.png,
    /// and what was drawn for them as frames/SET.csv
    #[arg(long, value_name = "K", default_value = "0", requires_all = ["random", "out"])]
    keep_frames: u64,
    /// Calibrations instead of widths: whether widths scatter as much from one to the
    /// next as each foretells of itself
    #[arg(long)]
    calibration: bool,
    /// Calibrations of each camera from corners with noise; 0: none
    #[arg(long, value_name = "N", default_value = "2000", value_parser = parse_trials)]
    trials: u64,
    /// Calibrations of each camera from rendered pictures; 0: none
    #[arg(long, value_name = "N", default_value = "100", value_parser = parse_trials)]
    rendered_trials: u64,
    /// Roughness of torn beads from successive frames, instead of widths
    #[arg(long, conflicts_with_all = ["calibration", "sets", "random"])]
    roughness: bool,
    /// With --roughness: beads that are rendered
    #[arg(long, value_name = "N", default_value = "200", requires = "roughness", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    beads: u64,
    /// Folder for accuracy.json and accuracy.md; for calibrations
    /// calibrations.json and calibrations.md, with --random random.json and random.md,
    /// with --roughness roughness.json and roughness.md
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &AccuracyArgs, voice: Voice) -> Result<ExitCode> {
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

/// A scatter takes two.
fn parse_trials(text: &str) -> Result<u64, String> {
    let count = text.trim().parse::<u64>().ok();
    count
        .filter(|count| *count != 1 && *count <= 10_000_000)
        .ok_or_else(|| "expected 0 for none, or 2 to 10000000".to_owned())
}

fn judge_calibrations(args: &AccuracyArgs, voice: Voice) -> Result<ExitCode> {
    let rigs =
        chosen(&args.sets, calibrations::rigs().context("the rigs' boards")?, |rig| rig.name)?;
    if let Some(out) = &args.out {
        output::make_folder(out)?;
    }
    let corners = rigs.iter().map(|rig| (rig, Source::Corners, args.trials));
    let rendered = rigs.iter().filter(|rig| rig.rendered);
    let pictures = rendered.map(|rig| (rig, Source::Pictures, args.rendered_trials));
    let all: Vec<_> = corners.chain(pictures).filter(|(.., trials)| *trials > 0).collect();
    let total = all.iter().map(|(.., trials)| trials).sum();
    let progress = Mutex::new(Progress::new("calibrating", "trials", Some(total), voice.quiet));
    let figures: Vec<RigFigures> = all
        .into_iter()
        .map(|(rig, source, trials)| judge_rig(rig, source, trials, &progress))
        .collect();
    progress.into_inner().unwrap_or_else(PoisonError::into_inner).finish();
    if let Some(out) = &args.out {
        let json = serde_json::to_vec_pretty(&figures).context("calibrations.json")?;
        output::write_whole(out, "calibrations.json", &json)?;
        output::write_whole(
            out,
            "calibrations.md",
            calibration_table::markdown(&figures).as_bytes(),
        )?;
    }
    say!("{}", calibration_table::table(&figures).trim_end());
    let missed = figures.iter().any(|figures| !figures.missed.is_empty());
    Ok(if missed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn judge_rig(rig: &Rig, source: Source, trials: u64, progress: &Mutex<Progress>) -> RigFigures {
    let bench = Bench::new(rig.clone(), source);
    let outcomes: Vec<_> = (0..trials)
        .into_par_iter()
        .map(|trial| {
            let outcomes = bench.calibrate(trial);
            progress.lock().unwrap_or_else(PoisonError::into_inner).advance();
            outcomes
        })
        .collect();
    RigFigures::of(rig, source, &outcomes)
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
    let studio = Studio::new(set)?;
    let runs: Result<Vec<Vec<Option<Outcome>>>> = (0..frames.div_ceil(RUN))
        .into_par_iter()
        .map(|run| {
            let mut measurer = Measurer::new(studio.gauge(), None);
            (run * RUN..frames.min((run + 1) * RUN))
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
fn measure(studio: &Studio, measurer: &mut Measurer, frame: u64) -> Result<Option<Outcome>> {
    let rendered = studio.take(frame)?;
    let truth = rendered.truth.context("a bead that runs through its gauge has a truth")?;
    let found = measurer.measure(&rendered.frame, studio.surface()).ok();
    Ok(found.map(|found| Outcome {
        error_mm: found.width.get() - truth.width_mm,
        sigma_mm: found.sigma.get(),
    }))
}
