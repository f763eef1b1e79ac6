//! Feasibility: whether every feed reaches the plug. The delay must never grow as fast as time
//! passes. Diagne et al. 2015, eqs. (56), (79) to (81) and (88).

use std::fmt;

use super::model::{Conveying, Screw};

/// A bound of the delay's growth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrowthBound {
    /// Largest sin/(1 + ε·cos)² over a period, or 1/(1 − ε)² in its place.
    pub factor: f64,
    /// ε·ω times the factor \[rad/s\].
    pub pulsation_rad_per_s: f64,
    /// Largest growth of the delay per second, over all lengths of the plug and fill ratios: the
    /// maximum of Λ, eq. (88).
    pub growth: f64,
    /// Length of the plug at which it grows fastest \[m\].
    pub worst_plug_m: f64,
    /// The condition of the paper that is met, if any.
    pub condition: Option<Condition>,
}

/// The three sufficient conditions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Eq. (79): the growth increases with the plug, to less than 1 at the feed.
    Increasing = 79,
    /// Eq. (80): the screw is short for its nozzle, θ2·L < 1.
    Short = 80,
    /// Eq. (81): the screw is long for its nozzle, θ2·L > 1.
    Long = 81,
}

/// Thresholds of the paper's conditions, in rad/s, for
/// [`GrowthBound::pulsation_rad_per_s`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// θ1·θ2/(1 + θ2·L)², below which (79) holds.
    pub increasing: f64,
    /// Below which (80) or (81) holds: θ1/L for a short screw,
    /// 4·θ1·θ2/(1 + θ2·L)² for a long one.
    pub reach: f64,
    /// θ2·L.
    pub lead: f64,
}

/// The result with its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feasibility {
    /// With the exact factor.
    pub exact: GrowthBound,
    /// With the looser factor of the paper, eq. (84).
    pub paper: GrowthBound,
    /// Thresholds of the paper's conditions.
    pub thresholds: Thresholds,
    /// An integrated delay is always feasible.
    pub conveying: Conveying,
}

impl Feasibility {
    /// Checks a screw over its whole length and every fill ratio from 0 to below 1.
    pub fn judge(screw: &Screw) -> Self {
        let lead = screw.theta2_per_m * screw.length_m;
        let spread = screw.theta1_m_per_s * screw.theta2_per_m / (1.0 + lead).powi(2);
        let reach = if lead < 1.0 { screw.theta1_m_per_s / screw.length_m } else { 4.0 * spread };
        let thresholds = Thresholds { increasing: spread, reach, lead };
        let amplitude = screw.pulsation.relative_amplitude;
        Self {
            exact: GrowthBound::over(screw, &thresholds, max_pulsation_factor(amplitude)),
            paper: GrowthBound::over(screw, &thresholds, 1.0 / (1.0 - amplitude).powi(2)),
            thresholds,
            conveying: screw.conveying,
        }
    }

    /// Whether every feed reaches the plug.
    pub fn is_feasible(&self) -> bool {
        self.conveying == Conveying::AtSpeedOnTheWay || self.exact.growth < 1.0
    }
}

/// The largest sin φ/(1 + ε·cos φ)² over a period: its derivative is zero where
/// ε·cos² φ − cos φ − 2ε = 0.
fn max_pulsation_factor(amplitude: f64) -> f64 {
    if amplitude == 0.0 {
        return 1.0;
    }
    // The smaller root, without cancellation for a small amplitude.
    let cos = -4.0 * amplitude / (1.0 + (1.0 + 8.0 * amplitude * amplitude).sqrt());
    (1.0 - cos * cos).max(0.0).sqrt() / (1.0 + amplitude * cos).powi(2)
}

impl GrowthBound {
    fn over(screw: &Screw, thresholds: &Thresholds, factor: f64) -> Self {
        let pulsation = screw.pulsation.relative_amplitude * screw.pulsation.rad_per_s * factor;
        let (theta2, length) = (screw.theta2_per_m, screw.length_m);
        let fall = pulsation / screw.theta1_m_per_s;
        // The growth has one maximum over the plug, eq. (95).
        let worst = if fall <= 0.0 { length } else { ((theta2 / fall).sqrt() - 1.0) / theta2 };
        let worst_plug_m = worst.clamp(0.0, length);
        Self {
            factor,
            pulsation_rad_per_s: pulsation,
            growth: fall * (length - worst_plug_m) + screw.holding_fill(worst_plug_m),
            worst_plug_m,
            condition: thresholds.met(pulsation),
        }
    }
}

impl Thresholds {
    /// The condition that a pulsation meets. A threshold itself belongs to the feasible side, as
    /// in eq. (87).
    fn met(&self, pulsation: f64) -> Option<Condition> {
        if pulsation <= self.increasing {
            Some(Condition::Increasing)
        } else if pulsation >= self.reach {
            None
        } else if self.lead < 1.0 {
            Some(Condition::Short)
        } else {
            Some(Condition::Long)
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "condition ({})", *self as u8)
    }
}

