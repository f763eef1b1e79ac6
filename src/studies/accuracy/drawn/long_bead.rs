//! A long bead with torn edges that passes through the gauge frame by frame, to evaluate
//! roughness over successive frames.

use std::ops::Range;

use super::draw::Draw;
use super::paint::{Painted, paint};
use super::scene::DrawnScene;
use super::{camera, recipes};
use crate::core::{Frame, Pixels, Size, Stamp, WrongSize};
use crate::numeric::number::to_count;
use crate::sim::hash;
use crate::vision::Gauge;

/// Name that seeds its random numbers.
const NAME: &str = "roughness";
/// Independent edges of a bead. By definition of a bead, two.
const EDGE_COUNT: f64 = 2.0;

/// A torn bead many correlation lengths long. A pixel is a millimetre.
#[derive(Debug, Clone)]
pub struct LongBead {
    /// Scene of one frame.
    scene: DrawnScene,
    painted: Painted,
    rows: usize,
    number: u64,
}

/// One frame of the bead.
#[derive(Debug, Clone)]
pub struct Passage {
    /// The image.
    pub frame: Frame,
    /// Area of the unblurred bead over the gauge's length \[px\].
    pub truth_px: f64,
}

impl LongBead {
    /// Draws roughness and correlation length \[px\] as the set `torn` does, and paints a bead
    /// that is `lengths` correlation lengths long.
    pub fn draw(number: u64, lengths: f64) -> Self {
        let mut draw = Draw::new(NAME, number);
        let scene = recipes::torn(&mut draw);
        let rows = to_count((lengths * scene.edges.length_px).ceil()).max(scene.size.1);
        let long = DrawnScene { size: (scene.size.0, rows), ..scene.clone() };
        let painted = paint(&long, &mut draw);
        Self { scene, painted, rows, number }
    }

    /// The gauge of every frame: the whole image.
    pub fn gauge(&self) -> Gauge {
        super::gauge(&self.scene, false)
    }

    /// Length of the gauge \[px\].
    pub fn gauge_rows(&self) -> usize {
        self.scene.size.1
    }

    /// Length of the bead \[px\].
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Mean width of an endless bead with these edges \[px\]; the mean over a gauge varies about
    /// it.
    pub fn own_width_px(&self) -> f64 {
        self.painted.own_width_px()
    }

    /// Standard deviation of its local width \[px\].
    pub fn roughness_px(&self) -> f64 {
        EDGE_COUNT.sqrt() * self.scene.edges.roughness_px
    }

    /// Correlation length of its local width \[px\].
    pub fn length_px(&self) -> f64 {
        self.scene.edges.length_px
    }

    /// Range of the correlation lengths \[px\].
    pub fn lengths_px() -> Range<f64> {
        recipes::LENGTH_PX
    }

    /// The frame whose gauge begins at `first_row`; each frame has noise of its own.
    pub fn take(&self, frame: u64, first_row: usize) -> Result<Passage, WrongSize> {
        let size = self.scene.size;
        let first_row = first_row.min(self.rows - size.1);
        let last_row = first_row + size.1;
        let light = &self.painted.light[first_row * size.0..last_row * size.0];
        let mut noise = Draw::new(NAME, hash::mix(&[self.number, frame]));
        let pixels = camera::expose(light, &self.scene, &mut noise);
        let size = Size::new(size.0, size.1);
        let frame = Frame::new(frame, Stamp::START, size, Pixels::Grey8(pixels))?;
        Ok(Passage { frame, truth_px: self.painted.mean_width_px(first_row..last_row) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_one_bead_show_what_lies_within_their_rows() {
        let bead = LongBead::draw(1, 50.0);
        let (gauge, mut sum, mut gauges) = (bead.gauge_rows(), 0.0, 0_u32);
        for first_row in (0..=bead.rows() - gauge).step_by(gauge) {
            sum += bead.take(u64::from(gauges), first_row).unwrap().truth_px;
            gauges += 1;
        }
        assert!(gauges > 1);
        let whole = bead.painted.mean_width_px(0..bead.rows() / gauge * gauge);
        assert!((sum / f64::from(gauges) - whole).abs() < 1e-9);
        assert_ne!(bead.take(0, 0).unwrap().frame, bead.take(1, 0).unwrap().frame);
    }
}
