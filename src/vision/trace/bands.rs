//! Places of an edge, band by band, from the rows that count.

use nalgebra::{Matrix3, Vector3};

use super::rows::Group;
use super::{Located, NEAR_ENOUGH, Scene, Tracer};
use crate::numeric::number::{float, narrow};
use crate::numeric::rank;
use crate::vision::pool;
use crate::vision::strip::Grey;

/// Share of the plain pixels that must be as they are expected for their level
/// to be believed.
const LEAST_PLAIN: f64 = 0.6;
/// Share of its rows that a band must have left to count.
const LEAST_SHARE: f64 = 0.5;
/// The same where rows are known to be clear, one by one.
const LEAST_CLEAR_SHARE: f64 = 0.2;
/// Extra deviation of levels that is believed, in standard deviations of its
/// own doubt.
const BELIEVED: f64 = 2.5;

/// Sums over the rows of a band that count.
#[derive(Debug, Clone, Copy, Default)]
pub struct BandSums {
    /// Rows that count, rows of the band, and rows that were held.
    pub rows: f64,
    pub all_rows: f64,
    pub held_rows: f64,
    /// Step that the rows were held against \[grey levels\].
    pub step: f64,
    /// Right-hand side of the equations for place and levels.
    pub vector: [f64; 3],
    /// Plain pixels before the edge and the sum of what they miss.
    pub before: (f64, f64),
    /// The same after it.
    pub after: (f64, f64),
}

impl Tracer {
    /// Solves every band; returns whether the path was near enough for that.
    #[inline(always)]
    pub(super) fn locate<T: Grey>(&mut self, scene: &Scene<'_, T>, blur: f64) -> bool {
        let variance = match self.scatter_in_texture {
            Some(scatter) => scatter.of_mean * self.left_of_texture(),
            None => f64::from(scene.noise).powi(2),
        };
        let core = self.template.products.matrix();
        let extra = [0, 1].map(|side| self.extra_variance(core, variance, side));
        let plain = self.template.plain_pixels();
        let least_share = if self.clear.is_empty() { LEAST_SHARE } else { LEAST_CLEAR_SHARE };
        self.edges.clear();
        let textured = self.texture.is_some();
        let mut off: f64 = 0.0;
        for (band, sums) in self.solved.iter().enumerate() {
            let located =
                sums.solve(core, variance, extra, plain, least_share).map(|(moved, located)| {
                    let bent = if textured { 0.0 } else { moved / blur };
                    let moved = moved * (1.0 + bent * bent / 12.0);
                    off = off.max(moved.abs());
                    let [path, _, _] = self.course.at(narrow(pool::middle(scene.lines[band])));
                    Located { at: f64::from(path) + moved, ..located }
                });
            self.edges.push(located);
        }
        if off <= NEAR_ENOUGH * blur {
            return true;
        }
        self.redraw(scene);
        false
    }

    /// How much of the texture's variance there is, in that of the texture that was fitted: a
    /// compression's correlations change sign and no texture has them, so that rows differ less
    /// than it says. The mean over the rows does by half as much: rendered JPEGs of qualities of
    /// 65 to 90 have a z of 0.9 to 1.0 then.
    fn left_of_texture(&self) -> f64 {
        f64::midpoint(1.0, self.misfit.powi(2).min(1.0))
    }

