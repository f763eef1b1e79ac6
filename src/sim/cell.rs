//! The simulated cell: the same controller, runner and robot as a live one, in
//! simulated time. Events come in the order of time; at the same moment the
//! robot reports first, then the camera sees, then a setpoint is sent.

mod camera;
mod port;

use crate::calib::Calibration;
use crate::config::Cell;
use crate::config::cell::RunPart;
use crate::control::{Command, Event, RobotMode, Step};
use crate::controller::{Controller, Setup};
use crate::link::{ParamError, RobotCell, RobotParams};
use crate::ports::Recorder;
use crate::runner::{Handled, Runner};
use crate::time::{Span, Stamp};
use crate::units::{Mm, MmPerS, MmPerS2};

use super::hash;
use super::laid::LaidBead;
use super::render::RenderError;

pub use camera::Sight;
use camera::SimCamera;
use port::SimPort;

/// A robot that stops for this long has finished.
const LONGEST_LAYER_S: f64 = 86_400.0;
/// Slowness of the simulated robot's own acceleration limit where the cell's
/// setpoints are limited already \[mm/s²\].
const ROBOT_ACCEL: MmPerS2 = MmPerS2::constant(1e6);
/// Share of the start speed from which the start counts as over.
const STARTED: f64 = 0.99;

/// Is told what happens in a simulated cell.
pub trait Witness {
    /// An event and the controller's answer.
    fn step(&mut self, now: Stamp, event: &Event, step: &Step);

    /// What the camera saw; comes after the step that answered it.
    fn look(&mut self, sight: &Sight<'_>);
}

/// A cell that cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// The robot that the cell describes cannot be.
    #[error("the simulated robot cannot be: {0}")]
    Robot(#[from] ParamError),
    /// The bead cannot be pictured.
    #[error("the simulated bead cannot be rendered: {0}")]
    Render(#[from] RenderError),
}

/// A cell in simulated time.
pub struct SimCell<K> {
    run: RunPart,
    cell: Cell,
    runner: Runner<SimPort, K>,
    camera: SimCamera,
    bead: LaidBead,
    now: Stamp,
    layers: u64,
    /// Nozzle's path at the start of the layer, and as far as bead is laid.
    bead_start: f64,
    laid_to: (f64, f64),
    started: bool,
    speed: Option<MmPerS>,
    setpoint: Option<MmPerS>,
}

/// How a layer went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerEnd {
    /// Simulated time that it took.
    pub took: Span,
    /// Whether the bead was laid to its end.
    pub whole: bool,
}

impl<K: Recorder> SimCell<K> {
    /// A cell as its file describes it, with the robot idle and connected.
    pub fn new(
        cell: &Cell,
        run: &RunPart,
        calibration: Calibration,
        recorder: K,
    ) -> Result<Self, SimError> {
        let simulation = &cell.simulation;
        let params = RobotParams {
            min: run.limits.min_speed,
            max: run.limits.max_speed,
            hold: run.robot.start_speed,
            start: run.robot.start_speed,
            bandwidth_hz: simulation.robot_bandwidth_hz,
            accel: ROBOT_ACCEL,
            bead: Some(simulation.path),
            ..RobotParams::default()
        };
        let port = SimPort::new(RobotCell::new(params, Stamp::START)?, run.robot.valid_ms);
        let controller = Controller::new(Setup::from(run));
        let mut sim = Self {
            camera: SimCamera::new(cell, calibration)?,
            runner: Runner::new(controller, port, recorder),
            run: run.clone(),
            cell: cell.clone(),
            bead: Self::fresh_bead(cell, 0),
            now: Stamp::START,
            layers: 0,
            bead_start: 0.0,
            laid_to: (0.0, 0.0),
            started: false,
            speed: None,
            setpoint: None,
        };
        let robot = sim.runner.robot_mut().connect(Stamp::START);
        let _ = sim.runner.handle(Stamp::START, &Event::LinkUp { robot });
        Ok(sim)
    }

    fn fresh_bead(cell: &Cell, layer: u64) -> LaidBead {
        let simulation = &cell.simulation;
        let seed = hash::mix(&[simulation.seed, layer]);
        LaidBead::new(simulation.bead, simulation.roughness, simulation.flow, seed)
    }

    /// The bead of the present layer, along the path since the layer's start.
    pub fn bead(&self) -> &LaidBead {
        &self.bead
    }

    /// Takes the recorder back at the end.
    pub fn into_recorder(self) -> K {
        self.runner.into_parts().2
    }

