//! What a measurement works on, kept from frame to frame.

use crate::core::geometry::ImagePoint;
use crate::vision::axis;
use crate::vision::coarse::{Coarse, LinePair};
use crate::vision::contour::Contours;
use crate::vision::edge::Candidates;
use crate::vision::gauge::Gauge;
use crate::vision::ground::{Ground, Place};
use crate::vision::mean_edge::MeanEdge;
use crate::vision::motion::BlurShapes;
use crate::vision::parallel::Parallel;
use crate::vision::pixel_noise::PixelNoise;
use crate::vision::pool::Bands;
use crate::vision::rough::RoughEdge;
use crate::vision::row_range::RowRange;
use crate::vision::trace::Tracer;

/// Share of the caliper lines that must show each of the two edges.
pub(super) const NEED_SHARE: f64 = 0.6;
/// Least deviation from its neighbours that makes a caliper an outlier \[px\].
pub(super) const OFF_PX: f64 = 0.3;

/// How edges were located.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// As blurred steps, all rows together.
    Steps,
    /// From what is seen below the end of the scale.
    CutOff,
    /// Line by line.
    Lines,
}

/// What a measurement works on.
#[derive(Debug, Clone)]
pub(super) struct Work {
    pub(super) gauge: Gauge,
    pub(super) blur_shapes: BlurShapes,
    pub(super) bands: Bands,
    pub(super) lines: Vec<RowRange>,
    pub(super) noise: PixelNoise,
    /// Scale across the gauge's middle.
    pub(super) mm_per_px: f64,
    pub(super) width_px: f32,
    pub(super) memory: Vec<f32>,
    pub(super) response: Vec<i16>,
    pub(super) candidates: Vec<Candidates>,
    pub(super) ups: Contours,
    pub(super) downs: Contours,
    pub(super) parallel: Parallel,
    pub(super) coarse: Coarse,
    pub(super) pairs: Vec<LinePair>,
    pub(super) rough: [RoughEdge; 2],
    pub(super) mean_edges: [MeanEdge; 2],
    pub(super) left: Tracer,
    pub(super) right: Tracer,
    pub(super) least_off_px: f64,
    pub(super) is_lost: bool,
    pub(super) way: Way,
    /// Whether a narrow groove may lie beside an edge.
    pub(super) is_beside_groove: bool,
    /// Standard deviation of the pattern that the ground has on both sides, as a
    /// fraction of the contrast; 0 where one side has none.
    pub(super) pattern_share: f64,
    pub(super) contrasts: [f64; 2],
    pub(super) scatter: Vec<f64>,
    pub(super) middles: Vec<f64>,
    pub(super) places: Vec<Place>,
    pub(super) ground: Ground,
    pub(super) axis: axis::Memory,
    pub(super) left_px: Vec<ImagePoint>,
    pub(super) right_px: Vec<ImagePoint>,
}

impl Work {
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
            memory: Vec::new(),
            response: Vec::new(),
            candidates: Vec::new(),
            ups: Contours::default(),
            downs: Contours::default(),
            parallel: Parallel::default(),
            coarse: Coarse::default(),
            pairs: Vec::new(),
            rough: Default::default(),
            mean_edges: Default::default(),
            left: Tracer::default(),
            right: Tracer::default(),
            least_off_px: OFF_PX,
            is_lost: false,
            way: Way::Steps,
            is_beside_groove: false,
            pattern_share: 0.0,
            contrasts: [0.0; 2],
            scatter: Vec::new(),
            middles: Vec::new(),
            places: Vec::new(),
            ground: Ground::default(),
            axis: axis::Memory::default(),
            left_px: Vec::new(),
            right_px: Vec::new(),
        }
    }
}
