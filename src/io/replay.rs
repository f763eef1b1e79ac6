//! Feeds recorded events to a controller and compares its steps with the
//! recorded ones, bit for bit.

use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::io::recording::{RecordedEntry, RecordingError};

/// The first step that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Number of the event.
    pub n: u64,
    /// Time at which the controller handled it.
    pub now: Stamp,
    /// The event.
    pub event: Event,
    /// The step of the run.
    pub recorded: Step,
    /// The step of the replay.
    pub replayed: Step,
}

/// Events that are missing in the middle of a recording. Later steps cannot be compared, because
/// the controller has not handled the missing events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingEvents {
    /// Number of the first event that is missing or has no step.
    pub expected: u64,
    /// Number of the event or step that was read instead.
    pub found: u64,
}

/// Result of a replay.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReplayReport {
    /// Number of compared steps. All are equal, except the last one if there is a difference.
    pub compared: u64,
    /// The first difference; the replay ends there.
    pub difference: Option<Difference>,
    /// Missing events; the replay ends there.
    pub gap: Option<MissingEvents>,
    /// A last event whose step was not recorded.
    pub unanswered: Option<u64>,
}

/// An event that was given to the controller; its recorded step comes next.
struct Pending {
    n: u64,
    now: Stamp,
    event: Event,
    replayed: Step,
}

/// Replays a recording. `step` is a controller in its initial state. Fails if the recording
/// becomes unreadable.
pub fn replay(
    entries: impl IntoIterator<Item = Result<RecordedEntry, RecordingError>>,
    mut step: impl FnMut(Stamp, &Event) -> Step,
) -> Result<ReplayReport, RecordingError> {
    let mut report = ReplayReport::default();
    let mut pending: Option<Pending> = None;
    for entry in entries {
        match entry? {
            RecordedEntry::Frame(_) => {}
            RecordedEntry::Event { n, now, event } => {
                let expected = report.compared;
                if pending.is_some() || n != expected {
                    report.gap = Some(MissingEvents { expected, found: n });
                    return Ok(report);
                }
                let replayed = step(now, &event);
                pending = Some(Pending { n, now, event, replayed });
            }
            RecordedEntry::Step { n, step: recorded, .. } => {
                let Some(Pending { now, event, replayed, .. }) =
                    pending.take_if(|open| open.n == n)
                else {
                    report.gap = Some(MissingEvents { expected: report.compared, found: n });
                    return Ok(report);
                };
                report.compared += 1;
                if !same_bits(&recorded, &replayed) {
                    report.difference =
                        Some(Difference { n, now, event, recorded: *recorded, replayed });
                    return Ok(report);
                }
            }
        }
    }
    report.unanswered = pending.map(|open| open.n);
    Ok(report)
}

/// Whether two steps are equal, including the sign of zeros: the shortest decimal of a float
/// identifies its bits.
fn same_bits(a: &Step, b: &Step) -> bool {
    match (serde_json::to_string(a), serde_json::to_string(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{State, Trace};
    use crate::core::Mm;

    /// A controller with memory: the error is the sum of all widths.
    fn controller() -> impl FnMut(Stamp, &Event) -> Step {
        let mut sum = 0.0;
        move |_, event| {
            if let Event::Measured { width_mm, .. } = event {
                sum += width_mm.get();
            }
            let trace = Trace { error_mm: Mm::new(sum).ok(), ..Trace::default() };
            Step { state: State::Tracking, trace, ..Step::default() }
        }
    }

    fn recorded(count: u32) -> Vec<RecordedEntry> {
        let mut controller = controller();
        let mut entries = Vec::new();
        for frame in 0..count {
            let n = u64::from(frame);
            let now = Stamp::from_ns(n * 20_000_000);
            let event = Event::Measured {
                frame: n,
                captured_at: now,
                width_mm: Mm::constant(0.1 * f64::from(frame)),
                sigma_mm: Mm::constant(0.05),
            };
            let step = controller(now, &event);
            entries.push(RecordedEntry::Event { n, now, event });
            entries.push(RecordedEntry::Step { n, now, step: Box::new(step) });
        }
        entries
    }

    fn replayed(entries: Vec<RecordedEntry>) -> ReplayReport {
        replay(entries.into_iter().map(Ok), controller()).unwrap()
    }

    #[test]
    fn the_same_controller_gives_the_same_steps() {
        let report = replayed(recorded(50));
        assert_eq!(report, ReplayReport { compared: 50, ..ReplayReport::default() });
    }

    #[test]
    fn one_bit_is_a_difference() {
        let mut entries = recorded(20);
        let RecordedEntry::Step { step, .. } = &mut entries[15] else {
            panic!("a step was expected")
        };
        let error = step.trace.error_mm.unwrap().get();
        step.trace.error_mm = Mm::new(f64::from_bits(error.to_bits() + 1)).ok();
        let report = replayed(entries);
        let difference = report.difference.unwrap();
        assert_eq!((report.compared, difference.n), (8, 7));
        assert_eq!(difference.replayed.trace.error_mm.unwrap().get().to_bits(), error.to_bits());
    }

    #[test]
    fn the_sign_of_a_zero_is_a_difference() {
        let mut entries = recorded(1);
        let RecordedEntry::Step { step, .. } = &mut entries[1] else {
            panic!("a step was expected")
        };
        step.trace.error_mm = Some(Mm::constant(-0.0));
        assert_eq!(replayed(entries).difference.unwrap().n, 0);
    }

    #[test]
    fn a_cut_recording_is_replayed_as_far_as_it_goes() {
        let mut entries = recorded(10);
        entries.truncate(13);
        let report = replayed(entries);
        assert_eq!((report.compared, report.unanswered, report.gap), (6, Some(6), None));
    }

    #[test]
    fn nothing_is_compared_behind_a_gap() {
        let mut entries = recorded(10);
        entries.drain(6..10);
        let report = replayed(entries);
        assert_eq!((report.compared, report.difference), (3, None));
        assert_eq!(report.gap, Some(MissingEvents { expected: 3, found: 5 }));
    }
}
