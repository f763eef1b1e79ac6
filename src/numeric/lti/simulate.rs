//! Simulation on a grid of samples, exact between them and with any dead time.

use nalgebra::{DMatrix, DVector};

use super::state::StateSpace;
use super::transfer::{ModelError, TransferFunction};
use crate::numeric::number::to_count;

/// Input between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// Constant at the last sample, as a command.
    Held,
    /// Linear to the next sample, as a measured quantity.
    Linear,
}

/// Dead times within this fraction of a step of a whole number of steps are whole: rounding.
const WHOLE_STEP_TOLERANCE: f64 = 1e-9;

/// Discrete state equations: x(k) = Φ·x(k−1) + Σ taps(j)·u(k−delay−j), y(k) = c·x(k) + Σ
/// through(j)·u(k−delay−j). A dead time that ends within a step splits its input in two parts.
#[derive(Debug, Clone)]
pub(super) struct Sampled {
    pub state: DMatrix<f64>,
    pub taps: [DVector<f64>; 3],
    pub c: DVector<f64>,
    pub through: [f64; 2],
    pub delay: usize,
}

impl Sampled {
    /// Fails where the step is not above zero.
    pub fn of(tf: &TransferFunction, dt_s: f64, between: Between) -> Result<Self, ModelError> {
        let (delay, rest_s) = split(tf.dead_time_s(), dt_s)?;
        let space = StateSpace::of(tf);
        let second = space.advance(dt_s - rest_s);
        let none = || DVector::zeros(space.b.len());
        let d = space.d;
        if between == Between::Held && rest_s == 0.0 {
            let taps = [none(), second.constant, none()];
            return Ok(Self { state: second.state, taps, c: space.c, through: [d, 0.0], delay });
        }
        let first = space.advance(rest_s);
        let state = &second.state * &first.state;
        let (taps, through) = match between {
            Between::Held => ([none(), second.constant, &second.state * first.constant], [0.0, d]),
            Between::Linear => {
                let fraction = rest_s / dt_s;
                let (rise, early) = (second.slope / dt_s, first.slope / dt_s);
                let oldest = &second.state * (&first.constant * fraction - &early);
                let middle = &second.state * (&first.constant * (1.0 - fraction) + &early)
                    + &second.constant
                    - &rise;
                ([rise, middle, oldest], [d * (1.0 - fraction), d * fraction])
            }
        };
        Ok(Self { state, taps, c: space.c, through, delay })
    }
}

/// A dead time as whole steps and a remainder \[s\]. Fails for a step that is not positive.
pub(super) fn split(dead_time_s: f64, dt_s: f64) -> Result<(usize, f64), ModelError> {
    if !dt_s.is_finite() || dt_s <= 0.0 {
        return Err(ModelError::NotPositive { what: "the time step", value: dt_s });
    }
    let steps = dead_time_s / dt_s;
    let whole = (steps + WHOLE_STEP_TOLERANCE).floor();
    let rest = (steps - whole) * dt_s;
    Ok((to_count(whole), if rest < WHOLE_STEP_TOLERANCE * dt_s { 0.0 } else { rest }))
}

/// A model that takes one sample after the other. A step does not allocate.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulator {
    order: usize,
    /// Φ, row by row.
    state: Vec<f64>,
    taps: [Vec<f64>; 3],
    c: Vec<f64>,
    through: [f64; 2],
    x: Vec<f64>,
    next: Vec<f64>,
    /// Inputs from the newest to the oldest within the dead time, as a ring.
    inputs: Vec<f64>,
    newest: usize,
    /// Steady state for a unit input; `None` for an integrator.
    steady: Option<Vec<f64>>,
}

