//! The light of a scene on the sensor. Across the bead each boundary is the exact integral of its
//! blurred, moved step over the pixel. Blurring a sampled image instead would move an edge by 0.02
//! px with its position within a pixel at a blur of 0.5 px, more than noise does.

use std::ops::Range;

use super::draw::Draw;
use super::outline::{BrightnessStep, DrawnOutline};
use super::profile::POINTS_PER_PX;
use super::scene::DrawnScene;
use crate::numeric::number::{narrow_to_f32, to_count, to_f64};
use crate::scenario::image::TexturePattern;
use crate::sim::convolve::{convolve_lines, kernel};
use crate::sim::edge::coverage;
use crate::sim::texture::texture;

/// Distance in blurs beyond which a step counts as complete. Derived: Φ(−5) = 3·10⁻⁷.
const REACH_BLURS: f64 = 5.0;
/// Points per pixel of the table of a step. Derived: linear interpolation over h = 1/64 px has
/// an error of h²/8·φ′/s² < 10⁻⁴ for blurs from 0.5 px.
const TABLE_POINTS_PER_PX: f64 = 64.0;

/// A painted scene.
#[derive(Debug, Clone)]
pub struct Painted {
    /// Light on the image's pixels, row by row \[grey levels of a camera with gamma 1\].
    pub light: Vec<f32>,
    /// Area of the unblurred bead over the image's height \[px\].
    pub truth_px: f64,
    /// Boundaries of the scene. Their lines begin above the image, at `first_line` of the image.
    outline: DrawnOutline,
    first_line: usize,
}

impl Painted {
    /// Area of the unblurred bead within a range of rows over their height \[px\].
    pub fn mean_width_px(&self, rows: Range<usize>) -> f64 {
        let line = |row: usize| self.first_line + row * POINTS_PER_PX;
        self.outline.mean_width(line(rows.start)..line(rows.end))
    }

    /// Width of the bead before its edges were torn \[px\].
    pub fn own_width_px(&self) -> f64 {
        self.outline.width_px
    }
}

/// Paints a scene. A texture is given as the image shows it: the blur does not weaken it.
pub fn paint(scene: &DrawnScene, draw: &mut Draw) -> Painted {
    let (width, height) = scene.size;
    let blur = kernel(scene.blur_px);
    // The blur reaches beyond the first and the last row.
    let margin = blur.len();
    let rows = height + 2 * margin;
    let outline = DrawnOutline::draw(scene, rows * POINTS_PER_PX, draw);
    let edge = StepTable::new(scene.blur_px, scene.motion_px);
    let within = |values: &[f32]| values[margin * width..(margin + height) * width].to_vec();
    let layer = |value: &dyn Fn(&BrightnessStep) -> f64| {
        let mut values = vec![0.0; width * rows];
        for (row, values) in values.chunks_exact_mut(width).enumerate() {
            let lines = row * POINTS_PER_PX..(row + 1) * POINTS_PER_PX;
            edge.fill(values, lines.map(|line| outline.steps(scene, line)), value);
        }
        convolve_lines(&mut values, width, &blur);
        within(&values)
    };
    let mut light = layer(&|step| step.grey);
    let textures = [scene.texture, scene.ground_texture];
    if textures.iter().any(|patches| patches.size_grey > 0.0) {
        let concrete = layer(&|step| f64::from(u8::from(step.concrete)));
        for (patches, on_concrete) in textures.into_iter().zip([true, false]) {
            let asked =
                TexturePattern { sigma_grey: patches.size_grey, length_px: patches.length_px };
            let Some(pattern) = texture(&asked, width, height, draw.key()) else { continue };
            for ((light, fraction), value) in light.iter_mut().zip(&concrete).zip(pattern) {
                *light += value * if on_concrete { *fraction } else { 1.0 - fraction };
            }
        }
    }
    let first_line = margin * POINTS_PER_PX;
    let truth_px = outline.mean_width(first_line..(margin + height) * POINTS_PER_PX);
    Painted { light, truth_px, outline, first_line }
}

/// Table of a blurred unit step: value of a pixel by the distance of its centre from the step.
struct StepTable {
    reach_px: f64,
    values: Vec<f64>,
}

impl StepTable {
    /// For a blur (standard deviation) and a motion across the step \[px\].
    fn new(blur_px: f64, motion_px: f64) -> Self {
        let reach_px = REACH_BLURS * blur_px + 0.5 * (1.0 + motion_px);
        let value = |position: usize| {
            let inside = to_f64(position) / TABLE_POINTS_PER_PX - reach_px;
            // The mean over the pixel and over the motion: a convolution with two boxes.
            coverage(inside, [1.0, motion_px], blur_px)
        };
        let last = to_count((2.0 * reach_px * TABLE_POINTS_PER_PX).ceil());
        Self { reach_px, values: (0..=last).map(value).collect() }
    }

    /// Value of a pixel this far inside the step; 1 beyond the table.
    fn at(&self, inside_px: f64) -> f64 {
        let position = ((inside_px + self.reach_px) * TABLE_POINTS_PER_PX).max(0.0);
        let below = to_count(position);
        match self.values.get(below..below + 2) {
            Some(ends) => ends[0] + (position - to_f64(below)) * (ends[1] - ends[0]),
            None => 1.0,
        }
    }

    /// Sets each pixel of a row to the mean over the row's lines.
    fn fill(
        &self,
        row: &mut [f32],
        lines: impl Iterator<Item = Vec<BrightnessStep>>,
        value: &dyn Fn(&BrightnessStep) -> f64,
    ) {
        let fraction = 1.0 / to_f64(POINTS_PER_PX);
        let mut flanks = vec![0.0; row.len()];
        // Sum of the steps that are complete from each pixel on.
        let mut complete = vec![0.0; row.len() + 1];
        for steps in lines {
            complete[0] += fraction * steps.first().map_or(0.0, value);
            for pair in steps.windows(2) {
                let height = fraction * (value(&pair[1]) - value(&pair[0]));
                let at = pair[1].at_px - 0.5;
                let from = to_count((at - self.reach_px).ceil()).min(row.len());
                let to = to_count((at + self.reach_px).floor() + 1.0);
                let to = to.clamp(from, row.len());
                for (pixel, flank) in flanks.iter_mut().enumerate().take(to).skip(from) {
                    *flank += height * self.at(to_f64(pixel) - at);
                }
                complete[to] += height;
            }
        }
        let mut level = 0.0;
        for ((pixel, flank), step) in row.iter_mut().zip(flanks).zip(complete) {
            level += step;
            *pixel = narrow_to_f32(level + flank);
        }
    }
}

#[cfg(test)]
mod tests;
