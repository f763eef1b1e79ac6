//! Measurement of one frame: bands, candidates, contours, sub-pixel edges, width.

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
use crate::core::{Frame, ImagePoint};
use checks::{MAX_BLUR_PX, MAX_MOTION_BLUR_PX};
use pattern_limits::MAX_PATTERN_BESIDE_COMPLETE;
use rough_edges::may_be_rough;
use work::{EdgeModel, GaugeFrame, MeasureState, Outcome};

use super::gauge::{Gauge, GaugeView, MeasureMethod};
use super::pixel_noise::PixelNoise;
use super::reject::Reject;
use super::roughness::{CaliperFilter, LocalWidths};
use super::strip::{GaugeRows, GaugeRowsOfDepth, GreyPixel, RowLayout};
use super::trace::EdgeTracer;
use super::width::{Caliper, CaliperPoint, Edges, Hints, WidthMeasurement};
use super::{axis, edge_lines, pool, vectors};
use crate::numeric::number::to_f64;

/// Standard deviation of a width of 4 blurs from the flanks' overlap, in blurs. Measured:
/// reference/accuracy.md, Drawn frames: 2,000 beads of 5 to 600 px (`narrow`) with a blur of 1.5
/// px.
const OVERLAP_SIGMA: f64 = 0.045;
/// Width for which [`OVERLAP_SIGMA`] holds \[blurs\]. By definition.
const OVERLAP_REFERENCE_BLURS: f64 = 4.0;
/// Difference of width over which it falls to 1/e \[blurs\]. Measured: as [`OVERLAP_SIGMA`].
const OVERLAP_DECAY_BLURS: f64 = 3.0;

/// Measures frames of one cell; keeps its buffers from frame to frame.
#[derive(Debug, Clone)]
pub struct Measurer {
    gauge: Gauge,
    white: Option<u16>,
    layout: RowLayout,
    work: MeasureState,
}

impl Measurer {
    /// For a gauge. `white` is the upper end of the camera's scale where it is
    /// not that of the pixels, as with 12 bits in 16.
    pub fn new(gauge: Gauge, white: Option<u16>) -> Self {
        Self { gauge, white, layout: RowLayout::new(gauge.gamma), work: MeasureState::new(gauge) }
    }

