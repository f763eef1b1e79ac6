//! Edges that run along the bead: chains of steps, one a band, found by dynamic programming. Bands
//! without a fitting step are skipped. Sparks and grains form no chains. The strongest chain is
//! found first, then the strongest of the rest.

use super::edge::{MAX_STEPS_KEPT, StepCandidate, StepCandidates};
use crate::numeric::number::to_f32;
use crate::numeric::rank;
use crate::vision::buffer::reset;

/// Contours of one sign at most.
const MAX_CONTOURS: usize = 6;
/// Bands that a contour may jump over at once.
const MAX_SKIP: usize = 4;
/// Cost of a band without a step, in typical steps.
const SKIP_COST: f32 = 0.35;
/// Cost of running aside at [`MAX_FREE_SLOPE`]; proportional to the slope below it.
const ASIDE_COST: f32 = 0.25;
/// Cost beyond which two steps are not neighbours.
const BREAK_COST: f32 = 1.0;
/// Slope against the gauge's axis up to which edges run at little cost. Derived: tan(20° + 15°),
/// for a bead that slants 20 degrees (contract, `bead_axis`) and bulges by another 15.
const MAX_FREE_SLOPE: f32 = 0.7;
/// Height of a band up to which waviness is not scaled \[px\]: an edge moves little within it.
const REFERENCE_BAND_PX: f32 = 4.0;
/// Marks the first step of a contour. By definition no packed gap and index.
const NO_PREDECESSOR: u16 = u16::MAX;

/// An edge that runs along the bead.
#[derive(Debug, Clone, Default)]
pub struct EdgeContour {
    /// Position of its step in each band \[px\]; `None` where it is hidden.
    pub at: Vec<Option<f32>>,
    /// Mean height of its steps \[grey levels\].
    pub step: f32,
    /// Fraction of the bands in which it has a step.
    pub band_fraction: f64,
    /// Median distance of a step from the line between its neighbours \[px\], scaled down for bands
    /// taller than [`REFERENCE_BAND_PX`]: small for an edge, even a rough one, large for sparks
    /// that happen to lie in a row.
    pub waviness_px: f32,
}

/// Contours of one sign; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct EdgeContours {
    scores: Vec<[f32; MAX_STEPS_KEPT]>,
    predecessors: Vec<[u16; MAX_STEPS_KEPT]>,
    used: Vec<u16>,
    steps: Vec<f32>,
    contours: Vec<EdgeContour>,
    count: usize,
}

/// The steps of one sign.
#[derive(Clone, Copy)]
struct SignSteps<'a> {
    bands: &'a [StepCandidates],
    up: bool,
}

impl<'a> SignSteps<'a> {
    fn of(self, band: usize) -> &'a [StepCandidate] {
        if self.up { self.bands[band].up() } else { self.bands[band].down() }
    }
}

impl EdgeContours {
    /// What was found, the strongest first.
    pub fn all(&self) -> &[EdgeContour] {
        &self.contours[..self.count]
    }

    /// Searches contours of steps up or down that have a step in at least `min_fraction` of the
    /// bands. `band_px` is the height of a band.
    pub fn search(&mut self, bands: &[StepCandidates], up: bool, band_px: f32, min_fraction: f64) {
        reset(&mut self.used, bands.len(), 0);
        self.scores.resize(bands.len(), [0.0; MAX_STEPS_KEPT]);
        self.predecessors.resize(bands.len(), [NO_PREDECESSOR; MAX_STEPS_KEPT]);
        self.contours.resize_with(MAX_CONTOURS, EdgeContour::default);
        self.count = 0;
        let steps = SignSteps { bands, up };
        while self.count < MAX_CONTOURS {
            let typical = self.typical_step(steps);
            if typical <= 0.0 {
                return;
            }
            let Some(last) = self.link(steps, band_px, typical) else { return };
            self.follow(last, steps);
            let found = &mut self.contours[self.count];
            found.waviness_px *= (REFERENCE_BAND_PX / band_px).min(1.0);
            if found.band_fraction < min_fraction {
                return;
            }
            self.count += 1;
        }
    }

    fn is_used(&self, band: usize, index: usize) -> bool {
        self.used[band] >> index & 1 == 1
    }

    /// A strong but not extreme step: the 70th percentile of each band's best.
    fn typical_step(&mut self, steps: SignSteps<'_>) -> f32 {
        self.steps.clear();
        for band in 0..steps.bands.len() {
            let free = steps.of(band).iter().enumerate();
            let best = free
                .filter(|&(index, _)| !self.is_used(band, index))
                .map(|(_, step)| step.step)
                .fold(0.0, f32::max);
            if best > 0.0 {
                self.steps.push(best);
            }
        }
        let rank = self.steps.len() * 7 / 10;
        rank::at(&mut self.steps, rank).unwrap_or(0.0)
    }

    /// Fills in scores and returns the last step of the best contour.
    fn link(&mut self, steps: SignSteps<'_>, band_px: f32, typical: f32) -> Option<(usize, usize)> {
        let bands = steps.bands.len();
        let mut best = None;
        let mut best_total = 0.0;
        for band in 0..bands {
            for (index, step) in steps.of(band).iter().enumerate() {
                if self.is_used(band, index) {
                    continue;
                }
                let reward = (step.step / typical).sqrt().min(1.2);
                let (score, from) = self.best_before(band, step.at, steps, band_px);
                self.scores[band][index] = score + reward;
                self.predecessors[band][index] = from;
                let total = score + reward - SKIP_COST * to_f32(bands - 1 - band);
                if total > best_total {
                    best_total = total;
                    best = Some((band, index));
                }
            }
        }
        best
    }

