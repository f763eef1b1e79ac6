//! What the simulated robot's thread shares with its handle.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::io::clock::RunClock;
use crate::link::VirtualRobot;

/// States that are kept. Derived: more than an hour at 50 per second.
const MAX_HISTORY: usize = 200_000;

/// Where the robot really was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueState {
    /// When.
    pub at: Stamp,
    /// Its state.
    pub state: RobotState,
}

/// What the robot's thread shares with the handle.
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

    pub(super) fn remember(&self, at: Stamp, state: RobotState) {
        let mut history = self.history();
        if history.len() == MAX_HISTORY {
            history.pop_front();
        }
        history.push_back(TrueState { at, state });
    }
}
