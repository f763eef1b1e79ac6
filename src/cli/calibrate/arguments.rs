//! Arguments of `truebead calibrate`.

use std::path::PathBuf;

use clap::Args;

use crate::cli::arguments::parse_length;
use crate::cli::board_arguments::BoardArgs;
use crate::core::Mm;

/// Finds camera, lens and bed plane from images of a board.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead calibrate images/ --board 9x6 --square-mm 20 --out calib.toml

Take 10 to 20 sharp images of a flat board, tilted to several sides and in
all parts of the image. Take the last one with the board flat on the bed, or
name that image with --plane. docs/src/how-to/calibrate-a-camera.md has more.

Besides the calibration file a report.html is written: the uncertainty of a
width over the image, and what one more image would bring.

  truebead calibrate --camera camera:0 --board 9x6 --square-mm 20 \\
    --bead-mm 40 --max-width-sigma-mm 0.05 --out calib.toml

takes the images, too: first of the board lying on the bed, then at every
position in which it is held, and ends when the uncertainty of the bead's width
is within its limit.")]
pub struct CalibrateArgs {
    /// Folder of images of a board
    #[arg(required_unless_present = "camera", conflicts_with = "camera")]
    pub input: Option<PathBuf>,
    /// Take the images now, with this camera, as a cell names it: camera:0,
    /// gst:PIPELINE, an http address, or recorded frames
    #[arg(long, value_name = "SOURCE")]
    pub camera: Option<String>,
    /// Folder for the images that are taken
    /// [default: beside the calibration file, with its name and -images]
    #[arg(long, value_name = "DIR", requires = "camera")]
    pub images: Option<PathBuf>,
    /// Images a second from an http address or from recorded frames
    #[arg(long, value_name = "HZ", requires = "camera", default_value_t = 10.0)]
    pub rate_hz: f64,
    #[command(flatten)]
    pub board: BoardArgs,
    /// Calibration file to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Image whose board lies on the bed: one of the folder's, or any other file; give
    /// it again for further boards on the bed
    /// [default: the last image in which the board is found]
    #[arg(long, value_name = "IMAGE", conflicts_with = "camera")]
    pub plane: Vec<PathBuf>,
    /// Height of the board's printed face above the bed [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length)]
    pub board_thickness_mm: Mm,
    /// The robot's z when the image that fixes the plane was taken [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length, allow_hyphen_values = true)]
    pub robot_z_mm: Mm,
    /// Width of the bead that will be measured, for what is reported about it [mm]
    /// [default: a third of the image's width]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub bead_mm: Option<Mm>,
    /// Height of its top edges above the bed, for what is reported about it; give it again
    /// for further layers [mm]
    /// [default: 0, and a twentieth of the camera's height]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub surface_height_mm: Vec<Mm>,
    /// Largest standard deviation that the calibration may leave in that width, where
    /// boards were seen; exit status 1 above it [mm]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub max_width_sigma_mm: Option<Mm>,
    /// Report to write
    /// [default: report.html beside the calibration file]
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
}

impl CalibrateArgs {
    /// The report's file.
    pub fn report(&self) -> PathBuf {
        self.report.clone().unwrap_or_else(|| self.out.with_file_name("report.html"))
    }
}