    /// Lays one bead from start to end with the nozzle at a height, and tells
    /// a witness everything. Ends early when the robot stops.
    pub fn layer(&mut self, z: Mm, witness: &mut impl Witness) -> LayerEnd {
        self.bead = Self::fresh_bead(&self.cell, self.layers);
        self.bead_start = self.runner.robot_mut().begin(self.now, z).path_mm.get();
        self.laid_to = (0.0, self.run.robot.start_speed.get());
        self.started = false;
        let mut clock = Ticker::new(&self.cell, &self.run, self.now, self.layers);
        let began = self.now;
        self.layers += 1;
        loop {
            let (at, what) = clock.next();
            self.now = at;
            self.lay();
            match what {
                What::Report => {
                    let state = self.runner.robot_mut().state(at);
                    self.speed = Some(state.speed_mm_per_s);
                    self.tell(&Event::Robot(state), witness);
                    let ended = !matches!(state.mode, RobotMode::Print | RobotMode::Hold);
                    if ended || (at - began).secs() > LONGEST_LAYER_S {
                        let whole = state.mode == RobotMode::Idle;
                        return LayerEnd { took: at - began, whole };
                    }
                }
                What::Frame => self.look(witness),
                What::Tick => {
                    let handled = self.tell(&Event::Tick, witness);
                    if let (Some(_), Some(Command::Speed(speed))) =
                        (handled.sent, handled.step.command)
                    {
                        self.setpoint = Some(speed);
                    }
                }
            }
        }
    }

    fn tell(&mut self, event: &Event, witness: &mut impl Witness) -> Handled {
        let handled = self.runner.handle(self.now, event);
        witness.step(self.now, event, &handled.step);
        handled
    }

    /// Lays the bead up to where the nozzle is now. While the robot gathers
    /// speed the flow is gathered with it, so that the bead begins as wide as
    /// it is at the start speed.
    fn lay(&mut self) {
        let state = self.runner.robot_mut().state(self.now);
        let path = state.path_mm.get() - self.bead_start;
        let start_speed = self.run.robot.start_speed.get();
        let mut speed = state.speed_mm_per_s.get();
        if !self.started {
            self.started = speed >= STARTED * start_speed;
            speed = start_speed;
        }
        let (from, last) = self.laid_to;
        if path > from && matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
            self.bead.lay_ramp((from, path), (last, speed));
            self.laid_to = (path, speed);
        }
    }

    fn look(&mut self, witness: &mut impl Witness) {
        let state = self.runner.robot_mut().state(self.now);
        let under = state.path_mm.get() - self.bead_start - self.run.camera.offset.get();
        let taken = self.camera.take(self.now, under, state.z_mm, &self.bead);
        let event = match &taken.outcome {
            Ok(measured) => Event::Measured {
                frame: taken.seq,
                captured_at: self.now,
                width_mm: measured.width,
                sigma_mm: measured.sigma,
            },
            Err(status) => Event::Rejected {
                frame: taken.seq,
                captured_at: self.now,
                reason: (*status).to_owned(),
            },
        };
        let handled = self.tell(&event, witness);
        witness.look(&Sight {
            seq: taken.seq,
            captured_at: self.now,
            outcome: taken.outcome,
            frame: taken.frame.as_ref(),
            edges: taken.frame.is_some().then(|| self.camera.edges()),
            truth: taken.truth,
            under_mm: under,
            step: &handled.step,
            speed: self.speed,
            setpoint: self.setpoint,
        });
    }
}

/// What comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    Report,
    Frame,
    Tick,
}

/// The three clocks of a cell.
struct Ticker {
    began: Stamp,
    /// Period, phase \[s\] and count of reports, frames and ticks.
    clocks: [(f64, f64, u32); 3],
}

impl Ticker {
    fn new(cell: &Cell, run: &RunPart, began: Stamp, layer: u64) -> Self {
        let simulation = &cell.simulation;
        let (frame, tick) = (1.0 / run.camera.rate_hz, 1.0 / run.robot.rate_hz);
        let step = simulation.step.secs();
        // On the grid of the world, as a real cell's clocks are not.
        let phase = |which: u64, period: f64| {
            if !simulation.random_phase {
                return 0.0;
            }
            let word = hash::mix(&[simulation.seed, layer, which]);
            #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
            let share = (word >> 11) as f64 / (1_u64 << 53) as f64;
            (share * period / step).floor() * step
        };
        let clocks = [(step, 0.0, 0), (frame, phase(1, frame), 0), (tick, phase(2, tick), 0)];
        Self { began, clocks }
    }

    fn next(&mut self) -> (Stamp, What) {
        let due = |k: usize| {
            let (period, phase, count) = self.clocks[k];
            self.began + Span::from_secs(phase + period * f64::from(count))
        };
        let dues = [due(0), due(1), due(2)];
        let first = if dues[0] <= dues[1] && dues[0] <= dues[2] {
            0
        } else if dues[1] <= dues[2] {
            1
        } else {
            2
        };
        self.clocks[first].2 += 1;
        (dues[first], [What::Report, What::Frame, What::Tick][first])
    }
}

/// A witness that hears nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deaf;

impl Witness for Deaf {
    fn step(&mut self, _: Stamp, _: &Event, _: &Step) {}
    fn look(&mut self, _: &Sight<'_>) {}
}
