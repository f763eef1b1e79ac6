//! Where the boundaries of a scene lie, line by line, and the area of its bead.

use std::ops::Range;

use super::draw::Draw;
use super::profile::{height_of, rough};
use super::scene::{DrawnScene, Groove, Holes};
use crate::numeric::number::to_f64;

/// Smallest width of a groove over its mean width, so that its two rough sides do not cross.
const MIN_GROOVE: f64 = 0.2;
/// Largest standard deviation of a groove's width over its mean: the sides of a narrow groove are
/// correlated.
const MAX_GROOVE_SPREAD: f64 = 1.0 / 3.0;
/// Smallest distance of a hole from the deepest bay \[px\], so that every hole is closed. Derived:
/// more than six times the largest roughness of those edges, 2 px.
const HOLE_CLEARANCE_PX: f64 = 14.0;

/// Brightness on a line from a position up to the next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrightnessStep {
    /// Position where it begins \[px\].
    pub at_px: f64,
    /// Its brightness \[grey levels\].
    pub grey: f64,
    /// Whether it is concrete; concrete has the bead's texture.
    pub concrete: bool,
}

/// A disc; coordinates from the image's left and the first line \[px\].
#[derive(Debug, Clone, Copy)]
struct Disc {
    x: f64,
    y: f64,
    radius: f64,
}

impl Disc {
    /// Half the chord at a height \[px\]; `None` if the disc does not reach it.
    fn half_chord(&self, y_px: f64) -> Option<f64> {
        let square = self.radius.powi(2) - (y_px - self.y).powi(2);
        (square > 0.0).then(|| square.sqrt())
    }
}

/// Where the scene's boundaries lie on every line, [`POINTS_PER_PX`](super::profile::POINTS_PER_PX) lines a pixel.
#[derive(Debug, Clone)]
pub struct DrawnOutline {
    left: Vec<f64>,
    right: Vec<f64>,
    /// Outer sides of the grooves, left and right.
    far: [Option<Vec<f64>>; 2],
    holes: Vec<Disc>,
    axis_px: f64,
    /// Width of the bead before its edges were torn \[px\].
    pub width_px: f64,
}

/// The bead before its edges are torn \[px\].
#[derive(Debug, Clone, Copy)]
struct Straight {
    axis: f64,
    half: f64,
}

impl DrawnOutline {
    /// Draws the boundaries of `count` lines. Position and width of the bead vary at random from
    /// frame to frame.
    pub fn draw(scene: &DrawnScene, count: usize, draw: &mut Draw) -> Self {
        let middle = to_f64(scene.size.0) / 2.0;
        let bead = Straight {
            axis: middle + draw.between(-scene.position_jitter_px, scene.position_jitter_px),
            half: scene.width_px / 2.0 + draw.between(-0.5, 0.5),
        };
        let edges = scene.edges;
        let torn = |draw: &mut Draw| rough(count, edges.roughness_px, edges.length_px, draw);
        let (left, right) = (torn(draw), torn(draw));
        let far_side = |groove: Option<Groove>, outwards: f64, near: &[f64], draw: &mut Draw| {
            let groove = groove?;
            let common = common_fraction(groove.width_px, edges.roughness_px);
            let own = (1.0 - common * common).sqrt();
            let gap = |(near, fresh): (&f64, f64)| {
                let mean = groove.width_px + outwards * (common * near + own * fresh - near);
                near + outwards * mean.max(MIN_GROOVE * groove.width_px)
            };
            let at_px = bead.axis + outwards * bead.half;
            Some(near.iter().zip(torn(draw)).map(gap).map(|position| at_px + position).collect())
        };
        let [before, after] = scene.grooves;
        let far = [far_side(before, -1.0, &left, draw), far_side(after, 1.0, &right, draw)];
        let position = |at_px: f64, deviations: Vec<f64>| -> Vec<f64> {
            deviations.into_iter().map(|deviation| at_px + deviation).collect()
        };
        let mut left = position(bead.axis - bead.half, left);
        let mut right = position(bead.axis + bead.half, right);
        let mut holes = Vec::new();
        if let Some(dug) = &scene.holes {
            cut_bays(dug, &mut left, bead.axis - bead.half, 1.0, draw);
            cut_bays(dug, &mut right, bead.axis + bead.half, -1.0, draw);
            holes = dig(dug, bead, count, draw);
        }
        Self { left, right, far, holes, axis_px: bead.axis, width_px: 2.0 * bead.half }
    }

    /// Area of the bead within a range of lines over their length \[px\].
    pub fn mean_width(&self, lines: Range<usize>) -> f64 {
        let count = lines.len().max(1);
        let widths = self.left[lines.clone()].iter().zip(&self.right[lines]);
        widths.map(|(left, right)| right - left).sum::<f64>() / to_f64(count)
    }

