//! The loops at 200 Hz on a screw that is not quite the one that the predictor
//! knows, or whose plug is measured with noise.

use super::run::{Method, Plan, RunError, follow};
use super::{BAND_MM, Case, SETPOINT};
use crate::extruder::screw::control::Scheme;
use crate::extruder::screw::{Conveying, FillLaw, Pulsation, Screw, TurnUnit};

/// Length of the runs, and when all has settled that settles \[s\].
const UNTIL_S: f64 = 12.0;
const LATE_S: f64 = 6.0;
/// Steps of the plant in one of the control: 200 Hz.
const HOLD: u32 = 5;

/// What is not as the predictor knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trouble {
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
pub const TROUBLES: [(&str, Trouble); 9] = [
    ("nothing wrong", Trouble::None),
    ("θ1 known 10 % too high", Trouble::Speed(1.1)),
    ("θ1 known 10 % too low", Trouble::Speed(0.9)),
    ("θ2 known 10 % too high", Trouble::Nozzle(1.1)),
    ("ε known half as large", Trouble::Share(0.5)),
    ("phase known 30° ahead", Trouble::Phase(std::f64::consts::FRAC_PI_6)),
    ("plug measured with 0.5 mm", Trouble::Noise(0.5)),
    ("plug measured with 2 mm", Trouble::Noise(2.0)),
    ("delay adds up on the way", Trouble::Belt),
];

/// What a run came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Settled after \[s\]; none where it never did.
    pub settles_s: Option<f64>,
    /// Farthest beyond the setpoint \[mm\].
    pub overshoot_mm: f64,
    /// Root mean square error after all that settles has settled \[mm\].
    pub late_mm: f64,
    /// Root mean square change of the feed from one plant step to the next then.
    pub shaking: f64,
}

/// Runs a law with a scheme against a trouble.
pub fn suffer(
    case: &Case,
    trouble: Trouble,
    law: FillLaw,
    scheme: Scheme,
) -> Result<Outcome, RunError> {
    let screw = case.screw(TurnUnit::RadPerS)?;
    let mut plan = Plan { hold: HOLD, ..Plan::exact(screw, UNTIL_S) };
    let mut known = screw;
    match trouble {
        Trouble::None => {}
        Trouble::Speed(times) => known.theta1_m_per_s *= times,
        Trouble::Nozzle(times) => known.theta2_per_m *= times,
        Trouble::Share(times) => known.pulsation.share *= times,
        Trouble::Phase(ahead) => {
            known.pulsation = Pulsation { phase_rad: ahead, ..known.pulsation };
        }
        Trouble::Noise(sigma_mm) => plan.noise_mm = sigma_mm,
        Trouble::Belt => {
            plan.screw = Screw { conveying: Conveying::AtSpeedOnTheWay, ..screw };
        }
    }
    let course = follow(&plan, &Method::Predictor { law, scheme, known })?;
    let target = SETPOINT.plug.get();
    Ok(Outcome {
        settles_s: course.settles(target, BAND_MM),
        overshoot_mm: course.overshoot_mm(target),
        late_mm: course.rms_mm(target, LATE_S),
        shaking: course.shaking(LATE_S),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::diagne2015::{CASES, paper_law, saturated};

    #[test]
    fn both_laws_settle_in_spite_of_a_speed_that_is_known_to_a_tenth() {
        let [_, _, case] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let paper = FillLaw::Exponential(paper_law(&screw).unwrap());
        for law in [paper, saturated(&screw, 60.0).unwrap()] {
            for times in [0.9, 1.1] {
                let found = suffer(&case, Trouble::Speed(times), law, Scheme::Exact).unwrap();
                assert!(found.settles_s.unwrap() < 1.4);
                assert!(found.overshoot_mm < 6.5 && found.late_mm < 1e-3);
            }
        }
    }

    #[test]
    fn a_nozzle_that_is_not_known_leaves_the_plug_beside_its_setpoint() {
        let [case, ..] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let law = saturated(&screw, 60.0).unwrap();
        let found = suffer(&case, Trouble::Nozzle(1.1), law, Scheme::Exact).unwrap();
        assert!((0.5..1.5).contains(&found.late_mm), "{}", found.late_mm);
    }

    #[test]
    fn a_steeper_law_shakes_the_feeder_more() {
        let [case, ..] = CASES;
        let screw = case.screw(TurnUnit::RadPerS).unwrap();
        let shaken = |slope| {
            let law = saturated(&screw, slope).unwrap();
            suffer(&case, Trouble::Noise(0.5), law, Scheme::Exact).unwrap()
        };
        let (flat, steep) = (shaken(36.0), shaken(100.0));
        assert!(steep.shaking > 2.0 * flat.shaking);
        assert!(steep.late_mm > flat.late_mm && steep.late_mm < 0.2);
    }
}
