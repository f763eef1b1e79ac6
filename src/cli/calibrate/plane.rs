//! The images that fix the bed plane, and what they say.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::{CalibrateArgs, Pictures, WrongArguments, check_size, look_at};
use crate::calibration::board::{Board, Seen};
use crate::calibration::charuco::NoMarkers;
use crate::calibration::equations::{Corner, Model};
use crate::calibration::plane::OnBed;
use crate::calibration::refusal::Refusal;
use crate::calibration::sighting::{Looks, is_same_place};
use crate::calibration::solve::Solution;
use crate::core::units::Mm;

/// Corners on the bed may be so many times further off than those of the other
/// pictures, and so far in any case \[px\]; beyond that the pictures do not belong to
/// this camera, or the boards lay on no plane.
const OFF: f64 = 4.0;
const OFF_PX: f64 = 0.3;

/// The bed plane and where it comes from.
pub struct Plane {
    /// The images whose boards lay on the bed.
    pub images: Vec<String>,
    /// Whether nobody has named them.
    pub assumed: bool,
    /// Images that come later, and were refused though they show a board.
    pub passed_over: Vec<String>,
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

/// The image of the folder that is meant: by path, or by its name alone where there is
/// no such file.
fn index_of(plane: &Path, files: &[PathBuf]) -> Option<usize> {
    let by_name = !plane.is_file() && plane.parent().is_none_or(|p| p.as_os_str().is_empty());
    let is_same = |file: &PathBuf| {
        (by_name && file.file_name() == plane.file_name())
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
    pictures: &Pictures,
) -> anyhow::Result<Plane> {
    let Pictures { files, looks, on_bed: named } = pictures;
    let mut boards = Boards::of(board);
    let mut passed_over = Vec::new();
    if named.is_empty() {
        let (last, later) = last_seen(solution, looks).context("no picture shows the board")?;
        boards.add(last.to_owned(), corners_of(solution, last).unwrap_or_default())?;
        passed_over = later;
    }
    for path in named {
        let (image, corners) = on_bed(path, board, solution, (files, looks))?;
        boards.add(image, corners)?;
    }
    let most_px = (OFF * solution.rms_px).max(OFF_PX);
    let other = format!("the other pictures have {:.2} px", solution.rms_px);
    let (images, on_bed) = boards.fit(&solution.model, most_px, &other)?;
    Ok(Plane {
        images,
        assumed: named.is_empty(),
        passed_over,
        on_bed,
        thickness: args.board_thickness_mm,
        robot_z: args.robot_z_mm,
    })
}

/// Boards of one kind that are said to lie on the bed, each with its image.
pub struct Boards<'a> {
    board: &'a Board,
    seen: Vec<(String, Vec<Seen>)>,
}

impl<'a> Boards<'a> {
    /// None yet.
    pub fn of(board: &'a Board) -> Self {
        Self { board, seen: Vec::new() }
    }

    /// Fails for one that is where another is.
    pub fn add(&mut self, image: String, corners: Vec<Seen>) -> anyhow::Result<()> {
        let is_twin =
            |(_, other): &&(String, Vec<Seen>)| is_same_place(self.board, other, &corners);
        if let Some((twin, _)) = self.seen.iter().find(is_twin) {
            bail!(
                "--plane {image}: the board is where it is in {twin}, which says nothing new; leave \
                 one of them out, or move the board on the bed"
            );
        }
        self.seen.push((image, corners));
        Ok(())
    }

    /// One plane through all of them, with the images' names. Fails where corners are
    /// further off it than `most_px` (RMS); `other` says what they are held against.
    pub fn fit(
        self,
        model: &Model,
        most_px: f64,
        other: &str,
    ) -> anyhow::Result<(Vec<String>, OnBed)> {
        let placed = self.seen.into_iter().map(|(image, seen)| (image, self.board.place(&seen)));
        let (images, boards): (Vec<String>, Vec<Vec<Corner>>) = placed.unzip();
        let names = images.join(", ");
        let on_bed = OnBed::fit(model, boards)
            .with_context(|| format!("the corners in {names} fit no plane"))?;
        if on_bed.rms_px <= most_px {
            return Ok((images, on_bed));
        }
        if images.len() > 1 {
            bail!(
                "the boards in {names} do not lie on one plane: corners are {:.2} px off (RMS), the \
                 board that is furthest off by {:.1} mm; name pictures of boards that all lie flat on \
                 the bed",
                on_bed.rms_px,
                on_bed.off_mm
            );
        }
        bail!(
            "{names}: corners are {:.2} px off (RMS) where {other}; was it taken with the same camera, \
             focus and zoom?",
            on_bed.rms_px
        );
    }
}

/// The last picture that shows a board, or its twin where the board was in its place
/// before; and those after it that show a board, but were refused.
fn last_seen<'a>(solution: &'a Solution, looks: &'a Looks) -> Option<(&'a str, Vec<String>)> {
    let mut later = Vec::new();
    for (name, look) in looks.iter().rev() {
        match look {
            Ok(_) if solution.views.iter().any(|view| view.name == *name) => {
                return Some((name, later));
            }
            Err(Refusal::Duplicate { of, .. }) => return Some((of, later)),
            Ok(_)
            | Err(
                Refusal::Unreadable(_)
                | Refusal::NoBoard { .. }
                | Refusal::NoMarkers(NoMarkers::None { .. }),
            ) => {}
            Err(_) => later.push(name.clone()),
        }
    }
    None
}

fn corners_of(solution: &Solution, name: &str) -> Option<Vec<Seen>> {
    solution.views.iter().find(|view| view.name == name).map(|view| view.corners.clone())
}

/// The board's corners in the named picture: out of the folder's where it took part,
/// else looked for anew.
fn on_bed(
    path: &Path,
    board: &Board,
    solution: &Solution,
    (files, looks): (&[PathBuf], &Looks),
) -> anyhow::Result<(String, Vec<Seen>)> {
    if let Some((file, (name, look))) =
        index_of(path, files).and_then(|index| Some((files.get(index)?, looks.get(index)?)))
    {
        return match look {
            Ok(_) => corners_of(solution, name)
                .map(|corners| (name.clone(), corners))
                .with_context(|| format!("--plane {name}: not used")),
            // A board that is in one place twice still lies on the bed.
            Err(Refusal::Duplicate { .. }) => looked_for(file, board, solution.image_size_px),
            Err(refusal) => {
                bail!("--plane {name}: {refusal}; name an image that shows the board")
            }
        };
    }
    looked_for(path, board, solution.image_size_px)
}

/// The board's corners in an image that took no part in finding the camera, which must
/// be of the size \[px\] that the camera is for.
pub fn looked_for(
    path: &Path,
    board: &Board,
    image_size_px: [u32; 2],
) -> anyhow::Result<(String, Vec<Seen>)> {
    let name = path.display().to_string();
    let sighting = look_at(board, &name, path)
        .with_context(|| format!("--plane {name} does not show the bed plane"))?;
    check_size(&sighting, image_size_px)?;
    Ok((name, sighting.corners))
}
