//! What a measurement works on, kept from frame to frame.

use crate::core::geometry::ImagePoint;
use crate::vision::axis;
use crate::vision::coarse::{LinePair, LineSearch};
use crate::vision::contour::EdgeContours;
use crate::vision::edge::StepCandidates;
use crate::vision::gauge::Gauge;
use crate::vision::ground::{EdgePosition, PatternSearch};
use crate::vision::mean_edge::MeanEdge;
use crate::vision::motion::BlurShapes;
use crate::vision::parallel::ParallelEdges;
use crate::vision::pixel_noise::PixelNoise;
use crate::vision::pool::Bands;
use crate::vision::rough::RoughEdge;
use crate::vision::row_range::RowRange;
use crate::vision::trace::EdgeTracer;

/// Share of the caliper lines that must show each of the two edges.
pub(super) const MIN_LINE_FRACTION: f64 = 0.6;
/// Least deviation from its neighbours that makes a caliper an outlier \[px\].
pub(super) const MIN_OUTLIER_PX: f64 = 0.3;

/// How edges were located.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EdgeModel {
    /// As blurred steps, all rows together.
    Steps,
    /// From what is seen below the end of the scale.
    Clipped,
    /// Line by line.
    LineByLine,
}

/// What a measurement works on.
#[derive(Debug, Clone)]
pub(super) struct MeasureState {
    pub(super) gauge: Gauge,
    pub(super) blur_shapes: BlurShapes,
    pub(super) bands: Bands,
    pub(super) lines: Vec<RowRange>,
    pub(super) noise: PixelNoise,
    /// Scale across the gauge's middle.
    pub(super) mm_per_px: f64,
    pub(super) width_px: f32,
    pub(super) scratch: Vec<f32>,
    pub(super) response: Vec<i16>,
    pub(super) candidates: Vec<StepCandidates>,
    pub(super) ups: EdgeContours,
    pub(super) downs: EdgeContours,
    pub(super) parallel: ParallelEdges,
    pub(super) coarse: LineSearch,
    pub(super) pairs: Vec<LinePair>,
    pub(super) rough: [RoughEdge; 2],
    pub(super) mean_edges: [MeanEdge; 2],
    pub(super) left: EdgeTracer,
    pub(super) right: EdgeTracer,
    pub(super) min_outlier_px: f64,
    pub(super) is_lost: bool,
    pub(super) edge_model: EdgeModel,
    /// Whether a narrow groove may lie beside an edge.
    pub(super) is_beside_groove: bool,
    /// Standard deviation of the pattern that the ground has on both sides, as a
    /// fraction of the contrast; 0 where one side has none.
    pub(super) pattern_ratio: f64,
    pub(super) contrasts: [f64; 2],
    pub(super) scratch_f64: Vec<f64>,
    pub(super) middles: Vec<f64>,
    pub(super) positions: Vec<EdgePosition>,
    pub(super) ground: PatternSearch,
    pub(super) axis: axis::WidthScratch,
    pub(super) left_px: Vec<ImagePoint>,
    pub(super) right_px: Vec<ImagePoint>,
}

impl MeasureState {
    /// For a gauge.
    pub(super) fn new(gauge: Gauge) -> Self {
        Self {
            gauge,
            blur_shapes: BlurShapes::default(),
            bands: Bands::default(),
            lines: Vec::new(),
            noise: PixelNoise::default(),
            mm_per_px: 0.0,
            width_px: 0.0,
            scratch: Vec::new(),
            response: Vec::new(),
            candidates: Vec::new(),
            ups: EdgeContours::default(),
            downs: EdgeContours::default(),
            parallel: ParallelEdges::default(),
            coarse: LineSearch::default(),
            pairs: Vec::new(),
            rough: Default::default(),
            mean_edges: Default::default(),
            left: EdgeTracer::default(),
            right: EdgeTracer::default(),
            min_outlier_px: MIN_OUTLIER_PX,
            is_lost: false,
            edge_model: EdgeModel::Steps,
            is_beside_groove: false,
            pattern_ratio: 0.0,
            contrasts: [0.0; 2],
            scratch_f64: Vec::new(),
            middles: Vec::new(),
            positions: Vec::new(),
            ground: PatternSearch::default(),
            axis: axis::WidthScratch::default(),
            left_px: Vec::new(),
            right_px: Vec::new(),
        }
    }
}