    fn best_before(&self, band: usize, at: f32, steps: SignSteps<'_>, band_px: f32) -> (f32, u16) {
        let mut best = (-SKIP_COST * to_f32(band), NO_PREDECESSOR);
        for gap in 1..=(MAX_SKIP + 1).min(band) {
            let before = band - gap;
            let skipped = SKIP_COST * to_f32(gap - 1);
            let free = MAX_FREE_SLOPE * band_px * to_f32(gap) + 1.0;
            for (index, step) in steps.of(before).iter().enumerate() {
                if self.is_used(before, index) {
                    continue;
                }
                let moved = (step.at - at).abs();
                let beyond = 0.5 * (moved - free).max(0.0);
                let cost = ASIDE_COST * moved.min(free) / free + beyond * beyond;
                let score = self.scores[before][index] - cost - skipped;
                if cost < BREAK_COST && score > best.0 {
                    best = (score, pack(gap, index));
                }
            }
        }
        best
    }

    /// Follows a contour back from its last step and takes its steps out.
    fn follow(&mut self, last: (usize, usize), steps: SignSteps<'_>) {
        let contour = &mut self.contours[self.count];
        reset(&mut contour.at, self.used.len(), None);
        let (mut sum, mut n) = (0.0, 0.0);
        let (mut band, mut index) = last;
        loop {
            let step = steps.of(band)[index];
            contour.at[band] = Some(step.at);
            self.used[band] |= 1 << index;
            sum += step.step;
            n += 1.0;
            let from = self.predecessors[band][index];
            if from == NO_PREDECESSOR {
                break;
            }
            band -= usize::from(from >> 8);
            index = usize::from(from & 0xff);
        }
        contour.step = sum / n;
        contour.band_fraction = f64::from(n) / f64::from(to_f32(self.used.len()));
        contour.waviness_px = median_waviness(&contour.at, &mut self.steps);
    }
}

fn median_waviness(at: &[Option<f32>], scratch: &mut Vec<f32>) -> f32 {
    scratch.clear();
    scratch.extend(
        at.windows(3).filter_map(|three| Some((three[1]? - 0.5 * (three[0]? + three[2]?)).abs())),
    );
    rank::median(scratch).unwrap_or(f32::INFINITY)
}

fn pack(gap: usize, index: usize) -> u16 {
    u16::try_from(gap << 8 | index).unwrap_or(NO_PREDECESSOR)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(positions: &[(f32, f32)]) -> StepCandidates {
        StepCandidates::of(positions.iter().map(|&(at, step)| StepCandidate { at, step }))
    }

    fn search(bands: &[StepCandidates]) -> EdgeContours {
        let mut contours = EdgeContours::default();
        contours.search(bands, true, 4.0, 0.4);
        contours
    }

    #[test]
    fn a_rough_edge_in_tall_bands_does_not_wobble_more_than_sparks_in_low_ones() {
        let edge = |band: u8| StepCandidate { at: 50.0 + f32::from(band * 7 % 3), step: 20.0 };
        let bands: Vec<StepCandidates> =
            (0..20).map(|band| StepCandidates::of([edge(band)].into_iter())).collect();
        let wobble = |band_px: f32| {
            let mut contours = EdgeContours::default();
            contours.search(&bands, true, band_px, 0.4);
            contours.all()[0].waviness_px
        };
        assert_eq!(wobble(4.0), 1.5);
        assert_eq!(wobble(20.0), 0.3);
    }

    #[test]
    fn a_contour_follows_the_edge_and_skips_what_is_hidden() {
        let bands: Vec<StepCandidates> = (0..20u8)
            .map(
                |k| if k == 7 || k == 8 { band(&[]) } else { band(&[(60.0 + f32::from(k), 80.0)]) },
            )
            .collect();
        let found = search(&bands);
        assert_eq!(found.all().len(), 1);
        assert_eq!(found.all()[0].at[8], None);
        assert_eq!(found.all()[0].at[19], Some(79.0));
        assert!((found.all()[0].band_fraction - 0.9).abs() < 1e-12);
    }

    #[test]
    fn sparks_that_are_stronger_do_not_lead_astray() {
        let bands: Vec<StepCandidates> = (0..20u8)
            .map(|k| {
                let far = |n: u8| f32::from((k * 37 + n * 91) % 200) + 100.0;
                band(&[(60.0, 60.0), (far(1), 160.0), (far(2), 160.0), (far(3), 160.0)])
            })
            .collect();
        let found = search(&bands);
        assert!(found.all()[0].at.iter().flatten().all(|&at| at == 60.0));
    }

    #[test]
    fn two_edges_are_two_contours_the_stronger_first() {
        let bands: Vec<StepCandidates> =
            (0..20u8).map(|k| band(&[(60.0 + 0.5 * f32::from(k), 50.0), (90.0, 80.0)])).collect();
        let found = search(&bands);
        assert_eq!(found.all().len(), 2);
        assert_eq!((found.all()[0].step, found.all()[1].step), (80.0, 50.0));
    }

    #[test]
    fn the_free_slope_is_that_of_a_slant_and_a_bulge() {
        assert!((MAX_FREE_SLOPE - 35f32.to_radians().tan()).abs() < 5e-4);
    }
}
