//! Model of the screw as a plug that grows and shrinks (Diagne et al. 2015, eqs. (13) to (17)).
//! From the nozzle the channel is full over the length x; from there to the feed at L it is
//! filled to the ratio U of the feed a delay ago.

use super::error::{ScrewError, positive};

/// Millimetres in a metre. By definition.
pub(super) const MM_PER_M: f64 = 1000.0;

/// Pulsation of the conveying speed about its mean: c = θ1·(1 + ε·cos(ωt + φ)), eq. (17).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpeedPulsation {
    /// Relative amplitude ε, from 0 to below 1.
    pub relative_amplitude: f64,
    /// Angular frequency ω \[rad/s\].
    pub rad_per_s: f64,
    /// Phase at the start of the run φ \[rad\]; 0 in the paper.
    pub phase_rad: f64,
}

/// How the delay follows from the conveying speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conveying {
    /// (L − x)/c(t): all of the distance at the speed of the moment of arrival, as in eq. (16).
    AtPresentSpeed,
    /// The time over which the speed integrates to the distance, as on a belt. Equal to
    /// [`Conveying::AtPresentSpeed`] where the speed is constant.
    AtSpeedOnTheWay,
}

/// The model's parameters, in metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Screw {
    /// Mean conveying speed θ1 \[m/s\].
    pub theta1_m_per_s: f64,
    /// Conductance of the nozzle over that of the back flow in the channel, θ2 \[1/m\].
    pub theta2_per_m: f64,
    /// Distance from the nozzle to the feed, L \[m\].
    pub length_m: f64,
    /// Pulsation of the conveying speed.
    pub pulsation: SpeedPulsation,
    /// How the delay follows from the conveying speed.
    pub conveying: Conveying,
}

impl Screw {
    /// The parameters, if they are valid.
    pub fn new(screw: Self) -> Result<Self, ScrewError> {
        positive("theta1_m_per_s", screw.theta1_m_per_s)?;
        positive("theta2_per_m", screw.theta2_per_m)?;
        positive("length_m", screw.length_m)?;
        let SpeedPulsation { relative_amplitude: amplitude, rad_per_s, phase_rad } =
            screw.pulsation;
        if !(0.0..1.0).contains(&amplitude) {
            return Err(ScrewError::PulsationAmplitude(amplitude));
        }
        if !(rad_per_s.is_finite() && rad_per_s >= 0.0 && phase_rad.is_finite()) {
            return Err(ScrewError::Frequency { rad_per_s, phase_rad });
        }
        Ok(screw)
    }

    /// The same screw without its pulsation, eqs. (102) to (104).
    pub fn steady(self) -> Self {
        Self { pulsation: SpeedPulsation::default(), ..self }
    }

    /// Whether the conveying speed pulsates.
    pub fn pulsates(&self) -> bool {
        self.pulsation.relative_amplitude > 0.0 && self.pulsation.rad_per_s > 0.0
    }

    /// Conveying speed at a moment, c(t) \[m/s\], eq. (17).
    pub fn speed(&self, at_s: f64) -> f64 {
        let SpeedPulsation { relative_amplitude: amplitude, rad_per_s, phase_rad } = self.pulsation;
        self.theta1_m_per_s * (1.0 + amplitude * libm::cos(rad_per_s * at_s + phase_rad))
    }

    /// Slowest conveying speed \[m/s\].
    pub fn slowest(&self) -> f64 {
        self.theta1_m_per_s * (1.0 - self.pulsation.relative_amplitude)
    }

    /// Distance conveyed from the start of the run to a moment, ∫c \[m\].
    pub fn conveyed_m(&self, at_s: f64) -> f64 {
        let SpeedPulsation { relative_amplitude: amplitude, rad_per_s, phase_rad } = self.pulsation;
        let oscillation = if rad_per_s > 0.0 {
            (libm::sin(rad_per_s * at_s + phase_rad) - libm::sin(phase_rad)) / rad_per_s
        } else {
            at_s * libm::cos(phase_rad)
        };
        self.theta1_m_per_s * (at_s + amplitude * oscillation)
    }

