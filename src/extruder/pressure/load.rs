//! The load: pressure that the commands do not cause. A step of it is answered at once by the
//! model; what changes slowly is left to the feedback.

use super::load_step::{Innovation, LoadStepDetector};

/// Weight of a reading in the slow average that innovations are taken from: a load step of the size
/// of the noise is gone from them after some 0.3 s at 50 readings a second.
const AVERAGE_WEIGHT: f64 = 0.075;
/// Variance of an innovation over that of a reading. Derived: 1 + w/(2 − w) of an average with a
/// weight of w, and some of the drift.
const INNOVATION_VARIANCE: f64 = 1.1;
/// Standard deviation of a step of the load, in standard deviations of a reading: 0.06 MPa of the
/// noise of Ma et al. 2026.
const STEP_SIGMAS: f64 = 8.5;
/// Log likelihood ratio from which a step is detected. A smaller one takes noise for a step; with
/// this one a load of 0.1 MPa in the noise of Ma et al. 2026 is detected after some 0.2 s.
const THRESHOLD: f64 = 10.0;

/// The load, in steady state and now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    lag_s: f64,
    settled: f64,
    now: f64,
    average: f64,
    detector: LoadStepDetector,
}

impl Load {
    /// A load that has settled \[MPa\], behind a lag \[s\], for readings with a standard deviation
    /// \[MPa\].
    pub fn new(settled: f64, lag_s: f64, sigma: f64) -> Self {
        let detector = LoadStepDetector::new(lag_s, STEP_SIGMAS * sigma, THRESHOLD);
        Self { lag_s, settled, now: settled, average: 0.0, detector }
    }

    /// Advances by a time \[s\].
    pub fn advance(&mut self, dt_s: f64) {
        self.now = self.ahead(dt_s);
    }

    /// The load now \[MPa\].
    pub const fn now(&self) -> f64 {
        self.now
    }

    /// The load after a time \[s\] \[MPa\].
    pub fn ahead(&self, dt_s: f64) -> f64 {
        self.settled + (self.now - self.settled) * libm::exp(-dt_s / self.lag_s)
    }

    /// Slow average of the residual \[MPa\].
    pub const fn average(&self) -> f64 {
        self.average
    }

    /// Adds a part that has settled \[MPa\]: it is in the residual no more.
    pub fn add(&mut self, settled: f64) {
        self.settled += settled;
        self.now += settled;
        self.average -= settled;
    }

    /// The model's pressure has changed by a difference \[MPa\].
    pub fn shift(&mut self, by: f64) {
        self.average -= by;
    }

    /// Looks for a step of the load in the residual of a reading, `dt_s` after the last, with a
    /// standard deviation \[MPa\]. Takes it up; returns by how much the load now has changed
    /// \[MPa\].
    pub fn detect(&mut self, residual: f64, sigma: f64, dt_s: f64) -> Option<f64> {
        let difference = residual - self.average;
        self.average += AVERAGE_WEIGHT * difference;
        let variance = INNOVATION_VARIANCE * sigma * sigma;
        let step = self.detector.update(Innovation { difference, variance }, dt_s)?;
        let shown = step.settled * step.shown_fraction;
        self.settled += step.settled;
        self.now += shown;
        self.average -= shown;
        Some(shown)
    }

    /// Follows the residual without looking for a step: the pressure moves for another reason.
    pub fn follow(&mut self, residual: f64) {
        self.average += AVERAGE_WEIGHT * (residual - self.average);
        self.detector.reset();
    }
}
