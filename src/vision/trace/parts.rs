//! The parts of a tracer's state.

use super::band_sums::BandSums;
use super::group::RowGroup;
use crate::vision::path;
use crate::vision::template::textured::TexturePositionVariance;
use crate::vision::template::{PlainSums, StepTemplate};
use crate::vision::texture::SurfaceTexture;
use crate::vision::whiten::NoiseWhitener;

/// What is known of an edge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum EdgeState {
    /// Nothing yet.
    #[default]
    NotFound,
    /// Nothing occludes it, as far as it shows.
    Clear,
    /// It is occluded in part, and located from its clear rows alone.
    Occluded,
    /// It seems to be occluded, but no clear rows were found: it is located as if nothing occluded
    /// it.
    Unresolved,
}

/// What is known of an edge band by band.
#[derive(Debug, Clone, Default)]
pub(super) struct BandValues {
    /// Positions that were picked \[px\]; NaN where there is none.
    pub(super) picked: Vec<f32>,
    /// Positions of the path \[px\].
    pub(super) path: Vec<f32>,
    /// Level before the edge \[grey levels\].
    pub(super) before: Vec<f32>,
    /// Step to the level after it \[grey levels\].
    pub(super) step: Vec<f32>,
}

/// Whether an edge winds between bands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WindingState {
    /// Whether the course was picked from line to line.
    pub(super) is_followed: bool,
    /// Distance of bands from the line between their neighbours, relative to that from which on an
    /// edge winds; more than 1 where it does.
    pub(super) excess: f32,
}

/// The texture beside an edge, and weights for it.
#[derive(Debug, Clone, Default)]
pub(super) struct TexturedFit {
    pub(super) texture: Option<SurfaceTexture>,
    pub(super) whitener: NoiseWhitener,
    /// Variance of positions with these weights.
    pub(super) scatter: Option<TexturePositionVariance>,
}

/// Rows compared with the edge.
#[derive(Debug, Clone, Default)]
pub(super) struct RowFit {
    pub(super) template: StepTemplate,
    /// Rows that were compared together.
    pub(super) groups: Vec<RowGroup>,
    /// Plain pixels of each band.
    pub(super) plain: Vec<PlainSums>,
    /// Sums over the rows of each band.
    pub(super) solved: Vec<BandSums>,
}

/// Which rows of an edge that is occluded in part show it.
#[derive(Debug, Clone, Default)]
pub(super) struct Occlusion {
    /// Rough positions that may still join a consensus, and those of the best course so far.
    pub(super) free: Vec<f32>,
    pub(super) best_free: Vec<f32>,
    /// Bands of the consensus.
    pub(super) trusted: Vec<bool>,
    /// For each group, whether it shows the edge and nothing else; empty where rows are not judged.
    pub(super) clear: Vec<bool>,
    /// Whether rows are judged in this way, each by itself.
    pub(super) sort_rows: bool,
}

/// Buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct TraceScratch {
    /// Rough values, one a band or a line.
    pub(super) rough: Vec<f32>,
    pub(super) sorted: Vec<f32>,
    /// For a course that is drawn again.
    pub(super) course: Vec<[f32; 3]>,
    pub(super) scatter: Vec<f64>,
}

impl TraceScratch {
    /// Fills the gaps of rough values and smooths them.
    pub(super) fn fill_rough(&mut self) {
        let values = self.rough.iter().map(|value| value.is_finite().then_some(*value));
        path::fill(values, &mut self.sorted);
        path::smooth(&self.sorted, &mut self.rough);
    }
}

/// Uncertainty of an edge's positions beyond the variance of each.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EdgeUncertainty {
    /// Variance of the error that all positions share, from shading that is not known better
    /// \[px²\].
    pub common_variance: f64,
    /// Variance of the mean position, where it is known apart from that of the
    /// positions \[px²\].
    pub mean_variance: Option<f64>,
    /// Variance of the whole edge's position from the pattern beside the bead \[px²\].
    pub ground_variance: f64,
    /// Standard deviation of the smoothing along the bead that positions have passed,
    /// beside the mean over a line's rows \[px\].
    pub along_px: f64,
    /// Fraction of the positions' variance that differs from position to position; the rest moves
    /// the whole edge.
    pub lines_fraction: f64,
}
