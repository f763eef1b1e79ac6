//! Beads with pauses between them, laid by a start-stop strategy, and their void and drool.

use crate::core::Span;
use crate::extruder::start_stop::{BeadConditions, Pause, StartStopTiming};
use crate::sim::melt::{Melt, MeltParameters};

/// How starts and stops are timed.
pub trait StartStopStrategy {
    /// A start after a pause: time from the run command until the robot moves \[s\], and its speed
    /// from then on as a fraction of the bead's speed, by the time since the run command.
    fn begins(&self, pause: &Pause) -> (f64, impl Fn(Span) -> f64);

    /// A stop: distance to the end of the bead at the stop command \[mm\], and the robot's speed
    /// as a fraction of the bead's speed, by the time since that command.
    fn ends(&self) -> (f64, impl Fn(Span) -> f64);
}

impl StartStopStrategy for StartStopTiming {
    fn begins(&self, pause: &Pause) -> (f64, impl Fn(Span) -> f64) {
        let start = self.start(pause);
        (start.robot_start().secs(), move |since| start.speed_ratio(since))
    }

    fn ends(&self) -> (f64, impl Fn(Span) -> f64) {
        let stop = self.stop();
        (stop.distance().get(), move |since| stop.speed_ratio(since))
    }
}

/// Missing and surplus volume \[mm³\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StartStopScore {
    /// Volume that is missing on the path that the robot travelled.
    pub void_mm3: f64,
    /// Surplus on the path, and all volume that left the nozzle while the robot stood.
    pub drool_mm3: f64,
}

impl StartStopScore {
    /// Void and drool together \[mm³\].
    pub fn sum_mm3(&self) -> f64 {
        self.void_mm3 + self.drool_mm3
    }

    /// The sum of two scores.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let void_mm3 = self.void_mm3 + other.void_mm3;
        Self { void_mm3, drool_mm3: self.drool_mm3 + other.drool_mm3 }
    }
}

/// A robot and the beads that it lays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartStopBench {
    /// Flow and speed; the smallest speed ratio is the one that a strategy uses.
    pub laid: BeadConditions,
    /// Length of a bead \[mm\].
    pub bead_mm: f64,
    /// Time constant of the robot's speed \[s\].
    pub robot_s: f64,
}

/// A sample of a start or a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowSample {
    /// Time since the command to the pump \[s\].
    pub since_s: f64,
    /// Flow at the nozzle \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// Flow that the robot's speed demands \[mm³/s\].
    pub demand_mm3_per_s: f64,
}

/// A stop and the start after it, each from the command to the pump.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartStopTrace {
    /// The stop.
    pub stop: Vec<FlowSample>,
    /// The start.
    pub start: Vec<FlowSample>,
}

/// Pauses after which starts are judged \[s\].
pub const PAUSES_S: [f64; 7] = [0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0];
/// Duration of a trace \[s\].
pub const TRACE_S: f64 = 4.0;

/// A pause and the beads beside it while they are simulated.
struct BenchRun<'a, S> {
    bench: &'a StartStopBench,
    strategy: &'a S,
    melt: Melt,
    speed_fraction: f64,
    score: StartStopScore,
    /// Last command to the pump, and its time.
    last_command: LastCommand,
    trace: StartStopTrace,
}

#[derive(Debug, Clone, Copy)]
enum LastCommand {
    Stop { at_s: f64 },
    Run { at_s: f64 },
}

impl StartStopBench {
    /// Lays beads one after another on the same machine, with these pauses \[s\] between them,
    /// each counted from the robot's arrival at the end of a bead; the melt keeps its state. One
    /// score for each pause: it covers the end of the bead, the pause, and the bead after it.
    pub fn score_pauses<S: StartStopStrategy>(
        &self,
        machine: MeltParameters,
        seed: u64,
        strategy: &S,
        idle_s: &[f64],
    ) -> Vec<StartStopScore> {
        let mut run = self.run(machine, seed, strategy);
        let one = |idle_s: &f64| {
            run.score = StartStopScore::default();
            run.pause(*idle_s);
            run.score
        };
        idle_s.iter().map(one).collect()
    }

