//! `truebead calibrate`: camera and bed plane from pictures of a checkerboard.

mod plane;
mod report;

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use self::plane::Plane;
use super::WrongArguments;
use crate::calib::board::{Board, Marks};
use crate::calib::covariance::Covariance;
use crate::calib::dictionary::Dictionary;
use crate::calib::map::{self, WidthMap};
use crate::calib::next_view::{self, NextView};
use crate::calib::quality;
use crate::calib::share;
use crate::calib::sighting::{self, Looks, Refusal, Sighting};
use crate::calib::solve::{self, Solution};
use crate::calib::{Calibration, Quality, file};
use crate::frame::Channel;
use crate::io::camera::folder::list_images;
use crate::io::image_file;
use crate::io::whole_file::write_whole;
use crate::offline::calibration::Page;
use crate::time::Stamp;
use crate::units::Mm;

/// Finds camera, lens and bed plane from a folder of checkerboard images.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead calibrate pictures/ --board 9x6 --square-mm 20 --out calib.toml

Take 10 to 20 sharp pictures of a flat board, tilted to several sides and in
all parts of the picture. Take the last one with the board flat on the bed, or
name that picture with --plane. calib/README.md tells more.

Besides the calibration file a report.html is written: what a width is known
to, all over the picture, and what one more picture would bring.")]
pub struct CalibrateArgs {
    /// Folder of checkerboard images
    input: PathBuf,
    #[command(flatten)]
    board: BoardArgs,
    /// Calibration file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Image whose board lies on the bed: one of the folder's, or any other file; give
    /// it again for further boards on the bed
    /// [default: the last image in which the board is found]
    #[arg(long, value_name = "IMAGE")]
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
    #[arg(long, value_name = "NAME", default_value = "4x4", value_parser = parse_dictionary)]
    dictionary: Dictionary,
}

impl BoardArgs {
    /// Fails for a board that cannot be used.
    pub fn board(&self) -> Result<Board, WrongArguments> {
        let (columns, rows) = self.board;
        let plain = Board::new(columns, rows, self.square_mm).map_err(WrongArguments::new)?;
        let Some(side) = self.marker_mm else { return Ok(plain) };
        let marks = Marks { side, dictionary: self.dictionary };
        plain.with_marks(marks).map_err(WrongArguments::new)
    }
}

fn parse_dictionary(text: &str) -> Result<Dictionary, String> {
    Dictionary::named(text).ok_or_else(|| {
        "expected 4x4, 5x5, 6x6 or 7x7, or a name of OpenCV's such as DICT_5X5_100".to_owned()
    })
}

