//! A bead in a recording: the robot's reports and the measured widths.

use crate::control::Event;
use crate::core::{RobotState, Stamp};
use crate::identify::camera_offset::TimedWidth;
use crate::io::recording::{RecordedEntry, RecordingError};

/// Recorded data of a bead.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordedBead {
    /// The robot's reports with their times of arrival.
    pub states: Vec<(Stamp, RobotState)>,
    /// Measured widths, by time of capture.
    pub widths: Vec<TimedWidth>,
    /// Number of rejected frames.
    pub rejected: u64,
}

/// Reads a recording to its end. Fails if the recording becomes unreadable.
pub fn recorded_bead(
    entries: impl IntoIterator<Item = Result<RecordedEntry, RecordingError>>,
) -> Result<RecordedBead, RecordingError> {
    let mut bead = RecordedBead::default();
    for entry in entries {
        let RecordedEntry::Event { now, event, .. } = entry? else { continue };
        match event {
            Event::Robot(state) => bead.states.push((now, state)),
            Event::Measured { captured_at, width_mm, sigma_mm, .. } => {
                bead.widths.push(TimedWidth { at: captured_at, width: width_mm, sigma: sigma_mm });
            }
            Event::Rejected { .. } => bead.rejected += 1,
            _ => {}
        }
    }
    // Sorted by capture time: widths may have arrived in another order.
    bead.widths.sort_by_key(|width| width.at);
    Ok(bead)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Mm;

    #[test]
    fn widths_are_put_in_the_order_of_their_frames() {
        let measured = |n: u64, ms: u64| {
            let captured_at = Stamp::from_ns(ms * 1_000_000);
            let (width_mm, sigma_mm) = (Mm::constant(40.0), Mm::constant(0.1));
            let event = Event::Measured { frame: n, captured_at, width_mm, sigma_mm };
            Ok(RecordedEntry::Event { n, now: captured_at, event })
        };
        let refused =
            Event::Rejected { frame: 2, captured_at: Stamp::START, reason: "no_pair".into() };
        let refused = Ok(RecordedEntry::Event { n: 2, now: Stamp::START, event: refused });
        let bead = recorded_bead([measured(0, 40), measured(1, 20), refused]).unwrap();
        let times: Vec<u64> = bead.widths.iter().map(|width| width.at.ns() / 1_000_000).collect();
        assert_eq!((times, bead.rejected), (vec![20, 40], 1));
    }
}
