//! Which requirements of a set some of its frames miss.

use super::figures::{DrawnFigures, Part};
use crate::studies::accuracy::drawn::Requirements;

/// Frames that the limits are made for: figures over as many have no allowance.
const FULL: usize = 30_000;
/// Standard errors that figures of fewer frames, or of a part of them, may be off.
const CHANCE: f64 = 3.0;
/// Fewest measured frames of a part that are judged.
const MIN_FRAMES: usize = 30;

/// What is missed. Shares, and the words of refusals, are judged over all frames of a
/// set, bias and z within each part.
pub fn misses(figures: &DrawnFigures, required: &Requirements, measured: usize) -> Vec<String> {
    let whole = figures.part == Part::All;
    if !whole && measured < MIN_FRAMES {
        return Vec::new();
    }
    let chance = if whole && figures.frames >= FULL { 0.0 } else { CHANCE };
    let mut missed = of_errors(figures, required, chance, measured);
    if whole {
        missed.splice(0..0, of_shares(figures, required, chance));
    }
    missed
}

#[expect(clippy::cast_precision_loss, reason = "no set has 2^53 frames")]
fn of_errors(
    figures: &DrawnFigures,
    required: &Requirements,
    chance: f64,
    measured: usize,
) -> Vec<String> {
    let count = measured.max(1) as f64;
    let mut missed = Vec::new();
    if let (Some(most), Some(bias), Some(rmse)) =
        (required.bias_px, figures.bias_px, figures.rmse_px)
        && bias.abs() > most + chance * rmse / count.sqrt()
    {
        missed.push(format!("bias {bias:.3} px"));
    }
    if let (Some((least, most)), Some(z)) = (required.z, figures.z) {
        let allowance = chance / (2.0 * count).sqrt();
        if z < least - allowance || z > most + allowance {
            missed.push(format!("z {z:.2}"));
        }
    }
    missed
}

#[expect(clippy::cast_precision_loss, reason = "no set has 2^53 frames")]
fn of_shares(figures: &DrawnFigures, required: &Requirements, chance: f64) -> Vec<String> {
    let frames = figures.frames as f64;
    let mut missed = Vec::new();
    if let Some(least) = required.measured {
        let allowance = chance * (least * (1.0 - least) / frames.max(1.0)).sqrt();
        if figures.measured_share < least - allowance {
            missed.push(format!("measured {:.2} %", 100.0 * figures.measured_share));
        }
    }
    if let Some(most) = required.silent
        && figures.silent as f64 > (most * frames).floor()
    {
        missed.push(format!("silently wrong {}", figures.silent));
    }
    if let Some(allowed) = required.statuses {
        let others = figures.refused.iter().filter(|(status, _)| !allowed.contains(status));
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
