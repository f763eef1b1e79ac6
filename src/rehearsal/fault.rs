//! What goes wrong in a rehearsed run, and when.

use crate::core::{Mm, Span, Stamp};

/// A fault from a time on, up to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// When it begins.
    pub from: Stamp,
    /// When it is over.
    pub until: Stamp,
}

/// What can go wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// The camera gives no frames. From the start of the run on: it has never answered.
    CameraSilent,
    /// The camera gives the same image again and again.
    CameraFrozen,
    /// Its frames arrive later.
    CameraLate(Span),
    /// The camera fails for good.
    CameraFails,
    /// The robot reports a path that is shifted.
    PathShifted(Mm),
    /// The robot reports the same path again and again.
    PathStands,
    /// The clock of the robot's reports stands.
    ClockStands,
    /// The clock of the robot's reports has fallen back.
    ClockBehind(Span),
    /// The robot sends no reports.
    RobotMute,
    /// No line reaches the robot or comes from it.
    RobotUnplugged,
    /// The robot moves at this fraction of its setpoint.
    RobotSlow(f64),
    /// The pump fails for good.
    PumpFails,
    /// No line reaches the extruder or comes from it.
    ExtruderUnplugged,
    /// The disk is full, for good.
    DiskFull,
}

/// All faults of a run.
#[derive(Debug, Clone, Default)]
pub struct Faults(pub Vec<Fault>);

impl Faults {
    /// What goes wrong at a time.
    pub fn at(&self, now: Stamp) -> impl Iterator<Item = FaultKind> + '_ {
        self.0.iter().filter(move |one| (one.from..one.until).contains(&now)).map(|one| one.kind)
    }

    /// Whether something goes wrong at a time.
    pub fn has(&self, now: Stamp, kind: FaultKind) -> bool {
        self.at(now).any(|one| one == kind)
    }

    /// When a kind of fault first begins; `None` if it never does.
    pub fn first(&self, kind: FaultKind) -> Option<Stamp> {
        self.0.iter().filter(|one| one.kind == kind).map(|one| one.from).min()
    }
}
