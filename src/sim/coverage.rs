//! Bead and disturbances on the pixels before light, texture and noise: fractions of bead, and
//! added grey levels.

use super::discs::{self, Backdrop, DiscLayer, Mask};
use super::motion::ShutterPosition;
use super::shade::BeadShape;
use super::tint::{BeadLine, Tint};
use super::view::GaugeExtent;
use crate::numeric::number::narrow_to_f32;
use crate::scenario::image::ImageModel;

/// Coverage of the pixels by bead, line by line across the bead.
#[derive(Debug, Clone)]
pub struct BeadCoverage {
    /// Fraction of each pixel that is bead.
    pub fractions: Vec<f32>,
    /// Grey levels that disturbances add.
    pub added_grey: Option<Vec<f32>>,
}

/// Objects on bead and ground; `None` if the image has none of the kind.
#[derive(Debug)]
pub struct Masks {
    /// Specular spots, only on the bead.
    pub spots: Option<Mask>,
    /// Grains, on top of the spots.
    pub grains: Option<Mask>,
}

impl BeadCoverage {
    /// The bead and the tint at its edges: the mean over the image's positions during exposure.
    pub fn of(shape: &BeadShape, tint: Option<&Tint>, positions: &[ShutterPosition]) -> Self {
        let GaugeExtent { run, cross } = shape.extent;
        let mut fractions = vec![0.0; run * cross];
        let mut added = tint.map(|_| vec![0.0; run * cross]);
        let mut line = Vec::with_capacity(cross);
        for ShutterPosition { weight, shift_px } in positions {
            let weight = narrow_to_f32(*weight);
            for at in 0..run {
                let Some(first) = shape.line(at, *shift_px, &mut line) else { continue };
                let start = at * cross + first;
                for (fraction, here) in fractions[start..].iter_mut().zip(&line) {
                    *fraction += weight * here;
                }
                if let Some((tint, added)) = tint.zip(added.as_mut()) {
                    let greys = &mut added[at * cross..][..cross];
                    let here =
                        BeadLine { at, shift_px: *shift_px, first, fractions: &line, weight };
                    tint.add(shape, &here, greys);
                }
            }
        }
        Self { fractions, added_grey: added }
    }

    /// Covers bead and ground with spots and grains. `light` gives the light of a pixel by its
    /// position along and across the axis.
    pub fn cover(
        &mut self,
        shape: &BeadShape,
        image: &ImageModel,
        Masks { spots, grains }: Masks,
        light: &dyn Fn(usize, usize) -> f64,
        positions: &[ShutterPosition],
    ) {
        let count = self.fractions.len();
        let tint = self.added_grey.take().unwrap_or_else(|| vec![0.0; count]);
        let grey = [image.ground_grey, image.bead_grey];
        let scene = Backdrop { shape, grey, tint: &tint };
        let mut change = vec![0.0; count];
        if let Some(mut mask) = spots {
            // Grains lie on top.
            if let Some(grains) = &grains {
                mask.subtract(grains);
            }
            // Saturated at any light.
            let grey = |run, cross| image.bead_grey.max(255.0 / light(run, cross));
            scene.paint(&DiscLayer { mask: &mask, grey: &grey, bead_only: true }, &mut change);
        }
        if let Some(mask) = &grains {
            let grey = |_, _| image.grains.grey;
            scene.paint(&DiscLayer { mask, grey: &grey, bead_only: false }, &mut change);
        }
        let mut added = discs::blur(change, shape.extent.cross, shape.blur_px, positions);
        for (added, tint) in added.iter_mut().zip(tint) {
            *added += tint;
        }
        self.added_grey = Some(added);
    }

    /// Transposes: lines of `cross` pixels become columns.
    pub fn turned(self, cross: usize) -> Self {
        let turn = |values: Vec<f32>| -> Vec<f32> {
            (0..cross).flat_map(|at| values.iter().skip(at).step_by(cross)).copied().collect()
        };
        Self { fractions: turn(self.fractions), added_grey: self.added_grey.map(turn) }
    }
}
