//! One frame after the other: bands, candidates, contours, sub-pixel edges,
//! width.

mod checks;
mod compressed;
mod locate;
mod model_selection;
mod pattern_limits;
mod patterned;
mod rough_edges;
mod search;
mod skew_offset;
#[cfg(test)]
mod tests;
mod uniformity;
mod work;

use crate::calibration::SurfaceMap;
use crate::core::frame::Frame;
use crate::core::geometry::ImagePoint;
use checks::{WIDEST_BLUR_PX, WIDEST_MOTION_PX};
use pattern_limits::STRONGEST_BESIDE_WHOLE;
use rough_edges::may_be_rough;
use work::{Way, Work};

use super::axis;
use super::edge_lines;
use super::gauge::{Gauge, Method, WidthRangePx};
use super::pixel_noise::PixelNoise;
use super::pool;
use super::reject::Reject;
use super::roughness::{CaliperFilter, LocalWidths};
use super::strip::{Grey, Strip, Strips, Turner, View};
use super::trace::Tracer;
use super::vectors;
use super::width::{Caliper, EdgePlace, Edges, Hints, WidthMeasurement};
use crate::numeric::number::float;

/// Standard deviation of a width of [`NARROWEST_BLURS`] blurs from the flanks' overlap, in
/// blurs, and the blurs by which a width must be larger for 1/e of it.
const OVERLAP: f64 = 0.045;
const NARROWEST_BLURS: f64 = 4.0;
const OVERLAP_BLURS: f64 = 3.0;

/// Measures frames of one cell; keeps its memory from frame to frame.
#[derive(Debug, Clone)]
pub struct Measurer {
    gauge: Gauge,
    white: Option<u16>,
    turner: Turner,
    work: Work,
}

impl Measurer {
    /// For a gauge. `white` is the upper end of the camera's scale where it is
    /// not that of the pixels, as with 12 bits in 16.
    pub fn new(gauge: Gauge, white: Option<u16>) -> Self {
        Self { gauge, white, turner: Turner::new(gauge.gamma), work: Work::new(gauge) }
    }

    /// The edges behind the last width, for pictures of them.
    pub fn edges(&self) -> Edges<'_> {
        Edges { left: &self.work.left_px, right: &self.work.right_px }
    }

    /// The same line by line, with how sure each place is. A refused frame has
    /// the edges that were found before it was refused.
    pub fn calipers(&self) -> impl Iterator<Item = Caliper> {
        let Edges { left, right } = self.edges();
        let (mut left, mut right) = (left.iter().copied(), right.iter().copied());
        let lines = match self.gauge.method {
            Method::Caliper => self.work.lines.len(),
            Method::EdgeLines => left.len(),
        };
        (0..lines).filter_map(move |number| {
            let left = self.place(&self.work.left, number, &mut left);
            let right = self.place(&self.work.right, number, &mut right);
            let found = left.is_some() || right.is_some();
            found.then_some(Caliper { number, left, right })
        })
    }

    /// Local widths of the frame that was measured last, as far as its caliper lines
    /// show them and the method knows their noise.
    pub fn local_widths(
        &self,
        measured: &WidthMeasurement,
        surface: &SurfaceMap,
    ) -> Option<LocalWidths> {
        let lines = self.work.lines.len();
        let along = View::new(self.gauge.roi, self.gauge.axis).along;
        let filter = CaliperFilter {
            filter_px: self
                .work
                .left
                .uncertainty
                .along_px
                .max(self.work.right.uncertainty.along_px),
            blur_px: measured.hints.blur_px,
            noise_fractions: [&self.work.left, &self.work.right]
                .map(|edge| edge.uncertainty.lines_fraction),
            line_px: float(along) / float(lines.max(1)),
        };
        LocalWidths::read(self.calipers(), lines, filter, surface)
    }

    /// Adds to the hints of the width that was measured last how skewed its flanks are: not
    /// needed for a width, and told well only by many frames.
    #[must_use]
    pub fn with_skew(&self, found: WidthMeasurement) -> WidthMeasurement {
        WidthMeasurement { hints: Hints { skew: self.work.skew(), ..found.hints }, ..found }
    }

    /// The next point of an edge, if it belongs to this line.
    fn place(
        &self,
        tracer: &Tracer,
        number: usize,
        points: &mut impl Iterator<Item = ImagePoint>,
    ) -> Option<EdgePlace> {
        if self.gauge.method == Method::EdgeLines {
            return Some(EdgePlace { at: points.next()?, sigma_px: None });
        }
        let located = tracer.edges().get(number).copied().flatten()?;
        Some(EdgePlace { at: points.next()?, sigma_px: Some(located.variance.sqrt()) })
    }

    /// Measures the bead in a frame on a surface. Refuses a width whose standard
    /// deviation is more than the gauge's `max_sigma` of it.
    pub fn measure(
        &mut self,
        frame: &Frame,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let edges_only = self.measure_picture(frame, surface)?;
        let found = edges_only.with_calibration(surface)?;
        found.check_sigma(edges_only.sigma, self.gauge.max_sigma)?;
        Ok(found)
    }

    /// The same with no more in sigma than the picture itself leaves open.
    fn measure_picture(
        &mut self,
        frame: &Frame,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let work = &mut self.work;
        work.left_px.clear();
        work.right_px.clear();
        if !self.gauge.roi.fits(frame.size()) {
            return Err(Reject::WrongSize { image: (frame.width(), frame.height()) });
        }
        check_size((frame.width(), frame.height()), surface)?;
        if self.gauge.method == Method::EdgeLines {
            let points = (&mut work.left_px, &mut work.right_px);
            return edge_lines::measure(&self.gauge, frame, surface, points);
        }
        let view = View::new(self.gauge.roi, self.gauge.axis);
        let strips = self.turner.strips(frame, &view, self.white);
        vectors::widest(
            #[inline(always)]
            || match strips {
                Strips::Bytes(strip) => work.measure(&strip, &view, surface),
                Strips::Words(strip) => work.measure(&strip, &view, surface),
            },
        )
    }
}

