//! Model of a corner: the product of two blurred steps across crossing lines, with its
//! derivatives.

use nalgebra::{SMatrix, SVector, Vector2};

use crate::numeric::blurred_step::StepTable;

/// Position (2), directions of both lines, blur, mean, contrast and the gradient of the
/// illumination (2). By definition of the model.
pub const PARAMETERS: usize = 9;
const BLUR_PX: std::ops::RangeInclusive<f64> = 0.2..=8.0;

/// A pixel of the window: its position relative to the rough corner \[px\], and its grey value.
pub struct CornerPixel {
    /// Relative to the rough corner \[px\].
    pub at: Vector2<f64>,
    pub value: f64,
}

/// Parameters of the model.
#[derive(Debug, Clone, Copy)]
pub struct CornerShape {
    /// Position relative to the rough corner \[px\].
    pub at: Vector2<f64>,
    /// Directions of the lines \[rad\].
    pub turns: [f64; 2],
    /// Curvatures of the lines \[1/px\], which are not fitted.
    pub bends: [f64; 2],
    pub blur: f64,
    /// Mean, half the contrast, gradient of the illumination.
    pub levels: [f64; 4],
}

/// The parameters with the directions of the lines as vectors.
#[derive(Debug, Clone, Copy)]
pub struct CornerModel {
    pub corner: CornerShape,
    pub along: [Vector2<f64>; 2],
    pub normals: [Vector2<f64>; 2],
}

impl CornerModel {
    pub fn of(corner: CornerShape) -> Self {
        let along = corner.turns.map(|turn| {
            let (sin, cos) = turn.sin_cos();
            Vector2::new(cos, sin)
        });
        Self { corner, along, normals: along.map(|along| Vector2::new(-along.y, along.x)) }
    }

    /// Predicted value at a position, and its derivatives.
    #[inline]
    pub fn at(&self, table: &StepTable, position: Vector2<f64>) -> (f64, SVector<f64, PARAMETERS>) {
        let CornerShape { at, bends, blur, levels: [mean, half, by_x, by_y], .. } = self.corner;
        let from = position - at;
        let along = self.along.map(|direction| direction.dot(&from));
        let aside: [f64; 2] = std::array::from_fn(|line| {
            self.normals[line].dot(&from) - 0.5 * bends[line] * along[line] * along[line]
        });
        let steps = aside.map(|aside| table.at(aside / blur));
        let waves = steps.map(|(step, _)| 2.0 * step - 1.0);
        let slopes = steps.map(|(_, density)| 2.0 * density / blur);
        let value = mean + half * waves[0] * waves[1] + by_x * position.x + by_y * position.y;
        // Derivatives of the product with the distance from each line.
        let by_aside = [half * slopes[0] * waves[1], half * slopes[1] * waves[0]];
        let by_place = -(self.normals[0] * by_aside[0] + self.normals[1] * by_aside[1]);
        let by_blur = -(by_aside[0] * aside[0] + by_aside[1] * aside[1]) / blur;
        let numbers = [
            by_place.x,
            by_place.y,
            // A rotation of a line shifts it in proportion to the distance along it.
            -by_aside[0] * along[0],
            -by_aside[1] * along[1],
            by_blur,
            1.0,
            waves[0] * waves[1],
            position.x,
            position.y,
        ];
        (value, SVector::from(numbers))
    }
}

/// Normal equations of the pixels of a window, lower triangle only, and the sum of squared
/// residuals.
pub struct CornerSums {
    pub matrix: SMatrix<f64, PARAMETERS, PARAMETERS>,
    pub side: SVector<f64, PARAMETERS>,
    pub sum_of_squares: f64,
}

impl CornerShape {
    pub fn sums(&self, table: &StepTable, samples: &[CornerPixel]) -> CornerSums {
        let model = CornerModel::of(*self);
        let mut sums =
            CornerSums { matrix: SMatrix::zeros(), side: SVector::zeros(), sum_of_squares: 0.0 };
        for sample in samples {
            let (value, slopes) = model.at(table, sample.at);
            let left = sample.value - value;
            for column in 0..PARAMETERS {
                for row in column..PARAMETERS {
                    sums.matrix[(row, column)] += slopes[row] * slopes[column];
                }
            }
            sums.side += slopes * left;
            sums.sum_of_squares += left * left;
        }
        sums
    }

    pub fn stepped(&self, step: &SVector<f64, PARAMETERS>) -> Self {
        let mut levels = self.levels;
        levels.iter_mut().zip(step.iter().skip(5)).for_each(|(level, by)| *level += by);
        Self {
            at: self.at + Vector2::new(step[0], step[1]),
            turns: [self.turns[0] + step[2], self.turns[1] + step[3]],
            bends: self.bends,
            blur: (self.blur + step[4]).clamp(*BLUR_PX.start(), *BLUR_PX.end()),
            levels,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slopes_are_the_derivatives() {
        let table = StepTable::default();
        let corner = CornerShape {
            at: Vector2::new(0.2, -0.1),
            turns: [0.1, 1.4],
            bends: [0.0, 0.0],
            blur: 0.9,
            levels: [120.0, -80.0, 0.5, -0.3],
        };
        for position in [Vector2::new(1.0, 0.4), Vector2::new(-0.7, 1.1), Vector2::new(0.1, -2.0)] {
            let (_, slopes) = CornerModel::of(corner).at(&table, position);
            for number in 0..PARAMETERS {
                let mut step = SVector::<f64, PARAMETERS>::zeros();
                step[number] = 0.02;
                let up = CornerModel::of(corner.stepped(&step)).at(&table, position).0;
                let down = CornerModel::of(corner.stepped(&-step)).at(&table, position).0;
                let by = (up - down) / 0.04;
                // The table is good to some 1e-5 of the step.
                assert!((by - slopes[number]).abs() < 0.3, "{number}: {by} {}", slopes[number]);
            }
        }
    }
}
