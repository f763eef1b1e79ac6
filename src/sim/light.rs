//! Light that changes linearly across the image.

use crate::numeric::number::to_f64;
use crate::scenario::image::ImageModel;

/// Relative light of every pixel; 1 in the middle of the image.
#[derive(Debug, Clone, Copy)]
pub struct Light {
    first: f64,
    /// Change per pixel, to the right and downwards.
    growth: [f64; 2],
}

impl Light {
    /// For an image with this number of columns and rows.
    pub fn new(image: &ImageModel, columns: usize, rows: usize) -> Self {
        let ratio = image.light_ratio.max(1.0);
        let amplitude = (ratio - 1.0) / (ratio + 1.0);
        let spans = [to_f64(columns) - 1.0, to_f64(rows) - 1.0];
        let growth = match image.light_deg {
            None => spans.map(|span| amplitude / span.max(1.0)),
            Some(direction) => {
                let (sin, cos) = libm::sincos(direction.to_radians());
                // Extent of the image in the direction of the light \[px\].
                let span = (cos * spans[0]).abs() + (sin * spans[1]).abs();
                [cos, sin].map(|part| 2.0 * amplitude * part / span.max(1.0))
            }
        };
        let middle = [spans[0] / 2.0, spans[1] / 2.0];
        let first = 1.0 - (growth[0] * middle[0] + growth[1] * middle[1]);
        Self { first, growth }
    }

    /// Light at a pixel.
    pub fn at(&self, column: usize, row: usize) -> f64 {
        let (first, growth) = self.row(row);
        first + growth * to_f64(column)
    }

    /// Light at the first pixel of a row, and its change per pixel along the row.
    pub fn row(&self, row: usize) -> (f64, f64) {
        (self.first + self.growth[1] * to_f64(row), self.growth[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(light_deg: Option<f64>, column: f64, row: usize) -> f64 {
        let image = ImageModel { light_ratio: 4.0, light_deg, ..ImageModel::DEFAULT };
        let (first, growth) = Light::new(&image, 101, 51).row(row);
        first + growth * column
    }

    #[test]
    fn the_ratio_is_reached_from_end_to_end_in_any_direction() {
        let ends = [
            (None, (0.0, 0), (100.0, 50)),
            (Some(0.0), (0.0, 0), (100.0, 0)),
            (Some(90.0), (0.0, 0), (0.0, 50)),
            (Some(180.0), (100.0, 0), (0.0, 0)),
            (Some(-30.0), (0.0, 50), (100.0, 0)),
        ];
        for (direction, dim, bright) in ends {
            let ratio = at(direction, bright.0, bright.1) / at(direction, dim.0, dim.1);
            assert!((ratio - 4.0).abs() < 1e-12, "{direction:?}: {ratio}");
            assert!((at(direction, 50.0, 25) - 1.0).abs() < 1e-12);
        }
        assert!((at(Some(0.0), 0.0, 0) - at(Some(0.0), 0.0, 50)).abs() < 1e-12);
    }
}
