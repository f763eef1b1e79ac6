//! The simulated robot behind its server, and the state that its thread and its handle share.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::core::{RobotMode, Stamp};
use crate::io::clock::RunClock;
use crate::link::robot::mode_word;
use crate::link::{LineError, PcLine, PrintJob, RobotLine, RobotStatus, VirtualRobot};
use crate::simulators::machine::{Answer, LineOutcome, LinkMachine};

/// Number of states that are kept. Derived: more than an hour at 50 per second.
const MAX_HISTORY: usize = 200_000;

/// True state of the robot at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueState {
    /// Time of the state.
    pub at: Stamp,
    /// Its state.
    pub state: RobotStatus,
}

/// State that the robot's thread and the handle share.
#[derive(Debug)]
pub(super) struct SharedRobot {
    pub(super) clock: RunClock,
    cell: Mutex<VirtualRobot>,
    history: Mutex<VecDeque<TrueState>>,
}

impl SharedRobot {
    pub(super) fn new(clock: RunClock, cell: VirtualRobot) -> Self {
        Self { clock, cell: Mutex::new(cell), history: Mutex::default() }
    }

    pub(super) fn cell(&self) -> MutexGuard<'_, VirtualRobot> {
        self.cell.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn history(&self) -> MutexGuard<'_, VecDeque<TrueState>> {
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn remember(&self, at: Stamp, state: RobotStatus) {
        let mut history = self.history();
        if history.len() == MAX_HISTORY {
            history.pop_front();
        }
        history.push_back(TrueState { at, state });
    }
}

pub(super) struct RobotMachine {
    shared: Arc<SharedRobot>,
    job: PrintJob,
    mode: RobotMode,
}

impl RobotMachine {
    pub(super) fn new(shared: Arc<SharedRobot>, job: PrintJob) -> Self {
        Self { shared, job, mode: RobotMode::Idle }
    }
}

impl LinkMachine for RobotMachine {
    const NAME: &'static str = "robot-sim";
    const SETPOINT_WORDS: &'static str = "the last setpoint";

    fn tick(&mut self, now: Stamp) -> Option<String> {
        let (state, report) = {
            let mut cell = self.shared.cell();
            self.job.advance(now, &mut cell);
            (cell.state(now), cell.report(now).filter(|_| cell.greeted()))
        };
        self.shared.remember(now, state);
        report.map(|report| report.format())
    }

    fn connected(&mut self, now: Stamp) {
        let mut cell = self.shared.cell();
        cell.connect(now);
        self.job.connected(cell.mode());
    }

    fn disconnected(&mut self, now: Stamp) {
        self.shared.cell().disconnect(now);
    }

    fn take(&mut self, now: Stamp, text: &str) -> Result<LineOutcome, LineError> {
        let line = PcLine::parse(text)?;
        let answer = self.shared.cell().take(now, line).map(Answer::from);
        Ok(LineOutcome { answer, bye: line == PcLine::Bye })
    }

    fn bad_line(&mut self, why: &str) -> Answer {
        RobotLine::bad_line(why).into()
    }

    fn changes(&mut self, now: Stamp) -> Option<String> {
        let state = self.shared.cell().state(now);
        if state.mode == self.mode {
            return None;
        }
        let (from, to) = (mode_word(self.mode), mode_word(state.mode));
        self.mode = state.mode;
        let (path, z) = (state.path_mm.get(), state.z_mm.get());
        Some(format!("{from} -> {to} at path {path:.1} mm, z {z:.1} mm"))
    }
}
