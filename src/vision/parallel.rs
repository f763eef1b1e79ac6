//! Steps that run side by side. The two edges of a bead lie at the same distance in more bands
//! than any other steps do, however the bead runs.

use crate::vision::buffer::reset;
use std::ops::Range;

/// Difference of the distances within which edges run side by side \[px\].
const SAME_DISTANCE_PX: f32 = 1.2;
/// Bands that must agree.
const MIN_BANDS: usize = 4;

/// A step up and a step down in one band.
#[derive(Debug, Clone, Copy)]
struct StepPair {
    band: usize,
    left: f32,
    right: f32,
}

impl StepPair {
    fn width(&self) -> f32 {
        self.right - self.left
    }
}

/// Positions of two edges side by side; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct ParallelEdges {
    spans: Vec<StepPair>,
    /// Number of each band's pairs within the range of distances that is examined.
    within: Vec<u16>,
    /// Positions of the left edge, one a band \[px\]; NaN in bands that do not show
    /// both edges at the distance.
    pub lefts: Vec<f32>,
    /// Those of the right edge.
    pub rights: Vec<f32>,
}

impl ParallelEdges {
    /// Finds the distance at which steps on the left and on the right lie in
    /// most bands, within a range \[px\], and the steps that do. Returns whether
    /// there are enough.
    pub fn find<L, R>(
        &mut self,
        bands: usize,
        lefts: impl Fn(usize) -> L,
        rights: impl Fn(usize) -> R,
        range: Range<f32>,
    ) -> bool
    where
        L: Iterator<Item = f32>,
        R: Iterator<Item = f32>,
    {
        self.spans.clear();
        for band in 0..bands {
            for left in lefts(band) {
                let spans = rights(band).map(|right| StepPair { band, left, right });
                self.spans.extend(spans.filter(|span| range.contains(&span.width())));
            }
        }
        self.spans.sort_unstable_by(|a, b| a.width().total_cmp(&b.width()));
        let (most, width) = self.most_alike(bands);
        self.pick(bands, width);
        most >= MIN_BANDS
    }

    /// Largest number of bands with the same distance, and that distance \[px\].
    fn most_alike(&mut self, bands: usize) -> (usize, f32) {
        reset(&mut self.within, bands, 0);
        let (mut first, mut count) = (0, 0);
        let mut best = (0, f32::NAN);
        for last in 0..self.spans.len() {
            let StepPair { band, .. } = self.spans[last];
            count += usize::from(self.within[band] == 0);
            self.within[band] += 1;
            while self.spans[last].width() - self.spans[first].width() > SAME_DISTANCE_PX {
                let StepPair { band, .. } = self.spans[first];
                self.within[band] -= 1;
                count -= usize::from(self.within[band] == 0);
                first += 1;
            }
            if count > best.0 {
                let middle = &self.spans[usize::midpoint(first, last)];
                best = (count, middle.width());
            }
        }
        best
    }

    /// Takes the span of each band that comes nearest to a distance.
    fn pick(&mut self, bands: usize, width: f32) {
        for positions in [&mut self.lefts, &mut self.rights] {
            reset(positions, bands, f32::NAN);
        }
        let mut nearest = f32::INFINITY;
        let mut band = usize::MAX;
        self.spans.sort_unstable_by_key(|span| span.band);
        for span in &self.spans {
            if span.band != band {
                (band, nearest) = (span.band, SAME_DISTANCE_PX);
            }
            let miss = (span.width() - width).abs();
            if miss < nearest {
                nearest = miss;
                (self.lefts[band], self.rights[band]) = (span.left, span.right);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small(number: usize) -> f32 {
        f32::from(u8::try_from(number).unwrap())
    }

    /// Edges that slant and wave alike, each with a false step in every band,
    /// and without the true one in every fourth.
    #[test]
    fn edges_that_are_mostly_covered_are_found_by_their_distance() {
        let bend = |band: usize| [0.3f32, 0.9, 2.0, 2.4][band % 4] + 0.4 * small(band);
        let left = |band: usize| {
            let covered = 40.0 + bend(band) - 3.0 - 0.7 * small(band * 5 % 8);
            let true_one = (band % 4 != 1).then_some(40.0 + bend(band));
            std::iter::once(covered).chain(true_one)
        };
        let right = |band: usize| {
            let covered = 140.5 + bend(band) + 3.0 + 0.9 * small(band * 7 % 11);
            let true_one = (band % 4 != 3).then_some(140.5 + bend(band));
            std::iter::once(covered).chain(true_one)
        };
        let mut parallel = ParallelEdges::default();
        assert!(parallel.find(24, left, right, 80.0..140.0));
        for band in 0..24 {
            let (left, right) = (parallel.lefts[band], parallel.rights[band]);
            if band % 2 == 0 {
                assert!((left - 40.0 - bend(band)).abs() < 1e-4, "{left} in band {band}");
                assert!((right - 140.5 - bend(band)).abs() < 1e-4, "{right} in band {band}");
            }
        }
    }

    #[test]
    fn a_few_steps_at_any_distance_are_no_bead() {
        let left = |band: usize| (band < 3).then_some(10.0).into_iter();
        let right = |_| std::iter::once(60.0);
        assert!(!ParallelEdges::default().find(24, left, right, 40.0..60.0));
        assert!(!ParallelEdges::default().find(3, left, right, 70.0..80.0));
    }
}
