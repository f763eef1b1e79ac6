//! The extruder's model ahead of time: flow and volume for a command that is given at evenly
//! spaced knots and is linear between them.

use crate::numeric::lti::{Between, ModelError, Simulator, TransferFunction};

/// Grid on which the flow is known \[s\]. Between two ticks it is taken for straight.
pub const TICK_S: f64 = 0.005;
/// Ticks between two knots of the command.
const KNOT_TICKS: usize = 16;
/// Time between two knots of the command \[s\].
pub const KNOT_S: f64 = 0.08;

/// Flow \[mm³/s\] and volume since the first tick \[mm³\], tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowTrajectory {
    from_s: f64,
    flow: Vec<f64>,
    volume: Vec<f64>,
}

impl FlowTrajectory {
    /// That begins at a moment \[s\] with a flow \[mm³/s\].
    fn new(from_s: f64, flow: f64) -> Self {
        Self { from_s, flow: vec![flow], volume: vec![0.0] }
    }

    fn push(&mut self, flow: f64) {
        let last = self.flow.last().copied().unwrap_or(flow);
        let before = self.volume.last().copied().unwrap_or(0.0);
        self.flow.push(flow);
        self.volume.push(before + 0.5 * TICK_S * (last + flow));
    }

    /// Flow at a moment \[mm³/s\]; beyond the ends that of the end.
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

    /// The tick before a moment and the share of a tick since.
    fn index_at(&self, time_s: f64) -> (usize, f64) {
        let ticks = (time_s - self.from_s) / TICK_S;
        let last = self.flow.len().saturating_sub(2);
        let at = whole(ticks).min(last);
        (at, ticks - float(at))
    }
}

/// The extruder at the moment from which on its command is still open.
#[derive(Debug, Clone)]
pub struct FlowModel {
    flow: Simulator,
    command: f64,
    history: FlowTrajectory,
}

impl FlowModel {
    /// Settled at a command since long before 0 s.
    pub fn settled(model: &TransferFunction, command: f64) -> Result<Self, ModelError> {
        let mut flow = Simulator::new(model, TICK_S, Between::Linear)?;
        flow.settle(command)?;
        let now = if command == 0.0 { 0.0 } else { command * model.dc_gain() };
        Ok(Self { flow, command, history: FlowTrajectory::new(0.0, now) })
    }

    /// The command from which the knots go on.
    pub fn command(&self) -> f64 {
        self.command
    }

    /// When the command is open \[s\].
    pub fn now_s(&self) -> f64 {
        self.history.from_s + TICK_S * float(self.history.flow.len() - 1)
    }

    /// Forgets what was before a moment \[s\], but for the tick before it.
    pub fn discard_before(&mut self, before_s: f64) {
        let past = &mut self.history;
        let ticks = whole((before_s - past.from_s) / TICK_S).min(past.flow.len().saturating_sub(2));
        past.flow.drain(..ticks);
        past.volume.drain(..ticks);
        past.from_s += TICK_S * float(ticks);
    }

    /// Takes knots for decided.
    pub fn advance(&mut self, knots: &[f64]) {
        run(&mut self.flow, self.command, knots, &mut self.history);
        self.command = knots.last().copied().unwrap_or(self.command);
    }

    /// What comes of knots, after what has been.
    pub fn predict(&self, knots: &[f64]) -> FlowTrajectory {
        let (mut flow, mut course) = (self.flow.clone(), self.history.clone());
        run(&mut flow, self.command, knots, &mut course);
        course
    }
}

/// What comes of a command over time \[s\], asked for tick by tick, at whose first value
/// the extruder has settled.
pub fn simulate(
    model: &TransferFunction,
    mut command: impl FnMut(f64) -> f64,
    until_s: f64,
) -> Result<FlowTrajectory, ModelError> {
    let FlowModel { mut flow, history: mut past, .. } = FlowModel::settled(model, command(0.0))?;
    for tick in 1..=whole(until_s / TICK_S) + 1 {
        past.push(flow.step(command(TICK_S * float(tick))));
    }
    Ok(past)
}

