//! The disk of a rehearsed run: it keeps nothing, and can be full.

use super::fault::{FaultKind, Faults};
use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::run::ports::{RecordError, Recorder};

/// A disk that is full from a time on, or never.
#[derive(Debug, Clone, Copy)]
pub struct Disk {
    full_from: Option<Stamp>,
}

impl Disk {
    /// With the faults of a run.
    pub fn new(faults: &Faults) -> Self {
        Self { full_from: faults.first(FaultKind::DiskFull) }
    }
}

impl Recorder for Disk {
    fn record(&mut self, now: Stamp, _: &Event, _: &Step) -> Result<(), RecordError> {
        match self.full_from {
            Some(from) if now >= from => Err(RecordError("no space left on the disk".to_owned())),
            _ => Ok(()),
        }
    }
}
