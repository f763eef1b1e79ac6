//! `truebead calibrate`: camera and bed plane from pictures of a checkerboard.

mod conclusion;
mod live;
pub(super) mod plane;
pub(super) mod report;

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use self::conclusion::Conclusion;
use super::WrongArguments;
use crate::calibration::board::{Board, Marks};
use crate::calibration::dictionary::Dictionary;
use crate::calibration::refusal::Refusal;
use crate::calibration::sighting;
use crate::calibration::sighting::{Looks, Sighting};
use crate::core::frame::Channel;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::drivers::camera::folder::list_images;
use crate::io::image_file;
use crate::io::whole_file::write_whole;

/// Finds camera, lens and bed plane from images of a board, in a folder or taken now.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead calibrate pictures/ --board 9x6 --square-mm 20 --out calib.toml

Take 10 to 20 sharp pictures of a flat board, tilted to several sides and in
all parts of the picture. Take the last one with the board flat on the bed, or
name that picture with --plane. calib/README.md tells more.

Besides the calibration file a report.html is written: what a width is known
to, all over the picture, and what one more picture would bring.

  truebead calibrate --camera camera:0 --board 9x6 --square-mm 20 \\
    --bead-mm 40 --max-width-sigma-mm 0.05 --out calib.toml

takes the pictures, too: first of the board lying on the bed, then of every
place in which it is held, and ends when the width of the bead is known as well
as was asked for.")]
pub struct CalibrateArgs {
    /// Folder of images of a board
    #[arg(required_unless_present = "camera", conflicts_with = "camera")]
    input: Option<PathBuf>,
    /// Take the pictures now, with this camera, as a cell names it: camera:0,
    /// gst:PIPELINE, an http address, or recorded frames
    #[arg(long, value_name = "SOURCE")]
    camera: Option<String>,
    /// Folder for the pictures that are taken
    /// [default: beside the calibration file, with its name and -pictures]
    #[arg(long, value_name = "DIR", requires = "camera")]
    pictures: Option<PathBuf>,
    /// Pictures a second from an http address or from recorded frames
    #[arg(long, value_name = "HZ", requires = "camera", default_value_t = 10.0)]
    rate_hz: f64,
    #[command(flatten)]
    board: BoardArgs,
    /// Calibration file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Image whose board lies on the bed: one of the folder's, or any other file; give
    /// it again for further boards on the bed
    /// [default: the last image in which the board is found]
    #[arg(long, value_name = "IMAGE", conflicts_with = "camera")]
    plane: Vec<PathBuf>,
    /// Height of the board's printed face above the bed [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length)]
    board_thickness_mm: Mm,
    /// The robot's z when the image that fixes the plane was taken [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length, allow_hyphen_values = true)]
    robot_z_mm: Mm,
    /// Width of the bead that will be measured, for what is told about it [mm]
    /// [default: a third of the picture's width]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    bead_mm: Option<Mm>,
    /// Height of its top edges above the bed, for what is told about it; give it again
    /// for further layers [mm]
    /// [default: 0, and a twentieth of the camera's height]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    surface_height_mm: Vec<Mm>,
    /// Largest standard deviation that the calibration may leave in that width, where
    /// boards were seen; exit status 1 above it [mm]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    max_width_sigma_mm: Option<Mm>,
    /// Report to write
    /// [default: report.html beside the calibration file]
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

/// A board, as it is told on the command line.
#[derive(Debug, Args)]
pub struct BoardArgs {
    /// Inner corners of the board: columns x rows, each one fewer than the squares
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_board)]
    board: (usize, usize),
    /// Side of one square [mm]
    #[arg(long, value_name = "MM", value_parser = parse_square)]
    square_mm: Mm,
    #[expect(clippy::doc_markdown, reason = "shown by --help as it is")]
    /// Side of the markers, with their black border, where the board is a ChArUco one [mm]
    /// [default: none, a plain checkerboard]
    #[arg(long, value_name = "MM", value_parser = parse_square)]
    marker_mm: Option<Mm>,
    /// Cells of such markers: 4x4, 5x5, 6x6 or 7x7, or OpenCV's name of the dictionary
    #[arg(long, value_name = "NAME", default_value = "4x4", value_parser = parse_dictionary, requires = "marker_mm")]
    dictionary: Dictionary,
}

