//! What is drawn of a run through the corner.

use crate::studies::bcs_thesis::corner::CornerRun;

/// What is drawn of a run.
#[derive(Debug)]
pub struct Around {
    /// Its name.
    pub name: &'static str,
    /// Places \[mm\] and by how much the width is off \[%\].
    pub error: Vec<(f64, f64)>,
    /// Places and the robot's speed \[mm/s\].
    pub speed: Vec<(f64, f64)>,
    /// Places and the flow \[mm³/s\].
    pub flow: Vec<(f64, f64)>,
}

impl Around {
    /// Of a run.
    pub fn of(name: &'static str, run: &CornerRun) -> Self {
        let percent = |(at, error): (f64, f64)| (at, 100.0 * error);
        let over = |of: fn((f64, f64, f64)) -> f64| -> Vec<(f64, f64)> {
            run.trajectory().map(|here| (here.0, of(here))).collect()
        };
        let error = run.quiet().along().map(percent).collect();
        Self { name, error, speed: over(|here| here.1), flow: over(|here| here.2) }
    }
}