impl Simulator {
    /// At rest with an input of zero. Fails where the step \[s\] is not above
    /// zero.
    pub fn new(tf: &TransferFunction, dt_s: f64, between: Between) -> Result<Self, ModelError> {
        let sampled = Sampled::of(tf, dt_s, between)?;
        let order = tf.order();
        let list = |v: &DVector<f64>| v.iter().copied().collect::<Vec<f64>>();
        Ok(Self {
            order,
            state: sampled.state.transpose().iter().copied().collect(),
            taps: sampled.taps.each_ref().map(list),
            c: list(&sampled.c),
            through: sampled.through,
            x: vec![0.0; order],
            next: vec![0.0; order],
            inputs: vec![0.0; sampled.delay + 3],
            newest: 0,
            steady: StateSpace::of(tf).steady().ok().map(|x| list(&x)),
        })
    }

    /// Sets the state to rest with an input of zero.
    pub fn rest(&mut self) {
        self.x.fill(0.0);
        self.inputs.fill(0.0);
    }

    /// Sets the steady state of a constant input. Fails for an integrator, unless the input is
    /// zero.
    pub fn settle(&mut self, input: f64) -> Result<(), ModelError> {
        if input == 0.0 {
            self.rest();
            return Ok(());
        }
        let steady = self.steady.as_ref().ok_or(ModelError::NoSteadyState)?;
        for (x, one) in self.x.iter_mut().zip(steady) {
            *x = one * input;
        }
        self.inputs.fill(input);
        Ok(())
    }

    /// Takes the input of this sample and returns the output at the same moment. A held input
    /// acts from this moment on, a linear one has changed until this moment.
    pub fn step(&mut self, input: f64) -> f64 {
        let length = self.inputs.len();
        self.newest = if self.newest == 0 { length - 1 } else { self.newest - 1 };
        self.inputs[self.newest] = input;
        let delayed = |steps: usize| {
            let position = self.newest + length - 3 + steps;
            self.inputs[if position >= length { position - length } else { position }]
        };
        let [u0, u1, u2] = [delayed(0), delayed(1), delayed(2)];
        let [g0, g1, g2] = &self.taps;
        let mut output = self.through[0] * u0 + self.through[1] * u1;
        // By index: iterators over several slices are slow where little is optimised (`make quick`).
        for row in 0..self.order {
            let mut moved = 0.0;
            for column in 0..self.order {
                moved += self.state[row * self.order + column] * self.x[column];
            }
            self.next[row] = moved + (g0[row] * u0 + g1[row] * u1 + g2[row] * u2);
            output += self.c[row] * self.next[row];
        }
        std::mem::swap(&mut self.x, &mut self.next);
        output
    }
}

