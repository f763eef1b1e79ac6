//! Discs that occlude bead and ground, on a grid of 4 × 4 points per pixel.

use super::contour::clamp_index;
use super::convolve::{convolve, kernel};
use super::motion::ShutterPosition;
use super::shade::BeadShape;
use super::view::GaugeExtent;
use crate::numeric::number::{narrow_to_f32, to_f64};

/// Points along the side of a pixel. Derived: 4² points fill the 16 bits of a mask.
const POINTS_PER_SIDE: usize = 4;

/// A disc in pixels along and across the gauge's axis.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    /// Along the axis.
    pub run: f64,
    /// Across it.
    pub cross: f64,
    /// Radius.
    pub radius: f64,
}

/// The points that discs cover, one bit each, line by line of pixels.
#[derive(Debug, Clone)]
pub struct Mask {
    extent: GaugeExtent,
    bits: Vec<u16>,
}

/// What the discs occlude, and its brightness.
#[derive(Debug)]
pub struct Backdrop<'a> {
    /// The bead.
    pub shape: &'a BeadShape,
    /// Grey levels of ground and bead.
    pub grey: [f64; 2],
    /// Grey levels that the tint adds, line by line.
    pub tint: &'a [f32],
}

/// The discs of one kind.
pub struct DiscLayer<'a> {
    /// Points that they cover.
    pub mask: &'a Mask,
    /// Grey level of a disc at a pixel along and across the axis.
    pub grey: &'a dyn Fn(usize, usize) -> f64,
    /// Whether discs end at the bead's edges.
    pub bead_only: bool,
}

/// Position of a grid point from the pixel's centre \[px\].
fn point(number: usize) -> f64 {
    (to_f64(number) + 0.5) / to_f64(POINTS_PER_SIDE) - 0.5
}

impl Mask {
    /// A mask without discs.
    pub fn new(extent: GaugeExtent) -> Self {
        Self { extent, bits: vec![0; extent.run * extent.cross] }
    }

    /// Covers the points of a disc.
    pub fn add_disc(&mut self, disc: Disc) {
        let Disc { run, cross, radius } = disc;
        let range = |middle: f64, count: usize| {
            clamp_index(middle - radius + 0.5, count)..clamp_index(middle + radius + 1.5, count)
        };
        for at in range(run, self.extent.run) {
            for number in range(cross, self.extent.cross) {
                let (dv, du) = (to_f64(at) - run, to_f64(number) - cross);
                let bits = &mut self.bits[at * self.extent.cross + number];
                for i in 0..POINTS_PER_SIDE * POINTS_PER_SIDE {
                    let (v, u) = (dv + point(i / POINTS_PER_SIDE), du + point(i % POINTS_PER_SIDE));
                    *bits |= u16::from(v * v + u * u <= radius * radius) << i;
                }
            }
        }
    }

    /// Removes the points of the other mask.
    pub fn subtract(&mut self, other: &Self) {
        for (bits, taken) in self.bits.iter_mut().zip(&other.bits) {
            *bits &= !taken;
        }
    }

    /// Fraction of all points that are covered.
    #[cfg(test)]
    pub fn fraction(&self) -> f64 {
        let covered: u32 = self.bits.iter().map(|bits| bits.count_ones()).sum();
        f64::from(covered) / to_f64(POINTS_PER_SIDE * POINTS_PER_SIDE * self.bits.len())
    }
}

impl Backdrop<'_> {
    /// Adds the change of grey level by a layer, before the blur, averaged over each pixel.
    pub fn paint(&self, layer: &DiscLayer<'_>, change: &mut [f32]) {
        let cross = self.shape.extent.cross;
        for (at, line) in layer.mask.bits.chunks_exact(cross).enumerate() {
            for (number, bits) in line.iter().enumerate().filter(|(_, bits)| **bits != 0) {
                let [outside, inside] = self.split(*bits, at, number);
                let [ground, bead] = self.grey;
                let disc = (layer.grey)(at, number) - f64::from(self.tint[at * cross + number]);
                let on_ground = if layer.bead_only { 0.0 } else { outside * (disc - ground) };
                change[at * cross + number] += narrow_to_f32(on_ground + inside * (disc - bead));
            }
        }
    }

    /// Fractions of the pixel's covered points on ground and on bead.
    fn split(&self, bits: u16, at: usize, number: usize) -> [f64; 2] {
        let (mut outside, mut inside) = (0_u32, 0_u32);
        let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)];
        let holds = |v: f64, u: f64| self.shape.holds(to_f64(at) + v, to_f64(number) + u);
        let held = corners.into_iter().filter(|(v, u)| holds(*v, *u)).count();
        match held {
            0 => outside = bits.count_ones(),
            4 => inside = bits.count_ones(),
            _ => {
                for i in (0..POINTS_PER_SIDE * POINTS_PER_SIDE).filter(|i| bits >> i & 1 == 1) {
                    let inner = holds(point(i / POINTS_PER_SIDE), point(i % POINTS_PER_SIDE));
                    *if inner { &mut inside } else { &mut outside } += 1;
                }
            }
        }
        [outside, inside].map(|count| f64::from(count) / to_f64(POINTS_PER_SIDE * POINTS_PER_SIDE))
    }
}