    /// Fill ratio that holds the plug at a length \[m\], v(x), eq. (19).
    pub fn holding_fill(&self, plug_m: f64) -> f64 {
        let lead = self.theta2_per_m * plug_m;
        lead / (1.0 + lead)
    }

    /// Growth of the plug per metre conveyed, −Γ(x, U), eq. (73).
    pub fn growth(&self, plug_m: f64, fill: f64) -> f64 {
        (fill - self.holding_fill(plug_m)) / (1.0 - fill)
    }

    /// Delay of the feed that arrives at a moment, eq. (16) \[s\].
    pub fn delay(&self, at_s: f64, plug_m: f64) -> f64 {
        let way = self.length_m - plug_m;
        match self.conveying {
            Conveying::AtPresentSpeed => way / self.speed(at_s),
            Conveying::AtSpeedOnTheWay => at_s - self.moment_of(self.conveyed_m(at_s) - way, at_s),
        }
    }

    /// Longest delay \[s\].
    pub fn longest_delay(&self) -> f64 {
        self.length_m / self.slowest()
    }

    /// When the distance conveyed since the start reaches `way_m` \[s\], by Newton's method within
    /// bounds. `near_s` is the initial guess.
    pub fn moment_of(&self, way_m: f64, near_s: f64) -> f64 {
        let time_s = (way_m - self.conveyed_m(near_s)) / self.theta1_m_per_s;
        let SpeedPulsation { relative_amplitude: amplitude, .. } = self.pulsation;
        let (slow, fast) =
            (near_s + time_s / (1.0 - amplitude), near_s + time_s / (1.0 + amplitude));
        let (mut low, mut high) = (slow.min(fast), slow.max(fast));
        let mut at = near_s + time_s;
        for _ in 0..60 {
            let miss = self.conveyed_m(at) - way_m;
            if miss > 0.0 {
                high = high.min(at);
            } else {
                low = low.max(at);
            }
            let newton = at - miss / self.speed(at);
            let next =
                if newton >= low && newton <= high { newton } else { f64::midpoint(low, high) };
            if (next - at).abs() <= 1e-15 * at.abs().max(1.0) {
                return next;
            }
            at = next;
        }
        at
    }

