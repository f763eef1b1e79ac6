//! Pattern of the ground or of the bead beside an edge: its standard deviation, and that of its
//! mean over the gauge.

use super::row_range::RowRange;
use super::strip::{GaugeRows, GreyPixel};
use crate::numeric::number::{narrow_to_f32, round_to_count, to_f64};
use crate::numeric::rank;

/// Distance from the edge from which on the pattern is read, in blurs. Derived: beyond 3 blurs
/// 1.3·10⁻³ of a step is left, 1 − Φ(3).
const FLANK_BLURS: f64 = 3.0;
/// Smallest distance from the edge at which it is read \[px\]: beyond a sharp edge's rounded foot.
const MIN_FIRST_PX: f64 = 4.0;
/// Distance of the columns that are read \[px\]: closer ones are correlated.
const COLUMN_STEP_PX: usize = 2;
/// Columns at most: more reach into what lies farther away.
const MAX_COLUMNS: usize = 10;
/// Fewest lines that show a pattern: fewer leave its variance too uncertain.
const MIN_LINES: usize = 8;
/// Smallest variance of a pattern, beyond the noise's, as a fraction of the noise's: less is not
/// distinguished from noise.
pub const MIN_EXCESS_VARIANCE: f64 = 0.25;

/// Variance of all pixels, relative to the noise's, up to which they show only noise: then no
/// medians are computed.
const MAX_NOISE_RATIO: f64 = 1.1;

/// Where an edge lies on some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgePosition {
    /// The rows.
    pub rows: RowRange,
    /// Position of the edge across the bead \[px\].
    pub at: f64,
}

/// Where to look for a pattern.
#[derive(Debug, Clone, Copy)]
pub struct EdgeSide<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a GaugeRows<'a, T>,
    /// Standard deviation of a pixel's noise \[grey levels\].
    pub noise: f64,
    /// The edge, row by row.
    pub positions: &'a [EdgePosition],
    /// Direction in which to look, away from the edge: 1 or -1.
    pub outwards: f64,
    /// Blur of the edge \[px\].
    pub blur_px: f64,
    /// Distance of the next edge, whose flank is no pattern \[px\].
    pub room_px: f64,
}

impl<T> EdgeSide<'_, T> {
    /// Whether it lies at higher positions than the edge.
    fn is_after(&self) -> bool {
        self.outwards > 0.0
    }
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

/// Looks for patterns; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct PatternSearch {
    /// Grey levels beside the edge, line by line, each column less its straight line.
    lines: Vec<ColumnValues>,
    /// Columns that lie within the gauge.
    columns: usize,
    column: Vec<f32>,
}

/// Pixels of one line, outwards.
type ColumnValues = [f32; MAX_COLUMNS];

impl PatternSearch {
    /// Pattern along an edge; `None` where it is not distinguished from noise, or too little of the
    /// side lies in the gauge.
    #[inline(always)]
    pub fn pattern<T: GreyPixel>(&mut self, side: &EdgeSide<'_, T>) -> Option<Pattern> {
        let noise = side.noise;
        let mut variances = self.look(side)?;
        let size_grey = self.without_noise(&mut variances, noise)?;
        Some(Pattern { size_grey, mean_variance: self.variance_of_mean(noise) })
    }

    /// Standard deviation of the texture along a side, without the pixels' noise \[grey levels\].
    /// From medians, so that sparks or holes do not count. `None` as for a pattern.
    #[inline(always)]
    pub fn texture<T: GreyPixel>(&mut self, side: &EdgeSide<'_, T>) -> Option<f64> {
        let mut variances = self.look(side)?;
        for (column, variance) in variances.iter_mut().enumerate().take(self.columns) {
            self.column.clear();
            self.column.extend(self.lines.iter().map(|line| line[column]));
            let median = rank::median(&mut self.column)?;
            let deviation = f64::from(rank::median_deviation(&mut self.column, median)?);
            *variance = narrow_to_f32((rank::SIGMA_PER_MEDIAN * deviation).powi(2));
        }
        self.without_noise(&mut variances, side.noise)
    }

