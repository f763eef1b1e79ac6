//! Normal equations of the rows of a band for position and levels of an edge.

use nalgebra::{Matrix3, Vector3};

use super::group::RowGroup;
use crate::vision::located::CaliperEdge;

/// Fraction of the plain pixels that must be as they are expected for their level
/// to be accepted.
const MIN_PLAIN_FRACTION: f64 = 0.6;

/// Sums over the rows of a band that count.
#[derive(Debug, Clone, Copy, Default)]
pub struct BandSums {
    /// Rows that count, rows of the band, and rows that were compared.
    pub rows: f64,
    pub all_rows: f64,
    pub held_rows: f64,
    /// Step that the rows were compared with \[grey levels\].
    pub step: f64,
    /// Right-hand side of the equations for position and levels.
    pub vector: [f64; 3],
    /// Plain pixels and the sum of their residuals, before the edge and after it.
    pub plain: [[f64; 2]; 2],
}

impl BandSums {
    /// Adds rows that count.
    pub fn add(&mut self, group: &RowGroup, core: &Matrix3<f64>) {
        let (sums, weight) = (&group.sums, f64::from(group.weight));
        self.rows += weight;
        // The unknown is the step times the distance from the path.
        let ahead = self.step * f64::from(group.ahead);
        self.vector[0] += weight * (core[(0, 0)] * ahead - f64::from(sums.slope));
        self.vector[1] += weight * (core[(1, 0)] * ahead + f64::from(sums.before));
        self.vector[2] += weight * (core[(2, 0)] * ahead + f64::from(sums.after));
    }

    /// Position relative to the path \[px\], and the edge with its variance; `None` where too few
    /// rows count or there is no edge.
    #[inline(always)]
    pub fn solve(
        &self,
        core: Matrix3<f64>,
        variance: f64,
        extra: [f64; 2],
        plain: [f64; 2],
        min_fraction: f64,
    ) -> Option<(f64, CaliperEdge)> {
        if self.rows < min_fraction * self.all_rows || self.rows < 1.0 {
            return None;
        }
        let mut matrix = core * self.rows;
        let mut vector = Vector3::from(self.vector);
        for (side, [count, sum]) in self.plain.into_iter().enumerate() {
            if count >= MIN_PLAIN_FRACTION * plain[side] * self.held_rows {
                let weight = 1.0 / (1.0 / count + extra[side] / variance);
                matrix[(side + 1, side + 1)] += weight;
                vector[side + 1] += weight * sum / count;
            }
        }
        let (found, variance_of_place) = solve(&matrix, &vector)?;
        let height = self.step + found[2] - found[1];
        let variance = variance * variance_of_place / (self.step * self.step);
        let row_fraction = self.rows / self.all_rows;
        Some((found[0] / self.step, CaliperEdge { at: 0.0, variance, height, row_fraction }))
    }
}

/// Solves symmetric equations for position and levels, the levels first; the
/// variance is that of the position.
fn solve(matrix: &Matrix3<f64>, vector: &Vector3<f64>) -> Option<([f64; 3], f64)> {
    let (before, both, after) = (matrix[(1, 1)], matrix[(2, 1)], matrix[(2, 2)]);
    let determinant = before * after - both * both;
    let with = [matrix[(1, 0)], matrix[(2, 0)]];
    // Levels for two right-hand sides, times the determinant.
    let levels =
        |sums: [f64; 2]| [after * sums[0] - both * sums[1], before * sums[1] - both * sums[0]];
    let shift = levels(with);
    let stiffness = matrix[(0, 0)] * determinant - (with[0] * shift[0] + with[1] * shift[1]);
    if determinant <= 0.0 || stiffness <= 0.0 {
        return None;
    }
    let position =
        (vector[0] * determinant - vector[1] * shift[0] - vector[2] * shift[1]) / stiffness;
    let levels = levels([vector[1] - with[0] * position, vector[2] - with[1] * position])
        .map(|level| level / determinant);
    Some(([position, levels[0], levels[1]], determinant / stiffness))
}
