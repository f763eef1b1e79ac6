//! The whole image as gauge, in every real image: whatever is found there, no
//! width is `ok` with a standard deviation beyond the gauge's limit.

use std::path::{Path, PathBuf};
use truebead::core::{Roi, Size};

use truebead::core::{Frame, Mm, WidthRange};
use truebead::io::image_file::has_image_extension;
use truebead::vision::{BeadAxis, Gauge, Polarity};

use super::statistics::median;
use super::{clip, data, image, measure};

/// Every n-th image of a set is measured: neighbours hardly differ.
const EVERY: usize = 7;

fn images(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries.filter(|path| has_image_extension(path)).collect();
    files.sort();
    files
}

/// The images of a set, thinned out where there are many.
fn frames(name: &str) -> Option<Vec<Frame>> {
    let path = data(name)?;
    if path.is_file() {
        return Some(clip(&path).into_iter().step_by(EVERY).collect());
    }
    let files = images(&path);
    let every = if files.len() > 20 { EVERY } else { 1 };
    Some(files.iter().step_by(every).map(|file| image(file)).collect())
}

fn gauge(frame: &Frame, axis: BeadAxis, polarity: Polarity) -> Gauge {
    let Size { width, height } = frame.size();
    let range = WidthRange { min: Mm::constant(2.0), max: Mm::constant(600.0) };
    Gauge::new(Roi { x: 0, y: 0, width, height }, axis, polarity, range)
}

#[test]
fn no_width_of_a_whole_image_has_a_useless_sigma() {
    let sets = [
        "bead_clip/bead_clip.mp4",
        "filament_clip/filament_clip.avi",
        "printed_lines",
        "concrete_layers",
        "concrete_beads/frames",
        "chessboard",
        "chessboard_right",
    ];
    let mut useless = 0;
    for name in sets {
        let Some(frames) = frames(name) else { continue };
        let (mut asked, mut fractions) = (0, Vec::new());
        for frame in &frames {
            for axis in [BeadAxis::Vertical, BeadAxis::Horizontal] {
                for polarity in [Polarity::Bright, Polarity::Dark, Polarity::Any] {
                    asked += 1;
                    let gauge = gauge(frame, axis, polarity);
                    let Ok(found) = measure(gauge, frame) else { continue };
                    let fraction = found.sigma.get() / found.width.get();
                    fractions.push(fraction);
                    if fraction.is_nan() || fraction > gauge.max_sigma {
                        useless += 1;
                        println!("useless: {name} {axis:?} {polarity:?}: {found:?}");
                    }
                }
            }
        }
        println!(
            "whole image, {name}: {} of {asked} ok, median sigma {:.2} %",
            fractions.len(),
            100.0 * median(&fractions)
        );
    }
    assert_eq!(useless, 0);
}