impl fmt::Display for Feasibility {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.conveying == Conveying::AtSpeedOnTheWay {
            return f.write_str(
                "feasible: the material keeps its order on the way, so every feed reaches the plug",
            );
        }
        let GrowthBound { growth, worst_plug_m, factor, pulsation_rad_per_s, condition } =
            &self.exact;
        let worst_mm = worst_plug_m * 1000.0;
        if self.is_feasible() {
            write!(
                f,
                "feasible: the delay grows by at most {growth:.3} s a second, at a plug of \
                 {worst_mm:.0} mm; ε·ω·{factor:.4} = {pulsation_rad_per_s:.4} rad/s "
            )?;
            let limit = match condition {
                Some(Condition::Increasing) => self.thresholds.increasing,
                _ => self.thresholds.reach,
            };
            write!(f, "lies below {limit:.4}")?;
            condition.map_or(Ok(()), |met| write!(f, ", {met}"))
        } else {
            write!(
                f,
                "not feasible: at a plug of {worst_mm:.0} mm the delay can grow by {growth:.3} s a \
                 second, so that material fed then arrives delayed or never; ε·ω·{factor:.4} = \
                 {pulsation_rad_per_s:.4} rad/s must be below {:.4}: a weaker or slower pulsation, \
                 a faster or shorter screw",
                self.thresholds.reach
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::screw::{ScrewDesign, SpeedPulsation, TurnUnit};
    use proptest::prelude::*;

    const A: SpeedPulsation =
        SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
    const B: SpeedPulsation =
        SpeedPulsation { relative_amplitude: 0.4, rad_per_s: 0.4, phase_rad: 0.0 };

    fn judge(unit: TurnUnit, pulsation: SpeedPulsation) -> Feasibility {
        let design = ScrewDesign { unit, ..ScrewDesign::DIAGNE_2015 };
        Feasibility::judge(&design.screw(pulsation).unwrap())
    }

    #[test]
    fn the_exact_factor_is_the_maximum_over_a_period() {
        for (amplitude, known) in [(0.1, 1.0202), (0.4, 1.3881)] {
            assert!((max_pulsation_factor(amplitude) - known).abs() < 5e-5);
            let seen = (0..100_000)
                .map(|k| f64::from(k) * std::f64::consts::TAU / 100_000.0)
                .map(|turn| turn.sin() / (1.0 + amplitude * turn.cos()).powi(2))
                .fold(0.0, f64::max);
            assert!((max_pulsation_factor(amplitude) - seen).abs() < 1e-8);
        }
        assert!((max_pulsation_factor(1e-9) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn both_published_cases_are_feasible_in_radians_and_neither_in_turns() {
        for pulsation in [A, B] {
            let radians = judge(TurnUnit::RadPerS, pulsation);
            assert!(radians.is_feasible());
            assert_eq!(radians.exact.condition, Some(Condition::Short));
            assert_eq!(radians.paper.condition, Some(Condition::Short));
            let turns = judge(TurnUnit::RevPerS, pulsation);
            assert!(!turns.is_feasible());
            assert_eq!(turns.exact.condition, None);
            assert_eq!(turns.paper.condition, None);
        }
    }

    #[test]
    fn the_exact_bound_allows_what_the_printed_one_refuses() {
        // 0.55·0.4/(1 − 0.55)² is 1.09 rad/s, beyond θ1/L = 0.471.
        let strong = judge(TurnUnit::RadPerS, SpeedPulsation { relative_amplitude: 0.55, ..B });
        assert!(strong.is_feasible());
        assert_eq!(strong.paper.condition, None);
        assert!(strong.paper.growth > 1.0);
    }

    #[test]
    fn the_result_is_printed_with_its_numbers() {
        let said = judge(TurnUnit::RadPerS, A).to_string();
        assert_eq!(
            said,
            "feasible: the delay grows by at most 0.758 s a second, at a plug of 0 mm; ε·ω·1.0202 \
             = 0.3571 rad/s lies below 0.4712, condition (80)"
        );
        let said = judge(TurnUnit::RevPerS, B).to_string();
        assert!(said.starts_with("not feasible: at a plug of 0 mm the delay can grow by 2.961 s"));
        assert!(said.contains("must be below 0.0750"), "{said}");
    }

    #[test]
    fn an_integrated_delay_is_always_feasible() {
        let screw = ScrewDesign::DIAGNE_2015.screw(A).unwrap();
        let fast = SpeedPulsation { relative_amplitude: 0.9, rad_per_s: 50.0, phase_rad: 0.0 };
        let fast = Screw { pulsation: fast, ..screw };
        assert!(!Feasibility::judge(&fast).is_feasible());
        let belt = Screw { conveying: Conveying::AtSpeedOnTheWay, ..fast };
        assert!(Feasibility::judge(&belt).is_feasible());
    }

    proptest! {
        #[test]
        fn the_largest_growth_is_that_of_a_search_and_agrees_with_the_conditions(
            relative_amplitude in 0.0..0.8_f64,
            rad_per_s in 0.0..6.0_f64,
            theta2_per_m in 0.2..40.0_f64,
        ) {
            let pulsation = SpeedPulsation { relative_amplitude, rad_per_s, phase_rad: 0.0 };
            let screw = ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap();
            let screw = Screw { theta2_per_m, ..screw };
            let verdict = Feasibility::judge(&screw);
            let mut most = 0.0_f64;
            for k in 0..=200 {
                let plug = 0.001 * f64::from(k);
                let at = relative_amplitude * rad_per_s * verdict.exact.factor / screw.theta1_m_per_s;
                most = most.max(at * (0.2 - plug) + screw.holding_fill(plug));
            }
            prop_assert!((verdict.exact.growth - most).abs() < 1e-3);
            prop_assert!(verdict.exact.growth >= most - 1e-12);
            for bound in [verdict.exact, verdict.paper] {
                prop_assert_eq!(bound.condition.is_some(), bound.growth < 1.0);
            }
        }
    }
}
