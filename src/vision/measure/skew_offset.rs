//! Offset of a width by the skew of both edges' flanks.

use super::work::{EdgeModel, MeasureState};
use crate::vision::trace::EdgeTracer;
use crate::vision::width::WidthSkew;

/// Skew, in its standard deviations, from which on it is significant. Derived: noise alone exceeds
/// 4 in 6 of 100,000 frames; from 3 on, one clean frame in 1,500 had as much.
const MIN_SKEW_SIGMAS: f64 = 4.0;

impl MeasureState {
    /// How far the skew of both flanks moves the width; `None` where the edges are not
    /// located as blurred steps.
    pub fn skew(&self) -> Option<WidthSkew> {
        if self.both.model != EdgeModel::Steps {
            return None;
        }
        let table = self.blur_shapes.table(self.both.blur_shape);
        let (left, right) = (self.left.skew(table)?, self.right.skew(table)?);
        Some(WidthSkew {
            offset_px: left.aside_px - right.aside_px,
            variance: left.variance + right.variance,
        })
    }

    /// Variance that a skew adds to the width where the frame shows it \[px²\].
    pub fn skew_variance(&self) -> f64 {
        let is_strange = |edge: &EdgeTracer| edge.step_fit.is_some_and(|fit| fit.is_not_step());
        if !is_strange(&self.left) && !is_strange(&self.right) {
            return 0.0;
        }
        let square = |skew: &WidthSkew| skew.offset_px * skew.offset_px;
        let least = |skew: &WidthSkew| MIN_SKEW_SIGMAS * MIN_SKEW_SIGMAS * skew.variance;
        self.skew().filter(|skew| square(skew) > least(skew)).as_ref().map_or(0.0, square)
    }
}
