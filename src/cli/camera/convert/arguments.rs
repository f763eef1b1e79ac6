//! Arguments of `truebead camera convert`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::calibration::dictionary::Dictionary;
use crate::cli::arguments::parse_length;
use crate::cli::board_arguments::{InnerCorners, parse_board, parse_dictionary, parse_square};
use crate::core::Mm;

/// Converts a calibration to ROS's `camera_info` or OpenCV's YAML, or from them.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead camera convert calib.toml --to ros --out camera_info.yaml
  truebead camera convert calib.toml --to opencv --out opencv.yaml
  truebead camera convert camera_info.yaml --plane bed.png --board 9x6 --square-mm 20 --out calib.toml

Whose YAML it is, is recognised by its keys. ROS and OpenCV hold the camera and its
lens, but neither the bed plane nor the uncertainty of a width: the way there
and back loses both. A calibration for truebead therefore needs images of a
board that lies flat on the bed.")]
pub struct ConvertArgs {
    /// Calibration: .toml, or .yaml or .yml of ROS or OpenCV
    pub input: PathBuf,
    /// File to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Whose file to write: ros, opencv or truebead
    /// [default: truebead where --out ends in .toml]
    #[arg(long, value_name = "FORMAT", hide_possible_values = true)]
    pub to: Option<To>,
    /// Name of the camera in ROS's file [default: that of the input, or camera]
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    pub camera_name: Option<String>,
    /// Image whose board lies on the bed; give it again for further boards on the bed
    #[arg(long, value_name = "IMAGE", requires_all = ["board", "square_mm"])]
    pub plane: Vec<PathBuf>,
    /// Inner corners of the board: columns x rows, each one fewer than the squares
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_board, requires = "plane")]
    pub board: Option<InnerCorners>,
    /// Side of one square [mm]
    #[arg(long, value_name = "MM", value_parser = parse_square, requires = "plane")]
    pub square_mm: Option<Mm>,
    /// Side of the markers where the board is a ChArUco one [mm]
    #[expect(clippy::doc_markdown, reason = "shown by --help as it is")]
    #[arg(long, value_name = "MM", value_parser = parse_square, requires = "plane")]
    pub marker_mm: Option<Mm>,
    /// Cells of such markers: 4x4, 5x5, 6x6 or 7x7, or OpenCV's name of the dictionary
    #[arg(long, value_name = "NAME", default_value = "4x4", value_parser = parse_dictionary, requires = "marker_mm")]
    pub dictionary: Dictionary,
    /// Height of the board's printed face above the bed [mm] [default: 0]
    #[arg(long, value_name = "MM", value_parser = parse_length, requires = "plane")]
    pub board_thickness_mm: Option<Mm>,
    /// The robot's z when the image that fixes the plane was taken [mm] [default: 0]
    #[arg(long, value_name = "MM", value_parser = parse_length, allow_hyphen_values = true, requires = "plane")]
    pub robot_z_mm: Option<Mm>,
}

/// Whose file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum To {
    /// A calibration that measures, TOML
    Truebead,
    /// ROS's `camera_info`, YAML
    Ros,
    /// OpenCV's `FileStorage`, YAML
    Opencv,
}

/// Parses a camera name with the characters that ROS's `camera_info_manager` accepts.
fn parse_name(text: &str) -> Result<String, String> {
    let is_sound = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !text.is_empty() && text.chars().all(is_sound) {
        return Ok(text.to_owned());
    }
    Err("expected letters, digits and _, as ROS does".to_owned())
}
