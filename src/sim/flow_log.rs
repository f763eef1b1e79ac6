//! A log of an extruder whose model is known, to try `extruder identify` without a machine.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::identify::excitation::{Excitation, ExcitationError, Waveform};
use crate::numeric::lti::{Between, ModelError, SecondOrder, Simulator, TransferFunction};

/// Sample time \[s\]: 50 Hz.
pub const STEP_S: f64 = 0.02;
/// Operating point of the screw \[rpm\].
const MIDDLE_RPM: f64 = 30.0;
/// Flow at the operating point \[mm³/s\], a choice: the model describes deviations from it.
const MIDDLE_MM3_PER_S: f64 = 540.0;
/// Standard deviation of the flow's noise \[mm³/s\]. Derived: 13 % of the excited flow, 5
/// rpm·19.05.
const NOISE_MM3_PER_S: f64 = 12.0;

/// Why a log cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FlowLogError {
    /// The excitation is not valid.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// The model is not valid.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// A log: samples of command and flow.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowLog {
    /// Sample times \[s\].
    pub time_s: Vec<f64>,
    /// Commanded speed of the screw \[rpm\].
    pub screw_rpm: Vec<f64>,
    /// Measured flow \[mm³/s\].
    pub flow_mm3_per_s: Vec<f64>,
}

/// The extruder: gain 19.05 mm³/s for each rpm, damping 0.6, one over the
/// natural frequency 0.81 s, dead time 0.25 s (after the flow model of the
/// bead characterisation thesis, whose poles are −0.738 ± 0.993i).
pub fn truth() -> Result<TransferFunction, ModelError> {
    SecondOrder::Oscillating {
        gain: 19.05,
        period_s: 0.81,
        damping: 0.6,
        zero_s: 0.0,
        dead_time_s: 0.25,
    }
    .transfer()
}

/// A log for the fit: a binary sequence of 7 bits between 25 and 35 rpm.
pub fn binary() -> Result<FlowLog, FlowLogError> {
    let shape = Waveform::Prbs { bits: 7, low: 25.0, high: 35.0 };
    record(&Excitation { shape, hold_s: 0.7, duration_s: None }, 1)
}

/// A log for validation: random levels for 60 s.
pub fn gaussian() -> Result<FlowLog, FlowLogError> {
    let shape = Waveform::Gaussian { mean: MIDDLE_RPM, sigma: 4.0, low: 20.0, high: 40.0, seed: 2 };
    record(&Excitation { shape, hold_s: 1.5, duration_s: Some(60.0) }, 3)
}

fn record(excitation: &Excitation, seed: u64) -> Result<FlowLog, FlowLogError> {
    let profile = excitation.profile()?.with_lead(MIDDLE_RPM, 5.0, 5.0);
    let profile = profile.map_err(ExcitationError::from)?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some thousand samples"
    )]
    let count = (profile.end_s() / STEP_S).floor() as u32;
    let screw_rpm = profile.sampled(STEP_S, count);
    let mut extruder = Simulator::new(&truth()?, STEP_S, Between::Held)?;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let flow = screw_rpm.iter().map(|rpm| {
        let drawn: f64 = StandardNormal.sample(&mut random);
        MIDDLE_MM3_PER_S + extruder.step(rpm - MIDDLE_RPM) + NOISE_MM3_PER_S * drawn
    });
    let flow_mm3_per_s = flow.collect();
    let time_s = (0..count).map(|k| f64::from(k) * STEP_S).collect();
    Ok(FlowLog { time_s, screw_rpm, flow_mm3_per_s })
}

impl FlowLog {
    /// The log as CSV text.
    pub fn to_csv(&self) -> String {
        let rows = self.time_s.iter().zip(&self.screw_rpm).zip(&self.flow_mm3_per_s);
        let rows = rows.map(|((t, rpm), flow)| format!("{t:.2},{rpm:.3},{flow:.2}\n"));
        "time_s,screw_rpm,flow_mm3_per_s\n".to_owned() + &rows.collect::<String>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_is_what_was_said_of_it() {
        let log = binary().unwrap();
        assert_eq!(log.time_s.len(), 4944);
        assert!(log.screw_rpm.iter().all(|rpm| [25.0, 30.0, 35.0].contains(rpm)));
        let rest = &log.flow_mm3_per_s[..250];
        let mean = rest.iter().sum::<f64>() / 250.0;
        let sigma = (rest.iter().map(|flow| (flow - mean).powi(2)).sum::<f64>() / 250.0).sqrt();
        assert!((mean - 540.0).abs() < 3.0 && (sigma - 12.0).abs() < 2.0, "{mean} {sigma}");
        assert!(log.to_csv().starts_with("time_s,screw_rpm,flow_mm3_per_s\n0.00,30.000,"));
        assert_eq!(gaussian().unwrap().time_s.len(), 3500);
    }
}
