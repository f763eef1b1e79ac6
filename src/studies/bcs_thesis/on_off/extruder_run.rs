//! Voltage and flow of the extruder in a run, independent of the wheel.

use crate::core::Stamp;
use crate::extruder::feedforward::FeedforwardError;
use crate::numeric::average::mean;
use crate::numeric::lti::{Between, Simulator};
use crate::numeric::number::to_count;
use crate::sim::hash::{mix, normal_pair};
use crate::studies::bcs_thesis::{drive, flow};

/// Step of the plant \[s\]: papers.md, "001, on/off".
pub(super) const STEP_S: f64 = 0.001;
/// Length of a run \[s\]: papers.md, "001, on/off".
const LENGTH_S: f64 = 90.0;
/// Time from which the section is judged \[s\]: papers.md, "001, on/off".
pub const JUDGED_FROM_S: f64 = 15.0;
/// Target section \[mm²\]: papers.md, "001, on/off".
pub const AREA_MM2: f64 = 45.0;
/// Speed of the wheel's surface \[mm/s per rpm\]. Derived: π·d/60 with d = 254.762 mm, bead
/// characterisation thesis, § 2.1.
pub const MM_PER_S_PER_RPM: f64 = std::f64::consts::PI * 254.762 / 60.0;
/// Correlation time of the unmodelled flow \[s\]: papers.md, "001, on/off".
pub const CORRELATION_S: f64 = 0.15;
/// Standard deviation of the unmodelled flow over that of the flow. Derived: 1 − 0.83, the NRMSE
/// fit of the thesis' model (papers.md, "001, on/off").
pub const UNMODELLED_FRACTION: f64 = 0.17;

/// Voltage and flow of the extruder in a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderRun {
    pub(super) seed: u64,
    /// Drive voltage \[V\] at every step.
    pub(super) voltage: Vec<f64>,
    /// Flow at the nozzle, unmodelled part included \[mm³/s\].
    pub(super) flow: Vec<f64>,
    /// Mean flow over the judged time \[mm³/s\].
    pub(super) mean_flow: f64,
    /// Standard deviation of the unmodelled part of the flow \[mm³/s\].
    pub(super) unmodelled: f64,
}

impl ExtruderRun {
    /// A run with a seed, and the standard deviation of the unmodelled flow over that of the flow.
    pub fn new(seed: u64, unmodelled_fraction: f64) -> Result<Self, FeedforwardError> {
        let steps = to_steps(LENGTH_S);
        let voltage: Vec<f64> = (0_u64..).take(steps).map(|step| voltage(seed, step)).collect();
        let (mut g1, mut g2) = (
            Simulator::new(&drive()?, STEP_S, Between::Held)?,
            Simulator::new(&flow()?, STEP_S, Between::Linear)?,
        );
        let start = voltage.first().copied().unwrap_or(0.0);
        g1.settle(start)?;
        g2.settle(start * drive()?.dc_gain())?;
        let mut flow: Vec<f64> = voltage.iter().map(|v| g2.step(g1.step(*v))).collect();
        let judged = flow.get(to_steps(JUDGED_FROM_S)..).unwrap_or_default();
        let mean_flow = mean(judged.iter().copied());
        let sigma = mean(judged.iter().map(|q| (q - mean_flow).powi(2))).sqrt();
        let unmodelled = unmodelled_fraction * sigma;
        let kept = libm::exp(-STEP_S / CORRELATION_S);
        let fresh = (1.0 - kept * kept).sqrt();
        let mut noise = normal_pair(mix(&[seed, 2, 0]))[0];
        for (step, q) in (1_u64..).zip(&mut flow) {
            *q += unmodelled * noise;
            noise = kept * noise + fresh * normal_pair(mix(&[seed, 2, step]))[0];
        }
        Ok(Self { seed, voltage, flow, mean_flow, unmodelled })
    }
}

fn voltage(seed: u64, step: u64) -> f64 {
    let (constant, held) = (8000, 1500);
    let Some(since) = step.checked_sub(constant) else { return 3.0 };
    3.0 + 0.45 * normal_pair(mix(&[seed, 1, since / held]))[0]
}

pub(super) fn at(step: u64) -> Stamp {
    Stamp::from_ns(step * 1_000_000)
}

pub(super) fn to_steps(seconds: f64) -> usize {
    to_count((seconds / STEP_S).round())
}
