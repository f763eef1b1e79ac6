//! Images of a board for a calibration.

use std::io::IsTerminal;
use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::calibration::board::Board;
use crate::calibration::board_observation::{BoardObservation, Observations};
use crate::cli::board_image::find_board;

/// Pictures that were looked at.
pub struct CalibrationImages {
    /// Their files, in their order.
    pub files: Vec<PathBuf>,
    /// What they show.
    pub found: Observations,
    /// Those whose boards lay on the bed; none where the last one is to be taken.
    pub on_bed: Vec<PathBuf>,
}

/// Looks for the board in all of these.
pub fn find_boards(board: &Board, files: &[PathBuf]) -> Observations {
    let bar = progress(files.len());
    let looks = files
        .par_iter()
        .map(|path| {
            let name = name_of(path);
            let look = find_board(board, &name, path);
            bar.inc(1);
            (name, look)
        })
        .collect();
    bar.finish_and_clear();
    looks
}

/// Names of files, without their folders.
fn name_of(path: &std::path::Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Pictures that a camera has taken so far, the first with the board on the bed.
pub fn taken_so_far(files: &[PathBuf], kept: &[BoardObservation]) -> CalibrationImages {
    let looks = kept.iter().map(|sighting| (sighting.name.clone(), Ok(sighting.clone())));
    let on_bed = files.first().cloned().into_iter().collect();
    CalibrationImages { files: files.to_vec(), found: looks.collect(), on_bed }
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
