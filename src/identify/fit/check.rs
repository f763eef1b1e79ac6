//! Whether settings and samples of a fit are compatible.

use super::error::FitError;
use super::samples::Samples;
use super::settings::{DeadTime, FitSettings, MAX_POLES};

/// Samples for each parameter below which the noise cannot be estimated. A choice.
const SAMPLES_PER_PARAMETER: usize = 5;

/// Whether a model of this structure can be fitted to the samples.
pub(super) fn check(settings: &FitSettings, samples: &Samples) -> Result<(), FitError> {
    let (poles, zeros) = (settings.structure.poles(), settings.structure.zeros());
    if poles == 0 || poles > MAX_POLES || zeros > poles {
        return Err(FitError::Order { poles, zeros });
    }
    let (min_s, max_s) = match settings.dead_time {
        DeadTime::Known(given) => (given, given),
        DeadTime::Estimated { min_s, max_s } => (min_s, max_s),
    };
    let max_allowed_s = 0.5 * samples.duration_s();
    let possible = min_s >= 0.0 && max_s >= min_s && max_s <= max_allowed_s;
    let estimated = matches!(settings.dead_time, DeadTime::Estimated { .. });
    if !possible || (estimated && max_s == min_s) {
        return Err(FitError::DeadTimeRange { min_s, max_s, max_allowed_s });
    }
    let (found, parameters) = (samples.len(), settings.parameters());
    let needed = SAMPLES_PER_PARAMETER * parameters;
    if found < needed {
        return Err(FitError::TooFewForParameters { found, parameters, needed });
    }
    Ok(())
}