/// What the other edge's flank adds to the variance of an edge's place \[px²\], for both at
/// so many pixels from each other and so blurred. Measured on 2,000 drawn beads of 5 to
/// 600 px with a blur of 1.5 px.
fn overlap_variance(width_px: f64, blur_px: f64) -> f64 {
    let blurs = width_px / blur_px;
    0.5 * (OVERLAP * blur_px * libm::exp((NARROWEST_BLURS - blurs) / OVERLAP_BLURS)).powi(2)
}

/// Refuses images of another size than those that the calibration was made with.
fn check_size(image: (usize, usize), surface: &SurfaceMap) -> Result<(), Reject> {
    let Some(calibrated) = surface.image_size_px() else { return Ok(()) };
    let same = [image.0, image.1].map(u32::try_from) == calibrated.map(Ok);
    if same { Ok(()) } else { Err(Reject::OtherSize { image, calibrated }) }
}

impl Work {
    #[inline(always)]
    fn measure<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let range = self.search_range(view, surface)?;
        self.noise = PixelNoise::read(strip, 0..strip.across);
        self.bands.pool(strip, self.gauge.calipers);
        pool::cut(strip.along, self.gauge.calipers, &mut self.lines);
        self.find_candidates();
        if self.is_busy()
            && let Some(textured) = self.measure_busy(strip, range, view, surface)
        {
            return textured;
        }
        match self.measure_steps(strip, range, view, surface) {
            Ok(found) => self.measure_again(found, strip, range, view, surface),
            Err(reject) if may_be_rough(&reject) => self
                .measure_rough(&reject, strip, range, view, surface)
                .map_err(|rough| rough.or(reject)),
            Err(reject) => Err(reject),
        }
    }

    /// Measures edges that were measured as blurred steps in another way, where that tells
    /// more; otherwise gives what was found.
    fn measure_again<T: Grey>(
        &mut self,
        found: WidthMeasurement,
        strip: &Strip<'_, T>,
        range: WidthRangePx,
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let knows_texture = self.left.knows_texture() && self.right.knows_texture();
        let is_bearable = self.pattern_share > 0.0 && self.pattern_share < STRONGEST_BESIDE_WHOLE;
        let is_on_texture = knows_texture && is_bearable;
        if !is_on_texture && let Some(textured) = self.measure_textured(strip, range, view, surface)
        {
            return textured;
        }
        let found = if self.may_be_more_than_steps()
            && let Ok(fits) = self.find_rough(strip, range)
        {
            if self.explains_more(&fits, &found) {
                return self.take_rough(&fits, strip, view, surface);
            }
            self.check_flanks(&fits)?;
            self.at_least_as_unsure(&fits, found)
        } else {
            found
        };
        self.check_lines_in_pattern()?;
        Ok(found)
    }

    /// Measures edges that are blurred steps.
    #[inline(always)]
    fn measure_steps<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        range: WidthRangePx,
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        self.find_contours();
        let pair = self.find_pair(range)?;
        self.trace(strip, pair)?;
        self.sort_out(pair.bright)?;
        self.check_contrast()?;
        let is_motion = self.blur_shapes.is_motion() && self.way != Way::Lines;
        self.check_blur(if is_motion { WIDEST_MOTION_PX } else { WIDEST_BLUR_PX })?;
        self.check_ground(strip, f64::max)?;
        self.check_border(strip.across)?;
        self.width_on(view, surface)
    }

    fn width_on(&mut self, view: &View, surface: &SurfaceMap) -> Result<WidthMeasurement, Reject> {
        let hints = Hints {
            contrast_grey: f64::midpoint(self.contrasts[0], self.contrasts[1]),
            blur_px: f64::midpoint(self.left.blur_px, self.right.blur_px),
            noise_grey: self.noise.grey.into(),
            saturated_share: self.bands.saturated_share(),
            used_share: f64::midpoint(self.left.used_share(), self.right.used_share()),
            skew: None,
        };
        self.middles.clear();
        self.middles.extend(self.lines.iter().map(|&line| line.middle()));
        for (tracer, points) in [(&self.left, &mut self.left_px), (&self.right, &mut self.right_px)]
        {
            let places = tracer.edges().iter().zip(&self.middles);
            points
                .extend(places.filter_map(|(edge, &v)| Some(view.to_image(edge.as_ref()?.at, v))));
        }
        let width_px = self.right.middle() - self.left.middle();
        let skew_variance = self.skew_variance();
        let sides = [&self.left, &self.right].map(|tracer| {
            let of_compression = self.variance_of_compression(tracer, hints.contrast_grey);
            // What rows vary by, where that is known, has some of the compression in it.
            let mean_variance =
                tracer.uncertainty.mean_variance.map(|known| known.max(of_compression));
            let of_steps = if mean_variance.is_none() { of_compression } else { 0.0 };
            axis::Side {
                places: tracer.edges(),
                common_variance: tracer.uncertainty.common_variance
                    + tracer.uncertainty.ground_variance
                    + 0.5 * skew_variance
                    + overlap_variance(width_px, tracer.blur_px)
                    + of_steps,
                misfit: tracer.misfit,
                mean_variance,
            }
        });
        let (gauge, middles) = (&self.gauge, self.middles.as_slice());
        let scene = axis::Scene { view, surface, gauge, middles, sides };
        let found = axis::width(&scene, hints, &mut self.axis)?;
        self.check_covered(&found)?;
        Ok(found)
    }
}