    /// Brightness along a line, from left to right; the first step begins at −∞.
    pub fn steps(&self, scene: &DrawnScene, line: usize) -> Vec<BrightnessStep> {
        let (left, right) = (self.left[line], self.right[line]);
        let step = |at_px: f64, grey: f64, concrete: bool| BrightnessStep { at_px, grey, concrete };
        let beyond = |side: usize, at_px: f64| match scene.grooves[side] {
            Some(groove) if groove.neighbour => step(at_px, scene.bead_grey, true),
            _ => step(at_px, scene.ground_grey, false),
        };
        let mut steps = vec![beyond(0, f64::NEG_INFINITY)];
        if let (Some(groove), Some(far)) = (scene.grooves[0], &self.far[0]) {
            steps.push(step(far[line], groove.grey, false));
        }
        steps.push(step(left, scene.bead_grey, true));
        for rib in &scene.ribs {
            let from = self.axis_px + rib.at_px - rib.width_px / 2.0;
            steps.push(step(from, scene.bead_grey + rib.over_grey, true));
            steps.push(step(from + rib.width_px, scene.bead_grey, true));
        }
        if let Some(dug) = scene.holes {
            for (from, to) in self.chords(height_of(line)) {
                steps.push(step(from, dug.grey, false));
                steps.push(step(to, scene.bead_grey, true));
            }
        }
        match (scene.grooves[1], &self.far[1]) {
            (Some(groove), Some(far)) => {
                steps.push(step(right, groove.grey, false));
                steps.push(beyond(1, far[line]));
            }
            _ => steps.push(beyond(1, right)),
        }
        steps
    }

    /// Start and end of each hole on a line \[px\], from left to right; overlapping holes are
    /// merged.
    fn chords(&self, y_px: f64) -> Vec<(f64, f64)> {
        let chord = |hole: &Disc| {
            let half = hole.half_chord(y_px)?;
            Some((hole.x - half, hole.x + half))
        };
        let mut chords: Vec<(f64, f64)> = self.holes.iter().filter_map(chord).collect();
        chords.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut apart: Vec<(f64, f64)> = Vec::new();
        for (from, to) in chords {
            match apart.last_mut() {
                Some(last) if from <= last.1 => last.1 = last.1.max(to),
                _ => apart.push((from, to)),
            }
        }
        apart
    }
}

/// Correlation of a groove's outer side with its inner side for the largest permitted spread of
/// its width: the difference of two sides with roughness r and correlation c has the standard
/// deviation r·√(2 − 2c).
fn common_fraction(width_px: f64, roughness_px: f64) -> f64 {
    let spread = MAX_GROOVE_SPREAD * width_px / roughness_px.max(f64::MIN_POSITIVE);
    (1.0 - 0.5 * spread * spread).max(0.0)
}

/// Cuts bays into an edge at `at_px`, in the direction +1 or −1.
fn cut_bays(dug: &Holes, edge: &mut [f64], at_px: f64, inwards: f64, draw: &mut Draw) {
    let height = height_of(edge.len());
    for _ in 0..dug.count {
        let bay = Disc { x: at_px, y: draw.between(0.0, height), radius: dug.size_px / 2.0 };
        for (line, at) in edge.iter_mut().enumerate() {
            if let Some(half_chord) = bay.half_chord(height_of(line)) {
                let end = bay.x + inwards * half_chord;
                *at = if inwards > 0.0 { at.max(end) } else { at.min(end) };
            }
        }
    }
}

/// Random closed holes, twice as many as an edge has bays.
fn dig(dug: &Holes, bead: Straight, lines: usize, draw: &mut Draw) -> Vec<Disc> {
    let height = height_of(lines);
    let room = bead.half - dug.size_px - HOLE_CLEARANCE_PX;
    let disc = |_| Disc {
        x: bead.axis + draw.between(-room, room),
        y: draw.between(0.0, height),
        radius: dug.size_px / 2.0,
    };
    (0..2 * dug.count).map(disc).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::accuracy::drawn::profile::POINTS_PER_PX;
    use crate::studies::accuracy::drawn::scene::Tear;

    #[test]
    fn grooves_are_as_wide_as_asked_for_and_rough_on_both_sides() {
        for width_px in [2.0, 10.0, 40.0] {
            let groove = Groove { width_px, grey: 10.0, neighbour: true };
            let edges = Tear { roughness_px: 3.0, length_px: 8.0 };
            let scene = DrawnScene { grooves: [Some(groove); 2], edges, ..DrawnScene::default() };
            let count = 20_000 * POINTS_PER_PX;
            let outline = DrawnOutline::draw(&scene, count, &mut Draw::new("groove", 1));
            let far = outline.far[1].as_ref().unwrap();
            let gaps: Vec<f64> =
                far.iter().zip(&outline.right).map(|(far, near)| far - near).collect();
            let mean = |values: &[f64]| {
                values.iter().sum::<f64>() / f64::from(u32::try_from(values.len()).unwrap())
            };
            assert!((mean(&gaps) / width_px - 1.0).abs() < 0.03, "{width_px}: {}", mean(&gaps));
            assert!(gaps.iter().all(|gap| *gap > 0.19 * width_px));
            let middle = mean(far);
            let squares: Vec<f64> = far.iter().map(|far| (far - middle).powi(2)).collect();
            // 20,000 px with a correlation length of 8 px hold 1,250 independent positions.
            assert!((mean(&squares) / 9.0 - 1.0).abs() < 0.15, "{}", mean(&squares));
        }
    }
}
