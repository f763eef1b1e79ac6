//! The loops at 200 Hz on a screw that is not quite the one that the predictor
//! knows, or whose plug is measured with noise.

use super::run::{FeedMethod, RunError, RunPlan, follow};
use super::{PulsationCase, SETPOINT, SETTLING_BAND_MM};
use crate::extruder::screw::control::Scheme;
use crate::extruder::screw::{Conveying, FillFeedback, Screw, SpeedPulsation, TurnUnit};

/// Length of the runs, and when all has settled that settles \[s\].
const RUN_S: f64 = 12.0;
const STEADY_AFTER_S: f64 = 6.0;
/// Steps of the plant in one of the control: 200 Hz.
const HOLD_STEPS: u32 = 5;

/// What is not as the predictor knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScrewMismatch {
    /// Nothing.
    None,
    /// The known conveying speed θ1 is the true one times this.
    Speed(f64),
    /// The known θ2 is the true one times this.
    Nozzle(f64),
    /// The known share ε of the pulsation is the true one times this.
    Share(f64),
    /// The known phase of the pulsation is ahead by this \[rad\].
    Phase(f64),
    /// The plug is measured with this standard deviation \[mm\].
    Noise(f64),
    /// The delay truly adds up on the way.
    Belt,
}

/// What is tried.
pub const MISMATCHES: [(&str, ScrewMismatch); 9] = [
    ("nothing wrong", ScrewMismatch::None),
    ("θ1 known 10 % too high", ScrewMismatch::Speed(1.1)),
    ("θ1 known 10 % too low", ScrewMismatch::Speed(0.9)),
    ("θ2 known 10 % too high", ScrewMismatch::Nozzle(1.1)),
    ("ε known half as large", ScrewMismatch::Share(0.5)),
    ("phase known 30° ahead", ScrewMismatch::Phase(std::f64::consts::FRAC_PI_6)),
    ("plug measured with 0.5 mm", ScrewMismatch::Noise(0.5)),
    ("plug measured with 2 mm", ScrewMismatch::Noise(2.0)),
    ("delay adds up on the way", ScrewMismatch::Belt),
];

/// What a run came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustnessOutcome {
    /// Settled after \[s\]; none where it never did.
    pub settles_s: Option<f64>,
    /// Farthest beyond the setpoint \[mm\].
    pub overshoot_mm: f64,
    /// Root mean square error after all that settles has settled \[mm\].
    pub steady_error_mm: f64,
    /// Root mean square change of the feed from one plant step to the next then.
    pub feed_change: f64,
}

/// Runs a law with a scheme against a trouble.
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
        ScrewMismatch::Speed(times) => known.theta1_m_per_s *= times,
        ScrewMismatch::Nozzle(times) => known.theta2_per_m *= times,
        ScrewMismatch::Share(times) => known.pulsation.relative_amplitude *= times,
        ScrewMismatch::Phase(ahead) => {
            known.pulsation = SpeedPulsation { phase_rad: ahead, ..known.pulsation };
        }
        ScrewMismatch::Noise(sigma_mm) => plan.noise_mm = sigma_mm,
        ScrewMismatch::Belt => {
            plan.screw = Screw { conveying: Conveying::AtSpeedOnTheWay, ..screw };
        }
    }
    let course = follow(&plan, &FeedMethod::Predictor { controller, scheme, known })?;
    let target = SETPOINT.plug.get();
    Ok(RobustnessOutcome {
        settles_s: course.settles(target, SETTLING_BAND_MM),
        overshoot_mm: course.overshoot_mm(target),
        steady_error_mm: course.rms_mm(target, STEADY_AFTER_S),
        feed_change: course.feed_change(STEADY_AFTER_S),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::diagne2015::{CASES, paper_controller, saturated};

    #[test]
    fn both_laws_settle_in_spite_of_a_speed_that_is_known_to_a_tenth() {
        let [_, _, case] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let paper = FillFeedback::Exponential(paper_controller(&screw).unwrap());
        for law in [paper, saturated(&screw, 60.0).unwrap()] {
            for times in [0.9, 1.1] {
                let found =
                    run_mismatched(&case, ScrewMismatch::Speed(times), law, Scheme::Exact).unwrap();
                assert!(found.settles_s.unwrap() < 1.4);
                assert!(found.overshoot_mm < 6.5 && found.steady_error_mm < 1e-3);
            }
        }
    }

    #[test]
    fn a_nozzle_that_is_not_known_leaves_the_plug_beside_its_setpoint() {
        let [case, ..] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let law = saturated(&screw, 60.0).unwrap();
        let found = run_mismatched(&case, ScrewMismatch::Nozzle(1.1), law, Scheme::Exact).unwrap();
        assert!((0.5..1.5).contains(&found.steady_error_mm), "{}", found.steady_error_mm);
    }

    #[test]
    fn a_steeper_law_shakes_the_feeder_more() {
        let [case, ..] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let shaken = |slope| {
            let law = saturated(&screw, slope).unwrap();
            run_mismatched(&case, ScrewMismatch::Noise(0.5), law, Scheme::Exact).unwrap()
        };
        let (flat, steep) = (shaken(36.0), shaken(100.0));
        assert!(steep.feed_change > 2.0 * flat.feed_change);
        assert!(steep.steady_error_mm > flat.steady_error_mm && steep.steady_error_mm < 0.2);
    }
}
