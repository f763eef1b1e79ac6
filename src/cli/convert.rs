//! `truebead convert`: cameras from and for ROS and OpenCV.

mod import;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::calibrate::{check_writable, parse_board, parse_dictionary, parse_length, parse_square};
use super::{Voice, WrongArguments};
use crate::calibration::dictionary::Dictionary;
use crate::calibration::exchange::{Import, Intrinsics, opencv, ros};
use crate::calibration::{Calibration, Quality};
use crate::core::units::Mm;
use crate::io::calibration_file;
use crate::io::whole_file::write_whole;

/// Converts a calibration to ROS's `camera_info` or OpenCV's YAML, or from them.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  truebead convert calib.toml --to ros --out camera_info.yaml
  truebead convert calib.toml --to opencv --out opencv.yaml
  truebead convert camera_info.yaml --plane bed.png --board 9x6 --square-mm 20 --out calib.toml

Whose YAML it is, is told by its keys. ROS and OpenCV hold the camera and its
lens, but no bed plane and nothing of how well a width is known: the way there
and back loses both. A calibration for truebead therefore needs pictures of a
board that lies flat on the bed.")]
pub struct ConvertArgs {
    /// Calibration: .toml, or .yaml or .yml of ROS or OpenCV
    input: PathBuf,
    /// File to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Whose file to write [default: truebead where --out ends in .toml]
    #[arg(long, value_name = "FORMAT")]
    to: Option<To>,
    /// Name of the camera in ROS's file [default: that of the input, or camera]
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    camera_name: Option<String>,
    /// Image whose board lies on the bed; give it again for further boards on the bed
    #[arg(long, value_name = "IMAGE", requires_all = ["board", "square_mm"])]
    plane: Vec<PathBuf>,
    /// Inner corners of the board: columns x rows, each one fewer than the squares
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_board, requires = "plane")]
    board: Option<(usize, usize)>,
    /// Side of one square [mm]
    #[arg(long, value_name = "MM", value_parser = parse_square, requires = "plane")]
    square_mm: Option<Mm>,
    /// Side of the markers where the board is a ChArUco one [mm]
    #[expect(clippy::doc_markdown, reason = "shown by --help as it is")]
    #[arg(long, value_name = "MM", value_parser = parse_square, requires = "plane")]
    marker_mm: Option<Mm>,
    /// Cells of such markers: 4x4, 5x5, 6x6 or 7x7, or OpenCV's name of the dictionary
    #[arg(long, value_name = "NAME", default_value = "4x4", value_parser = parse_dictionary, requires = "marker_mm")]
    dictionary: Dictionary,
    /// Height of the board's printed face above the bed [mm] [default: 0]
    #[arg(long, value_name = "MM", value_parser = parse_length, requires = "plane")]
    board_thickness_mm: Option<Mm>,
    /// The robot's z when the image that fixes the plane was taken [mm] [default: 0]
    #[arg(long, value_name = "MM", value_parser = parse_length, allow_hyphen_values = true, requires = "plane")]
    robot_z_mm: Option<Mm>,
}

/// Whose file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// A calibration that measures, TOML
    Truebead,
    /// ROS's `camera_info`, YAML
    Ros,
    /// OpenCV's `FileStorage`, YAML
    Opencv,
}

/// What ROS's `camera_info_manager` takes for a name.
fn parse_name(text: &str) -> Result<String, String> {
    let is_sound = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !text.is_empty() && text.chars().all(is_sound) {
        return Ok(text.to_owned());
    }
    Err("expected letters, digits and _, as ROS does".to_owned())
}

/// Runs the command. What the other format cannot hold goes to standard error.
pub fn run(args: &ConvertArgs, voice: Voice) -> anyhow::Result<()> {
    let to = target(args)?;
    check(args, to)?;
    let (source, mut notes) = read(args)?;
    let text = match (&source, to) {
        (Source::Truebead(..), To::Truebead) => {
            let what = format!("{}: it is truebead's already", args.input.display());
            return Err(WrongArguments::new(what).into());
        }
        (Source::Other(import), To::Truebead) => import::text(args, import, &mut notes)?,
        (source, To::Ros) => {
            let intrinsics = source.intrinsics();
            let own = intrinsics.camera_name.as_deref().unwrap_or("camera");
            notes.extend(source.left_out(to));
            ros::to_yaml(intrinsics, args.camera_name.as_deref().unwrap_or(own))
        }
        (source, To::Opencv) => {
            notes.extend(source.left_out(to));
            opencv::to_yaml(source.intrinsics())
        }
    };
    write_whole(&args.out, text.as_bytes())?;
    say!("wrote {}", args.out.display());
    if !voice.quiet {
        for note in &notes {
            tell!("note: {note}");
        }
    }
    Ok(())
}

fn ends_in(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| endings.contains(&ending.as_str()))
}

const YAML: &[&str] = &["yaml", "yml"];
const TOML: &[&str] = &["toml"];

