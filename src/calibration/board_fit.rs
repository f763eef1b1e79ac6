//! A board on a plane, fitted to its corners by least squares.
//!
//! With the corners as complex numbers about their means, a on the board and b on the plane, the
//! best similarity is b = s·a with s = Σ ā·b / Σ |a|²; the best rigid motion has s / |s|.

use nalgebra::{Point2, Vector2};

use super::SurfaceMap;
use super::board::{Board, CornerObservation};
use crate::core::GridSize;
use crate::numeric::number::to_f64;

/// Where a board lies on a plane: a rotation, a shift and, if it is free, a scale.
pub struct BoardFit {
    /// The corners on the plane \[mm\], in their order.
    pub on_plane: Vec<Vector2<f64>>,
    /// Measured size of the board over its true one.
    pub scale: f64,
    /// Root mean square distance of the corners from the fitted board \[mm\].
    pub rms_mm: f64,
    /// Means of the corners on the board and on the plane \[mm\].
    means: [Vector2<f64>; 2],
    /// The complex factor from the board to the plane.
    factor: Vector2<f64>,
    count: f64,
    /// Sum of the squared distances of the board's corners from their mean \[mm²\].
    sum_of_squares_mm2: f64,
}

impl BoardFit {
    /// A board of its true size. `None` where a corner is not seen on the plane.
    pub fn rigid(face: &SurfaceMap, board: &Board, corners: &[CornerObservation]) -> Option<Self> {
        Self::with(face, board, corners, |turn, _| turn.try_normalize(0.0))
    }

    /// A board of any size. `None` where a corner is not seen on the plane.
    pub fn similar(
        face: &SurfaceMap,
        board: &Board,
        corners: &[CornerObservation],
    ) -> Option<Self> {
        let fit = Self::with(face, board, corners, |turn, squares| Some(turn / squares))?;
        fit.scale.is_finite().then_some(fit)
    }

    fn with(
        face: &SurfaceMap,
        board: &Board,
        corners: &[CornerObservation],
        factor: impl Fn(Vector2<f64>, f64) -> Option<Vector2<f64>>,
    ) -> Option<Self> {
        let seen = corners.iter().map(|corner| Some(face.to_mm(corner.px)?.coords));
        let on_plane: Vec<Vector2<f64>> = seen.collect::<Option<_>>()?;
        let flat = board.correspondences(corners);
        let flat: Vec<Vector2<f64>> = flat.iter().map(|corner| mirrored(corner.on_board)).collect();
        let count = to_f64(flat.len());
        let means = [&flat, &on_plane].map(|points| points.iter().sum::<Vector2<f64>>() / count);
        let pairs = || flat.iter().zip(&on_plane).map(|(a, b)| (a - means[0], b - means[1]));
        let sum_of_squares_mm2: f64 = pairs().map(|(a, _)| a.norm_squared()).sum();
        let turn: Vector2<f64> = pairs().map(|(a, b)| Vector2::new(a.dot(&b), a.perp(&b))).sum();
        let factor = factor(turn, sum_of_squares_mm2)?;
        let left: f64 = pairs().map(|(a, b)| (b - product(a, factor)).norm_squared()).sum();
        let (scale, rms_mm) = (turn.norm() / sum_of_squares_mm2, (left / count).sqrt());
        Some(Self { on_plane, scale, rms_mm, means, factor, count, sum_of_squares_mm2 })
    }

    /// A point of the board on the plane \[mm\]: in squares from the first corner, or from the
    /// last one of a board that is counted from its other end.
    pub fn position(&self, board: &Board, [x, y]: [f64; 2], is_turned: bool) -> Point2<f64> {
        let GridSize { columns, rows } = board.corners();
        let last = [to_f64(columns - 1), to_f64(rows - 1)];
        let [x, y] = if is_turned { [last[0] - x, last[1] - y] } else { [x, y] };
        let on_board = mirrored(Point2::new(x, y) * board.square().get());
        (self.means[1] + product(on_board - self.means[0], self.factor)).into()
    }

    /// Standard deviation of a rigid board's point in any direction \[mm\]. The noise of a
    /// corner along one axis follows from the residuals of 2n coordinates less three
    /// parameters. The effect of the rotation grows with the distance from the mean of the
    /// corners.
    pub fn sigma_mm(&self, at: Point2<f64>) -> f64 {
        let variance = self.rms_mm.powi(2) * self.count / (2.0 * self.count - 3.0);
        let away = (at.coords - self.means[1]).norm_squared();
        (variance * (1.0 / self.count + away / self.sum_of_squares_mm2)).sqrt()
    }
}

/// The bed's y axis is opposite to the board's, because the bed's z points at the camera.
fn mirrored(on_board: Point2<f64>) -> Vector2<f64> {
    Vector2::new(on_board.x, -on_board.y)
}

/// The product of complex numbers.
fn product(a: Vector2<f64>, b: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Mm;

    /// Corners of a board that is 1 % too large, turned by 0.3 rad, on a plane of 0.1 mm a pixel.
    fn fits() -> [BoardFit; 2] {
        let board = Board::new(5, 4, Mm::constant(10.0)).unwrap();
        let turn = Vector2::new(0.3_f64.cos(), 0.3_f64.sin()) * 1.01;
        let corners: Vec<CornerObservation> = (0..20)
            .map(|index| {
                let (column, row) = (index % 5, index / 5);
                let at = Vector2::new(10.0 * to_f64(column), -10.0 * to_f64(row));
                let px = (product(at, turn) * 10.0 + Vector2::new(200.0, 300.0)).into();
                CornerObservation { index, px }
            })
            .collect();
        let face = SurfaceMap::from_scale(0.1);
        [BoardFit::similar, BoardFit::rigid].map(|fit| fit(&face, &board, &corners).unwrap())
    }

    #[test]
    fn both_fits_measure_the_size_and_only_the_similarity_leaves_nothing() {
        let [similar, rigid] = fits();
        assert!((similar.scale - 1.01).abs() < 1e-12 && (rigid.scale - 1.01).abs() < 1e-12);
        assert!(similar.rms_mm < 1e-12);
        // 1 % of the root mean square distance from the mean: columns 0 to 40 mm, rows 0 to 30 mm.
        assert!((rigid.rms_mm - 0.01 * (200.0_f64 + 125.0).sqrt()).abs() < 1e-12);
    }
}
