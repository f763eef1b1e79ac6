//! Smooth trajectories of position and levels along an edge, from rough values, one a band.

use super::pool::Bands;
use super::row_range::RowRange;
use crate::numeric::number::{narrow_to_f32, to_count, to_f32};
use crate::numeric::rank;
use crate::vision::buffer::refill;

/// Bands on either side that a smoothed value is taken from.
const NEIGHBOURS: usize = 3;

/// Smallest shift by a bend, of the line through the neighbours, that is corrected \[px\].
const MIN_BEND_PX: f32 = 0.1;

/// Neighbours by whose median outliers are recognised.
const OUTLIER_WINDOW: usize = 9;
/// Distance from the median that makes a value an outlier: in pixels, and in typical distances in
/// addition to that.
const MIN_OUTLIER_PX: f32 = 1.2;
const OUTLIER_RATIO: f32 = 4.0;

/// Fills gaps from their neighbours, in a straight line; `false` where there
/// is nothing at all.
pub fn fill(rough: impl Iterator<Item = Option<f32>>, out: &mut Vec<f32>) -> bool {
    out.clear();
    let mut last: Option<usize> = None;
    for (band, value) in rough.enumerate() {
        out.push(value.unwrap_or(f32::NAN));
        let Some(value) = value else { continue };
        let from = last.map_or(value, |last| out[last]);
        let first = last.map_or(0, |last| last + 1);
        let gap = to_f32((band - last.unwrap_or(0)).max(1));
        for (between, position) in (first..band).enumerate() {
            let fraction = if last.is_some() { to_f32(between + 1) / gap } else { 0.0 };
            out[position] = from + fraction * (value - from);
        }
        last = Some(band);
    }
    let Some(last) = last else { return false };
    let end = out[last];
    out[last + 1..].fill(end);
    true
}

/// Sets values that lie far off the median of their neighbours to NaN: where a grain hides the edge
/// for a few bands, its contour is not the edge's. `scratch` is a buffer.
pub fn remove_outliers(values: &mut [f32], scratch: &mut Vec<f32>) {
    let count = values.len();
    if count < OUTLIER_WINDOW || runs_smoothly(values) {
        return;
    }
    scratch.clear();
    for band in 0..count {
        let from = band.saturating_sub(OUTLIER_WINDOW / 2).min(count - OUTLIER_WINDOW);
        let mut window = [0.0; OUTLIER_WINDOW];
        window.copy_from_slice(&values[from..from + OUTLIER_WINDOW]);
        // Off the line through the window: along a slanted edge the median itself is
        // the value in the middle, however far that is off.
        let slope = (middle_of(&window[6..]) - middle_of(&window[..3])) / 6.0;
        for (k, value) in window.iter_mut().enumerate() {
            *value -= slope * to_f32(k);
        }
        let here = window[band - from];
        window.sort_unstable_by(f32::total_cmp);
        scratch.push(here - window[OUTLIER_WINDOW / 2]);
    }
    let offs = scratch.len();
    scratch.extend_from_within(..);
    for off in &mut scratch[offs..] {
        *off = off.abs();
    }
    let Some(typical) = rank::median(&mut scratch[offs..]) else { return };
    for (value, off) in values.iter_mut().zip(&scratch[..offs]) {
        if off.abs() > MIN_OUTLIER_PX + OUTLIER_RATIO * typical {
            *value = f32::NAN;
        }
    }
}

/// Whether no value lies far enough off the line between its neighbours to be an outlier.
fn runs_smoothly(values: &[f32]) -> bool {
    values.windows(3).all(|near| (near[1] - 0.5 * (near[0] + near[2])).abs() < 0.5 * MIN_OUTLIER_PX)
}

/// The middle one of the first three values.
fn middle_of(values: &[f32]) -> f32 {
    let (a, b, c) = (values[0], values[1], values[2]);
    a.max(b.min(c)).min(b.max(c))
}

/// Median of three, so that a single outlier leads nothing astray.
pub fn median_of_three(values: &mut [f32]) {
    let Some(mut before) = values.first().copied() else { return };
    for k in 1..values.len().saturating_sub(1) {
        let here = values[k];
        let after = values[k + 1];
        values[k] = middle_of(&[before, here, after]);
        before = here;
    }
}

/// Replaces each value by the straight line through its neighbours.
pub fn smooth(values: &[f32], out: &mut Vec<f32>) {
    out.clear();
    let count = values.len();
    let window = (2 * NEIGHBOURS + 1).min(count);
    for band in 0..count {
        let from = band.saturating_sub(NEIGHBOURS).min(count - window);
        let (mut mean, mut slope) = (0.0, 0.0);
        let middle = to_f32(window - 1) / 2.0;
        let mut spread = 0.0;
        for (k, value) in values[from..from + window].iter().enumerate() {
            let away = to_f32(k) - middle;
            mean += value;
            slope += away * value;
            spread += away * away;
        }
        let (count, away) = (to_f32(window), to_f32(band - from) - middle);
        out.push(mean / count + if spread > 0.0 { slope / spread * away } else { 0.0 });
    }
}

