//! What the data do not determine, with a message that says which parameters to leave out.

use std::fmt;

/// What the data do not determine.
#[derive(Debug, Clone, PartialEq)]
pub enum Undetermined {
    /// The highest coefficient of the denominator does not differ from zero, so that one pole
    /// fewer is enough. Parameters that are divided by that coefficient may nevertheless look
    /// well determined.
    Pole {
        /// Requested number of poles.
        poles: usize,
        /// The coefficient of the highest power of s in a denominator that ends
        /// with 1.
        coefficient: f64,
        /// Its standard error; infinite if undetermined.
        sigma: f64,
        /// A pole and a zero that nearly cancel \[1/s\].
        pair: Option<(f64, f64)>,
    },
    /// The static gain does not differ from zero: the output does not depend on the input.
    Gain {
        /// The gain.
        gain: f64,
        /// Its standard error; infinite if undetermined.
        sigma: f64,
    },
    /// The dead time may be none, or several time constants.
    DeadTime {
        /// The dead time \[s\].
        dead_time_s: f64,
        /// Its standard error \[s\]; infinite if undetermined.
        sigma_s: f64,
    },
    /// Parameters whose changes compensate each other.
    Combination {
        /// Their names.
        names: Vec<String>,
        /// A pole and a zero that nearly cancel \[1/s\], at an undetermined position.
        pair: Option<(f64, f64)>,
    },
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pole { poles, coefficient, sigma, pair } => {
                write!(
                    f,
                    "the data do not distinguish {poles} pole{} from {}: in a denominator that ends with \
                     1 the coefficient of s^{poles} is {coefficient:.2e} with a standard error of \
                     {sigma:.2e}, which is no more than chance",
                    if *poles == 1 { "" } else { "s" },
                    poles.saturating_sub(1)
                )?;
                write_cancelling_pair(f, *pair)
            }
            Self::Gain { gain, sigma } => write!(
                f,
                "the data do not determine the gain: {gain:.2e} with a standard error of {sigma:.2e} \
                 may be none at all. Look whether the output answers the input, and whether \
                 something else held it (a closed loop does)"
            ),
            Self::DeadTime { dead_time_s, sigma_s } => write!(
                f,
                "the data do not determine the dead time: {dead_time_s:.3} s with a standard error of \
                 {sigma_s:.3} s, longer than itself and than the slowest time constant"
            ),
            Self::Combination { names, pair } => {
                match names.split_last() {
                    Some((last, others)) if !others.is_empty() => write!(
                        f,
                        "the data do not determine {} and {last}: a change of one makes up for \
                         the others",
                        others.join(", ")
                    ),
                    Some((only, _)) => write!(f, "the data do not determine {only}"),
                    None => f.write_str("the data do not determine the parameters"),
                }?;
                write_cancelling_pair(f, *pair)
            }
        }
    }
}

fn write_cancelling_pair(f: &mut fmt::Formatter<'_>, pair: Option<(f64, f64)>) -> fmt::Result {
    match pair {
        Some((pole, zero)) => {
            write!(f, " (a pole at {pole:.3} 1/s and a zero at {zero:.3} 1/s all but cancel)")
        }
        None => Ok(()),
    }
}