impl BoardArgs {
    /// Fails for a board that cannot be used.
    pub fn board(&self) -> Result<Board, WrongArguments> {
        board_of(self.board, self.square_mm, (self.marker_mm, self.dictionary))
    }
}

/// A board of so many inner corners, with markers where their side is given. Fails for one
/// that cannot be used.
pub(super) fn board_of(
    (columns, rows): (usize, usize),
    square: Mm,
    (marker, dictionary): (Option<Mm>, Dictionary),
) -> Result<Board, WrongArguments> {
    let plain = Board::new(columns, rows, square).map_err(WrongArguments::new)?;
    let Some(side) = marker else { return Ok(plain) };
    plain.with_marks(Marks { side, dictionary }).map_err(WrongArguments::new)
}

pub(super) fn parse_dictionary(text: &str) -> Result<Dictionary, String> {
    Dictionary::named(text).ok_or_else(|| {
        "expected 4x4, 5x5, 6x6 or 7x7, or a name of OpenCV's such as DICT_5X5_100".to_owned()
    })
}

pub(super) fn parse_board(text: &str) -> Result<(usize, usize), String> {
    let sides = text.split_once(['x', 'X', '×']);
    let number = |side: &str| side.trim().parse::<usize>().ok();
    sides
        .and_then(|(columns, rows)| Some((number(columns)?, number(rows)?)))
        .ok_or_else(|| "write columns x rows of inner corners, such as 9x6".to_owned())
}

pub(super) fn parse_length(text: &str) -> Result<Mm, String> {
    let value: f64 = text.trim().parse().map_err(|_| "expected a number of mm".to_owned())?;
    let within = |mm: &f64| mm.abs() <= LONGEST_MM;
    if value.is_finite() && !within(&value) {
        return Err(format!("expected {LONGEST_MM} mm or less"));
    }
    Mm::new(value).map_err(|error| error.to_string())
}

/// The side of a square that can be printed and seen.
pub(super) fn parse_square(text: &str) -> Result<Mm, String> {
    let side = parse_length(text)?;
    let (smallest, largest) = SQUARES_MM;
    if (smallest..=largest).contains(&side.get()) {
        Ok(side)
    } else {
        Err(format!("expected {smallest} to {largest} mm"))
    }
}

/// Lengths beyond this are mistyped \[mm\].
const LONGEST_MM: f64 = 1e5;
/// Sides of squares \[mm\].
const SQUARES_MM: (f64, f64) = (0.01, 1e4);

/// Pictures that were looked at.
pub(super) struct Pictures {
    files: Vec<PathBuf>,
    looks: Looks,
    /// Those whose boards lay on the bed; none where the last one is to be taken.
    on_bed: Vec<PathBuf>,
}

