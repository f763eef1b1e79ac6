//! The pattern of what lies beside an edge, ground or bead: how strong it is, and how far
//! it may move the mean of the edge.

use super::number::{float, narrow};
use super::rank;
use super::rough::whole;
use super::strip::{Grey, Strip};

/// Distances from the edge at which the pattern is looked at \[px\]: the first one
/// beyond the flank, in blurs and at least, and those after it.
const FLANK_BLURS: f64 = 3.0;
const FIRST_PX: f64 = 4.0;
const STEP_PX: f64 = 2.0;
const COLUMNS: usize = 10;
/// Fewest lines that tell a pattern.
const LEAST_LINES: usize = 8;
/// Part of the noise's variance by which a pattern's must exceed it: less is not told
/// from noise.
const TOLD: f64 = 0.25;

/// Places beside the edge within which a narrow groove lies \[px\].
const GROOVE_PX: usize = 9;
/// By how much what lies beyond a groove is brighter at least: a fraction of the
/// contrast, and standard deviations of noise.
const RISE: f64 = 0.015;
const RISE_SIGMAS: f64 = 5.0;

/// Where an edge lies on some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// First row along the bead, and the one after the last.
    pub rows: (usize, usize),
    /// Position across it \[px\].
    pub at: f64,
}

/// Where to look for a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side<'a> {
    /// The edge, row by row.
    pub places: &'a [Place],
    /// Direction away from the bead: 1 or -1.
    pub outwards: f64,
    /// Blur of the edge \[px\].
    pub blur_px: f64,
    /// Distance of the next edge, whose flank is no pattern \[px\].
    pub room_px: f64,
}

impl Side<'_> {
    /// Mean grey level at a distance from the edge, the gauge's border beyond it.
    fn mean_at<T: Grey>(&self, strip: &Strip<'_, T>, off: f64) -> f64 {
        let of_place = |place: &Place| -> f64 {
            (place.rows.0..place.rows.1).map(|row| grey(strip, row, place.at + off)).sum()
        };
        self.places.iter().map(of_place).sum::<f64>() / float(self.rows().max(1))
    }

    /// Number of rows.
    fn rows(&self) -> usize {
        self.places.iter().map(|place| place.rows.1 - place.rows.0).sum()
    }
}

/// Grey level of a pixel, or of the nearest one in the gauge.
fn grey<T: Grey>(strip: &Strip<'_, T>, row: usize, at: f64) -> f64 {
    let row = strip.row(row);
    let pixel = row[whole(narrow(at)).min(row.len() - 1)];
    f64::from(strip.scale * T::float(pixel.add_to(T::Sum::default())))
}

/// A pattern beside an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// Its standard deviation along the bead, without the pixels' noise
    /// \[grey levels\].
    pub size_grey: f64,
    /// Variance of its mean over the gauge \[grey levels²\], its correlation along the
    /// bead included.
    pub mean_variance: f64,
}

/// Looks for patterns; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Ground {
    /// Columns of pixels along the edge, less their slope along the bead.
    columns: Vec<f64>,
}