fn parse_board(text: &str) -> Result<(usize, usize), String> {
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
fn parse_square(text: &str) -> Result<Mm, String> {
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

/// Runs the command; the table and the figures go to standard output. Fails
/// without writing anything where no calibration can be found.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let board = args.board.board()?;
    check_lengths(args)?;
    let files = list_images(&args.input)
        .map_err(|error| WrongArguments::new(format!("{}: {}", error.source_name, error.what)))?;
    plane::check(&args.plane, &files)?;
    let mut looks = look_at_all(&board, &files);
    sighting::agree_on_size(&mut looks);
    sighting::take_out_duplicates(&board, &mut looks);
    let seen: Vec<Sighting> = looks.iter().filter_map(|(_, look)| look.clone().ok()).collect();
    let solution = solve::solve(&board, &seen).inspect_err(|_| say(&report::refusals(&looks)))?;
    say(&report::images(&looks, &solution));
    let plane = plane::find(args, &board, &solution, (&files, &looks))?;
    let findings = Findings::of(args, &board, &solution, &plane)?;
    let calibration = write(args, &board, &solution, &plane, &findings)?;
    let answer = text_of(args, &solution, &plane, &calibration, &findings);
    say(&answer);
    say(&format!("\nwrote {}\n", args.out.display()));
    let page = Page {
        board: &board,
        looks: &looks,
        solution: &solution,
        maps: &findings.maps,
        limit_mm: args.max_width_sigma_mm.map(Mm::get),
        next: findings.next.as_ref(),
        text: &answer,
        calibration_file: &args.out.display().to_string(),
    }
    .page();
    let report = args.report();
    write_whole(&report, page.as_bytes())?;
    say(&format!("wrote {}\n", report.display()));
    Ok(if findings.fails(args.max_width_sigma_mm) { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// What the calibration leaves open.
struct Findings {
    covariance: Option<Covariance>,
    maps: Vec<WidthMap>,
    next: Option<NextView>,
}

impl Findings {
    /// Fails for a surface that the camera does not look down on.
    fn of(
        args: &CalibrateArgs,
        board: &Board,
        solution: &Solution,
        plane: &Plane,
    ) -> anyhow::Result<Self> {
        // Corners' noise is the least of the errors where the focal length is loose.
        let covariance = quality::settles_camera(solution)
            .then(|| Covariance::of(board, solution, &plane.on_bed, plane.thickness))
            .flatten();
        let Some(known) = &covariance else {
            return Ok(Self { covariance, maps: Vec::new(), next: None });
        };
        let camera_mm = known.camera_height_mm();
        if let Some(height) = args.surface_height_mm.iter().find(|h| h.get() >= camera_mm) {
            anyhow::bail!(
                "--surface-height-mm: found {height}, but the camera is only {camera_mm:.1} mm above \
                 the bed"
            );
        }
        let above = Mm::new((known.camera_height_mm() / 20.0).round()).unwrap_or(Mm::ZERO);
        let usual = [Mm::ZERO, above];
        let told = args.surface_height_mm.as_slice();
        let heights = if told.is_empty() { &usual[..] } else { told };
        let bead = args.bead_mm.map(Mm::get).or_else(|| map::usual_bead_mm(known));
        let maps = bead.map_or_else(Vec::new, |bead| {
            heights.iter().map(|&height| WidthMap::of(known, bead, height)).collect()
        });
        let next = next_view::best(board, solution, known);
        Ok(Self { covariance, maps, next })
    }

    /// Share of a width that the calibration leaves open where boards were seen: of the
    /// bead that was told or is usual, at the worst of the heights.
    fn share(&self) -> Option<f64> {
        let shares = self.maps.iter().map(|map| Some(map.worst_where_seen_mm? / map.bead_mm));
        let told = shares.reduce(|a, b| Some(a?.max(b?))).flatten();
        told.or_else(|| share::where_seen(self.covariance.as_ref()?))
    }

    /// Whether a width is known less well than it must be.
    fn fails(&self, limit: Option<Mm>) -> bool {
        let worst = self.maps.iter().map(|map| map.worst_where_seen_mm);
        let worst = worst.reduce(|a, b| Some(a?.max(b?))).flatten();
        limit.is_some_and(|limit| worst.is_none_or(|worst| worst > limit.get()))
    }
}

fn text_of(
    args: &CalibrateArgs,
    solution: &Solution,
    plane: &Plane,
    calibration: &Calibration,
    findings: &Findings,
) -> String {
    let covariance = findings.covariance.as_ref();
    [
        report::lens(solution),
        report::camera(solution),
        report::plane(plane),
        report::width(calibration, covariance, &findings.maps),
        report::maps(&findings.maps, args.max_width_sigma_mm),
        report::next_view(covariance, findings.next.as_ref()),
        report::scale(calibration, covariance, plane.thickness),
        report::doubts(solution),
    ]
    .concat()
}

impl CalibrateArgs {
    fn report(&self) -> PathBuf {
        self.report.clone().unwrap_or_else(|| self.out.with_file_name("report.html"))
    }
}

fn check_lengths(args: &CalibrateArgs) -> Result<(), WrongArguments> {
    let report = args.report();
    if report == args.out {
        let what = format!("--out and --report are both {}: name two files", report.display());
        return Err(WrongArguments::new(what));
    }
    for (name, path) in [("out", &args.out), ("report", &report)] {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            let what = format!("--{name} {}: no folder {}", path.display(), folder.display());
            return Err(WrongArguments::new(what));
        }
        if path.is_dir() {
            let what = format!("--{name} {}: a folder, expected a file", path.display());
            return Err(WrongArguments::new(what));
        }
    }
    if args.board_thickness_mm < Mm::ZERO {
        return Err(WrongArguments::new("the board's thickness cannot be below 0 mm"));
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

/// Writes to standard output. A reader that has gone away, such as `head`, is no
/// reason to stop.
fn say(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn look_at_all(board: &Board, files: &[PathBuf]) -> Looks {
    let bar = progress(files.len());
    let looks = files
        .par_iter()
        .map(|path| {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
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

fn progress(count: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        eprintln!("looking for the board in {count} images");
    }
    let style = ProgressStyle::with_template("looking for the board {wide_bar} {pos}/{len}");
    // Hidden by itself where standard error is not a terminal.
    let bar = ProgressBar::new(count as u64);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// Writes the file, once it has been read back and found sound.
fn write(
    args: &CalibrateArgs,
    board: &Board,
    solution: &Solution,
    plane: &Plane,
    findings: &Findings,
) -> anyhow::Result<Calibration> {
    let (columns, rows) = board.corners();
    let note = format!(
        "From {} images of a board with {columns}x{rows} inner corners and squares of {}.\n\
         Bed plane: {} below the board's face in {}.",
        solution.views.len(),
        board.square(),
        plane.thickness,
        plane.images.join(", "),
    );
    let covariance = findings.covariance.as_ref();
    let quality = Quality {
        reprojection_rms_px: solution.rms_px,
        width_sigma_share: findings.share(),
        seen_px: covariance.map(|covariance| {
            let [from, to] = covariance.seen_px();
            [from.x, from.y, to.x, to.y].map(|px| (px * 10.0).round() / 10.0)
        }),
        heights_mm: None,
    };
    let bed = plane.on_bed.bed(plane.thickness);
    let heights_mm = covariance.and_then(|_| solution.heights_mm(board, &bed));
    let quality = Quality { heights_mm, ..quality };
    let model = (solution.camera(), &bed);
    let (size, robot_z) = (solution.image_size_px, plane.robot_z);
    let text = file::to_toml(model, size, robot_z, Some(quality), &[note]);
    let name = args.out.display().to_string();
    let calibration = file::parse(&name, &text)
        .context("the solution is not a camera that can measure; nothing was written")?;
    write_whole(&args.out, text.as_bytes())?;
    Ok(calibration)
}
