//! A bead, or the ground beside it, that passes the upper end of the camera's
//! scale.

use super::pixel_noise;
use super::reject::{Checked, Reject};
use super::strip::GreyPixel;
use super::trace::{EdgeTracer, TraceInput};
use crate::numeric::number::to_count;

/// Fraction of a step that must lie below the end of the scale.
const MIN_VISIBLE_FRACTION: f64 = 0.4;
/// Largest uncertainty about an edge's position that a hidden level may leave \[px\].
const MAX_CLIPPED_SIGMA_PX: f64 = 0.2;
/// Ground on either side of the bead from which the noise is estimated \[px\].
const NOISE_COLUMNS_PX: f32 = 24.0;
/// Its distance from the edges \[px\].
const NOISE_MARGIN_PX: f32 = 6.0;

/// A bead of which an edge is clipped.
#[derive(Debug, Clone, Copy)]
pub struct SaturatedBead<'a, T> {
    /// Input for the left and the right edge.
    pub scenes: [TraceInput<'a, T>; 2],
    /// Rough positions of the left edge, band by band \[px\].
    pub lefts: &'a [Option<f32>],
    /// Those of the right edge.
    pub rights: &'a [Option<f32>],
}

impl<T: GreyPixel> SaturatedBead<'_, T> {
    /// Traces both edges; `cut_off` says for each whether the levels before and after it are
    /// clipped. Returns the noise of a pixel \[grey levels\].
    #[cold]
    pub fn trace(
        &self,
        tracers: [&mut EdgeTracer; 2],
        cut_off: [[bool; 2]; 2],
    ) -> Result<f32, Reject> {
        let [[_, left_inside], [right_inside, _]] = cut_off;
        let noise = self.visible_noise(left_inside || right_inside);
        for ((tracer, scene), cut_off) in tracers.into_iter().zip(self.scenes).zip(cut_off) {
            let scene = TraceInput { noise, ..scene };
            match cut_off {
                [true, true] => return Err(too_much_clipped(0.0)),
                [false, false] => trace_plainly(tracer, &scene)?,
                [_, hidden_after] => trace_clipped(tracer, &scene, hidden_after)?,
            }
        }
        Ok(noise)
    }

    /// Noise of the side that can be seen: of the bead, or of the ground beside
    /// it. What is clipped has less.
    fn visible_noise(&self, bead_is_hidden: bool) -> f32 {
        let strip = self.scenes[0].strip;
        let ((left, left_end), (right, right_end)) = (span(self.lefts), span(self.rights));
        let beside = NOISE_MARGIN_PX + NOISE_COLUMNS_PX;
        let ranges = if bead_is_hidden {
            [
                [left - beside, left - NOISE_MARGIN_PX],
                [right_end + NOISE_MARGIN_PX, right_end + beside],
            ]
        } else {
            [[left_end + NOISE_MARGIN_PX, right - NOISE_MARGIN_PX]; 2]
        };
        let (mut square, mut n) = (0.0, 0.0);
        for columns in ranges.map(|range| range.map(|at: f32| to_count(at.into()))) {
            let columns = columns[0]..columns[1].min(strip.across);
            if !columns.is_empty() {
                square += pixel_noise::of(strip, columns).powi(2);
                n += 1.0;
            }
        }
        if n > 0.0 { (square / n).sqrt() } else { self.scenes[0].noise }
    }
}

fn trace_clipped<T: GreyPixel>(
    tracer: &mut EdgeTracer,
    scene: &TraceInput<'_, T>,
    hidden_after: bool,
) -> Checked {
    let found = tracer.trace_clipped(scene, hidden_after).ok_or(too_much_clipped(0.0))?;
    if found.visible_fraction < MIN_VISIBLE_FRACTION || found.variance.sqrt() > MAX_CLIPPED_SIGMA_PX
    {
        return Err(too_much_clipped(found.visible_fraction));
    }
    Ok(())
}

/// An edge both sides of which can be seen.
fn trace_plainly<T: GreyPixel>(tracer: &mut EdgeTracer, scene: &TraceInput<'_, T>) -> Checked {
    if let Some(fit) = tracer.step_fit {
        tracer.trace(scene, fit.blur());
    }
    if tracer.is_located() { Ok(()) } else { Err(Reject::NoPair { got: 0.0, need: 1.0 }) }
}

fn too_much_clipped(visible: f64) -> Reject {
    Reject::Blinded { visible, need: MIN_VISIBLE_FRACTION }
}

/// Lowest and highest of an edge's positions.
fn span(positions: &[Option<f32>]) -> (f32, f32) {
    let none = (f32::INFINITY, 0.0);
    positions.iter().flatten().fold(none, |(low, high), &at| (low.min(at), f32::max(high, at)))
}
