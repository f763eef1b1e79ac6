//! Requirements of a set that some of its frames miss.

use super::figures::{DrawnFigures, SetPart};
use crate::numeric::number::to_f64;
use crate::studies::accuracy::drawn::Requirements;

/// Frames for which the limits hold without an allowance: the default of `lab accuracy
/// --random`.
const FULL_SET_FRAMES: usize = 30_000;
/// Standard errors by which a figure of fewer frames or of a part may miss its limit. Derived:
/// three miss one figure in 370 by chance.
const ALLOWANCE_SIGMAS: f64 = 3.0;
/// Smallest number of measured frames of a part that is judged. Derived: a z of 30 frames has a
/// standard error of 1/√60, 13 %.
const MIN_FRAMES: usize = 30;

/// The requirements that are missed. Fractions and messages of rejections are judged over all
/// frames of a set, bias and z also within each part.
pub fn misses(figures: &DrawnFigures, required: &Requirements, measured: usize) -> Vec<String> {
    let whole = figures.part == SetPart::All;
    if !whole && measured < MIN_FRAMES {
        return Vec::new();
    }
    let chance = if whole && figures.frames >= FULL_SET_FRAMES { 0.0 } else { ALLOWANCE_SIGMAS };
    let mut missed = of_errors(figures, required, chance, measured);
    if whole {
        missed.splice(0..0, of_fractions(figures, required, chance));
    }
    missed
}

fn of_errors(
    figures: &DrawnFigures,
    required: &Requirements,
    chance: f64,
    measured: usize,
) -> Vec<String> {
    let count = to_f64(measured.max(1));
    let mut missed = Vec::new();
    if let (Some(max), Some(bias), Some(rmse)) =
        (required.bias_px, figures.bias_px, figures.rmse_px)
        && bias.abs() > max + chance * rmse / count.sqrt()
    {
        missed.push(format!("bias {bias:.3} px"));
    }
    if let (Some((min, max)), Some(z)) = (required.z, figures.z) {
        let allowance = chance / (2.0 * count).sqrt();
        if z < min - allowance || z > max + allowance {
            missed.push(format!("z {z:.2}"));
        }
    }
    missed
}

fn of_fractions(figures: &DrawnFigures, required: &Requirements, chance: f64) -> Vec<String> {
    let frames = to_f64(figures.frames);
    let mut missed = Vec::new();
    if let Some(min) = required.measured {
        let allowance = chance * (min * (1.0 - min) / frames.max(1.0)).sqrt();
        if figures.measured_fraction < min - allowance {
            missed.push(format!("measured {:.2} %", 100.0 * figures.measured_fraction));
        }
    }
    if let Some(max) = required.silent
        && to_f64(figures.silent) > (max * frames).floor()
    {
        missed.push(format!("silently wrong {}", figures.silent));
    }
    if let Some(allowed) = required.statuses {
        let others = figures.rejected.iter().filter(|(status, _)| !allowed.contains(status));
        let count: usize = others.map(|(_, count)| count).sum();
        if count > 0 {
            missed.push(format!("refused otherwise {count}"));
        }
    }
    if required.names_gamma && figures.without_gamma > 0 {
        missed.push(format!("refused without a word on gamma {}", figures.without_gamma));
    }
    missed
}
