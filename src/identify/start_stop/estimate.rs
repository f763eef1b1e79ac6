//! Estimated starts and stops of an extruder.

use super::parameters::StartStop;

/// An observed start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedStart {
    /// When the command began \[s\].
    pub at_s: f64,
    /// Pause before it \[s\].
    pub idle_s: f64,
    /// Steady flow after it \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// From the command to the first flow \[s\].
    pub delay_s: f64,
    /// That delay by the fitted model \[s\].
    pub modelled_s: f64,
}

/// An observed stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedStop {
    /// When the command ended \[s\].
    pub at_s: f64,
    /// Flow before it \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// Observation time \[s\].
    pub observed_s: f64,
    /// Volume in that time, with the material under way \[mm³\].
    pub volume_mm3: f64,
}

/// The estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct StartStopFit {
    /// The parameters.
    pub parameters: StartStop,
    /// Their standard errors, each in its own unit.
    pub sigma: StartStop,
    /// Runs of the pump, those without information included.
    pub runs: usize,
    /// Starts after a known pause.
    pub starts: Vec<ObservedStart>,
    /// Stops.
    pub stops: Vec<ObservedStop>,
    /// Standard deviation of the delays about the model \[s\].
    pub delay_sigma_s: f64,
}