/// Output for held inputs, `dt_s` \[s\] apart, from rest with an input of zero. Fails where the
/// step is not above zero.
pub fn simulate(tf: &TransferFunction, input: &[f64], dt_s: f64) -> Result<Vec<f64>, ModelError> {
    let mut simulator = Simulator::new(tf, dt_s, Between::Held)?;
    Ok(input.iter().map(|u| simulator.step(*u)).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::numeric::lti::{FirstOrder, SecondOrder};

    fn fopdt(dead_time_s: f64) -> TransferFunction {
        FirstOrder { gain: 2.0, time_constant_s: 0.84, zero_s: 0.0, dead_time_s }
            .transfer()
            .unwrap()
    }

    fn time(k: u32, dt: f64) -> f64 {
        f64::from(k) * dt
    }

    #[test]
    fn a_step_answers_as_the_closed_form_whatever_the_dead_time() {
        for dead_time in [0.0, 0.02, 0.04, 0.0137, 0.41, 0.419_99] {
            let dt = 0.02;
            let output = simulate(&fopdt(dead_time), &[1.0; 300], dt).unwrap();
            for (k, y) in (0_u32..).zip(&output) {
                let since = (time(k, dt) - dead_time).max(0.0);
                let wanted = 2.0 * (1.0 - libm::exp(-since / 0.84));
                assert!((y - wanted).abs() < 1e-12, "{dead_time} {k}: {y} {wanted}");
            }
        }
    }

    #[test]
    fn a_ramp_answers_as_the_closed_form_with_a_linear_input() {
        for dead_time in [0.0, 0.05, 0.033, 0.12] {
            let dt = 0.05;
            let mut model = Simulator::new(&fopdt(dead_time), dt, Between::Linear).unwrap();
            for k in 0..200 {
                let y = model.step(3.0 * time(k, dt));
                let since = (time(k, dt) - dead_time).max(0.0);
                let wanted = 6.0 * (since - 0.84 * (1.0 - libm::exp(-since / 0.84)));
                assert!((y - wanted).abs() < 1e-12, "{dead_time} {k}: {y} {wanted}");
            }
        }
    }

    #[test]
    fn a_coarse_grid_agrees_with_a_fine_one_on_a_rough_input() {
        let model = SecondOrder::Oscillating {
            gain: 19.05,
            period_s: 0.81,
            damping: 0.6,
            zero_s: 0.2,
            dead_time_s: 0.0537,
        };
        let tf = model.transfer().unwrap();
        let coarse: Vec<f64> = (0..100_u32).map(|k| f64::from((k * 7919) % 13)).collect();
        // 50 ms in steps of 0.1 ms: the dead time is whole there.
        let fine: Vec<f64> = coarse.iter().flat_map(|u| [*u; 500]).collect();
        let by_coarse = simulate(&tf, &coarse, 0.05).unwrap();
        let by_fine = simulate(&tf, &fine, 0.0001).unwrap();
        for (k, y) in by_coarse.iter().enumerate() {
            assert!((y - by_fine[k * 500]).abs() < 1e-9, "{k}");
        }
    }

    #[test]
    fn as_many_zeros_as_poles_pass_the_input_straight_through_after_the_dead_time() {
        let tf = |dead| TransferFunction::new(&[0.5, 1.0], &[0.1, 1.0], dead).unwrap();
        let step = simulate(&tf(0.0), &[1.0; 3], 0.01).unwrap();
        assert!((step[0] - 5.0).abs() < 1e-12, "{step:?}");
        let late = simulate(&tf(0.015), &[1.0; 4], 0.01).unwrap();
        assert_eq!(late[..2], [0.0, 0.0]);
        let wanted = 1.0 + 4.0 * libm::exp(-0.005 / 0.1);
        assert!((late[2] - wanted).abs() < 1e-12, "{late:?} {wanted}");
    }

    #[test]
    fn a_settled_model_stays_where_it_is() {
        for between in [Between::Held, Between::Linear] {
            let mut model = Simulator::new(&fopdt(0.033), 0.01, between).unwrap();
            model.settle(1.7).unwrap();
            for _ in 0..100 {
                assert!((model.step(1.7) - 3.4).abs() < 1e-12);
            }
            model.rest();
            assert_eq!(model.step(0.0), 0.0);
        }
        let integrator = TransferFunction::new(&[1.0], &[1.0, 0.0], 0.0).unwrap();
        let mut model = Simulator::new(&integrator, 0.01, Between::Held).unwrap();
        assert_eq!(model.settle(1.0), Err(ModelError::NoSteadyState));
        assert_eq!(model.settle(0.0), Ok(()));
        let _ = model.step(2.0);
        assert!((model.step(2.0) - 0.02).abs() < 1e-15);
    }

    #[test]
    fn a_gain_with_dead_time_only_delays() {
        let tf = TransferFunction::new(&[3.0], &[1.0], 0.025).unwrap();
        let output = simulate(&tf, &[1.0, 2.0, 3.0, 4.0, 5.0], 0.01).unwrap();
        assert_eq!(output, [0.0, 0.0, 0.0, 3.0, 6.0]);
        let mut linear = Simulator::new(&tf, 0.01, Between::Linear).unwrap();
        let output: Vec<f64> = (1..=5).map(|k| linear.step(f64::from(k))).collect();
        for (y, wanted) in output.iter().zip([0.0, 0.0, 1.5, 4.5, 7.5]) {
            assert!((y - wanted).abs() < 1e-12, "{output:?}");
        }
    }

    #[test]
    fn a_step_of_no_length_is_refused() {
        let error = simulate(&fopdt(0.0), &[1.0], 0.0);
        assert_eq!(error, Err(ModelError::NotPositive { what: "the time step", value: 0.0 }));
    }
}
