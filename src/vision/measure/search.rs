//! The search for the bead: candidates, contours, and the pair of them that is
//! the bead's two edges.

use super::work::{BeadSearch, MIN_LINE_FRACTION, MeasureState};
use crate::calibration::SurfaceMap;
use crate::core::WidthRange;
use crate::numeric::number::{narrow_to_f32, to_f32, to_f64};
use crate::vision::edge::{STEP_HALF_WIDTH, StepCandidates, respond};
use crate::vision::gauge::{GaugeView, Polarity, WidthRangePx};
use crate::vision::pair::{self, EdgePair, Sides};
use crate::vision::pool::Bands;
use crate::vision::reject::Reject;

/// Smallest fraction of the bands in which a contour must have a step.
const MIN_BAND_FRACTION: f64 = 0.4;
/// Fraction of saturated pixels from which missing contrast is attributed to light.
const MIN_SATURATED_FRACTION: f64 = 0.3;
/// Room that a search allows beyond the range of widths, for the difference
/// between one caliper and the mean of all.
const RANGE_FACTOR: f64 = 1.5;
/// Step, in standard deviations of its noise, up to which it is ignored. Derived: noise alone
/// exceeds 3.5 at 5 of 10,000 positions, less than one of a row across the gauge.
const NOISE_FLOOR_SIGMAS: f32 = 3.5;

/// Steps of a band, in the mean, from which on texture or a pattern is likely: a bead has
/// two, with a groove beside each edge four; textured ones had 22 to 32.
const MIN_BUSY_STEPS: usize = 10;

/// A pair and its polarity.
#[derive(Debug, Clone, Copy)]
pub struct ContourPair {
    /// The pair.
    pub pair: EdgePair,
    /// Whether the bead is brighter than what lies beside it.
    pub bright: bool,
}

impl BeadSearch {
    /// Contours that may be left and right edges of a bright or of a dark bead.
    pub fn sides(&self, bright: bool) -> Sides<'_> {
        let (lefts, rights) =
            if bright { (&self.ups, &self.downs) } else { (&self.downs, &self.ups) };
        Sides { lefts, rights }
    }
}

impl MeasureState {
    #[inline(always)]
    pub fn find_candidates(&mut self) {
        // A step is the difference of two means of `pixels` pooled pixels.
        let pixels = to_f32(STEP_HALF_WIDTH);
        let noise = self.rows.noise.grey * (2.0 / (4.0 * pixels)).sqrt();
        let least = narrow_to_f32(0.4 * self.gauge.min_contrast_grey);
        let floor = least.max(NOISE_FLOOR_SIGMAS * noise);
        let unit = self.rows.bands.unit / pixels;
        self.search.candidates.resize(self.rows.bands.count(), StepCandidates::default());
        for (band, candidates) in self.search.candidates.iter_mut().enumerate() {
            let profile = self.rows.bands.profile(band);
            self.search.response.resize(profile.len(), 0);
            respond(profile, &mut self.search.response);
            candidates.find(&self.search.response, floor, unit);
        }
    }

    /// Lines of candidates along the bead.
    #[inline(always)]
    pub fn find_contours(&mut self) {
        let band_px = to_f32(strip_rows(&self.rows.bands)) / to_f32(self.rows.bands.count().max(1));
        self.search.ups.search(&self.search.candidates, true, band_px, MIN_BAND_FRACTION);
        self.search.downs.search(&self.search.candidates, false, band_px, MIN_BAND_FRACTION);
    }

    /// Whether so many steps show that texture or a pattern is likely.
    pub fn is_busy(&self) -> bool {
        let steps = |of: &StepCandidates| of.up().len() + of.down().len();
        self.search.candidates.iter().map(steps).sum::<usize>()
            > MIN_BUSY_STEPS * self.search.candidates.len()
    }

    /// The accepted widths in pixels across the gauge's middle.
    pub fn search_range(
        &mut self,
        view: &GaugeView,
        surface: &SurfaceMap,
    ) -> Result<WidthRangePx, Reject> {
        let (u, v) = (to_f64(view.across) / 2.0, to_f64(view.along) / 2.0);
        let middle = surface.to_mm(view.to_image(u, v)).ok_or(Reject::OffSurface)?;
        let beside = surface.to_mm(view.to_image(u + 1.0, v)).ok_or(Reject::OffSurface)?;
        let mm_per_px = (beside - middle).norm();
        self.mm_per_px = mm_per_px;
        let WidthRange { min, max } = self.gauge.width_range;
        Ok(WidthRangePx {
            min: narrow_to_f32(min.get() / mm_per_px / RANGE_FACTOR),
            max: narrow_to_f32(max.get() / mm_per_px * RANGE_FACTOR),
        })
    }

    /// The bead's two edges among the contours.
    pub fn find_pair(&mut self, range: WidthRangePx) -> Result<ContourPair, Reject> {
        let found = self.search(range);
        if let Some(found) = found.filter(|found| found.pair.band_fraction >= MIN_LINE_FRACTION) {
            return match found.pair.rival_px {
                Some(rival_px) => Err(self.ambiguous(found.pair.width_px, rival_px)),
                None => Ok(found),
            };
        }
        let got = found.map_or(0.0, |found| found.pair.band_fraction);
        let refused = Reject::NoPair { got, need: MIN_LINE_FRACTION };
        // A bead of another width is refused later, for its width.
        let least = self.gauge.min_contrast_grey;
        let strong = |found: &ContourPair| {
            found.pair.band_fraction >= MIN_LINE_FRACTION && f64::from(found.pair.step) >= least
        };
        let any = WidthRangePx { min: 4.0, max: f32::MAX };
        match self.search(any).filter(strong) {
            Some(found) => Ok(found),
            None => Err(self.saturation().unwrap_or(refused)),
        }
    }

    /// The refusal of a frame in which two pairs fit.
    pub fn ambiguous(&self, first_px: f32, second_px: f32) -> Reject {
        let mm = |px: f32| f64::from(px) * self.mm_per_px;
        Reject::Ambiguous { first_mm: mm(first_px), second_mm: mm(second_px) }
    }

    fn search(&mut self, range: WidthRangePx) -> Option<ContourPair> {
        let mut best: Option<ContourPair> = None;
        for bright in [true, false] {
            let unwanted = if bright { Polarity::Dark } else { Polarity::Bright };
            if self.gauge.polarity == unwanted {
                continue;
            }
            let pair = pair::find(self.search.sides(bright), range, &mut self.scratch.narrow);
            let is_better = |pair: &EdgePair| best.is_none_or(|best| pair.score > best.pair.score);
            let better = pair.filter(is_better).map(|pair| ContourPair { pair, bright });
            best = better.or(best);
        }
        best
    }

    pub fn saturation(&self) -> Option<Reject> {
        let got = self.rows.bands.saturated_fraction();
        (got > MIN_SATURATED_FRACTION)
            .then_some(Reject::Saturated { got, limit: MIN_SATURATED_FRACTION })
    }
}

fn strip_rows(bands: &Bands) -> usize {
    bands.bounds.last().map_or(0, |rows| rows.end)
}
