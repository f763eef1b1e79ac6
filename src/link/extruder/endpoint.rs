//! The extruder's side of the link as a state machine: which commands it accepts, and for how
//! long. Time is an argument; the caller drives pump and valve.

use super::drive_line::DriveLine;
use super::extruder_line::{ExtruderLine, ExtruderStatus};
use crate::core::Stamp;
use crate::extruder::{ExtruderCommand, ExtruderLimits, ExtruderReport, PumpMode};
use crate::link::frame::{DeviceClock, ErrCode, LineRefusal, Sequence, Validity};

/// The command that applies without a valid one.
const AT_REST: ExtruderCommand = ExtruderCommand { pump_on: false, valve_open: false, value: 0.0 };

/// Misbehaviour of an extruder, for tests and rehearsals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExtruderFaults {
    /// Refuses every command with this code.
    pub refuse: Option<ErrCode>,
    /// Sends no `STATE`.
    pub mute: bool,
}

/// An extruder's end of the link.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderEndpoint {
    limits: ExtruderLimits,
    clock: DeviceClock,
    sequence: Sequence,
    /// The current command and the time at which it expires.
    command: Option<(ExtruderCommand, Stamp)>,
    failed: bool,
    faults: ExtruderFaults,
}

impl ExtruderEndpoint {
    /// An extruder at rest whose clock shows `clock_start_ms` at stamp 0.
    pub const fn new(limits: ExtruderLimits, clock_start_ms: u64) -> Self {
        Self {
            limits,
            clock: DeviceClock { device: "extruder", start_ms: clock_start_ms },
            sequence: Sequence::new(),
            command: None,
            failed: false,
            faults: ExtruderFaults { refuse: None, mute: false },
        }
    }

    /// A new connection, which replaces an older one. Sequence numbers start again; the last
    /// command stays valid.
    pub const fn connect(&mut self) {
        self.sequence = Sequence::new();
    }

    /// The connection has ended. The last command stays valid until it expires.
    pub const fn disconnect(&mut self) {
        self.sequence.disconnect();
    }

    /// The pump fails: it stops, and no command starts it.
    pub const fn fail(&mut self) {
        self.failed = true;
        self.command = None;
    }

    /// Whether the pump has failed.
    pub const fn has_failed(&self) -> bool {
        self.failed
    }

    /// Leaves the fault, as an operator does at the extruder.
    pub const fn acknowledge(&mut self) {
        self.failed = false;
    }

    /// Sets faults that apply from now on.
    pub const fn set_faults(&mut self, faults: ExtruderFaults) {
        self.faults = faults;
    }

    /// Time at which the current command expires; `None` without one.
    pub fn runs_out(&self) -> Option<Stamp> {
        self.command.map(|(_, until)| until)
    }

    /// Current command to pump and valve: the last command while it is valid, otherwise the rest
    /// state.
    pub fn command(&mut self, now: Stamp) -> ExtruderCommand {
        self.command = self.command.filter(|&(_, until)| now < until);
        self.command.map_or(AT_REST, |(command, _)| command)
    }

    /// The `STATE` to send, with a report from pump, valve and sensors; `None` before `HELLO`, and
    /// while it is mute.
    pub fn state(&self, now: Stamp, report: ExtruderReport) -> Option<ExtruderLine> {
        let pump = if self.failed { PumpMode::Fault } else { report.pump };
        let (t_ms, seq) = (self.clock.ms(now), self.sequence.applied());
        let report = ExtruderReport { pump, ..report };
        let line = ExtruderLine::State(ExtruderStatus { t_ms, seq, report });
        (self.sequence.greeted() && !self.faults.mute).then_some(line)
    }

    /// Takes a line from the PC; the answer is `HELLO`, or `ERR` if the line is refused.
    pub fn take(&mut self, now: Stamp, line: DriveLine) -> Option<ExtruderLine> {
        match line {
            DriveLine::Hello => {
                self.sequence.greet();
                Some(ExtruderLine::Hello(self.limits.clone()))
            }
            DriveLine::Bye => None,
            DriveLine::Drive { seq, command, valid_ms, ref_t_ms } => {
                let taken = self.drive(now, seq, command, Validity { valid_ms, ref_t_ms });
                taken.err().map(|refusal| ExtruderLine::refused(seq, refusal))
            }
        }
    }