    /// How much the level at the edge differs from that of the surroundings
    /// from band to band beyond what noise explains: texture does that, and
    /// then the surroundings say less. Robust, from the median.
    #[inline(always)]
    fn extra_variance(&mut self, core: Matrix3<f64>, variance: f64, side: usize) -> f64 {
        let Some(inverse) = core.try_inverse() else { return 0.0 };
        let level = inverse.row(side + 1).transpose();
        self.scatter.clear();
        let mut explained = 0.0;
        for sums in &self.solved {
            let (count, sum) = if side == 0 { sums.before } else { sums.after };
            if sums.rows < 1.0 || count < 1.0 {
                continue;
            }
            let (per_row, per_pixel) = (1.0 / sums.rows, 1.0 / count);
            let at_edge = level.dot(&Vector3::from(sums.vector)) * per_row;
            let off = at_edge - sum * per_pixel;
            let expected = variance * (level[side + 1] * per_row + per_pixel);
            explained += expected;
            self.scatter.push(off * off / expected);
        }
        if self.scatter.len() < 6 {
            return 0.0;
        }
        let bands = float(self.scatter.len());
        // 0.455 is the median of the square of a standard normal number.
        let ratio = rank::median(&mut self.scatter).unwrap_or(0.0) / 0.455;
        let doubt = 2.3 / bands.sqrt();
        if ratio < 1.0 + BELIEVED * doubt { 0.0 } else { (ratio - 1.0) * explained / bands }
    }
}

impl BandSums {
    /// Adds rows that count.
    pub fn add(&mut self, group: &Group, core: &Matrix3<f64>) {
        let (sums, weight) = (&group.sums, f64::from(group.weight));
        self.rows += weight;
        // The unknown is the step times the distance from the path.
        let ahead = self.step * f64::from(group.ahead);
        self.vector[0] += weight * (core[(0, 0)] * ahead - f64::from(sums.slope));
        self.vector[1] += weight * (core[(1, 0)] * ahead + f64::from(sums.before));
        self.vector[2] += weight * (core[(2, 0)] * ahead + f64::from(sums.after));
    }

    /// Place relative to the path and what is known of it; `None` without a
    /// row or an edge.
    #[inline(always)]
    fn solve(
        &self,
        core: Matrix3<f64>,
        variance: f64,
        extra: [f64; 2],
        plain: [f64; 2],
        least_share: f64,
    ) -> Option<(f64, Located)> {
        if self.rows < least_share * self.all_rows || self.rows < 1.0 {
            return None;
        }
        let mut matrix = core * self.rows;
        let mut vector = Vector3::from(self.vector);
        for (side, (count, sum)) in [self.before, self.after].into_iter().enumerate() {
            if count >= LEAST_PLAIN * plain[side] * self.held_rows {
                let weight = 1.0 / (1.0 / count + extra[side] / variance);
                matrix[(side + 1, side + 1)] += weight;
                vector[side + 1] += weight * sum / count;
            }
        }
        let (found, variance_of_place) = solve(&matrix, &vector)?;
        let height = self.step + found[2] - found[1];
        let variance = variance * variance_of_place / (self.step * self.step);
        let share = self.rows / self.all_rows;
        Some((found[0] / self.step, Located { at: 0.0, variance, height, share }))
    }
}

/// Solves symmetric equations for place and levels, the levels first; the
/// variance is that of the place.
fn solve(matrix: &Matrix3<f64>, vector: &Vector3<f64>) -> Option<([f64; 3], f64)> {
    let (before, both, after) = (matrix[(1, 1)], matrix[(2, 1)], matrix[(2, 2)]);
    let determinant = before * after - both * both;
    let with = [matrix[(1, 0)], matrix[(2, 0)]];
    // What two sums do to the levels, times the determinant.
    let levels =
        |sums: [f64; 2]| [after * sums[0] - both * sums[1], before * sums[1] - both * sums[0]];
    let shift = levels(with);
    let stiffness = matrix[(0, 0)] * determinant - (with[0] * shift[0] + with[1] * shift[1]);
    if determinant <= 0.0 || stiffness <= 0.0 {
        return None;
    }
    let place = (vector[0] * determinant - vector[1] * shift[0] - vector[2] * shift[1]) / stiffness;
    let levels = levels([vector[1] - with[0] * place, vector[2] - with[1] * place])
        .map(|level| level / determinant);
    Some(([place, levels[0], levels[1]], determinant / stiffness))
}
