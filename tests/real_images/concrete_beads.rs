//! Real concrete beads, torn and beside grooves: how many are measured, whether the
//! same piece of bead has the same width in the next frame, and how widths follow
//! hand-drawn labels. One measurer a sequence, its frames in shuffled order: a
//! width comes from its own image.

use std::collections::BTreeMap;
use std::path::Path;

use truebead::calibration::SurfaceMap;
use truebead::core::{Frame, Mm, Roi, WidthRange};
use truebead::vision::{BeadAxis, Gauge, Measurer, Polarity};

use super::concrete_labels::{COLUMNS, Sequence};
use super::statistics::{median, quantile, sizes};
use super::{data, image};

/// Numbers of images that are neighbours.
const SEQUENCES: [std::ops::RangeInclusive<u32>; 5] =
    [100..=189, 1018..=1124, 1134..=1250, 1261..=1372, 1389..=1493];
/// Standard deviations of a normal number in its median size.
const NORMAL: f64 = 1.48;
/// Least correlation of a piece with itself in the next frame.
const SAME_PIECE: f64 = 0.9;

/// A width with its standard deviation \[px\].
#[derive(Debug, Clone, Copy)]
struct Width {
    px: f64,
    sigma: f64,
}

/// A sequence with its frames.
struct Beads {
    sequence: Sequence,
    frames: BTreeMap<u32, Frame>,
}

impl Beads {
    fn read(folder: &Path, numbers: std::ops::RangeInclusive<u32>) -> Self {
        let sequence = Sequence::read(folder, numbers);
        let read = |n: u32| image(&folder.join(format!("frames/{n}.png")));
        let frames = sequence.labels.iter().map(|l| (l.number, read(l.number))).collect();
        Self { sequence, frames }
    }

    fn gauge(&self, roi: Roi) -> Gauge {
        let [min, max] =
            [0.6, 1.3].map(|times| Mm::constant((times * self.sequence.width).round()));
        Gauge::new(roi, BeadAxis::Horizontal, Polarity::Bright, WidthRange { min, max })
    }

    /// Measures frames in shuffled order, each in its own region.
    fn measure(&self, regions: &BTreeMap<u32, Roi>) -> BTreeMap<u32, Width> {
        let mut order: Vec<u32> = regions.keys().copied().collect();
        order.sort_by_key(|n| n.wrapping_mul(2_654_435_761));
        let mut found = BTreeMap::new();
        let mut measurer = Measurer::new(self.gauge(self.sequence.roi), None);
        for n in order {
            if regions[&n] != self.sequence.roi {
                measurer = Measurer::new(self.gauge(regions[&n]), None);
            }
            match measurer.measure(&self.frames[&n], &SurfaceMap::from_scale(1.0)) {
                Ok(width) => {
                    found.insert(n, Width { px: width.width.get(), sigma: width.sigma.get() });
                }
                Err(reject) => println!("{n}: {} ({reject})", reject.status()),
            }
        }
        found
    }

    fn in_place(&self) -> BTreeMap<u32, Roi> {
        self.frames.keys().map(|&n| (n, self.sequence.roi)).collect()
    }

    /// Where the piece of bead that the frame before has in its gauge lies in each
    /// frame, as far as the frame before is there.
    fn moved(&self) -> BTreeMap<u32, Roi> {
        let place = |(&n, frame): (&u32, &Frame)| {
            let before = self.frames.get(&n.checked_sub(1)?)?;
            Some((n, same_piece(before, frame, self.sequence.roi)?))
        };
        self.frames.iter().filter_map(place).collect()
    }
}

/// A gauge moved with the bead from one frame to the next, by the normalised
/// cross-correlation of every second pixel; none where nothing is alike.
fn same_piece(before: &Frame, after: &Frame, roi: Roi) -> Option<Roi> {
    let (one, other) = (before.to_grey8(), after.to_grey8());
    let rows: Vec<usize> = (roi.y + 12..roi.y + roi.height - 12).step_by(2).collect();
    let pixels = |grey: &[u8], dx: isize, dy: isize| -> Vec<f64> {
        let at = |value: usize, by: isize| value.checked_add_signed(by).unwrap();
        let row = |y: usize| {
            COLUMNS.step_by(2).map(move |x| f64::from(grey[at(y, dy) * 640 + at(x, dx)]))
        };
        rows.iter().flat_map(|&y| row(y)).collect()
    };
    let piece = pixels(&one, 0, 0);
    let shifts = (-12..=12).flat_map(|dy| (-25..=25).map(move |dx| (dx, dy)));
    let best = shifts
        .map(|(dx, dy)| (correlation(&piece, &pixels(&other, dx, dy)), dx, dy))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let moved =
        Roi { x: roi.x.checked_add_signed(best.1)?, y: roi.y.checked_add_signed(best.2)?, ..roi };
    (best.0 > SAME_PIECE && moved.y + moved.height <= after.height()).then_some(moved)
}

