//! Whether the width is what the speed says: the watch over the model of the bead, whatever the
//! controller. It changes no speed; what it finds, the controller acts on or reports.

mod autoregression;
mod offset;
mod plausible_offsets;
mod response;

use offset::OffsetTest;
pub use offset::WrongOffset;
use plausible_offsets::View;
pub use response::NoResponse;
use response::ResponseTest;

use super::bead_noise::{BeadRoughness, WidthNoise};
use super::controller::BeadReport;
use super::distance::{OFFSET_SIGMAS, WidthReading};
use super::speed_history::SpeedHistory;
use crate::core::{Mm, MmPerS};

/// What is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchSettings {
    /// Path length from the nozzle back to the middle of the gauge.
    pub offset: Mm,
    /// Standard deviation of that distance.
    pub offset_sigma: Mm,
    /// Length of bead that one width is the mean of.
    pub gauge: Mm,
    /// Any speed: only ratios matter.
    pub reference_speed: MmPerS,
    /// b in w = A·(v/v₀)^−b; without it the offset is not tested, and bead that has answered does not
    /// say where the camera looks.
    pub exponent: Option<f64>,
    /// Roughness of the bead.
    pub roughness: BeadRoughness,
}

/// What a width shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Findings {
    /// The change of the speed that has had no effect.
    pub no_response: Option<NoResponse>,
    /// The offset that fits the widths better than the stated one, from the width on that shows it to
    /// the end of the run.
    pub wrong_offset: Option<WrongOffset>,
}

/// The watch.
#[derive(Debug, Clone, PartialEq)]
pub struct BeadWatch {
    offset: Mm,
    speeds: SpeedHistory,
    response: ResponseTest,
    offset_test: Option<OffsetTest>,
}

impl BeadWatch {
    /// Before the first report.
    pub fn new(settings: WatchSettings) -> Self {
        let WatchSettings { offset, offset_sigma, gauge, reference_speed, roughness, .. } =
            settings;
        let view = View::new(offset, offset_sigma * OFFSET_SIGMAS, gauge);
        let kept_mm = (1.0 + offset::LARGEST_ERROR) * offset.get() + gauge.get();
        let of_a_width = WidthNoise::new(roughness, gauge.get()).variance(f64::INFINITY);
        Self {
            offset,
            speeds: SpeedHistory::new(reference_speed.get(), kept_mm),
            response: ResponseTest::new(view, roughness, settings.exponent),
            offset_test: settings
                .exponent
                .map(|exponent| OffsetTest::new(offset, gauge, exponent, of_a_width)),
        }
    }

    /// A new bead, or one that goes on elsewhere.
    pub fn begin_bead(&mut self) {
        self.speeds.clear();
        self.begin_again();
    }

    /// What was seen before says nothing about the widths from now on.
    fn begin_again(&mut self) {
        self.response.begin_bead();
        if let Some(test) = &mut self.offset_test {
            test.begin_bead();
        }
    }

    /// The robot reported while it lays bead.
    pub fn reported(&mut self, report: &BeadReport) {
        let BeadReport { at, path, speed, flow_ratio } = *report;
        let goes_on = self.speeds.report(at.secs(), path.get(), speed.get(), flow_ratio);
        if !goes_on {
            self.begin_again();
        }
    }

    /// A width of a frame that was captured with the nozzle at `nozzle_path`, and the target width
    /// of that bead.
    pub fn measured(&mut self, nozzle_path: Mm, reading: WidthReading, target: Mm) -> Findings {
        if reading.width <= Mm::ZERO {
            return Findings::default();
        }
        let position_mm = (nozzle_path - self.offset).get();
        Findings {
            no_response: self.response.measured(&self.speeds, position_mm, reading, target),
            wrong_offset: self
                .offset_test
                .as_mut()
                .and_then(|test| test.measured(&self.speeds, position_mm, reading)),
        }
    }
}