/// Smooths values that may follow a parabola. A notable one is left as it is, because the line
/// through the neighbours of a bent edge runs inside it. `values` is overwritten.
pub fn smooth_bent(values: &mut [f32], out: &mut Vec<f32>) {
    let middle = 0.5 * (to_f32(values.len()) - 1.0);
    let square = |band: usize| (to_f32(band) - middle) * (to_f32(band) - middle);
    let mean = (0..values.len()).map(square).sum::<f32>() / to_f32(values.len()).max(1.0);
    let (mut sum, mut norm) = (0.0, 0.0);
    for (band, value) in values.iter().enumerate() {
        let bent = square(band) - mean;
        sum += bent * value;
        norm += bent * bent;
    }
    let bend = if norm > 0.0 { sum / norm } else { 0.0 };
    // The line is off by the bend times the mean square of the distances.
    let off = bend * to_f32(NEIGHBOURS * (NEIGHBOURS + 1)) / 3.0;
    if off.abs() < MIN_BEND_PX {
        return smooth(values, out);
    }
    for (band, value) in values.iter_mut().enumerate() {
        *value -= bend * (square(band) - mean);
    }
    smooth(values, out);
    for (band, value) in out.iter_mut().enumerate() {
        *value += bend * (square(band) - mean);
    }
}

/// Expected edge along the gauge: position, level before it and step, on lines between the middles
/// of the bands.
#[derive(Debug, Clone, Default)]
pub struct EdgeTrajectory {
    middles: Vec<f32>,
    values: Vec<[f32; 3]>,
    segments: Vec<TrajectorySegment>,
    /// Bands for each pixel along the bead.
    per_px: f32,
}

/// Correction of an expected edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCorrection {
    /// How far it lies aside \[px\].
    pub aside: f32,
    /// Its level before the step, relative to the expected one, as a fraction of the step.
    pub before: f32,
    /// Its level after the step, relative to the expected one before it, likewise.
    pub after: f32,
}

/// The trajectory from the middle of a band to that of the next.
#[derive(Debug, Clone, Copy)]
struct TrajectorySegment {
    /// Where it begins and how long it is \[px\].
    middle: f32,
    length: f32,
    /// Position, level before and step where it begins, and their changes for a
    /// pixel.
    values: [f32; 3],
    slopes: [f32; 3],
}

impl TrajectorySegment {
    fn between(middles: [f32; 2], values: [[f32; 3]; 2]) -> Self {
        let length = middles[1] - middles[0];
        let slope = |k: usize| (values[1][k] - values[0][k]) / length;
        Self { middle: middles[0], length, values: values[0], slopes: [0, 1, 2].map(slope) }
    }
}

impl EdgeTrajectory {
    /// Draws the lines between the bands.
    pub fn draw(&mut self, bands: &Bands, at: &[f32], before: &[f32], step: &[f32]) {
        refill(&mut self.middles, (0..bands.count()).map(|band| narrow_to_f32(bands.middle(band))));
        refill(&mut self.values, (0..at.len()).map(|band| [at[band], before[band], step[band]]));
        self.link();
    }

    /// Shifts the whole trajectory and corrects its levels.
    pub fn correct(&mut self, EdgeCorrection { aside, before, after }: EdgeCorrection) {
        for [at, level, step] in &mut self.values {
            *at += aside;
            *level += before * *step;
            *step *= after - before;
        }
        self.link();
    }

    /// Draws the line again through better positions; levels stay. `scratch` is a buffer.
    pub fn redraw(&mut self, lines: &[RowRange], at: &[f32], scratch: &mut Vec<[f32; 3]>) {
        scratch.clear();
        scratch.extend(lines.iter().zip(at).map(|(&line, &at)| {
            let [_, before, step] = self.at(narrow_to_f32(line.middle()));
            [at, before, step]
        }));
        std::mem::swap(&mut self.values, scratch);
        refill(&mut self.middles, lines.iter().map(|&line| narrow_to_f32(line.middle())));
        self.link();
    }

    /// Takes the levels of another trajectory.
    pub fn take_levels(&mut self, other: &Self) {
        for (middle, value) in self.middles.iter().zip(&mut self.values) {
            let [_, before, step] = other.at(*middle);
            (value[1], value[2]) = (before, step);
        }
        self.link();
    }

    /// Draws the lines between the middles.
    fn link(&mut self) {
        let last = self.middles.len() - 1;
        self.per_px = to_f32(last) / (self.middles[last] - self.middles[0]).max(1.0);
        let neighbours = self.middles.windows(2).zip(self.values.windows(2));
        self.segments.clear();
        self.segments.extend(neighbours.map(|(middles, values)| {
            TrajectorySegment::between([middles[0], middles[1]], [values[0], values[1]])
        }));
    }