/// Correlation of two lists of the same length.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / f64::from(u32::try_from(of.len()).unwrap());
    let (ma, mb) = (mean(a), mean(b));
    let product = |x: &[f64], mx: f64, y: &[f64], my: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum()
    };
    product(a, ma, b, mb) / (product(a, ma, a, ma) * product(b, mb, b, mb)).sqrt()
}

fn all_beads() -> Option<Vec<Beads>> {
    let folder = data("concrete_beads")?;
    Some(SEQUENCES.map(|numbers| Beads::read(&folder, numbers)).into_iter().collect())
}

#[test]
fn concrete_beads_are_measured() {
    let Some(all) = all_beads() else { return };
    let (mut asked, mut measured, mut sigmas) = (0, 0, Vec::new());
    let mut poor = 0;
    for beads in &all {
        let found = beads.measure(&beads.in_place());
        println!("concrete beads: {} of {} measured", found.len(), beads.frames.len());
        poor += usize::from(10 * found.len() < 9 * beads.frames.len());
        asked += beads.frames.len();
        measured += found.len();
        sigmas.extend(found.values().map(|width| width.sigma));
    }
    println!("all: {measured} of {asked}, median sigma {:.2} px", median(&sigmas));
    assert!(asked > 100, "{asked}");
    assert!(100 * measured >= 97 * asked && poor == 0, "{measured} of {asked}");
    assert!(median(&sigmas) <= 1.0);
}

#[test]
fn a_piece_of_concrete_has_the_same_width_in_the_next_frame() {
    let Some(all) = all_beads() else { return };
    let (mut asked, mut pairs) = (0, Vec::new());
    for beads in &all {
        let (place, moved) = (beads.measure(&beads.in_place()), beads.moved());
        asked += moved.len();
        let again = beads.measure(&moved);
        let pair = |(n, width): (&u32, &Width)| {
            let before = place.get(&(n - 1))?;
            Some((before.px - width.px, before.sigma.hypot(width.sigma)))
        };
        pairs.extend(again.iter().filter_map(pair));
    }
    // What perspective makes of a piece that moves on is the same in all pairs.
    let shift = median(&pairs.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let off: Vec<f64> = pairs.iter().map(|pair| (pair.0 - shift).abs()).collect();
    let scaled: Vec<f64> = pairs.iter().map(|pair| (pair.0 - shift).abs() / pair.1).collect();
    let (middle, most) = (median(&off), quantile(&off, 0.9));
    let over_sigma = NORMAL * median(&scaled);
    println!(
        "same piece of concrete again: {} of {asked} pairs, shift {shift:.2} px, median {middle:.2} \
         px, 90 % {most:.2} px, over sigma {over_sigma:.2}",
        pairs.len()
    );
    assert!(asked > 30 && 100 * pairs.len() >= 95 * asked, "{} of {asked}", pairs.len());
    assert!(middle <= 0.35 && most <= 0.8, "{middle} {most}");
    assert!(over_sigma <= 1.1, "{over_sigma}");
}

#[test]
fn widths_of_concrete_follow_the_labels() {
    let Some(all) = all_beads() else { return };
    let (mut by_label, mut by_us) = (Vec::new(), Vec::new());
    for beads in &all {
        let found = beads.measure(&beads.in_place());
        let both = beads.sequence.labels.iter();
        let both: Vec<_> = both.filter_map(|l| Some((l.width, found.get(&l.number)?.px))).collect();
        let (labels, ours): (Vec<f64>, Vec<f64>) = both.into_iter().unzip();
        let (middle_label, middle_ours) = (median(&labels), median(&ours));
        by_label.extend(labels.iter().map(|width| width - middle_label));
        by_us.extend(ours.iter().map(|width| width - middle_ours));
    }
    let off: Vec<f64> = by_label.iter().zip(&by_us).map(|(label, ours)| ours - label).collect();
    let square: f64 = by_label.iter().map(|label| label * label).sum();
    let slope = by_label.iter().zip(&by_us).map(|(label, ours)| label * ours).sum::<f64>() / square;
    let (alike, spread) = (correlation(&by_label, &by_us), NORMAL * median(&sizes(&off)));
    println!(
        "concrete against single labels, each sequence less its median: {} widths, correlation \
         {alike:.2}, slope {slope:.2}, spread {spread:.1} px",
        off.len()
    );
    assert!(alike >= 0.84 && (0.8..=1.2).contains(&slope), "{alike} {slope}");
    assert!(spread <= 4.0, "{spread}");
}
