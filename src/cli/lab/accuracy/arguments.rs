//! Arguments of `truebead lab accuracy`.

use std::path::PathBuf;

use clap::Args;

/// Measures rendered sets of images and says how far off the widths are.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead lab accuracy --set blur-1.5 --set grains-6-dark --out accuracy

Every set is rendered and measured like the frames of a cell with defaults.
Silent: widths that are more than half a pixel off, as a fraction of all frames.
Bound: the smallest standard deviation that the width of a straight bead can
have in an image that nothing disturbs; free bound: the same where its
direction is not known. The last column names the limits that are missed; the
status is 1 where there are any. docs/src/reference/accuracy.md says what every set is.

  truebead lab accuracy --calibration

calibrates cameras whose truth is known, from corners with noise and from
rendered images of boards, and compares the standard deviation of widths with
the one that the calibrations predict.

  truebead lab accuracy --random torn,grooves --frames 3000 --keep-frames 20 --out random

renders frames whose every parameter is drawn, uniformly in its logarithm, from
the ranges of each set, and measures each of them alone.

  truebead lab accuracy --roughness

lets long torn beads pass through a gauge frame by frame, and compares the roughness
that successive frames give with that of the bead.")]
pub struct AccuracyArgs {
    /// Frames of each set [default: 3000, with --random 30000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub frames: Option<u64>,
    /// Frames of each set whose silently wrong widths are limited
    #[arg(long, value_name = "M", default_value = "30000", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub silent_frames: u64,
    /// Only this set, or with --calibration only this camera; may be given more than once
    #[arg(long = "set", value_name = "NAME")]
    pub sets: Vec<String>,
    /// Frames whose parameters are drawn at random: all of these sets, or some by name;
    /// `ribs` names both `ribs-weak` and `ribs-strong`
    #[arg(long, value_name = "all|NAME[,NAME…]", value_delimiter = ',', conflicts_with_all = ["calibration", "sets"])]
    pub random: Vec<String>,
    /// With --random: number of the first frame, for frames on which nothing was tuned
    #[arg(long, value_name = "N", default_value = "0", requires = "random", value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
    pub first_frame: u64,
    /// With --random: keep the first so many frames of each set as frames/SET-NUMBER.png,
    /// and what was drawn for them as frames/SET.csv
    #[arg(long, value_name = "K", default_value = "0", requires_all = ["random", "out"])]
    pub keep_frames: u64,
    /// Calibrations instead of widths: whether the standard deviation of widths from one to
    /// the next is the one that each predicts
    #[arg(long)]
    pub calibration: bool,
    /// Calibrations of each camera from corners with noise; 0: none
    #[arg(long, value_name = "N", default_value = "2000", value_parser = parse_trials)]
    pub trials: u64,
    /// Calibrations of each camera from rendered images; 0: none
    #[arg(long, value_name = "N", default_value = "100", value_parser = parse_trials)]
    pub rendered_trials: u64,
    /// Roughness of torn beads from successive frames, instead of widths
    #[arg(long, conflicts_with_all = ["calibration", "sets", "random"])]
    pub roughness: bool,
    /// With --roughness: beads that are rendered
    #[arg(long, value_name = "N", default_value = "200", requires = "roughness", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub beads: u64,
    /// Folder for accuracy.json and accuracy.md; for calibrations
    /// calibrations.json and calibrations.md, with --random random.json and random.md,
    /// with --roughness roughness.json and roughness.md
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Parses a number of trials: a standard deviation needs at least two.
fn parse_trials(text: &str) -> Result<u64, String> {
    let count = text.trim().parse::<u64>().ok();
    count
        .filter(|count| *count != 1 && *count <= 10_000_000)
        .ok_or_else(|| "expected 0 for none, or 2 to 10000000".to_owned())
}
