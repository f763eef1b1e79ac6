//! Labels of concrete beads: drawn by hand, white where the groove is. Good to some
//! 5 px, up to 10 px in numbers 100 to 189.

use std::ops::{Range, RangeInclusive};
use std::path::Path;

use truebead::core::{Frame, Roi};

use super::image;

/// Columns of the gauge.
pub const COLUMNS: Range<usize> = 200..440;
/// Room above the upper groove and below the lower one \[px\].
const MARGIN: usize = 25;
/// Farthest that the grooves' outer borders lie from the median of their sequence:
/// beyond, another bead is in the gauge \[px\].
const SAME_BEAD: [usize; 2] = [16, 26];

/// What a label says of the bead in its image.
#[derive(Debug, Clone, Copy)]
pub struct Label {
    /// Number of the image.
    pub number: u32,
    /// Mean distance of the grooves' inner borders in the gauge's columns \[px\].
    pub width: f64,
    /// First row of the upper groove.
    top: usize,
    /// Row after the lower groove.
    bottom: usize,
}

/// Images of one bead that moves on.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// The labelled images, by number.
    pub labels: Vec<Label>,
    /// The gauge's region: both grooves and a margin.
    pub roi: Roi,
    /// Median of the labels' widths \[px\].
    pub width: f64,
}

impl Sequence {
    /// The labelled images among these numbers.
    pub fn read(folder: &Path, numbers: RangeInclusive<u32>) -> Self {
        let files = numbers.map(|n| (n, folder.join(format!("labels/{n}.png"))));
        let read =
            files.filter(|(_, file)| file.is_file()).map(|(n, file)| label(n, &image(&file)));
        let mut labels: Vec<Label> = read.flatten().collect();
        let top = middle(labels.iter().map(|label| label.top));
        let bottom = middle(labels.iter().map(|label| label.bottom));
        labels.retain(|label| {
            label.top.abs_diff(top) < SAME_BEAD[0] && label.bottom.abs_diff(bottom) < SAME_BEAD[1]
        });
        let first = top.saturating_sub(MARGIN);
        let height = (bottom + MARGIN).min(480) - first;
        let roi = Roi { x: COLUMNS.start, y: first, width: COLUMNS.len(), height };
        let widths: Vec<f64> = labels.iter().map(|label| label.width).collect();
        Self { labels, roi, width: super::statistics::median(&widths) }
    }
}

fn middle(values: impl Iterator<Item = usize>) -> usize {
    let mut values: Vec<usize> = values.collect();
    values.sort_unstable();
    usize::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2])
}

/// Reads a label; none where it does not show two grooves.
fn label(number: u32, mask: &Frame) -> Option<Label> {
    let (width, grey) = (mask.width(), mask.to_grey8());
    let white = |x: usize, y: usize| grey[y * width + x] > 127;
    let is_groove = |y: usize| COLUMNS.filter(|&x| white(x, y)).count() > COLUMNS.len() / 2;
    let rows: Vec<bool> = (0..mask.height()).map(is_groove).collect();
    let mut grooves = runs(&rows).into_iter();
    let (upper, lower) = (grooves.next()?, grooves.next()?);
    let widths: Vec<f64> = COLUMNS
        .filter_map(|x| {
            let column: Vec<bool> = (0..mask.height()).map(|y| white(x, y)).collect();
            let of_groove = |groove: &Range<usize>| {
                let near = |run: &Range<usize>| {
                    run.start <= groove.end + 12 && run.end + 12 >= groove.start
                };
                runs(&column).into_iter().filter(near).collect::<Vec<_>>()
            };
            let above = of_groove(&upper).iter().map(|run| run.end).max()?;
            let below = of_groove(&lower).iter().map(|run| run.start).min()?;
            Some(f64::from(u32::try_from(below).ok()?) - f64::from(u32::try_from(above).ok()?))
        })
        .collect();
    let mean = widths.iter().sum::<f64>() / f64::from(u32::try_from(widths.len()).ok()?);
    let enough = widths.len() > 100 && mean > 80.0;
    enough.then_some(Label { number, width: mean, top: upper.start, bottom: lower.end })
}

/// Where a row of flags is set.
fn runs(flags: &[bool]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (at, _) in flags.iter().enumerate().filter(|(_, set)| **set) {
        match runs.last_mut() {
            Some(run) if run.end == at => run.end += 1,
            _ => runs.push(at..at + 1),
        }
    }
    runs
}
