//! Whether what is to be fitted goes with the samples that there are.

use super::error::FitError;
use super::samples::Samples;
use super::settings::{DeadTime, FitSettings, MAX_POLES};

/// Fewer samples for each parameter say nothing about the noise.
const SAMPLES_PER_PARAMETER: usize = 5;

/// Whether a model of this form can be fitted to so many samples.
pub(super) fn check(settings: &FitSettings, samples: &Samples) -> Result<(), FitError> {
    let (poles, zeros) = (settings.structure.poles(), settings.structure.zeros());
    if poles == 0 || poles > MAX_POLES || zeros > poles {
        return Err(FitError::Order { poles, zeros });
    }
    let (least_s, most_s) = match settings.dead_time {
        DeadTime::Known(given) => (given, given),
        DeadTime::Estimated { min_s: least_s, max_s: most_s } => (least_s, most_s),
    };
    let most_allowed_s = 0.5 * samples.duration_s();
    let possible = least_s >= 0.0 && most_s >= least_s && most_s <= most_allowed_s;
    let estimated = matches!(settings.dead_time, DeadTime::Estimated { .. });
    if !possible || (estimated && most_s == least_s) {
        return Err(FitError::DeadTimeRange {
            min_s: least_s,
            max_s: most_s,
            max_allowed_s: most_allowed_s,
        });
    }
    let (found, parameters) = (samples.len(), settings.parameters());
    let needed = SAMPLES_PER_PARAMETER * parameters;
    if found < needed {
        return Err(FitError::TooFewForParameters { found, parameters, needed });
    }
    Ok(())
}
