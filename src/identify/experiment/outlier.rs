//! Samples far beyond all others, which are no measurements.

use super::error::{DataColumn, ExperimentError};

/// Distance beyond the range of the others, in such ranges, from which a sample is no
/// measurement. A choice: errors that a sensor may have are left to --hampel.
const OUTLIER_RANGES: f64 = 20.0;
/// Samples per outlier; more outliers belong to the signal.
const SAMPLES_PER_OUTLIER: usize = 1000;

/// Refuses a column with a few samples far beyond all others. Accepts it where the others are
/// constant: pulses from rest are an excitation.
pub(super) fn check(side: DataColumn, values: &[f64]) -> Result<(), ExperimentError> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let most = (values.len() / SAMPLES_PER_OUTLIER).max(1);
    let found = (1..=most)
        .find_map(|count| (0..=count).find_map(|low| farthest_outlier(&sorted, low, count)));
    let Some((count, value, others)) = found else { return Ok(()) };
    let at = values.iter().position(|v| *v == value).unwrap_or(0);
    Err(ExperimentError::Outlier { side, at, value, count, others })
}

/// The farthest of `count` samples, `low` of them at the lower end, and the range
/// of the others; none where these reach nearly as far.
fn farthest_outlier(sorted: &[f64], low: usize, count: usize) -> Option<(usize, f64, [f64; 2])> {
    let others = sorted.get(low..sorted.len().checked_sub(count - low)?)?;
    let (least, most) = (*others.first()?, *others.last()?);
    let limit = OUTLIER_RANGES * (most - least);
    let below = || sorted.iter().take(low).map(|v| (*v, least - v));
    let above = || sorted.iter().skip(low + others.len()).map(|v| (*v, v - most));
    let are_beyond = limit > 0.0 && below().chain(above()).all(|(_, by)| by > limit);
    let farthest = below().chain(above()).max_by(|a, b| a.1.total_cmp(&b.1))?;
    are_beyond.then_some((count, farthest.0, [least, most]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn swinging(count: u32) -> Vec<f64> {
        (0..count).map(|k| 50.0 + 5.0 * (0.1 * f64::from(k)).sin()).collect()
    }

    fn with(positions: &[(usize, f64)]) -> Result<(), ExperimentError> {
        let mut values = swinging(3000);
        for (at, value) in positions {
            values[*at] = *value;
        }
        check(DataColumn::Output, &values)
    }

    #[test]
    fn a_sample_that_nothing_measured_is_named() {
        for value in [1e300, 1e11, -1e11, 9999.0, -400.0] {
            let said = with(&[(700, value)]).unwrap_err().to_string();
            assert!(said.contains("at sample 701, and all others lie between 45"), "{said}");
            assert!(said.len() < 250 && said.contains("--hampel"), "{said}");
        }
        let both = with(&[(7, 1e300), (9, -1e300)]).unwrap_err().to_string();
        assert!(both.contains("the farthest of 2"), "{both}");
        let said = with(&[(7, 1e6), (2000, 9e5), (2900, -2e5)]).unwrap_err().to_string();
        assert!(said.contains("is 1000000 at sample 8 (the farthest of 3)"), "{said}");
    }

    #[test]
    fn readings_that_a_sensor_can_give_and_pulses_pass() {
        assert_eq!(with(&[]), Ok(()));
        assert_eq!(with(&[(700, 100.0)]), Ok(()));
        let mut pulse = vec![0.0; 3000];
        pulse[40] = 10.0;
        assert_eq!(check(DataColumn::Input, &pulse), Ok(()));
        // An answer to pulses, which begins and ends with noise.
        let mut answer: Vec<f64> = swinging(3000).iter().map(|v| 1e-3 * v).collect();
        for (k, value) in answer.iter_mut().skip(900).take(60).enumerate() {
            *value += 100.0 * 0.9_f64.powi(i32::try_from(k).unwrap());
        }
        assert_eq!(check(DataColumn::Output, &answer), Ok(()));
    }
}
