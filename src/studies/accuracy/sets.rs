//! Named sets of images with a known truth, on which the measurement is evaluated.

mod limits;
mod list;

use crate::core::{Mm, Roi, WidthRange};
use crate::scenario::bead::EdgeRoughness;
use crate::scenario::image::ImageModel;
use crate::vision::{BeadAxis, Gauge, Polarity};

pub use limits::SetLimits;
pub use list::all;

/// Scale of all sets without a camera model, that of the 2022 paper.
pub const MM_PER_PX: f64 = 0.126_582;
/// Extent across the bead of the gauge and of the image \[px\].
const ACROSS_PX: (usize, u32) = (640, 720);

/// Images of one kind.
#[derive(Debug, Clone)]
pub struct Set {
    /// Its name.
    pub name: &'static str,
    /// Image of the bead; its size is that of the set.
    pub image: ImageModel,
    /// Rows of the gauge; columns for a horizontal bead.
    pub rows: u32,
    /// Mean width of the bead \[mm\].
    pub width_mm: f64,
    /// Roughness of its edges.
    pub roughness: EdgeRoughness,
    /// Direction of the bead in the image.
    pub axis: BeadAxis,
    /// Whether the bead is brighter or darker than its surroundings.
    pub polarity: Polarity,
    /// Whether a tilted camera with lens distortion sees it.
    pub tilted: bool,
    /// Limits of the figures.
    pub limits: SetLimits,
}

impl Set {
    /// Cramér–Rao bound of the standard deviation of a straight bead's width \[px\] with a known
    /// direction.
    ///
    /// On a line across a step of height A that is blurred with s, in white noise σ, the variance
    /// of the step's position is at least 2√π·(σ/A)²·s (Cramér–Rao). That holds whether or not
    /// blur and height are known: their effect on the profile is odd about the position, that of
    /// the position is even. (An unknown level common to both sides is even, too, and costs a
    /// little more; less with more pixels beside the edge.) Along a row that cuts the edge at the
    /// slant t the blur is s/cos t, and a distance normal to the edge is cos t times that along
    /// the row. From N rows and two edges:
    ///
    /// ```text
    /// var = 2·cos² t·e²/N,   e² = 2√π·(σ/A)²·s/cos t
    /// ```
    pub fn cramer_rao_px(&self) -> f64 {
        let cos = libm::cos(self.image.slant_deg.to_radians());
        (2.0 * cos * cos * self.row_variance() / f64::from(self.rows)).sqrt()
    }

    /// Cramér–Rao bound \[px\] where the direction has to be estimated from the same edges.
    ///
    /// The width is w = c·cos t with the chord c along a row. Two parallel
    /// edges x = a + m·v, m = tan t, over the same N rows v give a, and with it
    /// c, independently of m, and m with the variance e²/(2·Σv²) = 6·e²/N³ for
    /// v counted from the middle. With dt = cos² t·dm and
    /// dw = −c·sin t·dt = −w·tan t·dt:
    ///
    /// ```text
    /// var = 2·cos² t·e²/N + (w·tan t)²·cos⁴ t·6·e²/N³
    /// ```
    ///
    /// That is 1 + 3·(w·sin t/N)² times the variance with a known direction, and
    /// the same for a bead along the gauge.
    pub fn free_cramer_rao_px(&self) -> f64 {
        let (sin, cos) = libm::sincos(self.image.slant_deg.to_radians());
        let rows = f64::from(self.rows);
        let lever = self.width_mm / MM_PER_PX * sin / cos;
        let direction = cos.powi(4) * 6.0 * self.row_variance() / rows.powi(3);
        (self.cramer_rao_px().powi(2) + lever * lever * direction).sqrt()
    }

    /// Smallest variance e² of an edge's position along a row \[px²\].
    fn row_variance(&self) -> f64 {
        let ImageModel { bead_grey, ground_grey, noise_grey, blur_px, slant_deg, .. } = self.image;
        let fraction = noise_grey / (bead_grey - ground_grey);
        let along_row = blur_px / libm::cos(slant_deg.to_radians());
        2.0 * std::f64::consts::PI.sqrt() * fraction * fraction * along_row
    }

    /// Whether the fraction of silently wrong widths has a limit; that needs many frames.
    pub fn limits_silent(&self) -> bool {
        self.limits.silent_fraction.is_some()
    }

    /// Size of the images \[px\].
    pub fn size_px(&self) -> [u32; 2] {
        match self.axis {
            BeadAxis::Vertical => [ACROSS_PX.1, self.rows + 20],
            BeadAxis::Horizontal => [self.rows + 20, ACROSS_PX.1],
        }
    }

    /// The gauge of a cell with default settings.
    pub fn gauge(&self) -> Gauge {
        let rows = usize::try_from(self.rows).unwrap_or(usize::MAX);
        let first = if self.tilted { 20 } else { 10 };
        let roi = match self.axis {
            BeadAxis::Vertical => Roi { x: 40, y: first, width: ACROSS_PX.0, height: rows },
            BeadAxis::Horizontal => Roi { x: first, y: 40, width: rows, height: ACROSS_PX.0 },
        };
        let range = if self.width_mm < 20.0 { [5.0, 25.0] } else { [20.0, 60.0] };
        let [min, max] = range.map(Mm::constant);
        Gauge::new(roi, self.axis, self.polarity, WidthRange { min, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn set(name: &str) -> Set {
        all().into_iter().find(|set| set.name == name).unwrap()
    }

    #[test]
    fn every_set_has_a_name_and_limits_of_its_own() {
        let sets = all();
        let names: BTreeSet<&str> = sets.iter().map(|set| set.name).collect();
        assert_eq!(names.len(), sets.len());
        assert!(sets.iter().all(|set| set.limits != SetLimits::default()));
    }

    #[test]
    fn the_bound_of_a_plain_set_is_that_of_two_edges() {
        for name in ["blur-1.5", "horizontal", "dark-bead"] {
            let bound = set(name).cramer_rao_px();
            assert!(
                (bound / (1.8827 * 0.05 * 1.5_f64.sqrt() * 0.02_f64.sqrt()) - 1.0).abs() < 1e-4
            );
            assert_eq!(set(name).free_cramer_rao_px(), bound);
        }
    }

    /// Compares with the information matrix of both edges' positions and the common slope, row by
    /// row.
    #[test]
    fn the_bound_for_an_unknown_direction_is_that_of_a_straight_fit() {
        let set = set("slant-15-blur-1.5");
        let (sin, cos) = 15_f64.to_radians().sin_cos();
        let variance = 1.8827_f64.powi(2) * 0.05_f64.powi(2) * 1.5 / cos;
        let mut information = nalgebra::Matrix3::<f64>::zeros();
        for row in 0..100 {
            let v = f64::from(row) - 20.0;
            for edge in [nalgebra::Vector3::new(1.0, 0.0, v), nalgebra::Vector3::new(0.0, 1.0, v)] {
                information += edge * edge.transpose() / variance;
            }
        }
        let chord = set.width_mm / MM_PER_PX / cos;
        // Derivatives of (right − left)·cos(atan m) with respect to left, right and m.
        let by = nalgebra::Vector3::new(-cos, cos, -chord * sin * cos * cos);
        let bound = (by.transpose() * information.try_inverse().unwrap() * by)[0].sqrt();
        assert!((set.free_cramer_rao_px() / bound - 1.0).abs() < 1e-3, "{bound}");
        assert!(set.free_cramer_rao_px() > 1.05 * set.cramer_rao_px());
    }
}
