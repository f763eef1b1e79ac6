//! How a robot's speed follows its target: a first-order lag with limited slope, solved in closed
//! form, so that the result does not depend on the time steps.

/// Target and dynamics of the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLoop {
    /// Target speed \[mm/s\].
    pub target: f64,
    /// Time constant of the velocity loop, 1/(2π·bandwidth) \[s\].
    pub lag_s: f64,
    /// Largest slope of the speed \[mm/s²\].
    pub accel: f64,
}

/// Speed and path at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PathMotion {
    /// Speed along the path \[mm/s\].
    pub speed: f64,
    /// Distance along the path \[mm\].
    pub path: f64,
}

impl PathMotion {
    /// The motion `dt_s` seconds later under a constant target: with e = target − v, dv/dt =
    /// clamp(e/τ, ±a). A ramp while |e| > a·τ, then v = target − e·exp(−t/τ).
    #[must_use]
    pub fn after(self, drive: SpeedLoop, dt_s: f64) -> Self {
        let SpeedLoop { target, lag_s, accel } = drive;
        let missing = target - self.speed;
        let ramp_s = ((missing.abs() - accel * lag_s) / accel).clamp(0.0, dt_s);
        let slope = accel.copysign(missing);
        let ramped = Self {
            speed: self.speed + slope * ramp_s,
            path: self.path + non_negative(self.speed * ramp_s + 0.5 * slope * ramp_s * ramp_s),
        };
        let rest_s = dt_s - ramp_s;
        let missing = target - ramped.speed;
        let settled = -(-rest_s / lag_s).exp_m1();
        Self {
            speed: ramped.speed + missing * settled,
            path: ramped.path + non_negative(target * rest_s - missing * lag_s * settled),
        }
    }

    /// Nanoseconds, of at most `within_ns`, until the path has reached `path_mm`, rounded up;
    /// `None` if it is not reached by then.
    pub fn ns_until(self, drive: SpeedLoop, path_mm: f64, within_ns: u64) -> Option<u64> {
        let there = |ns: u64| self.after(drive, seconds(ns)).path >= path_mm;
        if !there(within_ns) {
            return None;
        }
        let (mut before, mut reached) = (0, within_ns);
        while before < reached {
            let middle = before + (reached - before) / 2;
            if there(middle) {
                reached = middle;
            } else {
                before = middle + 1;
            }
        }
        Some(reached)
    }
}

/// Rounding must not decrease a path.
fn non_negative(step_mm: f64) -> f64 {
    step_mm.max(0.0)
}

/// Converts nanoseconds to seconds.
#[expect(clippy::cast_precision_loss, reason = "exact for spans under 104 days")]
pub(super) fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LAG_S: f64 = 1.0 / (2.0 * std::f64::consts::PI * 10.0);

    #[test]
    fn one_time_constant_covers_63_percent() {
        let drive = SpeedLoop { target: 100.0, lag_s: LAG_S, accel: 1e9 };
        let motion = PathMotion::default().after(drive, LAG_S);
        assert!((motion.speed - 100.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
        // ∫ u(1 − e^(−t/τ)) dt over one τ is u·τ/e.
        assert!((motion.path - 100.0 * LAG_S * (-1.0_f64).exp()).abs() < 1e-9);
    }

    #[test]
    fn the_slope_is_limited_until_the_lag_takes_over() {
        let drive = SpeedLoop { target: 100.0, lag_s: LAG_S, accel: 500.0 };
        let early = PathMotion::default().after(drive, 0.1);
        assert!((early.speed - 50.0).abs() < 1e-9);
        assert!((early.path - 2.5).abs() < 1e-9);
        assert!((PathMotion::default().after(drive, 2.0).speed - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_place_on_the_path_is_found_to_the_nanosecond() {
        let drive = SpeedLoop { target: 100.0, lag_s: LAG_S, accel: 2000.0 };
        let steady = PathMotion { speed: 100.0, path: 0.0 };
        assert_eq!(steady.ns_until(drive, 10.0, 200_000_000), Some(100_000_000));
        assert_eq!(steady.ns_until(drive, 10.0, 99_000_000), None);
        assert_eq!(steady.ns_until(drive, 0.0, 5), Some(0));
    }

    proptest! {
        #[test]
        fn it_does_not_matter_how_often_one_looks(
            speed in 0.0..200.0_f64,
            target in 0.0..200.0_f64,
            accel in 50.0..5000.0_f64,
            total_s in 0.0..1.0_f64,
            cuts in prop::collection::vec(0.0..1.0_f64, 0..20),
        ) {
            let drive = SpeedLoop { target, lag_s: LAG_S, accel };
            let start = PathMotion { speed, path: 7.0 };
            let whole = start.after(drive, total_s);
            let mut cuts = cuts;
            cuts.push(1.0);
            cuts.sort_by(f64::total_cmp);
            let (mut motion, mut at) = (start, 0.0);
            for cut in cuts {
                let next = motion.after(drive, (cut - at) * total_s);
                prop_assert!(next.path >= motion.path);
                prop_assert!(next.speed >= -1e-9);
                (motion, at) = (next, cut);
            }
            prop_assert!((motion.speed - whole.speed).abs() < 1e-6);
            prop_assert!((motion.path - whole.path).abs() < 1e-6);
        }
    }
}
