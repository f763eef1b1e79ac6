//! What the simulated robot's thread shares with its handle.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::io::clock::RunClock;
use crate::link::RobotCell;

/// Samples of the truth that are kept; at 50 a second more than an hour.
const LONGEST_HISTORY: usize = 200_000;

/// Where the robot really was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// When.
    pub at: Stamp,
    /// Its state.
    pub state: RobotState,
}

/// What the robot's thread shares with the handle.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) clock: RunClock,
    cell: Mutex<RobotCell>,
    history: Mutex<VecDeque<Truth>>,
}

impl Shared {
    pub(super) fn new(clock: RunClock, cell: RobotCell) -> Self {
        Self { clock, cell: Mutex::new(cell), history: Mutex::default() }
    }

    pub(super) fn cell(&self) -> MutexGuard<'_, RobotCell> {
        self.cell.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn history(&self) -> MutexGuard<'_, VecDeque<Truth>> {
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn remember(&self, at: Stamp, state: RobotState) {
        let mut history = self.history();
        if history.len() == LONGEST_HISTORY {
            history.pop_front();
        }
        history.push_back(Truth { at, state });
    }
}
