//! Filters of the readings for the strategy: single spikes removed, noise smoothed, each with
//! past samples only (bcs-thesis, section on signals; one-sided). The limit on the pressure
//! and the check of the screw's speed use the unfiltered readings.

use super::report::ExtruderReport;
use crate::core::{MPa, Mm, Mm3PerS};
use crate::numeric::hampel::{Hampel, LiveHampel};
use crate::numeric::savgol::{LiveSavGol, SavGol};

/// Which filters readings pass, in this order; by default none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReadingFilters {
    /// Replaces spikes by the median; a true step is delayed by half a window.
    pub spikes: Option<Hampel>,
    /// The value at the end of a polynomial through the last readings.
    pub smoothing: Option<SavGol>,
}

/// The filters of one connection.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    filters: ReadingFilters,
    pressure: ReadingFilter,
    flow: ReadingFilter,
    filled: ReadingFilter,
}

impl Readings {
    /// Before the first report.
    pub fn new(filters: ReadingFilters) -> Self {
        let filter = ReadingFilter::new(filters);
        Self { filters, pressure: filter.clone(), flow: filter.clone(), filled: filter }
    }

    /// Discards past readings, as after a gap.
    pub fn reset(&mut self) {
        *self = Self::new(self.filters);
    }

    /// The filtered report.
    pub fn filter(&mut self, report: &ExtruderReport) -> ExtruderReport {
        let filters = self.filters;
        let pressure = self.pressure.filter(report.pressure_mpa.map(f64::from), filters);
        let flow = self.flow.filter(report.flow_mm3_per_s.map(f64::from), filters);
        let filled = self.filled.filter(report.filled_mm.map(f64::from), filters);
        ExtruderReport {
            pressure_mpa: pressure.and_then(|mpa| MPa::new(mpa).ok()),
            flow_mm3_per_s: flow.and_then(|flow| Mm3PerS::new(flow).ok()),
            filled_mm: filled.and_then(|mm| Mm::new(mm).ok()),
            ..*report
        }
    }
}

/// One reading's filters with their windows.
#[derive(Debug, Clone, PartialEq)]
struct ReadingFilter {
    spikes: Option<LiveHampel>,
    smoothing: Option<LiveSavGol>,
    /// Whether a reading was filtered.
    begun: bool,
}

impl ReadingFilter {
    fn new(filters: ReadingFilters) -> Self {
        Self {
            spikes: filters.spikes.map(LiveHampel::new),
            smoothing: filters.smoothing.map(|filter| LiveSavGol::new(&filter)),
            begun: false,
        }
    }

    fn filter(&mut self, reading: Option<f64>, filters: ReadingFilters) -> Option<f64> {
        let Some(reading) = reading else {
            // Readings before and after a missing one are not neighbours.
            if self.begun {
                *self = Self::new(filters);
            }
            return None;
        };
        self.begun = true;
        let lone = self.spikes.as_mut().map_or(reading, |filter| filter.step(reading));
        // Until the window is full there is no polynomial.
        Some(self.smoothing.as_mut().and_then(|filter| filter.step(lone)).unwrap_or(lone))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rpm;
    use crate::extruder::PumpMode;
    use crate::sim::hash::{mix, normal_pair};

    fn report(mpa: f64) -> ExtruderReport {
        ExtruderReport {
            pump: PumpMode::On,
            valve_open: true,
            screw_rpm: Some(Rpm::constant(30.0)),
            pressure_mpa: MPa::new(mpa).ok(),
            flow_mm3_per_s: None,
            filled_mm: None,
        }
    }

    fn passed(readings: &mut Readings, mpa: f64) -> f64 {
        readings.filter(&report(mpa)).pressure_mpa.unwrap().get()
    }

    #[test]
    fn without_filters_a_report_is_unchanged() {
        let mut readings = Readings::new(ReadingFilters::default());
        for mpa in [0.6, 7.0, 0.61] {
            assert_eq!(readings.filter(&report(mpa)), report(mpa));
        }
    }

    #[test]
    fn a_single_spike_is_removed_and_a_step_is_delayed_by_half_a_window() {
        let spikes = Hampel::new(2, 4.0).ok();
        let mut readings = Readings::new(ReadingFilters { spikes, smoothing: None });
        let nothing = ExtruderReport { pressure_mpa: None, ..report(0.0) };
        let noisy = |i: u64, mpa: f64| 0.007_f64.mul_add(normal_pair(mix(&[3, i]))[0], mpa);
        for i in 0..200 {
            let mpa = if i % 23 == 11 { 3.0 } else { noisy(i, 0.6) };
            assert!((passed(&mut readings, mpa) - 0.6).abs() < 0.04, "{i}");
        }
        let after: Vec<f64> = (200..204).map(|i| passed(&mut readings, noisy(i, 0.9))).collect();
        assert!(after[1] < 0.65 && after[2] > 0.85, "{after:?}");
        // After a report without the reading the filter starts again.
        assert_eq!(readings.filter(&nothing), nothing);
        assert!((passed(&mut readings, 0.3) - 0.3).abs() < 1e-12);
    }

    #[test]
    fn smoothing_follows_a_ramp_without_delay_and_reduces_noise() {
        let smoothing = SavGol::new(11, 1).ok();
        let mut readings = Readings::new(ReadingFilters { spikes: None, smoothing });
        let ramp: Vec<f64> = (0..30).map(|i| passed(&mut readings, 0.01 * f64::from(i))).collect();
        assert!((ramp[29] - 0.29).abs() < 1e-12, "{}", ramp[29]);
        readings.reset();
        let (mut before, mut after) = (0.0, 0.0);
        for i in 0..40_000 {
            let off = 0.007 * normal_pair(mix(&[5, i]))[0];
            let found = passed(&mut readings, 0.6 + off) - 0.6;
            before += off * off;
            after += found * found;
        }
        // At the end of eleven samples of a straight line: (2·(2·11 − 1))/(11·12).
        let fraction: f64 = after / before;
        assert!((fraction - 42.0 / 132.0).abs() < 0.03, "{fraction}");
    }
}