    /// The trace of the end of a bead, a pause \[s\] and the start after it.
    pub fn trace<S: StartStopStrategy>(
        &self,
        machine: MeltParameters,
        seed: u64,
        strategy: &S,
        idle_s: f64,
    ) -> StartStopTrace {
        let mut run = self.run(machine, seed, strategy);
        run.pause(idle_s);
        run.trace
    }

    fn run<'a, S>(
        &'a self,
        machine: MeltParameters,
        seed: u64,
        strategy: &'a S,
    ) -> BenchRun<'a, S> {
        let (melt, speed_fraction) = (Melt::steady(machine, seed), 1.0);
        let last_command = LastCommand::Run { at_s: f64::NEG_INFINITY };
        let (bench, score, trace) = (self, StartStopScore::default(), StartStopTrace::default());
        BenchRun { bench, strategy, melt, speed_fraction, score, last_command, trace }
    }
}

impl<S: StartStopStrategy> BenchRun<'_, S> {
    /// Lays the end of a bead, waits, and lays the next bead.
    fn pause(&mut self, idle_s: f64) {
        self.trace = StartStopTrace::default();
        let stopped_s = self.finish();
        self.stand_until(self.melt.now_s() + idle_s);
        self.begin(stopped_s);
    }

    /// One step with the robot commanded to a fraction of its speed; returns the path in this step
    /// \[mm\].
    fn step(&mut self, commanded_fraction: f64) -> f64 {
        let (dt_s, laid_mm3) = self.melt.advance();
        let kept = libm::exp(-dt_s / self.bench.robot_s);
        self.speed_fraction = if commanded_fraction > 0.0 {
            commanded_fraction + (self.speed_fraction - commanded_fraction) * kept
        } else {
            0.0
        };
        let demand_mm3 = self.bench.laid.flow.get() * self.speed_fraction * dt_s;
        self.score.void_mm3 += (demand_mm3 - laid_mm3).max(0.0);
        self.score.drool_mm3 += (laid_mm3 - demand_mm3).max(0.0);
        self.record(laid_mm3 / dt_s, demand_mm3 / dt_s);
        self.bench.laid.speed.get() * self.speed_fraction * dt_s
    }

    fn record(&mut self, flow_mm3_per_s: f64, demand_mm3_per_s: f64) {
        let (at_s, kept) = match self.last_command {
            LastCommand::Stop { at_s } => (at_s, &mut self.trace.stop),
            LastCommand::Run { at_s } => (at_s, &mut self.trace.start),
        };
        let since_s = self.melt.now_s() - at_s;
        if since_s <= TRACE_S {
            kept.push(FlowSample { since_s, flow_mm3_per_s, demand_mm3_per_s });
        }
    }

    /// Lays the last part of a bead; returns the time of the stop command \[s\].
    fn finish(&mut self) -> f64 {
        let stopped_s = self.melt.now_s();
        self.melt.command(0.0);
        self.last_command = LastCommand::Stop { at_s: stopped_s };
        let (mut rest_mm, fraction) = self.strategy.ends();
        while rest_mm > 0.0 {
            let since = Span::from_secs(self.melt.now_s() - stopped_s);
            rest_mm -= self.step(fraction(since));
        }
        stopped_s
    }

    fn stand_until(&mut self, until_s: f64) {
        while self.melt.now_s() < until_s {
            self.step(0.0);
        }
    }

    /// Starts a bead and lays it up to where its end begins.
    fn begin(&mut self, stopped_s: f64) {
        let commanded_s = self.melt.now_s();
        let flow = self.bench.laid.flow;
        let pause = Pause { idle: Span::from_secs(commanded_s - stopped_s), flow_before: flow };
        self.melt.command(flow.get());
        self.last_command = LastCommand::Run { at_s: commanded_s };
        let (wait_s, fraction) = self.strategy.begins(&pause);
        self.stand_until(commanded_s + wait_s);
        let (end_mm, _) = self.strategy.ends();
        let mut rest_mm = self.bench.bead_mm - end_mm;
        while rest_mm > 0.0 {
            let since = Span::from_secs(self.melt.now_s() - commanded_s);
            rest_mm -= self.step(fraction(since));
        }
    }
}
