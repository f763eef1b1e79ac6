//! Prediction by the extruder's model: flow and volume for a command that is piecewise linear between
//! evenly spaced knots.

use crate::numeric::lti::{Between, ModelError, Simulator, TransferFunction};
use crate::numeric::number::to_f64;

/// Grid of the flow \[s\], which is linear in between: the 200 Hz of the controller in bcs-thesis,
/// § 4.2.
pub const TICK_S: f64 = 0.005;
/// Ticks between two knots of the command. Fewer give the command more freedom and the plan more
/// unknowns.
const KNOT_TICKS: usize = 16;
/// Time between two knots of the command \[s\].
pub const KNOT_S: f64 = 16.0 * TICK_S;

/// Flow \[mm³/s\] and volume since the first tick \[mm³\], on the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowTrajectory {
    from_s: f64,
    flow: Vec<f64>,
    volume: Vec<f64>,
}

impl FlowTrajectory {
    /// From a moment \[s\] with a flow \[mm³/s\].
    fn new(from_s: f64, flow: f64) -> Self {
        Self { from_s, flow: vec![flow], volume: vec![0.0] }
    }

    fn push(&mut self, flow: f64) {
        let last = self.flow.last().copied().unwrap_or(flow);
        let before = self.volume.last().copied().unwrap_or(0.0);
        self.flow.push(flow);
        self.volume.push(before + 0.5 * TICK_S * (last + flow));
    }

    /// Flow at a moment \[mm³/s\]; constant beyond the ends.
    pub fn flow_at(&self, time_s: f64) -> f64 {
        let (at, fraction) = self.index_at(time_s);
        between(&self.flow, at, fraction.clamp(0.0, 1.0))
    }

    /// Volume from the first tick to a moment \[mm³\].
    pub fn volume_at(&self, time_s: f64) -> f64 {
        let (at, fraction) = self.index_at(time_s);
        let base = self.volume.get(at).copied().unwrap_or(0.0);
        let first = self.flow.get(at).copied().unwrap_or(0.0);
        let here = between(&self.flow, at, fraction.clamp(0.0, 1.0));
        let inside = fraction.clamp(0.0, 1.0);
        base + TICK_S * (0.5 * (first + here) * inside + here * (fraction - inside))
    }

    /// The tick before a moment and the fraction of a tick since.
    fn index_at(&self, time_s: f64) -> (usize, f64) {
        let ticks = (time_s - self.from_s) / TICK_S;
        let last = self.flow.len().saturating_sub(2);
        let at = whole(ticks).min(last);
        (at, ticks - to_f64(at))
    }
}

/// The extruder at the moment up to which its command is decided.
#[derive(Debug, Clone)]
pub struct FlowModel {
    flow: Simulator,
    command: f64,
    history: FlowTrajectory,
}

impl FlowModel {
    /// In the steady state of a command at 0 s.
    pub fn settled(model: &TransferFunction, command: f64) -> Result<Self, ModelError> {
        let mut flow = Simulator::new(model, TICK_S, Between::Linear)?;
        flow.settle(command)?;
        let now = if command == 0.0 { 0.0 } else { command * model.dc_gain() };
        Ok(Self { flow, command, history: FlowTrajectory::new(0.0, now) })
    }

    /// The command before the first knot.
    pub fn command(&self) -> f64 {
        self.command
    }

    /// Time up to which the command is decided \[s\].
    pub fn now_s(&self) -> f64 {
        self.history.from_s + TICK_S * to_f64(self.history.flow.len() - 1)
    }

    /// Discards the history before a moment \[s\], except for the tick before it.
    pub fn discard_before(&mut self, before_s: f64) {
        let past = &mut self.history;
        let ticks = whole((before_s - past.from_s) / TICK_S).min(past.flow.len().saturating_sub(2));
        past.flow.drain(..ticks);
        past.volume.drain(..ticks);
        past.from_s += TICK_S * to_f64(ticks);
    }

    /// Advances over decided knots.
    pub fn advance(&mut self, knots: &[f64]) {
        run(&mut self.flow, self.command, knots, &mut self.history);
        self.command = knots.last().copied().unwrap_or(self.command);
    }

    /// Predicts over knots, with the history.
    pub fn predict(&self, knots: &[f64]) -> FlowTrajectory {
        let (mut flow, mut trajectory) = (self.flow.clone(), self.history.clone());
        run(&mut flow, self.command, knots, &mut trajectory);
        trajectory
    }
}

/// Simulates a command over time \[s\], which is evaluated in the order of time, from the steady state
/// of its first value.
pub fn simulate(
    model: &TransferFunction,
    mut command: impl FnMut(f64) -> f64,
    until_s: f64,
) -> Result<FlowTrajectory, ModelError> {
    let FlowModel { mut flow, history: mut past, .. } = FlowModel::settled(model, command(0.0))?;
    for tick in 1..=whole(until_s / TICK_S) + 1 {
        past.push(flow.step(command(TICK_S * to_f64(tick))));
    }
    Ok(past)
}

