//! `truebead calibrate`: camera and bed plane from pictures of a checkerboard.

mod report;

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::WrongArguments;
use crate::bridge::{self, BoardView};
use crate::calib::board::Board;
use crate::calib::covariance::Covariance;
use crate::calib::plane::bed_from_board;
use crate::calib::quality;
use crate::calib::solve::{self, Refusal, Sighting, Solution};
use crate::calib::{Calibration, Quality, file};
use crate::frame::Channel;
use crate::geometry::Pose;
use crate::io::camera::folder::list_images;
use crate::io::image_file;
use crate::io::whole_file::write_whole;
use crate::time::Stamp;
use crate::units::Mm;

/// Finds camera, lens and bed plane from a folder of checkerboard images.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead calibrate pictures/ --board 9x6 --square-mm 20 --out calib.toml

Take 10 to 20 sharp pictures of a flat board, tilted to several sides and in
all parts of the picture. Take the last one with the board flat on the bed, or
name that picture with --plane. calib/README.md tells more.")]
pub struct CalibrateArgs {
    /// Folder of checkerboard images
    input: PathBuf,
    /// Inner corners of the board: columns x rows, each one fewer than the squares
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_board)]
    board: (usize, usize),
    /// Side of one square [mm]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    square_mm: Mm,
    /// Calibration file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Image whose board lies on the bed: one of the folder's, or any other file
    /// [default: the last image in which the board is found]
    #[arg(long, value_name = "IMAGE")]
    plane: Option<PathBuf>,
    /// Height of the board's printed face above the bed [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length)]
    board_thickness_mm: Mm,
    /// The robot's z when the image that fixes the plane was taken [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length, allow_hyphen_values = true)]
    robot_z_mm: Mm,
}

fn parse_board(text: &str) -> Result<(usize, usize), String> {
    let sides = text.split_once(['x', 'X', '×']);
    let number = |side: &str| side.trim().parse::<usize>().ok();
    sides
        .and_then(|(columns, rows)| Some((number(columns)?, number(rows)?)))
        .ok_or_else(|| "write columns x rows of inner corners, such as 9x6".to_owned())
}

fn parse_length(text: &str) -> Result<Mm, String> {
    let value: f64 = text.trim().parse().map_err(|_| "expected a number of mm".to_owned())?;
    Mm::new(value).map_err(|error| error.to_string())
}

/// The bed plane and where it comes from.
struct Plane {
    image: String,
    assumed: bool,
    /// The board's axes in the camera's.
    board: Pose,
    bed: Pose,
    thickness: Mm,
    robot_z: Mm,
}

/// What became of each picture, in the folder's order.
type Looks = Vec<(String, Result<Sighting, Refusal>)>;

/// Runs the command; the table and the figures go to standard output. Fails
/// without writing anything where no calibration can be found.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<()> {
    let (columns, rows) = args.board;
    let board = Board::new(columns, rows, args.square_mm).map_err(WrongArguments::new)?;
    if args.board_thickness_mm < Mm::ZERO {
        return Err(WrongArguments::new("the board's thickness cannot be below 0 mm").into());
    }
    let files = list_images(&args.input)
        .map_err(|error| WrongArguments::new(format!("{}: {}", error.source_name, error.what)))?;
    check_plane(args.plane.as_deref(), &files)?;
    let mut looks = look_at_all(&board, &files);
    solve::agree_on_size(&mut looks);
    let seen: Vec<Sighting> = looks.iter().filter_map(|(_, look)| look.clone().ok()).collect();
    let solution = solve::solve(&board, &seen).inspect_err(|_| say(&report::refusals(&looks)))?;
    say(&report::images(&looks, &solution));
    let plane = find_plane(args, &board, &solution, &looks)?;
    // Corners' noise is the least of the errors where the focal length is loose.
    let covariance = quality::settles_camera(&solution)
        .then(|| Covariance::of(&board, &solution, &plane.board, plane.thickness))
        .flatten();
    let quality = Quality {
        reprojection_rms_px: solution.rms_px,
        width_sigma_share: covariance.as_ref().and_then(Covariance::width_sigma_share),
    };
    let calibration = write(args, &board, (&solution, quality), &plane)?;
    say(&report::camera(&solution));
    say(&report::plane(&plane));
    say(&report::width(&calibration, covariance.as_ref()));
    say(&report::scale(&calibration, covariance.as_ref(), plane.thickness));
    say(&report::doubts(&solution));
    say(&format!("\nwrote {}\n", args.out.display()));
    Ok(())
}

