//! Positions of an edge, band by band, from the rows that count.

use nalgebra::{Matrix3, Vector3};

use super::{EdgeTracer, MAX_PATH_ERROR_BLURS, TraceInput};
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::numeric::rank;
use crate::vision::located::CaliperEdge;
use crate::vision::scatter::MIN_EXCESS_SIGMAS;
use crate::vision::strip::GreyPixel;

/// Smallest fraction of its rows with which a band counts.
const MIN_ROW_FRACTION: f64 = 0.5;
/// Smallest fraction of its rows with which a band counts where rows are known to be clear.
const MIN_CLEAR_ROW_FRACTION: f64 = 0.2;

impl EdgeTracer {
    /// Solves every band; returns whether the path was near enough for that.
    #[inline(always)]
    pub fn locate<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, blur: f64) -> bool {
        let variance = match self.textured.scatter {
            Some(scatter) => scatter.of_mean * self.texture_variance_ratio(),
            None => f64::from(scene.noise).powi(2),
        };
        let core = self.row_fit.template.products.matrix();
        let extra = [0, 1].map(|side| self.extra_variance(core, variance, side));
        let plain = self.row_fit.template.plain_pixels();
        let min_fraction =
            if self.occlusion.clear.is_empty() { MIN_ROW_FRACTION } else { MIN_CLEAR_ROW_FRACTION };
        self.edges.clear();
        let textured = self.textured.texture.is_some();
        let mut off: f64 = 0.0;
        for (band, sums) in self.row_fit.solved.iter().enumerate() {
            let located =
                sums.solve(core, variance, extra, plain, min_fraction).map(|(moved, located)| {
                    let bent = if textured { 0.0 } else { moved / blur };
                    let moved = moved * (1.0 + bent * bent / 12.0);
                    off = off.max(moved.abs());
                    let [path, _, _] = self.course.at(narrow_to_f32(scene.lines[band].middle()));
                    CaliperEdge { at: f64::from(path) + moved, ..located }
                });
            self.edges.push(located);
        }
        if off <= MAX_PATH_ERROR_BLURS * blur {
            return true;
        }
        self.redraw(scene);
        false
    }

    /// Ratio of the texture's variance to that of the texture that was fitted: a compression's
    /// correlations change sign, unlike those of any texture, so that rows differ less than the fit
    /// predicts. The mean over the rows does by half as much: rendered JPEGs of qualities of 65 to
    /// 90 have a z of 0.9 to 1.0 then.
    fn texture_variance_ratio(&self) -> f64 {
        f64::midpoint(1.0, self.misfit.powi(2).min(1.0))
    }

    /// Variance of the level at the edge about that of the surroundings, from band to band, beyond
    /// what noise explains: texture adds it, and then the surroundings show less of the level at
    /// the edge. Robust, from the median.
    #[inline(always)]
    fn extra_variance(&mut self, core: Matrix3<f64>, variance: f64, side: usize) -> f64 {
        let Some(inverse) = core.try_inverse() else { return 0.0 };
        let level = inverse.row(side + 1).transpose();
        self.scratch.scatter.clear();
        let mut explained = 0.0;
        for sums in &self.row_fit.solved {
            let [count, sum] = sums.plain[side];
            if sums.rows < 1.0 || count < 1.0 {
                continue;
            }
            let (per_row, per_pixel) = (1.0 / sums.rows, 1.0 / count);
            let at_edge = level.dot(&Vector3::from(sums.vector)) * per_row;
            let off = at_edge - sum * per_pixel;
            let expected = variance * (level[side + 1] * per_row + per_pixel);
            explained += expected;
            self.scratch.scatter.push(off * off / expected);
        }
        if self.scratch.scatter.len() < 6 {
            return 0.0;
        }
        let bands = to_f64(self.scratch.scatter.len());
        let ratio =
            rank::median(&mut self.scratch.scatter).unwrap_or(0.0) / rank::MEDIAN_OF_SQUARED_NORMAL;
        let ratio_sigma = 2.3 / bands.sqrt();
        if ratio < 1.0 + MIN_EXCESS_SIGMAS * ratio_sigma {
            0.0
        } else {
            (ratio - 1.0) * explained / bands
        }
    }
}