fn run(flow: &mut Simulator, from: f64, knots: &[f64], trajectory: &mut FlowTrajectory) {
    let mut last = from;
    for knot in knots {
        for tick in 1..=KNOT_TICKS {
            let fraction = to_f64(tick) / to_f64(KNOT_TICKS);
            trajectory.push(flow.step(last + fraction * (knot - last)));
        }
        last = *knot;
    }
}

/// Responses to a unit change of one knot, on the grid from the knot before it: the command rises to
/// the knot and falls to the next one, or is constant after the last one.
#[derive(Debug, Clone)]
pub struct KnotResponses {
    inner: FlowTrajectory,
    last: FlowTrajectory,
}

impl KnotResponses {
    /// For a number of knots.
    pub fn new(model: &TransferFunction, knots: usize) -> Result<Self, ModelError> {
        let ticks = (knots + 1) * KNOT_TICKS;
        let response = |input: &dyn Fn(f64) -> f64| -> Result<FlowTrajectory, ModelError> {
            let mut flow = Simulator::new(model, TICK_S, Between::Linear)?;
            let mut trajectory = FlowTrajectory::new(0.0, flow.step(0.0));
            for tick in 1..=ticks {
                trajectory.push(flow.step(input(to_f64(tick) / to_f64(KNOT_TICKS))));
            }
            Ok(trajectory)
        };
        Ok(Self {
            inner: response(&|at: f64| (1.0 - (at - 1.0).abs()).max(0.0))?,
            last: response(&|at: f64| at.min(1.0))?,
        })
    }

    /// Flow \[mm³/s\] and volume \[mm³\] at a time after the last decided knot, for each knot.
    pub fn at(&self, since_s: f64, knots: usize) -> impl Iterator<Item = (f64, f64)> {
        (0..knots).map(move |knot| {
            let since = since_s - KNOT_S * to_f64(knot);
            let response = if knot + 1 == knots { &self.last } else { &self.inner };
            if since <= 0.0 {
                (0.0, 0.0)
            } else {
                (response.flow_at(since), response.volume_at(since))
            }
        })
    }
}

/// Linear interpolation in a row after an index.
pub(super) fn between(row: &[f64], at: usize, fraction: f64) -> f64 {
    let first = row.get(at).copied().unwrap_or(0.0);
    let second = row.get(at + 1).copied().unwrap_or(first);
    first + fraction * (second - first)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
pub(super) fn whole(value: f64) -> usize {
    value.max(0.0) as usize
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn model() -> TransferFunction {
        TransferFunction::new(&[5.0, 20.0], &[0.1, 0.7, 1.0], 0.054).unwrap()
    }

    #[test]
    fn knots_lie_on_ticks() {
        assert!((TICK_S * to_f64(KNOT_TICKS) - KNOT_S).abs() < 1e-12);
    }

    #[test]
    fn a_constant_command_keeps_the_flow() {
        let trajectory = FlowModel::settled(&model(), 3.0).unwrap().predict(&[3.0; 20]);
        assert!((trajectory.flow_at(0.7) - 60.0).abs() < 1e-9);
        assert!((trajectory.volume_at(1.234) - 60.0 * 1.234).abs() < 1e-9);
    }

    #[test]
    fn knot_responses_superpose_to_the_prediction() {
        let knots = [1.0, 4.0, 2.0, 2.5, 7.0];
        let extruder = FlowModel::settled(&model(), 2.0).unwrap();
        let trajectory = extruder.predict(&knots);
        let responses = KnotResponses::new(&model(), knots.len()).unwrap();
        for k in 0_u32..80 {
            let time = TICK_S * f64::from(k);
            let (mut flow, mut volume) = (40.0, 40.0 * time);
            for (knot, (by_flow, by_volume)) in knots.iter().zip(responses.at(time, knots.len())) {
                flow += (knot - 2.0) * by_flow;
                volume += (knot - 2.0) * by_volume;
            }
            assert!((trajectory.flow_at(time) - flow).abs() < 1e-9, "{time}");
            assert!((trajectory.volume_at(time) - volume).abs() < 1e-9, "{time}");
        }
    }

    #[test]
    fn advancing_and_discarding_does_not_change_the_prediction() {
        let knots = [1.0, 4.0, 2.0, 2.5, 7.0];
        let mut extruder = FlowModel::settled(&model(), 2.0).unwrap();
        let whole = extruder.predict(&knots);
        extruder.advance(&knots[..2]);
        extruder.discard_before(0.1);
        let rest = extruder.predict(&knots[2..]);
        assert!((extruder.now_s() - 2.0 * KNOT_S).abs() < 1e-12);
        for time in [0.12, 0.2, 0.39] {
            assert!((rest.flow_at(time) - whole.flow_at(time)).abs() < 1e-9);
            assert!((rest.volume_at(time) - whole.volume_at(time)).abs() < 1e-9);
        }
    }
}
