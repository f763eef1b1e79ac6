//! A screw that fills and empties: the plant of Diagne et al. 2015, eqs. (13), (16) and (17),
//! including the feed on its way to the plug.

use crate::extruder::screw::feed_history::FeedHistory;
use crate::extruder::screw::{Conveying, Screw};
use crate::numeric::number::to_count;

/// Integration method of the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Integrator {
    /// The paper's: one Euler step. The delay is rounded up to whole steps, so that no feed
    /// arrives too early.
    Euler,
    /// Fourth order in steps of at most this length \[s\]; a step ends when a change of the feed
    /// reaches the plug.
    RungeKutta(f64),
}

/// The plant.
#[derive(Debug, Clone, PartialEq)]
pub struct SimScrew {
    screw: Screw,
    integrator: Integrator,
    step_s: f64,
    ticks: u32,
    plug_m: f64,
    feed: FeedHistory,
}

impl SimScrew {
    /// A plant with the constant feed `before` until now; feed and plug are on a time grid of
    /// `step_s`.
    pub fn new(
        screw: Screw,
        integrator: Integrator,
        step_s: f64,
        plug_m: f64,
        before: f64,
    ) -> Self {
        let room = to_count((screw.longest_delay() / step_s).ceil()) + 4;
        let feed = FeedHistory::new(room, before);
        Self { screw, integrator, step_s, ticks: 0, plug_m, feed }
    }

    /// Time since the start \[s\].
    pub fn now_s(&self) -> f64 {
        f64::from(self.ticks) * self.step_s
    }

    /// Length of the plug \[m\].
    pub fn plug_m(&self) -> f64 {
        self.plug_m
    }

    /// Delay of the feed that reaches the plug now \[s\].
    pub fn delay_s(&self) -> f64 {
        self.screw.delay(self.now_s(), self.plug_m)
    }

    /// Advances by one step with this fill of the feed, 0 to 1.
    pub fn advance(&mut self, fill: f64) {
        let from = self.now_s();
        self.feed.push(self.feed_position(from), fill);
        let to = f64::from(self.ticks + 1) * self.step_s;
        match self.integrator {
            Integrator::Euler => self.euler(from),
            Integrator::RungeKutta(longest) => self.runge_kutta(from, to, longest),
        }
        self.plug_m = self.plug_m.clamp(0.0, self.screw.length_m);
        self.ticks += 1;
    }

    fn euler(&mut self, from: f64) {
        let steps = (self.screw.delay(from, self.plug_m) / self.step_s).ceil();
        // The centre of the feed's step, so that rounding of its ends has no effect.
        let position = self.feed_position(from - (steps - 0.5) * self.step_s);
        self.plug_m += self.step_s * self.rate(from, self.plug_m, self.feed.at(position));
    }

    fn runge_kutta(&mut self, from: f64, to: f64, longest: f64) {
        let mut at = from;
        while at < to {
            let position = self.arriving_position(at, self.plug_m);
            let (fill, change) = (self.feed.at(position), self.feed.next_change(position));
            let full = longest.min(to - at);
            let mut step = full;
            if let Some(change) = change {
                let past = |step: f64| {
                    self.arriving_position(at + step, self.grown(at, step, fill)) - change
                };
                if past(full) > 0.0 {
                    step = crossing(past, full);
                }
            }
            self.plug_m = self.grown(at, step, fill);
            at = if to - at - step < 1e-13 { to } else { at + step };
        }
    }

    /// Length of the plug after a step with a constant feed \[m\].
    fn grown(&self, at: f64, step: f64, fill: f64) -> f64 {
        runge_kutta_step(|at, plug| self.rate(at, plug, fill), at, self.plug_m, step)
    }

    fn rate(&self, at: f64, plug: f64, fill: f64) -> f64 {
        self.screw.speed(at) * self.screw.growth(plug, fill)
    }

    /// Position in the feed history of the feed that reaches the plug now.
    fn arriving_position(&self, at: f64, plug: f64) -> f64 {
        match self.screw.conveying {
            Conveying::AtPresentSpeed => at - (self.screw.length_m - plug) / self.screw.speed(at),
            Conveying::AtSpeedOnTheWay => self.screw.conveyed_m(at) - (self.screw.length_m - plug),
        }
    }

    /// Position in the feed history of the feed that enters now.
    fn feed_position(&self, at: f64) -> f64 {
        match self.screw.conveying {
            Conveying::AtPresentSpeed => at,
            Conveying::AtSpeedOnTheWay => self.screw.conveyed_m(at),
        }
    }
}

/// The fourth-order step of x′ = `rate`(t, x).
fn runge_kutta_step(rate: impl Fn(f64, f64) -> f64, at: f64, x: f64, step: f64) -> f64 {
    let half = 0.5 * step;
    let first = rate(at, x);
    let second = rate(at + half, x + half * first);
    let third = rate(at + half, x + half * second);
    let fourth = rate(at + step, x + step * third);
    x + step / 6.0 * (first + 2.0 * (second + third) + fourth)
}

