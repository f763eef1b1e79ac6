//! Why there is no fit.

use super::samples::SamplesError;
use super::undetermined::Undetermined;
use crate::identify::digits::{six_digits, three_digits};
use crate::numeric::lti::ModelError;

/// Why there is no fit, with what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The data themselves.
    #[error(transparent)]
    Data(#[from] SamplesError),
    /// Unsupported numbers of poles and zeros.
    #[error("{poles} poles and {zeros} zeros; give 1 to 4 poles and at most as many zeros")]
    Order {
        /// Requested number of poles.
        poles: usize,
        /// Requested number of zeros.
        zeros: usize,
    },
    /// An invalid range of dead times.
    #[error(
        "a dead time of {} to {} s; give a range that begins at 0 or above and ends \
         above that, by half the record ({max_allowed_s:.3} s) at the latest",
        six_digits(*.min_s), six_digits(*.max_s)
    )]
    DeadTimeRange {
        /// Lower end \[s\].
        min_s: f64,
        /// Upper end \[s\].
        max_s: f64,
        /// Latest upper end \[s\].
        max_allowed_s: f64,
    },
    /// Fewer samples than the parameters need.
    #[error("{found} samples for {parameters} parameters; it needs at least {needed}")]
    TooFewForParameters {
        /// Samples.
        found: usize,
        /// Parameters.
        parameters: usize,
        /// Samples that are needed.
        needed: usize,
    },
    /// The best model hardly differs from a constant.
    #[error(
        "the output does not depend on the input: the best model explains {explained_percent:.2} % \
         of its variance, and {chance_percent:.2} % could be chance; look whether the columns are \
         the right ones, or excite the input more"
    )]
    NoDependence {
        /// Fraction of the output's variance that the model explains \[%\].
        explained_percent: f64,
        /// Fraction that such a model might explain of noise alone \[%\].
        chance_percent: f64,
    },
    /// A pole at the edge of stability.
    #[error(
        "the fit runs against the edge of stability: a pole at {re:.3e} 1/s, slower than ten \
         records of {record_s:.1} s; the output drifts or integrates, or the record is too short \
         to see it settle"
    )]
    UnstableFit {
        /// Real part of the pole \[1/s\].
        re: f64,
        /// Length of the record \[s\].
        record_s: f64,
    },
    /// A drifting output, and a model that follows the drift.
    #[error(
        "the output drifts: a straight line in time explains {explained_percent:.1} % of it ({} by {} \
         over {record_s:.1} s) and not the input, and the model follows that line. Hold temperature \
         and feed steady, use a part without the drift (--from-s, --to-s), or take the line out of \
         the log; an extruder that is so slow takes a longer log", if *.rise > 0.0 { "up" } else {
            "down"
        }, three_digits(.rise.abs())
    )]
    Drift {
        /// Fraction of the output's variance that the line explains \[%\].
        explained_percent: f64,
        /// By how much it rises over the record, in units of the output.
        rise: f64,
        /// Length of the record \[s\].
        record_s: f64,
    },
    /// The dead time is at an end of its range.
    #[error(
        "the dead time runs against the {end} end of its range, {} s; widen the range, or \
         look whether input and output are on one clock", six_digits(*.bound_s)
    )]
    DeadTimeAtBound {
        /// `lower` or `upper`.
        end: &'static str,
        /// That end \[s\].
        bound_s: f64,
    },
    /// Real poles were requested, and the data oscillate.
    #[error(
        "two real poles were asked for, but the data say a damping of {damping:.2}; take the \
         oscillating second order"
    )]
    PolesNotReal {
        /// ζ of the best fit.
        damping: f64,
    },
    /// The data do not determine all parameters.
    #[error("{0}; take fewer poles or zeros, or excite the input more")]
    Undetermined(Undetermined),
    /// No initial model was found.
    #[error(
        "no model of this form could be started: the output does not follow the input with any \
         dead time in the range"
    )]
    NoStart,
    /// An invalid model.
    #[error(transparent)]
    Model(#[from] ModelError),
}
