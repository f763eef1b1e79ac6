//! The images that fix the bed plane, and what they say.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::{CalibrateArgs, WrongArguments, look_at};
use crate::calib::board::Board;
use crate::calib::equations::Corner;
use crate::calib::plane::OnBed;
use crate::calib::sighting::{Looks, Refusal};
use crate::calib::solve::Solution;
use crate::units::Mm;

/// The bed plane and where it comes from.
pub struct Plane {
    /// The images whose boards lay on the bed.
    pub images: Vec<String>,
    /// Whether nobody has named them.
    pub assumed: bool,
    /// The boards on the bed.
    pub on_bed: OnBed,
    /// Height of their printed faces above the bed.
    pub thickness: Mm,
    /// The robot's z when they were taken.
    pub robot_z: Mm,
}

/// Finds a mistyped image before the long work.
pub fn check(planes: &[PathBuf], files: &[PathBuf]) -> Result<(), WrongArguments> {
    match planes.iter().find(|path| !path.is_file() && index_of(path, files).is_none()) {
        Some(path) => {
            let what = format!(
                "--plane {}: no such image in the folder, and no such file",
                path.display()
            );
            Err(WrongArguments::new(what))
        }
        None => Ok(()),
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

/// Fits the bed plane to the boards of the images that were named, or to the last
/// board that was found.
pub fn find(
    args: &CalibrateArgs,
    board: &Board,
    solution: &Solution,
    looks: &Looks,
) -> anyhow::Result<Plane> {
    let mut images = Vec::new();
    let mut boards = Vec::new();
    if args.plane.is_empty() {
        let last = solution.views.last().context("no picture shows the board")?;
        images.push(last.name.clone());
        boards.push(board.place(&last.corners));
    }
    for path in &args.plane {
        let (image, corners) = on_bed(path, &args.input, board, solution, looks)?;
        images.push(image);
        boards.push(corners);
    }
    let on_bed = OnBed::fit(&solution.model, boards)
        .with_context(|| format!("the corners in {} fit no plane", images.join(", ")))?;
    Ok(Plane {
        images,
        assumed: args.plane.is_empty(),
        on_bed,
        thickness: args.board_thickness_mm,
        robot_z: args.robot_z_mm,
    })
}

/// The board's corners in the named picture: out of the folder's where it took part,
/// else looked for anew.
fn on_bed(
    path: &Path,
    folder: &Path,
    board: &Board,
    solution: &Solution,
    looks: &Looks,
) -> anyhow::Result<(String, Vec<Corner>)> {
    let names: Vec<PathBuf> = looks.iter().map(|(name, _)| PathBuf::from(name)).collect();
    let own = path.file_name().filter(|_| !path.is_file() || index_of(path, &names).is_some());
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if let Some(view) = solution.views.iter().find(|view| view.name == name) {
        return Ok((name, board.place(&view.corners)));
    }
    let in_folder = folder.join(&name);
    let file = if path.is_file() { path } else { &in_folder };
    if own.is_some()
        && let Some((_, Err(refusal))) = looks.iter().find(|look| look.0 == name)
        // A board that is in one place twice still lies on the bed.
        && !matches!(refusal, Refusal::Duplicate { .. })
    {
        bail!("--plane {name}: {refusal}; name an image that shows the whole board");
    }
    let sighting = look_at(board, &name, file)
        .with_context(|| format!("--plane {} does not show the bed plane", path.display()))?;
    if sighting.image_size_px != solution.image_size_px {
        let refusal =
            Refusal::Size { found: sighting.image_size_px, expected: solution.image_size_px };
        bail!("--plane {}: {refusal}", path.display());
    }
    Ok((path.display().to_string(), board.place(&sighting.corners)))
}