fn run(flow: &mut Simulator, from: f64, knots: &[f64], course: &mut FlowTrajectory) {
    let mut last = from;
    for knot in knots {
        for tick in 1..=KNOT_TICKS {
            let fraction = float(tick) / float(KNOT_TICKS);
            course.push(flow.step(last + fraction * (knot - last)));
        }
        last = *knot;
    }
}

/// What a unit more at one knot does, tick by tick after the knot before it: the command
/// rises to the knot and falls to the next one, or stays where there is none.
#[derive(Debug, Clone)]
pub struct KnotResponses {
    inner: FlowTrajectory,
    last: FlowTrajectory,
}

impl KnotResponses {
    /// For a number of knots.
    pub fn new(model: &TransferFunction, knots: usize) -> Result<Self, ModelError> {
        let ticks = (knots + 1) * KNOT_TICKS;
        let answer = |input: &dyn Fn(f64) -> f64| -> Result<FlowTrajectory, ModelError> {
            let mut flow = Simulator::new(model, TICK_S, Between::Linear)?;
            let mut course = FlowTrajectory::new(0.0, flow.step(0.0));
            for tick in 1..=ticks {
                course.push(flow.step(input(float(tick) / float(KNOT_TICKS))));
            }
            Ok(course)
        };
        Ok(Self {
            inner: answer(&|at: f64| (1.0 - (at - 1.0).abs()).max(0.0))?,
            last: answer(&|at: f64| at.min(1.0))?,
        })
    }

    /// Flow \[mm³/s\] and volume \[mm³\] at a time after the command opened, for each knot.
    pub fn at(&self, since_s: f64, knots: usize) -> impl Iterator<Item = (f64, f64)> {
        (0..knots).map(move |knot| {
            let since = since_s - KNOT_S * float(knot);
            let response = if knot + 1 == knots { &self.last } else { &self.inner };
            if since <= 0.0 {
                (0.0, 0.0)
            } else {
                (response.flow_at(since), response.volume_at(since))
            }
        })
    }
}

fn between(row: &[f64], at: usize, fraction: f64) -> f64 {
    let first = row.get(at).copied().unwrap_or(0.0);
    let second = row.get(at + 1).copied().unwrap_or(first);
    first + fraction * (second - first)
}

#[expect(clippy::cast_precision_loss, reason = "counts of a plan are far below 2⁵²")]
pub(super) fn float(count: usize) -> f64 {
    count as f64
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
        assert!((TICK_S * float(KNOT_TICKS) - KNOT_S).abs() < 1e-12);
    }

    #[test]
    fn a_command_that_stays_keeps_the_flow() {
        let course = FlowModel::settled(&model(), 3.0).unwrap().predict(&[3.0; 20]);
        assert!((course.flow_at(0.7) - 60.0).abs() < 1e-9);
        assert!((course.volume_at(1.234) - 60.0 * 1.234).abs() < 1e-9);
    }

    #[test]
    fn hats_add_up_to_what_knots_do() {
        let knots = [1.0, 4.0, 2.0, 2.5, 7.0];
        let extruder = FlowModel::settled(&model(), 2.0).unwrap();
        let course = extruder.predict(&knots);
        let responses = KnotResponses::new(&model(), knots.len()).unwrap();
        for k in 0_u32..80 {
            let time = TICK_S * f64::from(k);
            let (mut flow, mut volume) = (40.0, 40.0 * time);
            for (knot, (by_flow, by_volume)) in knots.iter().zip(responses.at(time, knots.len())) {
                flow += (knot - 2.0) * by_flow;
                volume += (knot - 2.0) * by_volume;
            }
            assert!((course.flow_at(time) - flow).abs() < 1e-9, "{time}");
            assert!((course.volume_at(time) - volume).abs() < 1e-9, "{time}");
        }
    }

    #[test]
    fn what_was_decided_and_forgotten_changes_nothing_later() {
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
