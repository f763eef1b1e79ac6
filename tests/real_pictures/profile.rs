//! Width profiles along the bead, and how well those of neighbouring frames
//! agree once the motion between them is taken out.

use std::collections::BTreeMap;
use std::path::Path;

/// Row at which the camera of the bead clip would see the bead's widths shrink
/// to nothing: the best agreement over the whole clip, and near the row where
/// the mean profile, a straight line, comes to zero.
const VANISHING_ROW: f64 = -80.0;
/// Middle of the gauge: where shifts are told.
pub const MIDDLE_ROW: f64 = 192.0;
/// Rows that are compared. Above, the bead is fresh from the nozzle and in its
/// shadow; below, the ground's light changes within a few rows.
const ROWS: std::ops::Range<f64> = 150.0..262.0;
/// Shifts that are tried \[px at the middle row\].
const SHIFTS: (f64, f64, f64) = (4.0, 18.0, 0.05);

/// Width on one row of the image.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    pub row: f64,
    pub width: f64,
    pub variance: f64,
}

/// Widths along the bead, from the top.
pub type Profile = Vec<Sample>;

/// The profiles in an `edges.csv`, by frame: rows with both edges.
pub fn read(path: &Path) -> BTreeMap<u64, Profile> {
    let mut profiles = BTreeMap::<u64, Profile>::new();
    for row in csv::Reader::from_path(path).unwrap().records() {
        let row = row.unwrap();
        let number = |column: usize| row[column].parse::<f64>().ok();
        let (Some(left), Some(right)) = (number(2), number(5)) else { continue };
        let variance = number(4).unwrap().powi(2) + number(7).unwrap().powi(2);
        let sample = Sample { row: number(3).unwrap(), width: right - left, variance };
        profiles.entry(row[0].parse().unwrap()).or_default().push(sample);
    }
    profiles
}

/// How two profiles differ, row by row.
#[derive(Debug, Clone, Default)]
pub struct Difference {
    /// Later less earlier width \[px\].
    pub px: Vec<f64>,
    /// The same as a share of the width.
    pub share: Vec<f64>,
    /// Variance that the calipers' own standard deviations explain \[px²\].
    pub variance: Vec<f64>,
}

impl Difference {
    /// With the bead moved on by so many pixels at the middle row. On a plane
    /// under a camera widths grow with the distance from the vanishing row, and
    /// lengths along the bead are differences of its reciprocal.
    pub fn between(earlier: &Profile, later: &Profile, shift: f64) -> Self {
        let depth = MIDDLE_ROW - VANISHING_ROW;
        let moved = 1.0 / (depth - shift) - 1.0 / depth;
        let mut difference = Self::default();
        for here in later.iter().filter(|sample| ROWS.contains(&sample.row)) {
            let far = here.row - VANISHING_ROW;
            let was = 1.0 / (1.0 / far + moved);
            let Some(there) = at(earlier, was + VANISHING_ROW) else { continue };
            let growth = far / was;
            let off = here.width - there.width * growth;
            difference.px.push(off);
            difference.share.push(off / here.width);
            difference.variance.push(here.variance + there.variance * growth * growth);
        }
        difference
    }

    pub fn add(&mut self, other: Self) {
        self.px.extend(other.px);
        self.share.extend(other.share);
        self.variance.extend(other.variance);
    }

    pub fn rms(&self) -> f64 {
        mean(self.px.iter().map(|off| off * off)).sqrt()
    }

    pub fn median(&self) -> f64 {
        median(self.px.iter().map(|off| off.abs()))
    }

    pub fn median_share(&self) -> f64 {
        median(self.share.iter().map(|off| off.abs()))
    }

    /// RMS that the calipers' own standard deviations explain.
    pub fn explained(&self) -> f64 {
        mean(self.variance.iter().copied()).sqrt()
    }
}

/// The shift at which two profiles agree best, in the least squares \[px\].
pub fn best_shift(earlier: &Profile, later: &Profile) -> f64 {
    let (mut best, mut least) = (0.0, f64::INFINITY);
    let mut shift = SHIFTS.0;
    while shift <= SHIFTS.1 {
        let rms = Difference::between(earlier, later, shift).rms();
        if rms < least {
            (best, least) = (shift, rms);
        }
        shift += SHIFTS.2;
    }
    best
}

/// A profile between its samples; `None` beyond its ends.
fn at(profile: &Profile, row: f64) -> Option<Sample> {
    let next = profile.iter().position(|sample| sample.row >= row)?;
    let (before, after) = (profile[next.checked_sub(1)?], profile[next]);
    let share = (row - before.row) / (after.row - before.row);
    let between = |from: f64, to: f64| from + share * (to - from);
    Some(Sample {
        row,
        width: between(before.width, after.width),
        variance: between(before.variance, after.variance),
    })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    sum / f64::max(count, 1.0)
}

/// Of an empty list 0.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// The value below which this share of the values lies.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a place in a short list"
)]
pub fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let place = (share * values.len() as f64) as usize;
    values.get(place.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
