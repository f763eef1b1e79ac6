//! Images of a board for a calibration.

use std::io::IsTerminal;
use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::calibration::board::Board;
use crate::calibration::board_observation::{BoardObservation, Observations};
use crate::cli::board_image::find_board;

/// Images in which the board was searched.
pub struct CalibrationImages {
    /// Their files, in order.
    pub files: Vec<PathBuf>,
    /// The board in each, or why it was rejected.
    pub found: Observations,
    /// Images of boards on the bed; empty for the last image.
    pub on_bed: Vec<PathBuf>,
}

/// Searches the board in all files.
pub fn find_boards(board: &Board, files: &[PathBuf]) -> Observations {
    let bar = progress(files.len());
    let look = |path: &PathBuf| {
        let name = name_of(path);
        let found = find_board(board, &name, path);
        bar.inc(1);
        (name, found)
    };
    let found = files.par_iter().map(look).collect();
    bar.finish_and_clear();
    found
}

/// Name of a file without its folder.
fn name_of(path: &std::path::Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Images that a camera has taken so far; the first board lies on the bed.
pub fn taken_so_far(files: &[PathBuf], kept: &[BoardObservation]) -> CalibrationImages {
    let found = kept.iter().map(|board| (board.name.clone(), Ok(board.clone())));
    let on_bed = files.first().cloned().into_iter().collect();
    CalibrationImages { files: files.to_vec(), found: found.collect(), on_bed }
}

fn progress(count: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        tell!("looking for the board in {count} images");
    }
    let style = ProgressStyle::with_template("looking for the board {wide_bar} {pos}/{len}");
    // The bar hides itself if standard error is not a terminal.
    let bar = ProgressBar::new(count as u64);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
