//! The search for the bead: candidates, contours, and the pair of them that is
//! the bead's two edges.

use super::work::{MIN_LINE_FRACTION, MeasureState};
use crate::calibration::SurfaceMap;
use crate::core::units::WidthRange;
use crate::vision::contour::EdgeContours;
use crate::vision::edge::{STEP_HALF_WIDTH, StepCandidates, respond};
use crate::vision::gauge::{Polarity, WidthRangePx};
use crate::vision::pair::{self, EdgePair};
use crate::vision::pool::Bands;
use crate::vision::reject::Reject;
use crate::vision::strip::GaugeView;

/// Share from which a contour is looked at.
const MIN_BAND_FRACTION: f64 = 0.4;
/// Share of saturated pixels from which missing contrast is laid to light.
const MIN_SATURATED_FRACTION: f64 = 0.3;
/// Room that a search allows beyond the range of widths, for the difference
/// between one caliper and the mean of all.
const RANGE_FACTOR: f64 = 1.5;
/// Steps that noise alone makes are passed over up to so many of its standard
/// deviations.
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

impl ContourPair {
    /// Contours of left and right edges.
    pub fn sides<'a>(
        &self,
        ups: &'a EdgeContours,
        downs: &'a EdgeContours,
    ) -> (&'a EdgeContours, &'a EdgeContours) {
        if self.bright { (ups, downs) } else { (downs, ups) }
    }
}

impl MeasureState {
    #[inline(always)]
    pub(super) fn find_candidates(&mut self) {
        // A step is the difference of two means of REACH pooled pixels.
        #[expect(clippy::cast_precision_loss, reason = "REACH is small")]
        let noise = self.noise.grey * (2.0 / (4.0 * STEP_HALF_WIDTH as f32)).sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "a grey level")]
        let least = (0.4 * self.gauge.min_contrast_grey) as f32;
        let floor = least.max(NOISE_FLOOR_SIGMAS * noise);
        #[expect(clippy::cast_precision_loss, reason = "REACH is small")]
        let unit = self.bands.unit() / STEP_HALF_WIDTH as f32;
        self.candidates.resize(self.bands.count(), StepCandidates::default());
        for (band, candidates) in self.candidates.iter_mut().enumerate() {
            let profile = self.bands.profile(band);
            self.response.resize(profile.len(), 0);
            respond(profile, &mut self.response);
            candidates.find(&self.response, floor, unit);
        }
    }

    /// Lines of candidates along the bead.
    #[inline(always)]
    pub(super) fn find_contours(&mut self) {
        #[expect(clippy::cast_precision_loss, reason = "a band has few rows")]
        let band_px = strip_rows(&self.bands) as f32 / self.bands.count().max(1) as f32;
        self.ups.search(&self.candidates, true, band_px, MIN_BAND_FRACTION);
        self.downs.search(&self.candidates, false, band_px, MIN_BAND_FRACTION);
    }

    /// Whether so many steps show that texture or a pattern is likely.
    pub(super) fn is_busy(&self) -> bool {
        let steps = |of: &StepCandidates| of.up().len() + of.down().len();
        self.candidates.iter().map(steps).sum::<usize>() > MIN_BUSY_STEPS * self.candidates.len()
    }

    /// The believed widths in pixels across the gauge's middle.
    pub(super) fn search_range(
        &mut self,
        view: &GaugeView,
        surface: &SurfaceMap,
    ) -> Result<WidthRangePx, Reject> {
        #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
        let (u, v) = (view.across as f64 / 2.0, view.along as f64 / 2.0);
        let middle = surface.to_mm(view.to_image(u, v)).ok_or(Reject::OffSurface)?;
        let beside = surface.to_mm(view.to_image(u + 1.0, v)).ok_or(Reject::OffSurface)?;
        let mm_per_px = (beside - middle).norm();
        self.mm_per_px = mm_per_px;
        let WidthRange { min, max } = self.gauge.width_range;
        #[expect(clippy::cast_possible_truncation, reason = "widths in pixels")]
        let range = WidthRangePx {
            min: (min.get() / mm_per_px / RANGE_FACTOR) as f32,
            max: (max.get() / mm_per_px * RANGE_FACTOR) as f32,
        };
        Ok(range)
    }

    /// The bead's two edges among the contours.
    pub(super) fn find_pair(&mut self, range: WidthRangePx) -> Result<ContourPair, Reject> {
        let found = self.search(range);
        if let Some(found) = found.filter(|found| found.pair.band_fraction >= MIN_LINE_FRACTION) {
            return match found.pair.rival_px {
                Some(rival_px) => Err(self.ambiguous(found.pair.width_px, rival_px)),
                None => Ok(found),
            };
        }
        let got = found.map_or(0.0, |found| found.pair.band_fraction);
        let refused = Reject::NoPair { got, need: MIN_LINE_FRACTION };
        // A bead of another width deserves to be called that.
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
    pub(super) fn ambiguous(&self, first_px: f32, second_px: f32) -> Reject {
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
            let (lefts, rights) =
                if bright { (&self.ups, &self.downs) } else { (&self.downs, &self.ups) };
            let pair = pair::find(lefts, rights, range, &mut self.scratch);
            best = match (best, pair) {
                (Some(best), Some(pair)) if best.pair.score >= pair.score => Some(best),
                (best, None) => best,
                (_, Some(pair)) => Some(ContourPair { pair, bright }),
            };
        }
        best
    }

    pub(super) fn saturation(&self) -> Option<Reject> {
        let got = self.bands.saturated_fraction();
        (got > MIN_SATURATED_FRACTION)
            .then_some(Reject::Saturated { got, limit: MIN_SATURATED_FRACTION })
    }
}

fn strip_rows(bands: &Bands) -> usize {
    bands.count().checked_sub(1).map_or(0, |last| bands.rows(last).end)
}
