//! The parts of a set: all frames, and the thirds of each range.

use std::collections::BTreeMap;

use super::figures::{DrawnFigures, DrawnOutcome, SetPart};
use super::limits;
use crate::numeric::number::to_count;
use crate::numeric::statistics::Moments;
use crate::studies::accuracy::drawn::{DrawnParameter, DrawnSet};
use crate::studies::accuracy::figures::fraction;

/// Number of parts of a range, equal in the logarithm.
const RANGE_PARTS: u32 = 3;
/// Number of frames with the largest errors that are listed.
const WORST_FRAMES: usize = 5;

/// Figures of a set: over all frames first, then within the thirds of each range.
pub fn figures(set: &DrawnSet, outcomes: &[DrawnOutcome]) -> Vec<DrawnFigures> {
    let all: Vec<&DrawnOutcome> = outcomes.iter().collect();
    let mut figures = vec![figures_of(set, SetPart::All, &all)];
    let Some(first) = outcomes.first() else { return figures };
    for parameter in &first.parameters {
        let value = |outcome: &DrawnOutcome| {
            outcome
                .parameters
                .iter()
                .find(|other| other.name == parameter.name)
                .map(|one| one.value)
        };
        let mut parts = vec![Vec::new(); RANGE_PARTS as usize];
        let mut zero = Vec::new();
        for outcome in outcomes {
            match value(outcome) {
                Some(value) if value > 0.0 => parts[part_of(parameter, value)].push(outcome),
                Some(_) => zero.push(outcome),
                None => {}
            }
        }
        if !zero.is_empty() {
            let part = SetPart::Zero { parameter: parameter.name };
            figures.push(figures_of(set, part, &zero));
        }
        for (number, some) in (0..RANGE_PARTS).zip(parts) {
            let (from, to) = (end(parameter, number), end(parameter, number + 1));
            let part = SetPart::Third { parameter: parameter.name, from, to };
            figures.push(figures_of(set, part, &some));
        }
    }
    figures
}

/// Figures of some frames of a set.
fn figures_of(set: &DrawnSet, part: SetPart, outcomes: &[&DrawnOutcome]) -> DrawnFigures {
    let (mut errors, mut ratios) = (Moments::default(), Moments::default());
    let mut refused = BTreeMap::new();
    let (mut silent, mut without_gamma) = (0, 0);
    let mut by_ratio = Vec::new();
    for outcome in outcomes {
        match outcome.width {
            Ok(found) => {
                let ratio = found.error_px / found.sigma_px;
                errors.add(found.error_px);
                ratios.add(ratio);
                silent += usize::from(found.is_silent());
                by_ratio.push((ratio.abs(), outcome.frame));
            }
            Err(refusal) => {
                *refused.entry(refusal.status).or_insert(0) += 1;
                without_gamma += usize::from(!refusal.names_gamma);
            }
        }
    }
    by_ratio.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut figures = DrawnFigures {
        set: set.name,
        part,
        frames: outcomes.len(),
        measured_fraction: fraction(by_ratio.len(), outcomes.len()),
        bias_px: errors.mean(),
        rmse_px: errors.rms(),
        z: ratios.rms(),
        silent,
        rejected: refused,
        without_gamma,
        worst: by_ratio.iter().take(WORST_FRAMES).map(|(_, frame)| *frame).collect(),
        missed: Vec::new(),
    };
    figures.missed = limits::misses(&figures, &set.requirements, by_ratio.len());
    figures
}

/// Lower end of a part; part `RANGE_PARTS` gives the range's upper end.
fn end(parameter: &DrawnParameter, number: u32) -> f64 {
    let (from, to) = parameter.range;
    from * libm::exp(f64::from(number) / f64::from(RANGE_PARTS) * libm::log(to / from))
}

/// Index of the part in which a value lies.
fn part_of(parameter: &DrawnParameter, value: f64) -> usize {
    let (from, to) = parameter.range;
    let position = f64::from(RANGE_PARTS) * libm::log(value / from) / libm::log(to / from);
    to_count(position.clamp(0.0, f64::from(RANGE_PARTS - 1)))
}