/// A point just after the sign change of a growing function within a step.
fn crossing(past: impl Fn(f64) -> f64, full: f64) -> f64 {
    let (mut low, mut high) = (0.0, full);
    for _ in 0..40 {
        let middle = f64::midpoint(low, high);
        if past(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// The same screw without delay under continuous feedback, from a given plug and time on. From the
/// first effect of the control it equals a loop with a perfect predictor. Lengths of the plug
/// \[m\] every `step_s`, by Runge–Kutta steps of a tenth of that.
pub fn delay_free(
    screw: &Screw,
    plug_m: f64,
    from_s: f64,
    step_s: f64,
    controller: impl Fn(f64) -> f64,
) -> impl Iterator<Item = f64> {
    /// Runge–Kutta steps per sample.
    const PARTS: u32 = 10;
    let rate = move |at: f64, plug: f64| screw.speed(at) * screw.growth(plug, controller(plug));
    let step = step_s / f64::from(PARTS);
    let mut plug = plug_m;
    (0_u32..).map(move |tick| {
        let now = plug;
        for part in 0..PARTS {
            let at = from_s + step_s * f64::from(tick) + step * f64::from(part);
            plug = runge_kutta_step(&rate, at, plug, step);
        }
        now
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::screw::exact::ExactPredictor;
    use crate::extruder::screw::{ScrewDesign, SpeedPulsation};

    const A: SpeedPulsation =
        SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
    const B: SpeedPulsation =
        SpeedPulsation { relative_amplitude: 0.4, rad_per_s: 0.4, phase_rad: 0.0 };

    fn screw(pulsation: SpeedPulsation) -> Screw {
        ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap()
    }

    /// A feed that no controller would give.
    fn fill(tick: u32) -> f64 {
        0.35 + 0.3 * (0.011 * f64::from(tick)).sin() + if tick % 400 < 200 { 0.1 } else { 0.0 }
    }

    #[test]
    fn a_plug_that_is_held_stays() {
        for integrator in [Integrator::Euler, Integrator::RungeKutta(1e-3)] {
            let screw = screw(A);
            let mut plant = SimScrew::new(screw, integrator, 1e-3, 0.13, screw.holding_fill(0.13));
            for _ in 0..5_000 {
                plant.advance(screw.holding_fill(0.13));
            }
            assert!((plant.plug_m() - 0.13).abs() < 1e-12);
        }
    }

    #[test]
    fn nothing_happens_before_the_first_effect() {
        for integrator in [Integrator::Euler, Integrator::RungeKutta(1e-3)] {
            let screw = screw(B);
            let mut plant = SimScrew::new(screw, integrator, 1e-3, 0.1, screw.holding_fill(0.1));
            while (plant.plug_m() - 0.1).abs() < 1e-9 {
                plant.advance(0.9);
            }
            let first = screw.arrival(0.0, 0.1);
            assert!((plant.now_s() - first).abs() < 2.1e-3, "{}", plant.now_s());
        }
    }

    #[test]
    fn material_is_conserved_on_a_belt() {
        // All feed is in the channel or has left through the nozzle: with the conveyed distance q,
        // d(plug + ∫fill ahead of it) = U − θ2·x/(1 + θ2·x) per metre.
        let screw = Screw { conveying: Conveying::AtSpeedOnTheWay, ..screw(A) };
        let before = screw.holding_fill(0.1);
        let mut plant = SimScrew::new(screw, Integrator::RungeKutta(2e-4), 1e-3, 0.1, before);
        let (mut stored, mut passed) = (0.1 + 0.1 * before, 0.0);
        for tick in 0..3_000 {
            let way = screw.conveyed_m(plant.now_s() + 1e-3) - screw.conveyed_m(plant.now_s());
            let leaves = screw.holding_fill(plant.plug_m());
            plant.advance(fill(tick));
            let leaves = f64::midpoint(leaves, screw.holding_fill(plant.plug_m()));
            passed += way * (fill(tick) - leaves);
        }
        let now = screw.conveyed_m(plant.now_s());
        let ahead: f64 = plant
            .feed
            .segments(now - (screw.length_m - plant.plug_m()), now)
            .map(|piece| piece.length * piece.fill)
            .sum();
        stored -= plant.plug_m() + ahead;
        assert!((stored + passed).abs() < 1e-6, "{stored} {passed}");
    }

    #[test]
    fn a_prediction_comes_true() {
        for conveying in [Conveying::AtPresentSpeed, Conveying::AtSpeedOnTheWay] {
            for pulsation in [SpeedPulsation::default(), A, B] {
                let screw = Screw { conveying, ..screw(pulsation) };
                let predictor = ExactPredictor::new(screw);
                let mut plant = SimScrew::new(screw, Integrator::RungeKutta(2e-4), 1e-3, 0.1, 0.2);
                let mut history = FeedHistory::new(4_000, 0.2);
                let mut due = Vec::new();
                for tick in 0..4_000 {
                    let now = plant.now_s();
                    if tick % 100 == 7 {
                        due.push(predictor.predict(&history, now, plant.plug_m()).unwrap());
                    }
                    history.push(predictor.coordinate(now), fill(tick));
                    let was = plant.plug_m();
                    plant.advance(fill(tick));
                    due.retain(|found| {
                        let here = plant.now_s() - found.arrival_s;
                        let plug = plant.plug_m() + (was - plant.plug_m()) * here / 1e-3;
                        assert!(here < 0.0 || (plug - found.plug_m).abs() < 2e-6, "{here}");
                        here < 0.0
                    });
                }
                assert!(due.len() < 30);
            }
        }
    }

    #[test]
    fn without_delay_the_plug_goes_where_the_share_holds_it() {
        let screw = screw(B);
        let hold = screw.holding_fill(0.16);
        let last = delay_free(&screw, 0.1, 0.0, 0.1, |_| hold).nth(900).unwrap();
        assert!((last - 0.16).abs() < 1e-6);
    }
}
