//! Proportional-integral control on the width error, with the time step as an argument.
//! Shojaei Barjuei et al. 2022, eq. (4), with the sign that regulates:
//! error = measured − target, so that a bead that is too wide speeds the robot up.

use crate::core::{Mm, MmPerS, Span};

/// Gains on an error in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiGains {
    /// Speed for each millimetre of error \[mm/s per mm\].
    pub kp_per_s: f64,
    /// Speed integrated each second for each millimetre of error \[mm/s² per mm\].
    pub ki_per_s2: f64,
}

/// In which direction the applied speed cannot follow the demand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Saturation {
    /// It follows.
    #[default]
    None,
    /// A higher speed cannot be reached.
    Above,
    /// A lower speed cannot be reached.
    Below,
}

/// The controller with its integrator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pi {
    gains: PiGains,
    integral: MmPerS,
}

/// A demanded speed and its parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// Demanded speed.
    pub speed: MmPerS,
    /// Proportional part.
    pub proportional: MmPerS,
    /// Integral part.
    pub integral: MmPerS,
}

impl Pi {
    /// Starts so that the first demand at this error is the robot's speed (bumpless).
    pub fn start_bumpless(gains: PiGains, driven: MmPerS, error: Mm) -> Self {
        let proportional = proportional(gains, error);
        Self { gains, integral: driven - proportional }
    }

    /// One step over `dt` since the last error. The integrator is frozen in a direction in
    /// which the applied speed cannot follow (anti-windup by conditional integration).
    pub fn step(&mut self, error: Mm, dt: Span, saturation: Saturation) -> Demand {
        let increment = self.gains.ki_per_s2 * error.get() * dt.secs();
        let increment = MmPerS::ZERO + MmPerS::new(increment).unwrap_or_default();
        let against = match saturation {
            Saturation::None => false,
            Saturation::Above => increment > MmPerS::ZERO,
            Saturation::Below => increment < MmPerS::ZERO,
        };
        if !against && dt > Span::ZERO {
            self.integral = self.integral + increment;
        }
        let proportional = proportional(self.gains, error);
        Demand { speed: proportional + self.integral, proportional, integral: self.integral }
    }
}

fn proportional(gains: PiGains, error: Mm) -> MmPerS {
    MmPerS::new(gains.kp_per_s * error.get()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: PiGains = PiGains { kp_per_s: 5.925, ki_per_s2: 4.74 };
    const TENTH: Span = Span::from_millis(100);

    #[test]
    fn too_wide_is_answered_with_more_speed() {
        let mut pi = Pi::start_bumpless(GAINS, MmPerS::constant(112.5), Mm::ZERO);
        let demand = pi.step(Mm::constant(1.0), TENTH, Saturation::None);
        assert!(demand.speed > MmPerS::constant(112.5));
    }

    #[test]
    fn the_first_demand_is_the_robots_speed() {
        let error = Mm::constant(-3.4);
        let mut pi = Pi::start_bumpless(GAINS, MmPerS::constant(112.5), error);
        let demand = pi.step(error, Span::ZERO, Saturation::None);
        assert!((demand.speed.get() - 112.5).abs() < 1e-12);
    }

    #[test]
    fn a_constant_error_is_integrated_over_time() {
        let mut often = Pi::start_bumpless(GAINS, MmPerS::ZERO, Mm::ZERO);
        let mut seldom = often;
        for _ in 0..9 {
            let _ = often.step(Mm::constant(2.0), TENTH, Saturation::None);
        }
        let often = often.step(Mm::constant(2.0), TENTH, Saturation::None);
        let seldom = seldom.step(Mm::constant(2.0), Span::from_secs(1.0), Saturation::None);
        assert!((often.integral.get() - 4.74 * 2.0).abs() < 1e-9);
        assert!((often.speed.get() - seldom.speed.get()).abs() < 1e-9);
    }

    #[test]
    fn the_integrator_is_frozen_against_a_limit_and_free_to_return() {
        let mut pi = Pi::start_bumpless(GAINS, MmPerS::constant(60.0), Mm::ZERO);
        let low = pi.step(Mm::constant(-1.0), TENTH, Saturation::Below);
        assert_eq!(low.integral, MmPerS::constant(60.0));
        let back = pi.step(Mm::constant(1.0), TENTH, Saturation::Below);
        assert!(back.integral > MmPerS::constant(60.0));
    }
}
