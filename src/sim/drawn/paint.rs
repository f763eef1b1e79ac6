//! The pixels of a scene before the camera: exact shares of what covers them, from
//! four lines a pixel.

use super::draw::Draw;
use super::profile::{self, PER_PX};
use super::scene::{Groove, Holes, Scene};
use crate::sim::picture::Texture;
use crate::sim::texture::texture;

/// A picture with a margin that the camera's blur needs.
#[derive(Debug, Clone)]
pub struct Canvas {
    /// Pixels beyond the picture on every side.
    pub margin: usize,
    /// Columns, margins included.
    pub width: usize,
    /// Light of the pixels, row by row.
    pub light: Vec<f32>,
}

/// A painted scene.
#[derive(Debug, Clone)]
pub struct Painted {
    /// Its pixels.
    pub canvas: Canvas,
    /// Area of the bead over the picture's height.
    pub truth_px: f64,
}

/// Paints a scene.
pub fn paint(scene: &Scene, draw: &mut Draw) -> Painted {
    let margin = margin(scene);
    let (width, height) = (scene.size.0 + 2 * margin, scene.size.1 + 2 * margin);
    let lines = Lines::draw(scene, margin, height * PER_PX, draw);
    let mut light = vec![0.0; width * height];
    let mut matter = vec![0.0; width * height];
    for (row, (light, matter)) in
        light.chunks_exact_mut(width).zip(matter.chunks_exact_mut(width)).enumerate()
    {
        for number in row * PER_PX..(row + 1) * PER_PX {
            lines.paint(scene, number, light, matter);
        }
        let share = 1.0 / f32::from(u8::try_from(PER_PX).unwrap_or(1));
        for value in light.iter_mut().chain(matter) {
            *value *= share;
        }
    }
    for (patches, of_bead) in [(scene.texture, true), (scene.ground_texture, false)] {
        let asked = Texture { size_grey: patches.size_grey, length_px: patches.length_px };
        let Some(pattern) = texture(&asked, (width, height), draw.key()) else { continue };
        for ((light, matter), value) in light.iter_mut().zip(&matter).zip(pattern) {
            *light += value * if of_bead { *matter } else { 1.0 - matter };
        }
    }
    let truth_px = lines.mean_width(margin * PER_PX..(height - margin) * PER_PX);
    Painted { canvas: Canvas { margin, width, light }, truth_px }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a small positive length"
)]
fn margin(scene: &Scene) -> usize {
    (4.5 * scene.blur_px + 0.5 * scene.motion_px).ceil() as usize + 2
}

/// A disc \[px, lines\].
#[derive(Debug, Clone, Copy)]
struct Disc {
    x: f64,
    y: f64,
    radius: f64,
}

impl Disc {
    /// Half of its chord at a height; none where it does not reach.
    fn half_chord(&self, y_px: f64) -> Option<f64> {
        let square = self.radius.powi(2) - (y_px - self.y).powi(2);
        (square > 0.0).then(|| square.sqrt())
    }
}

/// Where the scene's borders lie on every line.
struct Lines {
    left: Vec<f64>,
    right: Vec<f64>,
    /// Far sides of the grooves.
    far: [Option<Vec<f64>>; 2],
    holes: Vec<Disc>,
    axis_px: f64,
}

#[expect(clippy::cast_precision_loss, reason = "a few thousand lines")]
fn height_of(line: usize) -> f64 {
    (line as f64 + 0.5) / PER_PX as f64
}