    /// When the feed of a moment reaches a plug of constant length \[s\]: σ0, the first effect of
    /// a control that begins then, eq. (53).
    pub fn arrival(&self, fed_s: f64, plug_m: f64) -> f64 {
        let way = self.length_m - plug_m;
        if self.conveying == Conveying::AtSpeedOnTheWay || !self.pulsates() {
            return self.moment_of(self.conveyed_m(fed_s) + way, fed_s);
        }
        let excess = |at: f64| at - self.delay(at, plug_m) - fed_s;
        let (from, to) = (way / (2.0 * self.theta1_m_per_s), way / self.slowest());
        let step = (to - from) / (8.0 + 16.0 * self.pulsation.rad_per_s * (to - from)).ceil();
        let (mut low, mut high) = (fed_s + from, fed_s + to);
        let mut at = low;
        while at < high && excess(at) < 0.0 {
            low = at;
            at += step;
        }
        high = high.min(at);
        for _ in 0..80 {
            let middle = f64::midpoint(low, high);
            if excess(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        f64::midpoint(low, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rpm;
    use crate::extruder::screw::{ScrewDesign, TurnUnit};

    const B: SpeedPulsation =
        SpeedPulsation { relative_amplitude: 0.4, rad_per_s: 0.4, phase_rad: 0.0 };

    fn screw(pulsation: SpeedPulsation) -> Screw {
        ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap()
    }

    #[test]
    fn both_units_of_the_screw_speed_give_the_published_parameters() {
        let screw = screw(SpeedPulsation::default());
        assert!((screw.theta1_m_per_s - 0.094_247_779_6).abs() < 1e-10);
        assert!((screw.theta2_per_m - 2.114_292_6).abs() < 1e-7);
        let turns = ScrewDesign { unit: TurnUnit::RevPerS, ..ScrewDesign::DIAGNE_2015 };
        assert!((turns.screw(B).unwrap().theta1_m_per_s - 0.015).abs() < 1e-15);
    }

    #[test]
    fn the_holding_ratio_holds_the_plug_and_more_makes_it_grow() {
        let screw = screw(B);
        let hold = screw.holding_fill(0.16);
        assert!((hold - 0.252_78).abs() < 1e-5);
        assert!(screw.growth(0.16, hold).abs() < 1e-15);
        assert!(screw.growth(0.16, 0.9) > 0.0);
        // Eq. (13) as it is printed.
        let (x, u) = (0.1, 0.6);
        let lead = screw.theta2_per_m * x;
        let printed = -lead / ((1.0 + lead) * (1.0 - u)) + u / (1.0 - u);
        assert!((screw.growth(x, u) - printed).abs() < 1e-14);
    }

    #[test]
    fn the_distance_is_the_integral_of_the_speed_and_is_invertible() {
        let screw = screw(SpeedPulsation { phase_rad: 0.7, ..B });
        let mut sum = 0.0;
        for k in 0..40_000 {
            sum += screw.speed((f64::from(k) + 0.5) * 1e-4) * 1e-4;
        }
        assert!((screw.conveyed_m(4.0) - sum).abs() < 1e-9);
        for near in [0.0, 3.9, 20.0] {
            assert!((screw.moment_of(screw.conveyed_m(4.0), near) - 4.0).abs() < 1e-12, "{near}");
        }
    }

    #[test]
    fn the_first_effect_of_a_control_is_as_published() {
        let none = screw(SpeedPulsation::default()).arrival(0.0, 0.1);
        assert!((none - 0.1 / 0.094_247_779_6).abs() < 1e-9);
        let a = SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
        assert!((screw(a).arrival(0.0, 0.1) - 1.137).abs() < 5e-4);
        assert!((screw(B).arrival(0.0, 0.1) - 0.768).abs() < 5e-4);
    }

    #[test]
    fn an_integrated_delay_is_that_of_the_paper_where_the_speed_is_constant() {
        let belt = Conveying::AtSpeedOnTheWay;
        let steady = Screw { conveying: belt, ..screw(SpeedPulsation::default()) };
        assert!((steady.delay(5.0, 0.1) - 0.1 / 0.094_247_779_6).abs() < 1e-9);
        let pulsating = Screw { conveying: belt, ..screw(B) };
        let delay = pulsating.delay(5.0, 0.1);
        assert!(
            (pulsating.conveyed_m(5.0) - pulsating.conveyed_m(5.0 - delay) - 0.1).abs() < 1e-12
        );
        let arrival = pulsating.arrival(5.0 - delay, 0.1);
        assert!((arrival - 5.0).abs() < 1e-9);
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        let design = ScrewDesign::DIAGNE_2015;
        let empty = ScrewDesign { density_kg_per_m3: 0.0, ..design };
        let said = empty.screw(B).unwrap_err().to_string();
        assert_eq!(said, "density_kg_per_m3 is 0, which must be a positive number");
        let still = ScrewDesign { speed: Rpm::ZERO, ..design };
        assert!(matches!(
            still.screw(B),
            Err(ScrewError::NotPositive { name: "theta1_m_per_s", .. })
        ));
        let nan = ScrewDesign { nozzle_m3: f64::NAN, ..design };
        assert!(matches!(nan.screw(B), Err(ScrewError::NotPositive { name: "nozzle_m3", .. })));
        for amplitude in [1.0, -0.1, f64::NAN] {
            let pulsation = SpeedPulsation { relative_amplitude: amplitude, ..B };
            assert!(
                matches!(design.screw(pulsation), Err(ScrewError::PulsationAmplitude(_))),
                "{amplitude}"
            );
        }
        for rad_per_s in [f64::INFINITY, -1.0] {
            let pulsation = SpeedPulsation { rad_per_s, ..B };
            assert!(matches!(design.screw(pulsation), Err(ScrewError::Frequency { .. })));
        }
    }
}