    fn drive(
        &mut self,
        now: Stamp,
        seq: u64,
        command: ExtruderCommand,
        validity: Validity,
    ) -> Result<(), LineRefusal> {
        self.sequence.count(seq)?;
        if let Some(code) = self.faults.refuse {
            return Err(LineRefusal::on_purpose(code));
        }
        if self.failed && command.pump_on {
            return Err(LineRefusal::new(ErrCode::Mode, "the pump has failed"));
        }
        let ExtruderLimits { quantity, min, max, .. } = &self.limits;
        if command.pump_on && !(*min..=*max).contains(&command.value) {
            let (value, unit) = (command.value, quantity.unit());
            let text = format!("{value} {unit} is not within {min} to {max}");
            return Err(LineRefusal::new(ErrCode::Range, text));
        }
        let until = self.clock.void_at(now, validity)?;
        self.command = Some((command, until));
        self.sequence.apply(seq);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::CommandQuantity;

    const RUN: ExtruderCommand = ExtruderCommand { pump_on: true, valve_open: true, value: 60.0 };

    fn at(ms: u64) -> Stamp {
        Stamp::from_ns(ms * 1_000_000)
    }

    fn gate() -> ExtruderEndpoint {
        let limits = ExtruderLimits {
            name: "test".into(),
            quantity: CommandQuantity::Rpm,
            min: 5.0,
            max: 90.0,
        };
        ExtruderEndpoint::new(limits, 7000)
    }

    fn greeted() -> ExtruderEndpoint {
        let mut gate = gate();
        assert!(matches!(gate.take(at(0), DriveLine::Hello), Some(ExtruderLine::Hello(_))));
        gate
    }

    fn code(answer: Option<&ExtruderLine>) -> Option<ErrCode> {
        match answer {
            Some(ExtruderLine::Err { code, .. }) => Some(*code),
            _ => None,
        }
    }

    fn drive(seq: u64, command: ExtruderCommand, valid_ms: u64, ref_t_ms: u64) -> DriveLine {
        DriveLine::Drive { seq, command, valid_ms, ref_t_ms }
    }

    #[test]
    fn a_command_runs_out_and_pump_and_valve_go_to_rest() {
        let mut gate = greeted();
        assert_eq!(gate.take(at(20), drive(1, RUN, 300, 7010)), None);
        assert_eq!(gate.command(at(309)), RUN);
        assert_eq!(gate.command(at(310)), AT_REST);
        assert_eq!(
            code(gate.take(at(320), drive(2, RUN, 300, 7010)).as_ref()),
            Some(ErrCode::Stale)
        );
        assert_eq!(gate.take(at(320), drive(3, RUN, 300, 7310)), None);
        assert_eq!(gate.command(at(609)), RUN);
    }

    #[test]
    fn what_is_refused_leaves_the_last_command_running() {
        let mut gate = greeted();
        assert_eq!(gate.take(at(20), drive(1, RUN, 1000, 7000)), None);
        let much = ExtruderCommand { value: 90.1, ..RUN };
        for (line, why) in [
            (drive(2, much, 300, 7010), ErrCode::Range),
            (drive(5, RUN, 300, 7010), ErrCode::Sequence),
            (drive(6, RUN, 99, 7010), ErrCode::Range),
            (drive(7, RUN, 300, 7900), ErrCode::Range),
        ] {
            assert_eq!(code(gate.take(at(30), line).as_ref()), Some(why), "{line:?}");
        }
        assert_eq!(gate.command(at(999)), RUN);
        // At rest the command is not compared with the smallest one.
        assert_eq!(gate.take(at(40), drive(8, AT_REST, 300, 7010)), None);
    }

    #[test]
    fn nothing_is_taken_before_hello_and_each_connection_counts_from_one() {
        let mut gate = gate();
        assert_eq!(code(gate.take(at(1), drive(1, RUN, 300, 7000)).as_ref()), Some(ErrCode::Form));
        let mut gate = greeted();
        assert_eq!(gate.take(at(20), drive(1, RUN, 1000, 7000)), None);
        gate.connect();
        let _ = gate.take(at(30), DriveLine::Hello);
        assert_eq!(gate.command(at(40)), RUN);
        assert_eq!(gate.take(at(40), drive(1, RUN, 300, 7010)), None);
    }

    #[test]
    fn a_pump_that_failed_runs_only_after_its_operator_was_there() {
        let mut gate = greeted();
        assert_eq!(gate.take(at(20), drive(1, RUN, 1000, 7000)), None);
        gate.fail();
        assert_eq!(gate.command(at(30)), AT_REST);
        assert_eq!(code(gate.take(at(30), drive(2, RUN, 300, 7010)).as_ref()), Some(ErrCode::Mode));
        assert_eq!(gate.take(at(30), drive(3, AT_REST, 300, 7010)), None);
        gate.acknowledge();
        assert_eq!(gate.take(at(30), drive(4, RUN, 300, 7010)), None);
        assert_eq!(gate.command(at(40)), RUN);
    }
}