impl Lines {
    fn draw(scene: &Scene, margin: usize, count: usize, draw: &mut Draw) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "a small margin")]
        let axis_px = scene.size.0 as f64 / 2.0 + margin as f64 + draw.between(-1.0, 1.0);
        let half = scene.width_px / 2.0 + draw.between(-0.5, 0.5);
        let edges = scene.edges;
        let line = |at: f64, draw: &mut Draw| -> Vec<f64> {
            let rough = profile::rough(count, edges.roughness_px, edges.length_px, draw);
            rough.into_iter().map(|deviation| at + deviation).collect()
        };
        let mut left = line(axis_px - half, draw);
        let mut right = line(axis_px + half, draw);
        let [before, after] = scene.grooves;
        let far_side = |groove: Option<Groove>, outwards: f64, near: &[f64], draw: &mut Draw| {
            let groove = groove?;
            let mut far = line(axis_px + outwards * (half + groove.width_px), draw);
            // A groove is nowhere narrower than a fifth of its width.
            for (far, near) in far.iter_mut().zip(near) {
                let gap = (outwards * (*far - near)).max(0.2 * groove.width_px);
                *far = near + outwards * gap;
            }
            Some(far)
        };
        let far = [far_side(before, -1.0, &left, draw), far_side(after, 1.0, &right, draw)];
        let holes = scene.holes.map_or(Vec::new(), |holes| {
            dig(&holes, (&mut left, &mut right), (axis_px, half), draw)
        });
        Self { left, right, far, holes, axis_px }
    }

    fn mean_width(&self, lines: std::ops::Range<usize>) -> f64 {
        let count = lines.len().max(1);
        let widths = self.left[lines.clone()].iter().zip(&self.right[lines]);
        #[expect(clippy::cast_precision_loss, reason = "a few thousand lines")]
        let mean = widths.map(|(left, right)| right - left).sum::<f64>() / count as f64;
        mean
    }

    /// Adds one line to a row of pixels.
    fn paint(&self, scene: &Scene, number: usize, light: &mut [f32], matter: &mut [f32]) {
        let (left, right) = (self.left[number], self.right[number]);
        #[expect(clippy::cast_precision_loss, reason = "pixels of a row")]
        let end = light.len() as f64;
        let near = [left, right];
        let mut steps = vec![(0.0, scene.ground_grey, 0.0)];
        let outside = |side: usize| -> (f64, f64) {
            let neighbour = scene.grooves[side].is_some_and(|groove| groove.neighbour);
            if neighbour { (scene.bead_grey, 1.0) } else { (scene.ground_grey, 0.0) }
        };
        steps[0] = (0.0, outside(0).0, outside(0).1);
        if let (Some(groove), Some(far)) = (scene.grooves[0], &self.far[0]) {
            steps.push((far[number], groove.grey, 0.0));
        }
        steps.push((near[0], scene.bead_grey, 1.0));
        if let Some(rib) = scene.rib {
            let from = self.axis_px + rib.at_px - rib.width_px / 2.0;
            steps.push((from, scene.bead_grey + rib.over_grey, 1.0));
            steps.push((from + rib.width_px, scene.bead_grey, 1.0));
        }
        if let Some(holes) = scene.holes {
            let y_px = height_of(number);
            let mut chords: Vec<(f64, f64)> = self
                .holes
                .iter()
                .filter_map(|hole| {
                    let half = hole.half_chord(y_px)?;
                    Some((hole.x - half, hole.x + half))
                })
                .collect();
            chords.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut reached = left;
            for (from, to) in chords {
                let from = from.max(reached);
                if from < to && to < right {
                    steps.push((from, holes.grey, 0.0));
                    steps.push((to, scene.bead_grey, 1.0));
                    reached = to;
                }
            }
        }
        let (beyond, beyond_matter) = outside(1);
        match (scene.grooves[1], &self.far[1]) {
            (Some(groove), Some(far)) => {
                steps.push((near[1], groove.grey, 0.0));
                steps.push((far[number], beyond, beyond_matter));
            }
            _ => steps.push((near[1], beyond, beyond_matter)),
        }
        for (step, next) in steps.iter().zip(steps.iter().skip(1).map(|next| next.0).chain([end])) {
            cover(step.0, next.min(end), (step.1, light));
            cover(step.0, next.min(end), (step.2, matter));
        }
    }
}

/// Adds a value to pixels by the share of them between two places.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "places within the row"
)]
fn cover(from: f64, to: f64, (value, pixels): (f64, &mut [f32])) {
    let from = from.max(0.0);
    if to <= from || value == 0.0 {
        return;
    }
    let (first, last) = (from as usize, (to as usize).min(pixels.len() - 1));
    #[expect(clippy::cast_precision_loss, reason = "pixels of a row")]
    let share = |pixel: usize| (to.min(pixel as f64 + 1.0) - from.max(pixel as f64)).max(0.0);
    let value32 = value as f32;
    for (pixel, light) in pixels.iter_mut().enumerate().take(last + 1).skip(first) {
        *light +=
            if pixel == first || pixel == last { (value * share(pixel)) as f32 } else { value32 };
    }
}

/// Holes within the bead; bays are taken out of its edges.
fn dig(
    holes: &Holes,
    (left, right): (&mut [f64], &mut [f64]),
    (axis_px, half): (f64, f64),
    draw: &mut Draw,
) -> Vec<Disc> {
    let height = height_of(left.len());
    let radius = holes.size_px / 2.0;
    // Holes stay clear of the edges, so that none is open.
    let room = half - holes.size_px - 12.0;
    let disc = |x: f64, draw: &mut Draw| Disc { x, y: draw.between(0.0, height), radius };
    for (edge, inwards) in [(left, 1.0), (right, -1.0)] {
        for _ in 0..holes.count {
            let bay = disc(axis_px - inwards * half, draw);
            for (line, at) in edge.iter_mut().enumerate() {
                if let Some(half_chord) = bay.half_chord(height_of(line)) {
                    let end = bay.x + inwards * half_chord;
                    *at = if inwards > 0.0 { at.max(end) } else { at.min(end) };
                }
            }
        }
    }
    (0..2 * holes.count)
        .map(|_| {
            let x = axis_px + draw.between(-room, room);
            disc(x, draw)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::drawn::scene::{Rib, Tear};

    #[test]
    fn the_light_of_a_row_is_that_of_its_areas() {
        let scene = Scene { edges: Tear { roughness_px: 3.0, length_px: 8.0 }, ..Scene::default() };
        let bare = paint(&scene, &mut Draw::new("test", 5));
        let holes = Some(Holes { count: 3, size_px: 9.0, grey: 20.0 });
        let holed = paint(&Scene { holes, ..scene.clone() }, &mut Draw::new("test", 5));
        let rib = Some(Rib { at_px: 20.0, width_px: 7.3, over_grey: -30.0 });
        let ribbed = paint(&Scene { rib, ..scene }, &mut Draw::new("test", 5));
        let canvas = &bare.canvas;
        let rows = canvas.light.chunks_exact(canvas.width).skip(canvas.margin).take(100);
        let sum: f64 = rows.flatten().map(|&light| f64::from(light)).sum();
        let area = (sum / 100.0 - 70.0 * f64::from(u32::try_from(canvas.width).unwrap())) / 80.0;
        assert!((area - bare.truth_px).abs() < 1e-3, "{area} {}", bare.truth_px);
        // Bays make the bead narrower; a rib and closed holes do not.
        assert!(holed.truth_px < bare.truth_px && holed.truth_px > bare.truth_px - 6.0);
        assert!((ribbed.truth_px - bare.truth_px).abs() < 1e-9);
    }
}
