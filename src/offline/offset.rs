//! What a recording says of a bead: where the robot was, and the widths that were
//! measured meanwhile.

use crate::calib::SurfaceMap;
use crate::control::offset::Width;
use crate::control::{Event, RobotState};
use crate::geometry::ImagePoint;
use crate::io::recording::{Entry, RecordingError};
use crate::time::Stamp;
use crate::units::Mm;
use crate::vision::{Axis, Gauge};

/// A bead as it was recorded.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Print {
    /// What the robot reported, when it arrived.
    pub states: Vec<(Stamp, RobotState)>,
    /// Widths that were measured.
    pub widths: Vec<Width>,
    /// Frames that gave none.
    pub refused: u64,
}

/// Reads a recording to its end. Fails where it cannot be read on.
pub fn print(
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
) -> Result<Print, RecordingError> {
    let mut print = Print::default();
    for entry in entries {
        let Entry::Event { now, event, .. } = entry? else { continue };
        match event {
            Event::Robot(state) => print.states.push((now, state)),
            Event::Measured { captured_at, width_mm, sigma_mm, .. } => {
                print.widths.push(Width { at: captured_at, width: width_mm, sigma: sigma_mm });
            }
            Event::Rejected { .. } => print.refused += 1,
            _ => {}
        }
    }
    // Time goes by capture, whatever came in between.
    print.widths.sort_by_key(|width| width.at);
    Ok(print)
}

/// Length of a gauge along the bead on a surface; `None` where an end does not see it.
pub fn gauge_length(gauge: &Gauge, map: &SurfaceMap) -> Option<Mm> {
    let roi = gauge.roi;
    #[expect(clippy::cast_precision_loss, reason = "pixel numbers stay far below 2^53")]
    let [x, y, width, height] = [roi.x, roi.y, roi.width, roi.height].map(|px| px as f64);
    let (across, along) = (x + 0.5 * (width - 1.0), y + 0.5 * (height - 1.0));
    // From border to border of its pixels, the first of which has its centre at 0.
    let ends = match gauge.axis {
        Axis::Vertical => {
            [ImagePoint::new(across, y - 0.5), ImagePoint::new(across, y + height - 0.5)]
        }
        Axis::Horizontal => {
            [ImagePoint::new(x - 0.5, along), ImagePoint::new(x + width - 0.5, along)]
        }
    };
    Mm::new((map.to_mm(ends[1])? - map.to_mm(ends[0])?).norm()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Roi;
    use crate::vision::{Method, Polarity};

    #[test]
    fn a_gauge_is_as_long_as_its_rows_or_its_columns() {
        let gauge = |axis| Gauge {
            roi: Roi { x: 10, y: 20, width: 100, height: 50 },
            axis,
            polarity: Polarity::Bright,
            width_range: (Mm::ZERO, Mm::constant(50.0)),
            method: Method::Caliper,
            calipers: 64,
            min_contrast_grey: 6.0,
        };
        let map = SurfaceMap::from_scale(0.1);
        let length = |axis| gauge_length(&gauge(axis), &map).unwrap().get();
        assert!((length(Axis::Vertical) - 5.0).abs() < 1e-9);
        assert!((length(Axis::Horizontal) - 10.0).abs() < 1e-9);
    }

    #[test]
    fn widths_are_put_in_the_order_of_their_frames() {
        let measured = |n: u64, ms: u64| {
            let captured_at = Stamp::from_ns(ms * 1_000_000);
            let (width_mm, sigma_mm) = (Mm::constant(40.0), Mm::constant(0.1));
            let event = Event::Measured { frame: n, captured_at, width_mm, sigma_mm };
            Ok(Entry::Event { n, now: captured_at, event })
        };
        let refused =
            Event::Rejected { frame: 2, captured_at: Stamp::START, reason: "no_pair".into() };
        let refused = Ok(Entry::Event { n: 2, now: Stamp::START, event: refused });
        let print = print([measured(0, 40), measured(1, 20), refused]).unwrap();
        let times: Vec<u64> = print.widths.iter().map(|width| width.at.ns() / 1_000_000).collect();
        assert_eq!((times, print.refused), (vec![20, 40], 1));
    }
}
