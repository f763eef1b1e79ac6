//! A bead whose edges are occluded so far that one edge alone does not show which of its rows are
//! clear.

use super::blur_estimate::BlurEstimate;
use super::edge::{StepCandidate, StepCandidates};
use super::parallel::ParallelEdges;
use super::strip::GreyPixel;
use super::trace::{EdgeTracer, TraceInput};

/// By how much the distance of two steps may differ from that of the rough
/// edges \[px\].
const WIDTH_TOLERANCE_PX: f32 = 40.0;

/// Smallest distance of two steps, as a fraction of that of the rough edges.
const MIN_WIDTH_RATIO: f32 = 0.3;

/// A bead of which an edge is hidden.
#[derive(Debug, Clone, Copy)]
pub struct OccludedBead<'a, T> {
    /// Input for the left and the right edge.
    pub scenes: [TraceInput<'a, T>; 2],
    /// Candidates of each band.
    pub candidates: &'a [StepCandidates],
    /// Whether the bead is brighter than what lies beside it.
    pub bright: bool,
}

impl<T: GreyPixel> OccludedBead<'_, T> {
    /// Locates the hidden one of two edges, or both, along steps that run beside
    /// each other, where there are any.
    #[cold]
    pub fn locate_from_clear_rows(
        &self,
        [left, right]: [&mut EdgeTracer; 2],
        blur: BlurEstimate,
        parallel: &mut ParallelEdges,
    ) {
        let [left_scene, right_scene] = &self.scenes;
        let width = left_scene.width_px;
        let range = f32::max(width - WIDTH_TOLERANCE_PX, MIN_WIDTH_RATIO * width)
            ..width + WIDTH_TOLERANCE_PX;
        let bands = self.candidates.len();
        let lefts = |band| self.candidate_positions(band, left, left_scene, self.bright);
        let rights = |band| self.candidate_positions(band, right, right_scene, !self.bright);
        if !parallel.find(bands, lefts, rights, range) {
            return;
        }
        if left.is_lost() {
            left.locate_occluded_along(left_scene, blur, &parallel.lefts);
        }
        if right.is_lost() {
            right.locate_occluded_along(right_scene, blur, &parallel.rights);
        }
    }

    /// Positions where an edge may lie in a band \[px\]: where it was located, or any step of its
    /// sign.
    fn candidate_positions(
        &self,
        band: usize,
        tracer: &EdgeTracer,
        scene: &TraceInput<'_, T>,
        up: bool,
    ) -> impl Iterator<Item = f32> {
        let candidates = &self.candidates[band];
        let steps: &[StepCandidate] = match (tracer.is_clear(), up) {
            (true, _) => &[],
            (false, true) => candidates.up(),
            (false, false) => candidates.down(),
        };
        let known = tracer.is_clear().then(|| tracer.expected_at(scene.bands.middle(band)));
        known.into_iter().chain(steps.iter().map(|step| step.at))
    }
}