impl Ground {
    /// The pattern along an edge. `noise` is the standard deviation of a pixel's
    /// \[grey levels\]. `None` where none is told from noise, or too little is in the
    /// gauge.
    pub fn pattern<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        side: &Side<'_>,
        noise: f64,
    ) -> Option<Pattern> {
        let count = side.places.len();
        let mean_square = |column: &mut [f64]| {
            let squares: f64 = column.iter().map(|value| value * value).sum();
            Some(squares / float(count - 2))
        };
        let size_grey = self.spread(strip, side, noise, mean_square)?;
        Some(Pattern { size_grey, mean_variance: self.variance_of_mean(count, noise) })
    }

    /// Standard deviation of the texture along a side, without the pixels' noise
    /// \[grey levels\], from the median of how far pixels are off: a few sparks or holes
    /// are none. `None` as for a pattern.
    pub fn texture<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        side: &Side<'_>,
        noise: f64,
    ) -> Option<f64> {
        self.spread(strip, side, noise, |column| {
            for value in column.iter_mut() {
                *value = value.abs();
            }
            rank::median(column).map(|median| (rank::SIGMA_PER_MEDIAN * median).powi(2))
        })
    }

    /// Standard deviation along a side without the pixels' noise \[grey levels\], from the
    /// median of the columns' variances.
    fn spread<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        side: &Side<'_>,
        noise: f64,
        variance_of: impl Fn(&mut [f64]) -> Option<f64>,
    ) -> Option<f64> {
        let count = side.places.len();
        if count < LEAST_LINES {
            return None;
        }
        self.read(strip, side);
        let mut variances = [0.0_f32; COLUMNS];
        let mut columns = 0;
        for (column, variance) in self.columns.chunks_exact_mut(count).zip(&mut variances) {
            *variance = narrow(variance_of(column)?);
            columns += 1;
        }
        let variance = f64::from(rank::median(&mut variances[..columns])?) - noise * noise;
        (variance > TOLD * noise * noise).then(|| variance.sqrt())
    }

    /// Reads columns of pixels beside an edge, as far as they lie within the gauge.
    fn read<T: Grey>(&mut self, strip: &Strip<'_, T>, side: &Side<'_>) {
        let first = FIRST_PX.max(FLANK_BLURS * side.blur_px);
        let last = float(strip.across - 1);
        self.columns.clear();
        for column in 0..COLUMNS {
            let distance = first + STEP_PX * float(column);
            if distance > side.room_px - first {
                return;
            }
            let off = side.outwards * distance;
            if side.places.iter().any(|place| place.at + off < 0.0 || place.at + off > last) {
                return;
            }
            let start = self.columns.len();
            self.columns.extend(side.places.iter().map(|place| {
                let row = usize::midpoint(place.rows.0, place.rows.1 - 1);
                grey(strip, row, place.at + off)
            }));
            level(&mut self.columns[start..]);
        }
    }

    /// Variance of the mean of so many lines, from their covariances up to the first
    /// that is not positive.
    fn variance_of_mean(&self, count: usize, noise: f64) -> f64 {
        let covariance = |lag: usize| {
            let products = self.columns.chunks_exact(count).map(|column| {
                column[lag..].iter().zip(column).map(|(one, other)| one * other).sum::<f64>()
            });
            products.sum::<f64>() / float(self.columns.len())
        };
        let later = (1..count / 4).map(covariance).take_while(|covariance| *covariance > 0.0);
        let sum = covariance(0) - noise * noise + 2.0 * later.sum::<f64>();
        sum.max(0.0) / float(count)
    }
}

/// Whether what lies beside an edge becomes brighter again away from it, as beyond a
/// narrow groove. `noise` is the standard deviation of a pixel's, `contrast` the step
/// \[grey levels\].
pub fn rises<T: Grey>(strip: &Strip<'_, T>, side: &Side<'_>, noise: f64, contrast: f64) -> bool {
    let mut darkest = f64::INFINITY;
    let mut rise: f64 = 0.0;
    for off in 1..=GROOVE_PX {
        let grey = side.mean_at(strip, side.outwards * float(off));
        darkest = darkest.min(grey);
        rise = rise.max(grey - darkest);
    }
    rise > (RISE * contrast).max(RISE_SIGMAS * noise / float(side.rows().max(1)).sqrt())
}

/// Takes the straight line through values out of them.
fn level(values: &mut [f64]) {
    let count = float(values.len());
    let middle = (count - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / count;
    let (mut across, mut along) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let place = float(k) - middle;
        across += place * (value - mean);
        along += place * place;
    }
    for (k, value) in values.iter_mut().enumerate() {
        *value -= mean + across / along * (float(k) - middle);
    }
}