    /// The edges behind the last width, for images of them.
    pub fn edges(&self) -> Edges<'_> {
        Edges { left: &self.work.left_px, right: &self.work.right_px }
    }

    /// The edges line by line, with the standard deviation of each position. A refused frame has
    /// the edges that were found before it was refused.
    pub fn calipers(&self) -> impl Iterator<Item = Caliper> {
        let Edges { left, right } = self.edges();
        let (mut left, mut right) = (left.iter().copied(), right.iter().copied());
        let lines = match self.gauge.method {
            MeasureMethod::Caliper => self.work.rows.lines.len(),
            MeasureMethod::EdgeLines => left.len(),
        };
        (0..lines).filter_map(move |number| {
            let left = self.next_edge_point(&self.work.left, number, &mut left);
            let right = self.next_edge_point(&self.work.right, number, &mut right);
            let found = left.is_some() || right.is_some();
            found.then_some(Caliper { number, left, right })
        })
    }

    /// Local widths of the frame that was measured last; `None` where too few caliper lines show
    /// them, or their noise is not known.
    pub fn local_widths(
        &self,
        measured: &WidthMeasurement,
        surface: &SurfaceMap,
    ) -> Option<LocalWidths> {
        let lines = self.work.rows.lines.len();
        let along = GaugeView::new(self.gauge.roi, self.gauge.axis).along;
        let [left, right] = [&self.work.left, &self.work.right].map(|edge| edge.uncertainty);
        let filter = CaliperFilter {
            filter_px: left.along_px.max(right.along_px),
            blur_px: measured.hints.blur_px,
            noise_fractions: [left.lines_fraction, right.lines_fraction],
            line_px: to_f64(along) / to_f64(lines.max(1)),
        };
        LocalWidths::read(self.calipers(), lines, filter, surface)
    }

    /// Adds the skew of the flanks to the hints of the last measured width: a width does not need
    /// it, and only many frames determine it well.
    #[must_use]
    pub fn with_skew(&self, found: WidthMeasurement) -> WidthMeasurement {
        WidthMeasurement { hints: Hints { skew: self.work.skew(), ..found.hints }, ..found }
    }

    /// The next point of an edge, if it belongs to this line.
    fn next_edge_point(
        &self,
        tracer: &EdgeTracer,
        number: usize,
        points: &mut impl Iterator<Item = ImagePoint>,
    ) -> Option<CaliperPoint> {
        if self.gauge.method == MeasureMethod::EdgeLines {
            return Some(CaliperPoint { at: points.next()?, sigma_px: None });
        }
        let located = tracer.edges.get(number).copied().flatten()?;
        Some(CaliperPoint { at: points.next()?, sigma_px: Some(located.variance.sqrt()) })
    }

    /// Measures the bead in a frame on a surface. Refuses a width whose standard
    /// deviation is more than the gauge's `max_sigma` of it.
    pub fn measure(
        &mut self,
        frame: &Frame,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let edges_only = self.measure_image(frame, surface)?;
        let found = edges_only.with_calibration(surface)?;
        found.check_sigma(edges_only.sigma, self.gauge.max_sigma)?;
        Ok(found)
    }

    /// Measures with a sigma from the image alone, without the calibration's uncertainty.
    fn measure_image(&mut self, frame: &Frame, surface: &SurfaceMap) -> Outcome {
        let work = &mut self.work;
        work.left_px.clear();
        work.right_px.clear();
        if !self.gauge.roi.fits(frame.size()) {
            return Err(Reject::WrongSize { image: (frame.width(), frame.height()) });
        }
        check_size((frame.width(), frame.height()), surface)?;
        if self.gauge.method == MeasureMethod::EdgeLines {
            let points = (&mut work.left_px, &mut work.right_px);
            return edge_lines::measure(&self.gauge, frame, surface, points);
        }
        let view = GaugeView::new(self.gauge.roi, self.gauge.axis);
        let strips = self.layout.strips(frame, &view, self.white);
        vectors::widest(
            #[inline(always)]
            || match strips {
                GaugeRowsOfDepth::Bytes(strip) => work.measure(&strip, &view, surface),
                GaugeRowsOfDepth::Words(strip) => work.measure(&strip, &view, surface),
            },
        )
    }
}

/// Variance that the other edge's flank adds to an edge's position \[px²\], for edges at a distance
/// from each other \[px\] and with a blur \[px\]. Measured on 2,000 drawn beads of 5 to 600 px with
/// a blur of 1.5 px.
fn overlap_variance(width_px: f64, blur_px: f64) -> f64 {
    let blurs = width_px / blur_px;
    0.5 * (OVERLAP_SIGMA
        * blur_px
        * libm::exp((OVERLAP_REFERENCE_BLURS - blurs) / OVERLAP_DECAY_BLURS))
    .powi(2)
}

/// Refuses images of another size than those that the calibration was made with.
fn check_size(image: (usize, usize), surface: &SurfaceMap) -> Result<(), Reject> {
    let Some(calibrated) = surface.image_size_px() else { return Ok(()) };
    let same = [image.0, image.1].map(u32::try_from) == calibrated.map(Ok);
    if same { Ok(()) } else { Err(Reject::OtherSize { image, calibrated }) }
}

