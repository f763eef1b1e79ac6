//! What was found of an extruder's starts and stops.

use super::parameters::StartStop;

/// A start as it was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedStart {
    /// When the command began \[s\].
    pub at_s: f64,
    /// How long the pump had stood \[s\].
    pub idle_s: f64,
    /// Flow that it came to \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// From the command to the first flow \[s\].
    pub delay_s: f64,
    /// What the fitted model says of it \[s\].
    pub modelled_s: f64,
}

/// A stop as it was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedStop {
    /// When the command ended \[s\].
    pub at_s: f64,
    /// Flow before it \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// How long the flow was looked at after it \[s\].
    pub observed_s: f64,
    /// What came in that time, with what was on its way \[mm³\].
    pub volume_mm3: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct StartStopFit {
    /// The parameters.
    pub parameters: StartStop,
    /// Their standard errors, each in its own unit.
    pub sigma: StartStop,
    /// Runs of the pump, with those that tell nothing.
    pub runs: usize,
    /// Starts after a pause that is known.
    pub starts: Vec<ObservedStart>,
    /// Stops.
    pub stops: Vec<ObservedStop>,
    /// Standard deviation of the delays about the model \[s\].
    pub delay_sigma_s: f64,
}