    /// Reads the pixels beside an edge: variance of each column \[grey levels²\]; `None` where they
    /// are certainly only noise, or too few lines.
    #[inline(always)]
    fn look<T: GreyPixel>(&mut self, side: &EdgeSide<'_, T>) -> Option<ColumnValues> {
        let count = side.positions.len();
        if count < MIN_LINES {
            return None;
        }
        self.read(side);
        detrend(&mut self.lines);
        let freedom = 1.0 / narrow_to_f32(to_f64(count - 2));
        let variances = sum(self.lines.iter().map(|line| line.map(|grey| freedom * grey * grey)));
        let mean =
            variances[..self.columns].iter().sum::<f32>() / narrow_to_f32(to_f64(self.columns));
        (f64::from(mean) > MAX_NOISE_RATIO * side.noise * side.noise).then_some(variances)
    }

    /// Standard deviation without the pixels' noise, from the median of the columns'
    /// variances \[grey levels\]; `None` where it is not distinguished from noise.
    fn without_noise(&self, variances: &mut [f32; MAX_COLUMNS], noise: f64) -> Option<f64> {
        let variance = f64::from(rank::median(&mut variances[..self.columns])?) - noise * noise;
        (variance > MIN_EXCESS_VARIANCE * noise * noise).then(|| variance.sqrt())
    }

    /// Reads columns of pixels beside an edge, as far as they lie within the gauge.
    #[inline(always)]
    fn read<T: GreyPixel>(&mut self, side: &EdgeSide<'_, T>) {
        let strip = side.strip;
        let first = MIN_FIRST_PX.max(FLANK_BLURS * side.blur_px);
        let last = to_f64(strip.across - 1);
        let boundary = |of: &EdgePosition| if side.is_after() { last - of.at } else { of.at };
        let room = side.positions.iter().map(boundary).fold(side.room_px - first, f64::min);
        let fits = |column: &usize| first + to_f64(COLUMN_STEP_PX * column) <= room;
        self.columns = (0..MAX_COLUMNS).take_while(fits).count();
        self.lines.clear();
        self.lines.extend(side.positions.iter().map(|position| {
            let pixels = strip.row(usize::midpoint(position.rows.first, position.rows.end - 1));
            let nearest = round_to_count(narrow_to_f32(position.at + side.outwards * first));
            std::array::from_fn(|column| {
                let off = COLUMN_STEP_PX * column;
                let at = if side.is_after() { nearest + off } else { nearest.saturating_sub(off) };
                let pixel = pixels[at.min(pixels.len() - 1)];
                strip.scale * T::sum_to_f32(pixel.add_to(T::Sum::default()))
            })
        }));
    }

    /// Variance of the mean of all lines, from their covariances up to the first that is
    /// not positive.
    fn variance_of_mean(&self, noise: f64) -> f64 {
        let count = self.lines.len();
        let covariance = |lag: usize| {
            let pairs = self.lines[lag..].iter().zip(&self.lines);
            let products = sum(pairs.map(|(a, b)| std::array::from_fn(|k| a[k] * b[k])));
            let all = products[..self.columns].iter().sum::<f32>();
            f64::from(all) / to_f64(self.columns * count)
        };
        let later = (1..count / 4).map(covariance).take_while(|covariance| *covariance > 0.0);
        let sum = covariance(0) - noise * noise + 2.0 * later.sum::<f64>();
        sum.max(0.0) / to_f64(count)
    }
}

/// Subtracts from each column the straight line through it.
#[inline(always)]
fn detrend(lines: &mut [ColumnValues]) {
    let count = narrow_to_f32(to_f64(lines.len()));
    let middle = (count - 1.0) / 2.0;
    let means = sum(lines.iter().copied()).map(|sum| sum / count);
    let places = || (0_usize..).map(move |k| narrow_to_f32(to_f64(k)) - middle);
    let across = sum(lines.iter().zip(places()).map(|(line, position)| line.map(|v| position * v)));
    let along = count * (count * count - 1.0) / 12.0;
    let slopes = across.map(|across| across / along);
    for (line, position) in lines.iter_mut().zip(places()) {
        for (value, (mean, slope)) in line.iter_mut().zip(means.iter().zip(&slopes)) {
            *value -= mean + slope * position;
        }
    }
}

/// Sum of lines, column by column.
#[inline(always)]
fn sum(lines: impl Iterator<Item = ColumnValues>) -> ColumnValues {
    let mut sums = [0.0; MAX_COLUMNS];
    for line in lines {
        for (sum, value) in sums.iter_mut().zip(line) {
            *sum += value;
        }
    }
    sums
}
