//! Frames with random parameters, each uniform in its logarithm over a named range: torn edges,
//! holes, grooves, texture, ribs, motion, and camera faults. The measurement was not tuned on
//! them.
//!
//! ```text
//! list     the sets and their requirements
//! recipes  the random parameters of each set and their ranges
//! draw     random numbers of a frame, with a record of them
//! scene    what a frame shows
//! profile  edges as random lines
//! outline  where the boundaries lie on each line, and the area of the bead
//! paint    light on the sensor: blur, motion, texture
//! long_bead  a bead that passes through the gauge frame by frame
//! camera   from light to grey levels: vignetting, gamma, noise, JPEG
//! ```

mod camera;
mod draw;
mod list;
mod long_bead;
mod outline;
mod paint;
mod profile;
mod recipes;
mod scene;

use crate::core::{Frame, Mm, Pixels, Roi, Size, Stamp, WidthRange, WrongSize};
use crate::vision::{BeadAxis, Gauge, Polarity};
use draw::Draw;
use scene::DrawnScene;

pub use draw::DrawnParameter;
pub use list::{DrawnSet, Requirements, all, named};
pub use long_bead::LongBead;

/// Smallest and largest width that the gauge accepts, over the bead's nominal width.
const RANGE: (f64, f64) = (0.6, 1.3);

/// A frame and its true width. A pixel is a millimetre.
#[derive(Debug, Clone)]
pub struct DrawnFrame {
    /// The image.
    pub frame: Frame,
    /// The gauge that measures it: the whole image.
    pub gauge: Gauge,
    /// True width: area of the unblurred bead over the gauge's length \[px\]. A bay that is open
    /// to the outside does not count as bead, a closed hole does.
    pub truth_px: f64,
    /// The random parameters of the frame.
    pub parameters: Vec<DrawnParameter>,
}

impl DrawnSet {
    /// The frame with this number; the same number gives the same frame.
    pub fn take(&self, number: u64) -> Result<DrawnFrame, WrongSize> {
        let mut draw = Draw::new(self.name, number);
        let scene = (self.scene)(&mut draw);
        let painted = paint::paint(&scene, &mut draw);
        let pixels = camera::expose(&painted.light, &scene, &mut draw);
        let size = Size::new(scene.size.0, scene.size.1);
        let frame = Frame::new(number, Stamp::START, size, Pixels::Grey8(pixels))?;
        let gauge = gauge(&scene, self.knows_gamma);
        Ok(DrawnFrame { frame, gauge, truth_px: painted.truth_px, parameters: draw.record() })
    }
}

fn gauge(scene: &DrawnScene, knows_gamma: bool) -> Gauge {
    let roi = Roi { x: 0, y: 0, width: scene.size.0, height: scene.size.1 };
    let [min, max] = [RANGE.0, RANGE.1].map(|times| Mm::constant(times * scene.width_px));
    let gauge = Gauge::new(roi, BeadAxis::Vertical, Polarity::Bright, WidthRange { min, max });
    if knows_gamma { Gauge { gamma: Some(scene.gamma), ..gauge } } else { gauge }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_depends_on_set_and_number_alone() {
        for set in all() {
            let (one, again, other) =
                (set.take(3).unwrap(), set.take(3).unwrap(), set.take(4).unwrap());
            assert_eq!(one.frame, again.frame, "{}", set.name);
            assert_ne!(one.frame.pixels(), other.frame.pixels(), "{}", set.name);
            assert!(!one.parameters.is_empty(), "{}", set.name);
        }
    }
}
