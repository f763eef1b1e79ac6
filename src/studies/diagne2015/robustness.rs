//! The loops at 200 Hz with a mismatch of the predictor's model, or with noise of the measured
//! plug.

use super::run::{FeedMethod, RunError, RunPlan, follow};
use super::{PulsationCase, SETPOINT, SETTLING_BAND_MM};
use crate::extruder::screw::control::Scheme;
use crate::extruder::screw::{Conveying, FillFeedback, TurnUnit};

/// Length of the runs \[s\].
const RUN_S: f64 = 12.0;
/// Time by which a stable loop has settled \[s\].
const STEADY_AFTER_S: f64 = 6.0;
/// Plant steps of 1 ms between two control steps. Derived: 200 Hz.
const HOLD_STEPS: u32 = 5;

/// A difference between the screw and the predictor's model, or a fault of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScrewMismatch {
    /// No mismatch.
    None,
    /// The model's conveying speed θ1 is the true one times this.
    Speed(f64),
    /// The model's θ2 is the true one times this.
    Nozzle(f64),
    /// The model's relative amplitude ε of the pulsation is the true one times this.
    Amplitude(f64),
    /// The model's phase of the pulsation leads the true one by this \[rad\].
    Phase(f64),
    /// The plug is measured with this standard deviation \[mm\].
    Noise(f64),
    /// The plant conveys the feed at the speed of every moment on the way, so the delay accumulates.
    Belt,
}

/// Mismatches and their names.
pub const MISMATCHES: [(&str, ScrewMismatch); 9] = [
    ("nothing wrong", ScrewMismatch::None),
    ("θ1 known 10 % too high", ScrewMismatch::Speed(1.1)),
    ("θ1 known 10 % too low", ScrewMismatch::Speed(0.9)),
    ("θ2 known 10 % too high", ScrewMismatch::Nozzle(1.1)),
    ("ε known half as large", ScrewMismatch::Amplitude(0.5)),
    ("phase known 30° ahead", ScrewMismatch::Phase(std::f64::consts::FRAC_PI_6)),
    ("plug measured with 0.5 mm", ScrewMismatch::Noise(0.5)),
    ("plug measured with 2 mm", ScrewMismatch::Noise(2.0)),
    ("delay adds up on the way", ScrewMismatch::Belt),
];

/// Performance figures of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustnessOutcome {
    /// Settling time \[s\]; none where it does not settle.
    pub settles_s: Option<f64>,
    /// Overshoot \[mm\].
    pub overshoot_mm: f64,
    /// Root mean square error in the steady state \[mm\].
    pub steady_error_mm: f64,
    /// Root mean square change of the feed from one plant step to the next, in the steady state.
    pub feed_change: f64,
}

/// Runs a controller with a prediction scheme and a mismatch.
pub fn run_mismatched(
    case: &PulsationCase,
    mismatch: ScrewMismatch,
    controller: FillFeedback,
    scheme: Scheme,
) -> Result<RobustnessOutcome, RunError> {
    let screw = case.screw(TurnUnit::RadPerS)?;
    let mut plan = RunPlan { hold: HOLD_STEPS, ..RunPlan::exact(screw, RUN_S) };
    let mut known = screw;
    match mismatch {
        ScrewMismatch::None => {}
        ScrewMismatch::Speed(factor) => known.theta1_m_per_s *= factor,
        ScrewMismatch::Nozzle(factor) => known.theta2_per_m *= factor,
        ScrewMismatch::Amplitude(factor) => known.pulsation.relative_amplitude *= factor,
        ScrewMismatch::Phase(ahead) => known.pulsation.phase_rad = ahead,
        ScrewMismatch::Noise(sigma_mm) => plan.noise_mm = sigma_mm,
        ScrewMismatch::Belt => plan.screw.conveying = Conveying::AtSpeedOnTheWay,
    }
    let response = follow(&plan, &FeedMethod::Predictor { controller, scheme, known })?;
    let target = SETPOINT.plug.get();
    Ok(RobustnessOutcome {
        settles_s: response.settles(target, SETTLING_BAND_MM),
        overshoot_mm: response.overshoot_mm(target),
        steady_error_mm: response.rms_mm(target, STEADY_AFTER_S),
        feed_change: response.feed_change(STEADY_AFTER_S),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::diagne2015::{CASES, paper_controller, saturated};

    #[test]
    fn both_controllers_settle_with_a_speed_error_of_ten_percent() {
        let [_, _, case] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let paper = FillFeedback::Exponential(paper_controller(&screw).unwrap());
        for controller in [paper, saturated(&screw, 60.0).unwrap()] {
            for factor in [0.9, 1.1] {
                let found =
                    run_mismatched(&case, ScrewMismatch::Speed(factor), controller, Scheme::Exact)
                        .unwrap();
                assert!(found.settles_s.unwrap() < 1.4);
                assert!(found.overshoot_mm < 6.5 && found.steady_error_mm < 1e-3);
            }
        }
    }

    #[test]
    fn a_wrong_nozzle_parameter_leaves_a_steady_error() {
        let [case, ..] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let controller = saturated(&screw, 60.0).unwrap();
        let found =
            run_mismatched(&case, ScrewMismatch::Nozzle(1.1), controller, Scheme::Exact).unwrap();
        assert!((0.5..1.5).contains(&found.steady_error_mm), "{}", found.steady_error_mm);
    }

    #[test]
    fn a_steeper_controller_moves_the_feeder_more() {
        let [case, ..] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let noisy = |slope| {
            let controller = saturated(&screw, slope).unwrap();
            run_mismatched(&case, ScrewMismatch::Noise(0.5), controller, Scheme::Exact).unwrap()
        };
        let (flat, steep) = (noisy(36.0), noisy(100.0));
        assert!(steep.feed_change > 2.0 * flat.feed_change);
        assert!(steep.steady_error_mm > flat.steady_error_mm && steep.steady_error_mm < 0.2);
    }
}
