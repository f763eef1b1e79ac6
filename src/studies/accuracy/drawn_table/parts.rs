//! The parts of a set: all frames, and the thirds of each range.

use super::{DrawnFigures, DrawnOutcome, Part};
use crate::studies::accuracy::drawn::{DrawnSet, Parameter};

/// Parts of a range, equal in the logarithm.
const PARTS: u32 = 3;

/// Figures of a set: over all frames first, then within the thirds of each range.
pub fn figures(set: &DrawnSet, outcomes: &[DrawnOutcome]) -> Vec<DrawnFigures> {
    let all: Vec<&DrawnOutcome> = outcomes.iter().collect();
    let mut figures = vec![DrawnFigures::of(set, Part::All, &all)];
    let Some(first) = outcomes.first() else { return figures };
    for parameter in &first.parameters {
        let value = |outcome: &DrawnOutcome| {
            outcome
                .parameters
                .iter()
                .find(|other| other.name == parameter.name)
                .map(|one| one.value)
        };
        let mut parts = vec![Vec::new(); PARTS as usize];
        let mut zero = Vec::new();
        for outcome in outcomes {
            match value(outcome) {
                Some(value) if value > 0.0 => parts[part_of(parameter, value)].push(outcome),
                Some(_) => zero.push(outcome),
                None => {}
            }
        }
        if !zero.is_empty() {
            let part = Part::Zero { parameter: parameter.name };
            figures.push(DrawnFigures::of(set, part, &zero));
        }
        for (number, some) in (0..PARTS).zip(parts) {
            let (from, to) = (end(parameter, number), end(parameter, number + 1));
            let part = Part::Third { parameter: parameter.name, from, to };
            figures.push(DrawnFigures::of(set, part, &some));
        }
    }
    figures
}

/// Where a part begins.
fn end(parameter: &Parameter, number: u32) -> f64 {
    let (from, to) = parameter.range;
    from * libm::exp(f64::from(number) / f64::from(PARTS) * libm::log(to / from))
}

/// In which part a value lies.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn part_of(parameter: &Parameter, value: f64) -> usize {
    let (from, to) = parameter.range;
    let place = f64::from(PARTS) * libm::log(value / from) / libm::log(to / from);
    place.clamp(0.0, f64::from(PARTS - 1)) as usize
}