/// Blurs the changes as the lens does, and averages them over the image's positions during
/// exposure.
pub fn blur(
    mut change: Vec<f32>,
    width: usize,
    blur_px: f64,
    positions: &[ShutterPosition],
) -> Vec<f32> {
    convolve(&mut change, width, &kernel(blur_px));
    if let [ShutterPosition { shift_px: [0.0, 0.0], .. }] = positions {
        return change;
    }
    let mut mean = vec![0.0; change.len()];
    for ShutterPosition { weight, shift_px: [run, cross] } in positions {
        let (down, along) = (run.floor(), cross.floor());
        let (v, u) = (run - down, cross - along);
        let corners = [
            ((0, 0), (1.0 - v) * (1.0 - u)),
            ((0, 1), (1.0 - v) * u),
            ((1, 0), v * (1.0 - u)),
            ((1, 1), v * u),
        ];
        for ((lower, later), fraction) in corners {
            #[expect(clippy::cast_possible_truncation, reason = "a weight, and a few pixels")]
            let (fraction, by) =
                ((weight * fraction) as f32, [down as isize + lower, along as isize + later]);
            add_shifted(&mut mean, &change, width, by, fraction);
        }
    }
    mean
}

/// Adds values shifted by `by`: lines down and pixels to the right.
fn add_shifted(sum: &mut [f32], values: &[f32], width: usize, by: [isize; 2], weight: f32) {
    let height = values.len() / width;
    let (skip, drop) =
        (by[1].min(0).unsigned_abs().min(width), by[1].max(0).unsigned_abs().min(width));
    for (at, line) in sum.chunks_exact_mut(width).enumerate() {
        let Some(from) = at.checked_add_signed(by[0]).filter(|from| *from < height) else {
            continue;
        };
        let values = &values[from * width..][..width];
        for (sum, value) in line[skip..width - drop].iter_mut().zip(&values[drop..width - skip]) {
            *sum += weight * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_covers_its_area_once() {
        let mut mask = Mask::new(GaugeExtent { run: 40, cross: 50 });
        let disc = Disc { run: 20.3, cross: 24.8, radius: 9.0 };
        mask.add_disc(disc);
        mask.add_disc(disc);
        let area = mask.fraction() * 2000.0;
        assert!((area - 81.0 * std::f64::consts::PI).abs() < 1.5, "{area}");
        mask.add_disc(Disc { run: -3.0, cross: 60.0, radius: 5.0 });
        mask.subtract(&mask.clone());
        assert_eq!(mask.fraction(), 0.0);
    }

    #[test]
    fn moving_keeps_the_sum_and_shifts_the_middle() {
        let mut values = vec![0.0; 30 * 20];
        values[10 * 30 + 15] = 6.0;
        let positions =
            [[1.25, -2.5], [2.25, -2.5]].map(|shift_px| ShutterPosition { weight: 0.5, shift_px });
        let moved = blur(values, 30, 0.0, &positions);
        let moment = |of: &dyn Fn(f64, f64) -> f64| {
            (0..600).map(|i| f64::from(moved[i]) * of(to_f64(i / 30), to_f64(i % 30))).sum::<f64>()
        };
        assert!((moment(&|_, _| 1.0) - 6.0).abs() < 1e-5);
        // A shift of the image by one pixel moves its content the other way.
        assert!((moment(&|v, _| v) / 6.0 - (10.0 - 1.75)).abs() < 1e-5);
        assert!((moment(&|_, u| u) / 6.0 - (15.0 + 2.5)).abs() < 1e-5);
    }
}