    /// Position, level before and step at a row, or between two. Beyond the first
    /// and the last band the edge runs on, but levels do not change.
    #[inline(always)]
    pub fn at(&self, v: f32) -> [f32; 3] {
        let Some(last) = self.segments.len().checked_sub(1) else { return self.values[0] };
        let mut band = to_count(((v - self.middles[0]) * self.per_px).into()).min(last);
        // Bands differ by a row in height.
        if v < self.middles[band] && band > 0 {
            band -= 1;
        } else if v >= self.middles[band + 1] && band < last {
            band += 1;
        }
        let TrajectorySegment { middle, length, values, slopes } = self.segments[band];
        let ahead = v - middle;
        let within = ahead.clamp(0.0, length);
        [
            values[0] + ahead * slopes[0],
            values[1] + within * slopes[1],
            values[2] + within * slopes[2],
        ]
    }

    /// Steepest slope of the edge between two bands.
    pub fn steepest(&self) -> f32 {
        self.segments.iter().fold(0.0, |most, segment| segment.slopes[0].abs().max(most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_in_straight_lines_and_ends_go_on() {
        let mut out = Vec::new();
        let rough = [None, Some(2.0), None, None, Some(5.0), None];
        assert!(fill(rough.into_iter(), &mut out));
        assert_eq!(out, [2.0, 2.0, 3.0, 4.0, 5.0, 5.0]);
        assert!(!fill([None, None].into_iter(), &mut out));
    }

    #[test]
    fn the_course_runs_straight_between_bands_and_on_beyond_them() {
        let frame = crate::core::Frame::new(
            0,
            crate::core::Stamp::START,
            crate::core::Size::new(20, 43),
            crate::core::Pixels::Grey8(vec![0; 860]),
        );
        let frame = frame.unwrap();
        let roi = crate::core::Roi { x: 0, y: 0, width: 20, height: 43 };
        let view =
            crate::vision::gauge::GaugeView::new(roi, crate::vision::gauge::BeadAxis::Vertical);
        let mut layout = crate::vision::strip::RowLayout::default();
        let crate::vision::strip::GaugeRowsOfDepth::Bytes(strip) =
            layout.strips(&frame, &view, None)
        else {
            unreachable!()
        };
        let mut bands = Bands::default();
        bands.pool(&strip, 8);
        let at: Vec<f32> =
            (0..8).map(|band| 3.0 + 0.5 * narrow_to_f32(bands.middle(band))).collect();
        let mut course = EdgeTrajectory::default();
        course.draw(&bands, &at, &[40.0; 8], &[80.0; 8]);
        for v in 0..43u8 {
            let [position, before, step] = course.at(f32::from(v));
            assert!((position - 3.0 - 0.5 * f32::from(v)).abs() < 1e-4);
            assert_eq!((before, step), (40.0, 80.0));
        }
        assert!((course.steepest() - 0.5).abs() < 1e-5);
    }

    #[test]
    fn a_rough_edge_that_slants_has_nothing_wild_and_a_grain_on_it_is() {
        let rough =
            |k: u8| 5.4 * f32::from(k) + [0.0, 1.4, 2.3, 0.9, -1.2, -2.0][usize::from(k % 6)];
        let mut values: Vec<f32> = (0..25).map(rough).collect();
        remove_outliers(&mut values, &mut Vec::new());
        assert!(values.iter().all(|value| value.is_finite()), "{values:?}");
        values[3] += 25.0;
        remove_outliers(&mut values, &mut Vec::new());
        let gone: Vec<usize> = (0..25).filter(|&k| values[k].is_nan()).collect();
        assert_eq!(gone, [3]);
    }

    #[test]
    fn a_bent_edge_is_smoothed_where_it_is() {
        let at = |k: usize| 200.0 + 3.0 * to_f32(k) - 0.2 * to_f32(k) * to_f32(k);
        let mut bent: Vec<f32> = (0..25).map(at).collect();
        let mut out = Vec::new();
        smooth_bent(&mut bent, &mut out);
        assert!(out.iter().enumerate().all(|(k, value)| (value - at(k)).abs() < 1e-3), "{out:?}");
    }

    #[test]
    fn a_line_stays_a_line_and_a_wild_value_goes() {
        let mut line: Vec<f32> = (0..12u8).map(|k| 3.0 + 0.5 * f32::from(k)).collect();
        let mut out = Vec::new();
        smooth(&line, &mut out);
        assert!(out.iter().zip(&line).all(|(a, b)| (a - b).abs() < 1e-5));
        line[5] = 90.0;
        median_of_three(&mut line);
        assert_eq!(line[5], 6.0);
    }
}
