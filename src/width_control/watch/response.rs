//! Whether the width answers the speed: actuator against effect.
//!
//! Where the speed changes and the width stays as it is, the flow has changed by just as much in the
//! same place, or the width is not that of the bead that is laid: the camera looks at another one, or
//! the extruder is elsewhere. The flow of this bead so far says which: where it would have to change
//! many times as much as it has done before, the width does not answer.

mod stretch;

use serde::{Deserialize, Serialize};

use super::plausible_offsets::{MatchedWidth, PlausibleOffsets, View};
use crate::core::{Mm, MmPerS};
use crate::width_control::bead_noise::{BeadRoughness, WidthNoise};
use crate::width_control::distance::WidthReading;
use crate::width_control::speed_history::SpeedHistory;

use stretch::{Ends, Expected, Extent, Stretch};

/// The weakest answer that is expected, over the exponent of the cell: the width falls by the exponent
/// times a small change of the speed. Derived: the lower end of what control by distance learns.
const WEAKEST_ANSWER: f64 = 0.7;
/// The largest exponent for this, and that of a cell that states none: a stated one is a guess as well.
/// Derived: that of Shojaei Barjuei et al. 2022.
const USUAL_EXPONENT: f64 = 0.25;
/// Length of bead on which the answer to a slow change is looked for, in lags: from ... Derived: a step
/// of the flow lies within two means that overlap, over two lags.
const SLOW_FROM: f64 = 3.0;
/// ... to. Derived: control by distance follows another bead that is 2 % off target by 0.02 of ln v in
/// a lag or more, and less than 0.10 need not be noticed.
const SLOW_TO: f64 = 4.0;

/// A change of the speed without effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NoResponse {
    /// Change of the speed, as a fraction.
    pub speed_change: f64,
    /// Change of the width of bead that was laid before and after it, as a fraction.
    pub width_change: f64,
    /// Path on which both changed \[mm\].
    pub over_mm: f64,
    /// Speed before that, with the flow of now.
    pub speed_before: MmPerS,
}

/// The test: over a lag between single widths, and for a speed that changes slowly over some lags between
/// means.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseTest {
    /// The weakest exponent that is expected.
    weakest: f64,
    /// Where the camera may look, by the bead up to a lag ago.
    offsets: PlausibleOffsets,
    /// Single widths.
    fast: Stretch,
    slow: Option<Means>,
}

/// Means over a lag, one every half of it.
#[derive(Debug, Clone, PartialEq)]
struct Means {
    lag_mm: f64,
    stretch: Stretch,
    /// The widths of the next mean.
    next: Vec<MatchedWidth>,
}

impl ResponseTest {
    /// Before the first width: where the camera looks, the roughness of the bead, and its exponent,
    /// where control has one. Control without one changes the speed in a ramp, which a drift of the flow
    /// imitates: then no place is excluded at which the camera may look, and slow changes are not
    /// compared.
    pub fn new(view: View, roughness: BeadRoughness, exponent: Option<f64>) -> Self {
        let over = |mm: f64| WidthNoise::new(roughness, mm).variance(f64::INFINITY);
        let of_a_width = over(view.gauge_mm());
        let offsets = PlausibleOffsets::new(view, of_a_width, exponent.is_some());
        // Within a lag a change of the speed shows whole, wherever the camera may look.
        let lag_mm = offsets.span_mm();
        let fast = Extent { lag_mm, least: 1.0, most: 1.0, roughness: of_a_width };
        let slow = Extent { least: SLOW_FROM, most: SLOW_TO, roughness: over(lag_mm), ..fast };
        Self {
            weakest: WEAKEST_ANSWER * exponent.unwrap_or(USUAL_EXPONENT).min(USUAL_EXPONENT),
            offsets,
            fast: Stretch::new(fast),
            slow: exponent.map(|_| Means::new(slow)),
        }
    }

    /// A new bead, or one that goes on elsewhere.
    pub fn begin_bead(&mut self) {
        self.offsets.clear();
        self.fast.clear();
        self.slow.iter_mut().for_each(Means::clear);
    }

    /// A width of the bead about a position, by the stated offset, and its target. Returns the change
    /// of the speed that has had no effect, where there is one.
    pub fn measured(
        &mut self,
        speeds: &SpeedHistory,
        position_mm: f64,
        reading: WidthReading,
        target: Mm,
    ) -> Option<NoResponse> {
        if target <= Mm::ZERO {
            return None;
        }
        let newest = self.offsets.matched(speeds, position_mm, reading.width)?;
        if self.fast.newest().is_some_and(|last| last.position_mm >= newest.position_mm) {
            return None;
        }
        let noise = reading.sigma / reading.width;
        if let Some(before) = self.fast.add(newest) {
            self.offsets.add(&before);
        }
        let (weakest, plausible) = (self.weakest, self.offsets.plausible());
        let expected = Expected { noise, target, weakest, plausible };
        let fast = self.fast.unanswered(&expected);
        let slow = self.slow.as_mut().and_then(|means| means.unanswered(newest, &expected));
        let Ends { oldest, newest } = fast.or(slow)?;
        Some(NoResponse {
            speed_change: libm::expm1(newest.ln_speed() - oldest.ln_speed()),
            width_change: libm::expm1(newest.ln_width - oldest.ln_width),
            over_mm: newest.position_mm - oldest.position_mm,
            speed_before: speeds.speed_of(oldest.ln_speed()),
        })
    }
}

impl Means {
    fn new(extent: Extent) -> Self {
        Self { lag_mm: extent.lag_mm, stretch: Stretch::new(extent), next: Vec::new() }
    }

    fn clear(&mut self) {
        self.stretch.clear();
        self.next.clear();
    }

    /// Adds a width. The bead without an answer, where a mean has shown it.
    fn unanswered(&mut self, newest: MatchedWidth, expected: &Expected) -> Option<Ends> {
        self.next.push(newest);
        let first = self.next.first()?;
        if newest.position_mm - first.position_mm < self.lag_mm {
            return None;
        }
        let mean = MatchedWidth::mean(&self.next);
        let middle_mm = newest.position_mm - 0.5 * self.lag_mm;
        self.next.retain(|one| one.position_mm > middle_mm);
        self.stretch.add(mean?);
        self.stretch.unanswered(expected)
    }
}

#[cfg(test)]
mod tests;