impl MeasureState {
    #[inline(always)]
    fn measure<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        view: &GaugeView,
        surface: &SurfaceMap,
    ) -> Outcome {
        let range = self.search_range(view, surface)?;
        let frame = &GaugeFrame { strip, view, surface, range };
        self.rows.noise = PixelNoise::read(strip, 0..strip.across);
        self.rows.bands.pool(strip, self.gauge.calipers);
        pool::cut_into_ranges(strip.along, self.gauge.calipers, &mut self.rows.lines);
        self.find_candidates();
        if self.is_busy()
            && let Some(textured) = self.measure_busy(frame)
        {
            return textured;
        }
        match self.measure_steps(frame) {
            Ok(found) => self.refine_measurement(found, frame),
            Err(reject) if may_be_rough(&reject) => {
                self.measure_rough(&reject, frame).map_err(|rough| rough.or(reject))
            }
            Err(reject) => Err(reject),
        }
    }

    /// Measures edges that were found as blurred steps by another model, where that explains more;
    /// otherwise returns what was found.
    fn refine_measurement<T: GreyPixel>(
        &mut self,
        found: WidthMeasurement,
        frame: &GaugeFrame<'_, T>,
    ) -> Outcome {
        let knows_texture = self.left.is_textured() && self.right.is_textured();
        let is_weak =
            self.both.pattern_ratio > 0.0 && self.both.pattern_ratio < MAX_PATTERN_BESIDE_COMPLETE;
        let is_on_texture = knows_texture && is_weak;
        if !is_on_texture && let Some(textured) = self.measure_texture(frame) {
            return textured;
        }
        let found = if self.may_not_be_steps()
            && let Ok(fits) = self.find_rough(frame)
        {
            if self.explains_more(&fits, &found) {
                return self.width_of_rough(&fits, frame);
            }
            self.check_flanks(&fits)?;
            self.with_row_uncertainty(&fits, found)
        } else {
            found
        };
        self.check_lines_in_pattern()?;
        Ok(found)
    }

    /// Measures edges that are blurred steps.
    #[inline(always)]
    fn measure_steps<T: GreyPixel>(&mut self, frame: &GaugeFrame<'_, T>) -> Outcome {
        self.find_contours();
        let pair = self.find_pair(frame.range)?;
        self.trace(frame.strip, pair)?;
        self.reject_outliers(pair.bright)?;
        self.check_contrast()?;
        let is_motion = self.both.blur_shape > 0 && self.both.model != EdgeModel::LineByLine;
        self.check_blur(if is_motion { MAX_MOTION_BLUR_PX } else { MAX_BLUR_PX })?;
        self.check_ground(frame.strip, f64::max)?;
        self.check_boundary(frame.strip.across)?;
        self.width_on_surface(frame.view, frame.surface)
    }

    fn width_on_surface(&mut self, view: &GaugeView, surface: &SurfaceMap) -> Outcome {
        let hints = Hints {
            contrast_grey: f64::midpoint(self.both.contrasts[0], self.both.contrasts[1]),
            blur_px: f64::midpoint(self.left.blur_px, self.right.blur_px),
            noise_grey: self.rows.noise.grey.into(),
            saturated_fraction: self.rows.bands.saturated_fraction(),
            used_fraction: f64::midpoint(self.left.used_fraction(), self.right.used_fraction()),
            skew: None,
        };
        self.rows.middles.clear();
        self.rows.middles.extend(self.rows.lines.iter().map(|&line| line.middle()));
        let middles = self.rows.middles.as_slice();
        for (tracer, out) in [(&self.left, &mut self.left_px), (&self.right, &mut self.right_px)] {
            let edges = tracer.edges.iter().zip(middles);
            out.extend(edges.filter_map(|(edge, &v)| Some(view.to_image(edge.as_ref()?.at, v))));
        }
        let width_px = self.right.middle() - self.left.middle();
        let skew_variance = self.skew_variance();
        let sides = [&self.left, &self.right].map(|tracer| {
            let of_compression = self.variance_of_compression(tracer, hints.contrast_grey);
            // The variance that rows show, where it is known, includes some of the compression's.
            let mean_variance =
                tracer.uncertainty.mean_variance.map(|known| known.max(of_compression));
            let of_steps = if mean_variance.is_none() { of_compression } else { 0.0 };
            axis::LocatedEdge {
                positions: &tracer.edges,
                common_variance: tracer.uncertainty.common_variance
                    + tracer.uncertainty.ground_variance
                    + 0.5 * skew_variance
                    + overlap_variance(width_px, tracer.blur_px)
                    + of_steps,
                misfit: tracer.misfit,
                mean_variance,
            }
        });
        let gauge = &self.gauge;
        let scene = axis::WidthInput { view, surface, gauge, middles, sides };
        let found = axis::width(&scene, hints, &mut self.scratch.axis)?;
        self.check_occlusion(&found)?;
        Ok(found)
    }
}
