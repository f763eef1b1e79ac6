//! The state of a measurement. Its buffers are kept from frame to frame.

use crate::calibration::SurfaceMap;
use crate::core::ImagePoint;
use crate::vision::axis;
use crate::vision::coarse::{LinePair, LineSearch};
use crate::vision::contour::EdgeContours;
use crate::vision::edge::StepCandidates;
use crate::vision::gauge::{Gauge, GaugeView, WidthRangePx};
use crate::vision::ground::{EdgePosition, PatternSearch};
use crate::vision::mean_edge::MeanEdge;
use crate::vision::motion::BlurShapes;
use crate::vision::parallel::ParallelEdges;
use crate::vision::pixel_noise::PixelNoise;
use crate::vision::pool::Bands;
use crate::vision::reject::Reject;
use crate::vision::rough::RoughEdge;
use crate::vision::row_range::RowRange;
use crate::vision::strip::GaugeRows;
use crate::vision::trace::EdgeTracer;
use crate::vision::width::WidthMeasurement;

/// Fraction of the caliper lines that must show each of the two edges.
pub(super) const MIN_LINE_FRACTION: f64 = 0.6;
/// Smallest deviation from its neighbours that makes a caliper an outlier \[px\].
pub(super) const MIN_OUTLIER_PX: f64 = 0.3;

/// A width, or why there is none.
pub(super) type Outcome = Result<WidthMeasurement, Reject>;

/// The gauge in one frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct GaugeFrame<'a, T> {
    pub(super) strip: &'a GaugeRows<'a, T>,
    pub(super) view: &'a GaugeView,
    pub(super) surface: &'a SurfaceMap,
    /// Widths that are searched.
    pub(super) range: WidthRangePx,
}

/// How edges were located.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum EdgeModel {
    /// As blurred steps, all rows together.
    #[default]
    Steps,
    /// From the part of the flank below the end of the scale.
    Clipped,
    /// Line by line.
    LineByLine,
}

/// The gauge's rows, pooled and cut.
#[derive(Debug, Clone, Default)]
pub(super) struct GaugeSampling {
    pub(super) bands: Bands,
    /// Rows of the caliper lines, and their middles \[px\].
    pub(super) lines: Vec<RowRange>,
    pub(super) middles: Vec<f64>,
    pub(super) noise: PixelNoise,
}

/// The search for the bead.
#[derive(Debug, Clone, Default)]
pub(super) struct BeadSearch {
    pub(super) response: Vec<i16>,
    pub(super) candidates: Vec<StepCandidates>,
    pub(super) ups: EdgeContours,
    pub(super) downs: EdgeContours,
    pub(super) coarse: LineSearch,
    pub(super) pairs: Vec<LinePair>,
}

/// What is known of the two edges together.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EdgeEvidence {
    pub(super) min_outlier_px: f64,
    pub(super) is_lost: bool,
    pub(super) model: EdgeModel,
    /// Number of the blur's shape.
    pub(super) blur_shape: usize,
    /// Whether a narrow groove may lie beside an edge.
    pub(super) is_beside_groove: bool,
    /// Standard deviation of the pattern that the ground has on both sides, as a
    /// fraction of the contrast; 0 where one side has none.
    pub(super) pattern_ratio: f64,
    pub(super) contrasts: [f64; 2],
}

/// Buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct MeasureScratch {
    pub(super) narrow: Vec<f32>,
    pub(super) wide: Vec<f64>,
    pub(super) positions: Vec<EdgePosition>,
    pub(super) ground: PatternSearch,
    pub(super) parallel: ParallelEdges,
    pub(super) axis: axis::WidthScratch,
}

/// The state of a measurement.
#[derive(Debug, Clone)]
pub(super) struct MeasureState {
    pub(super) gauge: Gauge,
    pub(super) blur_shapes: BlurShapes,
    pub(super) rows: GaugeSampling,
    /// Scale across the gauge's middle.
    pub(super) mm_per_px: f64,
    pub(super) width_px: f32,
    pub(super) search: BeadSearch,
    pub(super) left: EdgeTracer,
    pub(super) right: EdgeTracer,
    pub(super) rough: [RoughEdge; 2],
    pub(super) mean_edges: [MeanEdge; 2],
    pub(super) both: EdgeEvidence,
    pub(super) scratch: MeasureScratch,
    pub(super) left_px: Vec<ImagePoint>,
    pub(super) right_px: Vec<ImagePoint>,
}

impl MeasureState {
    /// For a gauge.
    pub fn new(gauge: Gauge) -> Self {
        Self {
            gauge,
            blur_shapes: BlurShapes::default(),
            rows: GaugeSampling::default(),
            mm_per_px: 0.0,
            width_px: 0.0,
            search: BeadSearch::default(),
            left: EdgeTracer::default(),
            right: EdgeTracer::default(),
            rough: Default::default(),
            mean_edges: Default::default(),
            both: EdgeEvidence::default(),
            scratch: MeasureScratch::default(),
            left_px: Vec::new(),
            right_px: Vec::new(),
        }
    }
}
