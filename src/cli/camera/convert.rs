//! `truebead camera convert`: calibrations to and from ROS and OpenCV.

mod arguments;
mod import;

use std::path::Path;

pub use self::arguments::ConvertArgs;
use self::arguments::To;
use crate::calibration::exchange::{Import, Intrinsics, opencv, ros};
use crate::calibration::{Calibration, CalibrationQuality};
use crate::cli::arguments::{Written, WrongArguments, check_writable};
use crate::cli::print::Verbosity;
use crate::core::Mm;
use crate::io::atomic_file::write_atomic;
use crate::io::calibration_file;

/// Runs the command. Data that the other format has no place for are listed on standard error.
pub fn run(args: &ConvertArgs, voice: Verbosity) -> anyhow::Result<()> {
    let to = target(args)?;
    check(args, to)?;
    let (source, mut notes) = read(args)?;
    let text = match (&source, to) {
        (ConvertSource::Truebead(..), To::Truebead) => {
            refuse!("{}: it is truebead's already", args.input.display());
        }
        (ConvertSource::Other(import), To::Truebead) => import::text(args, import, &mut notes)?,
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
    write_atomic(&args.out, text.as_bytes())?;
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

/// The format of the output; its name must have the extension that other programs expect.
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
    let kind = if to == To::Truebead { Written::Calibration } else { Written::ForeignCamera };
    check_writable("out", &args.out, kind)?;
    let input = args.input.display();
    if !ends_in(&args.input, TOML) && !ends_in(&args.input, YAML) {
        refuse!(
            "{input}: expected a name that ends in .toml, .yaml or .yml; other formats of ROS and \
             OpenCV are not read, write YAML there"
        );
    }
    if !args.input.is_file() {
        refuse!("{input}: no such file");
    }
    if args.out.canonicalize().is_ok_and(|out| args.input.canonicalize().is_ok_and(|i| i == out)) {
        refuse!("--out {input}: it is the input, name another file");
    }
    if let Some(path) = args.plane.iter().find(|path| !path.is_file()) {
        refuse!("--plane {}: no such file", path.display());
    }
    if args.board_thickness_mm.is_some_and(|thickness| thickness < Mm::ZERO) {
        refuse!("the board's thickness cannot be below 0 mm");
    }
    if args.camera_name.is_some() && to != To::Ros {
        refuse!("--camera-name: only ROS's files have one (--to ros)");
    }
    match (to, args.plane.is_empty()) {
        (To::Truebead, true) if ends_in(&args.input, YAML) => refuse!(
            "{input} holds no bed plane: lay a board flat on the bed, take an image, and give \
             --plane IMAGE --board COLUMNSxROWS --square-mm MM"
        ),
        (To::Ros | To::Opencv, false) => {
            refuse!("--plane: files of ROS and OpenCV hold no bed plane; leave it out")
        }
        _ => Ok(()),
    }
}

/// The source of a conversion.
#[expect(clippy::large_enum_variant, reason = "there is one, read once")]
enum ConvertSource {
    /// A calibration of truebead: its intrinsics, and its quality.
    Truebead(Intrinsics, Option<CalibrationQuality>),
    /// A file of ROS or OpenCV.
    Other(Import),
}

fn read(args: &ConvertArgs) -> anyhow::Result<(ConvertSource, Vec<String>)> {
    if ends_in(&args.input, YAML) {
        let import = calibration_file::read_yaml(&args.input)?;
        let notes = import.notes.clone();
        return Ok((ConvertSource::Other(import), notes));
    }
    let calibration = calibration_file::read(&args.input)?;
    let Calibration::Full { image_size_px, camera, quality, .. } = calibration else {
        anyhow::bail!("{}: no camera in it", args.input.display());
    };
    let rms_px = quality.map(|quality| quality.reprojection_rms_px);
    let intrinsics = Intrinsics { image_size_px, camera, rms_px, camera_name: None };
    Ok((ConvertSource::Truebead(intrinsics, quality), Vec::new()))
}

impl ConvertSource {
    fn intrinsics(&self) -> &Intrinsics {
        match self {
            Self::Truebead(intrinsics, _) => intrinsics,
            Self::Other(import) => &import.intrinsics,
        }
    }

    /// A note about data for which the format has no place; `None` if nothing is lost.
    fn left_out(&self, to: To) -> Option<String> {
        let is_given = |quality: &CalibrationQuality| {
            quality.width_relative_sigma.is_some()
                || quality.seen_px.is_some()
                || quality.heights_mm.is_some()
                || quality.uncertainty.is_some()
        };
        let mut lost = Vec::new();
        let mut way_back = "";
        if let Self::Truebead(_, quality) = self {
            lost.push("the bed plane and the robot's z");
            if quality.as_ref().is_some_and(is_given) {
                lost.push("the uncertainty of a width and where boards were seen");
            }
            way_back = "; keep the .toml: on the way back the bed plane needs images of a board \
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
        Some(format!("{format} cannot hold {lost}{way_back}"))
    }
}