/// Runs the command; the table and the figures go to standard output. Fails
/// without writing anything where no calibration can be found.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let board = args.board.board()?;
    check_arguments(args)?;
    if let (Some(_), Some(folder)) = (&args.input, &args.pictures) {
        let what = format!("--pictures {}: only with --camera", folder.display());
        return Err(WrongArguments::new(what).into());
    }
    let pictures = match &args.input {
        Some(folder) => look_into(args, &board, folder)?,
        None => live::take(args, &board)?,
    };
    let conclusion = Conclusion::of(args, &board, &pictures)
        .inspect_err(|_| say(&report::refusals(&pictures.looks)))?;
    say(&report::images(&pictures.looks, &conclusion.solution));
    let calibration = conclusion.write()?;
    let answer = conclusion.text(&calibration);
    say(&answer);
    say(&format!("\nwrote {}\n", args.out.display()));
    let report = args.report();
    write_whole(&report, conclusion.page(&answer, None).as_bytes())?;
    say(&format!("wrote {}\n", report.display()));
    Ok(if conclusion.fails() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn look_into(args: &CalibrateArgs, board: &Board, folder: &Path) -> anyhow::Result<Pictures> {
    let files = list_images(folder)
        .map_err(|error| WrongArguments::new(format!("{}: {}", error.source_name, error.what)))?;
    plane::check(&args.plane, &files)?;
    let mut looks = look_at_all(board, &files);
    sighting::agree_on_size(&mut looks);
    sighting::take_out_duplicates(board, &mut looks);
    Ok(Pictures { files, looks, on_bed: args.plane.clone() })
}

impl CalibrateArgs {
    fn report(&self) -> PathBuf {
        self.report.clone().unwrap_or_else(|| self.out.with_file_name("report.html"))
    }
}

fn check_arguments(args: &CalibrateArgs) -> Result<(), WrongArguments> {
    let report = args.report();
    if report == args.out {
        let what = format!("--out and --report are both {}: name two files", report.display());
        return Err(WrongArguments::new(what));
    }
    for (name, path) in [("out", &args.out), ("report", &report)] {
        check_writable(name, path)?;
    }
    if args.board_thickness_mm < Mm::ZERO {
        return Err(WrongArguments::new("the board's thickness cannot be below 0 mm"));
    }
    if !(0.1..=1000.0).contains(&args.rate_hz) {
        let what = format!("--rate-hz: found {}, expected 0.1 to 1000", args.rate_hz);
        return Err(WrongArguments::new(what));
    }
    for (name, value) in
        [("bead-mm", args.bead_mm), ("max-width-sigma-mm", args.max_width_sigma_mm)]
    {
        if let Some(value) = value.filter(|&value| value <= Mm::ZERO) {
            return Err(WrongArguments::new(format!(
                "--{name}: found {value}, expected more than 0"
            )));
        }
    }
    Ok(())
}

/// Finds a mistyped place for a file before the long work; `name` is the option's.
pub(super) fn check_writable(name: &str, path: &Path) -> Result<(), WrongArguments> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        let what = format!("--{name} {}: no folder {}", path.display(), folder.display());
        return Err(WrongArguments::new(what));
    }
    if path.is_dir() {
        let what = format!("--{name} {}: a folder, expected a file", path.display());
        return Err(WrongArguments::new(what));
    }
    Ok(())
}

/// Writes to standard output. A reader that has gone away, such as `head`, is no
/// reason to stop.
pub(super) fn say(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn look_at_all(board: &Board, files: &[PathBuf]) -> Looks {
    let bar = progress(files.len());
    let looks = files
        .par_iter()
        .map(|path| {
            let name = conclusion::name_of(path);
            let look = look_at(board, &name, path);
            bar.inc(1);
            (name, look)
        })
        .collect();
    bar.finish_and_clear();
    looks
}

/// Looks for the board in an image file.
pub fn look_at(board: &Board, name: &str, path: &Path) -> Result<Sighting, Refusal> {
    let frame = image_file::read(path, Channel::Grey, 0, Stamp::START)
        .map_err(|error| Refusal::Unreadable(error.to_string()))?;
    sighting::look(board, name, &frame)
}

/// Fails for a picture that is not of the size that a calibration is for.
pub(super) fn check_size(sighting: &Sighting, expected: [u32; 2]) -> anyhow::Result<()> {
    let ([width, height], [right, bottom]) = (sighting.image_size_px, expected);
    anyhow::ensure!(
        sighting.image_size_px == expected,
        "{}: {width}x{height} px, but the calibration is for {right}x{bottom} px: take the \
         picture as the camera was calibrated, or calibrate anew",
        sighting.name
    );
    Ok(())
}

fn progress(count: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        tell!("looking for the board in {count} images");
    }
    let style = ProgressStyle::with_template("looking for the board {wide_bar} {pos}/{len}");
    // Hidden by itself where standard error is not a terminal.
    let bar = ProgressBar::new(count as u64);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