/// Whose file is wanted; its name must say what is in it, by which others choose how
/// they read it.
fn target(args: &ConvertArgs) -> Result<To, WrongArguments> {
    let is_toml = ends_in(&args.out, TOML);
    let out = args.out.display();
    let what = match args.to {
        None if is_toml => return Ok(To::Truebead),
        None => format!(
            "--out {out}: give --to ros or --to opencv, or a name that ends in .toml for truebead"
        ),
        Some(to) if (to == To::Truebead && is_toml) => return Ok(to),
        Some(to) if (to != To::Truebead && ends_in(&args.out, YAML)) => return Ok(to),
        Some(To::Truebead) => format!("--out {out}: expected a name that ends in .toml"),
        Some(_) => format!("--out {out}: expected a name that ends in .yaml or .yml"),
    };
    Err(WrongArguments::new(what))
}

fn check(args: &ConvertArgs, to: To) -> Result<(), WrongArguments> {
    check_writable("out", &args.out)?;
    let wrong = |what: String| Err(WrongArguments::new(what));
    let input = args.input.display();
    if !ends_in(&args.input, TOML) && !ends_in(&args.input, YAML) {
        return wrong(format!(
            "{input}: expected a name that ends in .toml, .yaml or .yml; other formats of ROS and \
             OpenCV are not read, write YAML there"
        ));
    }
    if !args.input.is_file() {
        return wrong(format!("{input}: no such file"));
    }
    if args.out.canonicalize().is_ok_and(|out| args.input.canonicalize().is_ok_and(|i| i == out)) {
        return wrong(format!("--out {input}: it is the input, name another file"));
    }
    if let Some(path) = args.plane.iter().find(|path| !path.is_file()) {
        return wrong(format!("--plane {}: no such file", path.display()));
    }
    if args.board_thickness_mm.is_some_and(|thickness| thickness < Mm::ZERO) {
        return wrong("the board's thickness cannot be below 0 mm".to_owned());
    }
    if args.camera_name.is_some() && to != To::Ros {
        return wrong("--camera-name: only ROS's files have one (--to ros)".to_owned());
    }
    match (to, args.plane.is_empty()) {
        (To::Truebead, true) if ends_in(&args.input, YAML) => wrong(format!(
            "{input} holds no bed plane: lay a board flat on the bed, take a picture, and give \
             --plane IMAGE --board COLUMNSxROWS --square-mm MM"
        )),
        (To::Ros | To::Opencv, false) => {
            wrong("--plane: files of ROS and OpenCV hold no bed plane; leave it out".to_owned())
        }
        _ => Ok(()),
    }
}

/// What is converted.
#[expect(clippy::large_enum_variant, reason = "there is one, read once")]
enum Source {
    /// A calibration of ours: what others can hold of it, and what the pictures said.
    Truebead(Intrinsics, Option<Quality>),
    /// A file of others.
    Other(Import),
}

fn read(args: &ConvertArgs) -> anyhow::Result<(Source, Vec<String>)> {
    if ends_in(&args.input, YAML) {
        let import = calibration_file::read_exchanged(&args.input)?;
        let notes = import.notes.clone();
        return Ok((Source::Other(import), notes));
    }
    let calibration = calibration_file::read(&args.input)?;
    let Calibration::Full { image_size_px, camera, quality, .. } = calibration else {
        anyhow::bail!("{}: no camera in it", args.input.display());
    };
    let rms_px = quality.map(|quality| quality.reprojection_rms_px);
    let intrinsics = Intrinsics { image_size_px, camera, rms_px, camera_name: None };
    Ok((Source::Truebead(intrinsics, quality), Vec::new()))
}

impl Source {
    fn intrinsics(&self) -> &Intrinsics {
        match self {
            Self::Truebead(intrinsics, _) => intrinsics,
            Self::Other(import) => &import.intrinsics,
        }
    }

    /// What a file of this format does not hold, in words; `None` where nothing is lost.
    fn left_out(&self, to: To) -> Option<String> {
        let is_told = |quality: &Quality| {
            let Quality {
                reprojection_rms_px: _,
                width_sigma_share,
                seen_px,
                heights_mm,
                uncertainty,
            } = quality;
            width_sigma_share.is_some()
                || seen_px.is_some()
                || heights_mm.is_some()
                || uncertainty.is_some()
        };
        let mut lost = Vec::new();
        let mut way_back = "";
        if let Self::Truebead(_, quality) = self {
            lost.push("the bed plane and the robot's z");
            if quality.as_ref().is_some_and(is_told) {
                lost.push("how well a width is known and where boards were seen");
            }
            way_back = "; keep the .toml: on the way back the bed plane needs pictures of a board \
                        (--plane), and the calibration's part of sigma_mm stays unknown";
        }
        let intrinsics = self.intrinsics();
        match to {
            To::Ros if intrinsics.rms_px.is_some() => lost.push("the reprojection error"),
            To::Opencv if intrinsics.camera_name.is_some() => lost.push("the camera's name"),
            _ => {}
        }
        let format = if to == To::Ros { "ROS's camera_info" } else { "OpenCV's YAML" };
        let lost = lost.split_last().map(|(last, first)| match first {
            [] => (*last).to_owned(),
            _ => format!("{}, and {last}", first.join(", ")),
        })?;
        Some(format!("{format} has no place for {lost}{way_back}"))
    }
}