/// Writes to standard output. A reader that has gone away, such as `head`, is no
/// reason to stop.
fn say(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Finds a mistyped image before the long work.
fn check_plane(plane: Option<&Path>, files: &[PathBuf]) -> Result<(), WrongArguments> {
    match plane {
        Some(path) if !path.is_file() && index_of(path, files).is_none() => {
            let what = format!(
                "--plane {}: no such image in the folder, and no such file",
                path.display()
            );
            Err(WrongArguments::new(what))
        }
        _ => Ok(()),
    }
}

/// The image of the folder that is meant: by path, or by its name alone.
fn index_of(plane: &Path, files: &[PathBuf]) -> Option<usize> {
    let is_same = |file: &PathBuf| {
        let by_name = plane.parent().is_none_or(|p| p.as_os_str().is_empty());
        file == plane
            || (by_name && file.file_name() == plane.file_name())
            || plane.canonicalize().is_ok_and(|p| file.canonicalize().is_ok_and(|f| f == p))
    };
    files.iter().position(is_same)
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

fn look_at(board: &Board, name: &str, path: &Path) -> Result<Sighting, Refusal> {
    let frame = image_file::read(path, Channel::Grey, 0, Stamp::START)
        .map_err(|error| Refusal::Unreadable(error.to_string()))?;
    solve::look(board, name, &frame)
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

fn find_plane(
    args: &CalibrateArgs,
    board: &Board,
    solution: &Solution,
    looks: &Looks,
) -> anyhow::Result<Plane> {
    let (image, pose) = match &args.plane {
        None => {
            let last = solution.views.last().context("no picture shows the board")?;
            (last.name.clone(), last.pose)
        }
        Some(path) => plane_pose(path, board, solution, looks)?,
    };
    Ok(Plane {
        image,
        assumed: args.plane.is_none(),
        board: pose,
        bed: bed_from_board(&pose, args.board_thickness_mm),
        thickness: args.board_thickness_mm,
        robot_z: args.robot_z_mm,
    })
}

/// The board's pose in the named picture: out of the solution where it took
/// part, else found with the camera that is now known.
fn plane_pose(
    path: &Path,
    board: &Board,
    solution: &Solution,
    looks: &Looks,
) -> anyhow::Result<(String, Pose)> {
    let names: Vec<PathBuf> = looks.iter().map(|(name, _)| PathBuf::from(name)).collect();
    let own = path.file_name().filter(|_| !path.is_file() || index_of(path, &names).is_some());
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if let Some(view) = solution.views.iter().find(|view| view.name == name) {
        return Ok((name, view.pose));
    }
    if own.is_some()
        && let Some((_, Err(refusal))) = looks.iter().find(|look| look.0 == name)
    {
        bail!("--plane {name}: {refusal}; name an image that shows the whole board");
    }
    let sighting = look_at(board, &name, path)
        .with_context(|| format!("--plane {} does not show the bed plane", path.display()))?;
    if sighting.image_size_px != solution.image_size_px {
        let refusal =
            Refusal::Size { found: sighting.image_size_px, expected: solution.image_size_px };
        bail!("--plane {}: {refusal}", path.display());
    }
    let view = BoardView { board_mm: board.corners_mm(), image_px: sighting.corners_px };
    Ok((path.display().to_string(), bridge::solve_pose(&view, &solution.camera)?))
}

/// Writes the file, once it has been read back and found sound.
fn write(
    args: &CalibrateArgs,
    board: &Board,
    (solution, quality): (&Solution, Quality),
    plane: &Plane,
) -> anyhow::Result<Calibration> {
    let (columns, rows) = board.corners();
    let note = format!(
        "From {} images of a board with {columns}x{rows} inner corners and squares of {}.\n\
         Bed plane: {} below the board's face in {}.",
        solution.views.len(),
        board.square(),
        plane.thickness,
        plane.image,
    );
    let model = (&solution.camera, &plane.bed);
    let (size, robot_z) = (solution.image_size_px, plane.robot_z);
    let text = file::to_toml(model, size, robot_z, Some(quality), &[note]);
    let name = args.out.display().to_string();
    let calibration = file::parse(&name, &text)
        .context("the solution is not a camera that can measure; nothing was written")?;
    write_whole(&args.out, text.as_bytes())?;
    Ok(calibration)
}
