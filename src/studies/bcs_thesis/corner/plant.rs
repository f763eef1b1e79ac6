//! A run through the corner: from voltage to flow to width along the path.

use super::scenario::{BEAD, CornerError, JUDGED_MM, Scenario, UNMODELLED};
use crate::numeric::average::{mean, standard_deviation};
use crate::numeric::lti::{Between, Simulator};
use crate::numeric::number::{to_count, to_f64};
use crate::plan::SpeedProfile;
use crate::sim::hash::{mix, normal_pair};
use crate::studies::bcs_thesis::{drive, flow};

/// Step of the plant \[s\]: papers.md, "001, on/off", 1 ms.
const STEP_S: f64 = 0.001;
/// Distance between positions at which the error is judged \[mm\].
const POSITION_SPACING_MM: f64 = 0.5;
/// Positions on either side. Derived: `JUDGED_MM` / `POSITION_SPACING_MM`.
const POSITIONS_PER_SIDE: i32 = 200;
/// Relative change of the flow below which it counts as unchanged.
const MIN_FLOW_CHANGE: f64 = 0.01;

/// Root mean square error of the width, relative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// With the modelled flow alone.
    pub quiet: f64,
    /// With the unmodelled flow added, over all seeds.
    pub noisy: f64,
}

/// A simulated run through the corner.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerRun {
    speed: SpeedProfile,
    /// Flow every millisecond \[mm³/s\].
    flow: Vec<f64>,
}

/// Relative error of the width along the path.
#[derive(Debug, Clone, PartialEq)]
pub struct WidthProfile {
    errors: Vec<f64>,
}

impl WidthProfile {
    /// Root mean square within ±100 mm of the corner.
    pub fn rms(&self) -> f64 {
        mean_square(&self.errors).sqrt()
    }

    /// Positions \[mm\] and relative errors.
    pub fn along(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        positions().zip(self.errors.iter().copied())
    }
}

impl CornerRun {
    /// Simulates the flow of a run with a speed profile and a voltage \[V\] over time \[s\]. The
    /// voltage is held from one command to the next; its range and rate are the drive's. The first
    /// voltage, at which the extruder is settled, is not limited.
    pub fn new(
        scenario: &Scenario,
        speed: &SpeedProfile,
        voltage: impl Fn(f64) -> f64,
    ) -> Result<Self, CornerError> {
        let limits = scenario.drive()?;
        let period = 1.0 / f64::from(scenario.rate_hz);
        let mut g1 = Simulator::new(&drive()?, STEP_S, Between::Held)?;
        let mut g2 = Simulator::new(&flow()?, STEP_S, Between::Linear)?;
        let mut command = voltage(0.0);
        g1.settle(command)?;
        g2.settle(command * drive()?.dc_gain())?;
        let held = crate::core::Span::from_secs(period);
        let mut next = 0.0;
        let mut flow = Vec::new();
        for now in moments(speed.duration_s()) {
            if now + 0.5 * STEP_S >= next {
                // The voltage of a command is that of the middle of its hold period.
                (command, _) = limits.apply(voltage(now + 0.5 * period), command, held);
                next += period;
            }
            flow.push(g2.step(g1.step(command)));
        }
        Ok(Self { speed: speed.clone(), flow })
    }

    /// Position \[mm\], speed \[mm/s\] and flow \[mm³/s\], every millisecond within ±100 mm of
    /// the corner.
    pub fn trajectory(&self) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        let all = moments(self.speed.duration_s()).zip(&self.flow).map(|(now, flow)| {
            let path_mm = self.speed.path_at(now);
            (path_mm, self.speed.speed_at(path_mm), *flow)
        });
        all.filter(|(path_mm, ..)| path_mm.abs() <= JUDGED_MM)
    }

    /// Width error with the modelled flow.
    pub fn quiet(&self) -> WidthProfile {
        self.quiet_over(BEAD.nozzle_mm)
    }

    /// Width error with the modelled flow, averaged over `length_mm` instead of the nozzle's
    /// length.
    pub fn quiet_over(&self, length_mm: f64) -> WidthProfile {
        self.laid(&self.flow, length_mm)
    }

    /// Errors without and with unmodelled flow.
    pub fn errors(&self, seeds: u64) -> Errors {
        let noisy = (0..seeds).map(|seed| mean_square(&self.noisy(seed).errors)).sum::<f64>();
        #[expect(clippy::cast_precision_loss, reason = "a few seeds")]
        let count = seeds.max(1) as f64;
        Errors { quiet: self.quiet().rms(), noisy: (noisy / count).sqrt() }
    }

    /// Width error with unmodelled flow, a first-order autoregressive process.
    pub fn noisy(&self, seed: u64) -> WidthProfile {
        let sigma = UNMODELLED.ratio * self.change();
        let kept = libm::exp(-STEP_S / UNMODELLED.correlation_s);
        let fresh = (1.0 - kept * kept).sqrt();
        let mut noise = normal_pair(mix(&[seed, 3, 0]))[0];
        let flow = (1_u64..).zip(&self.flow).map(|(step, flow)| {
            let here = flow + sigma * noise;
            noise = kept * noise + fresh * normal_pair(mix(&[seed, 3, step]))[0];
            here
        });
        self.laid(&flow.collect::<Vec<f64>>(), BEAD.nozzle_mm)
    }

    /// Expected root mean square error due to the unmodelled flow alone.
    pub fn floor(&self) -> f64 {
        let sigma = UNMODELLED.ratio * self.change();
        let (full, half) = (BEAD.area_mm2 * BEAD.nozzle_mm, 0.5 * BEAD.nozzle_mm);
        let duration = |at| self.speed.time_at(at + half) - self.speed.time_at(at - half);
        let sigmas = positions().map(|at| UNMODELLED.volume_variance(duration(at)).sqrt());
        sigma / full * mean_square(&sigmas.collect::<Vec<f64>>()).sqrt()
    }

    /// Standard deviation of the modelled flow \[mm³/s\]: over the time of the judged path, or
    /// over the whole manoeuvre from the first change of the flow to the last; the larger of the
    /// two.
    pub fn change(&self) -> f64 {
        let first = self.flow.first().copied().unwrap_or(0.0);
        let changed = |flow: &f64| (flow - first).abs() > MIN_FLOW_CHANGE * first;
        let judged = [-JUDGED_MM, JUDGED_MM].map(|at| to_count(self.speed.time_at(at) / STEP_S));
        let from = self.flow.iter().position(changed).unwrap_or(judged[0]).min(judged[0]);
        let to = self.flow.iter().rposition(changed).unwrap_or(judged[1]).max(judged[1]);
        deviation(&self.flow, from, to).max(deviation(&self.flow, judged[0], judged[1]))
    }

    fn laid(&self, flow: &[f64], length_mm: f64) -> WidthProfile {
        let mut sum = 0.0;
        let grown = flow.windows(2).map(|pair| {
            sum += 0.5 * STEP_S * (pair[0] + pair[1]);
            sum
        });
        let volume: Vec<f64> = std::iter::once(0.0).chain(grown).collect();
        let (full, half) = (BEAD.area_mm2 * length_mm, 0.5 * length_mm);
        let at = |time_s: f64| {
            let step = to_count(time_s / STEP_S).min(volume.len().saturating_sub(2));
            let first = volume.get(step).copied().unwrap_or(0.0);
            let next = volume.get(step + 1).copied().unwrap_or(first);
            let fraction = time_s / STEP_S - to_f64(step);
            first + fraction * (next - first)
        };
        let until = |path_mm| at(self.speed.time_at(path_mm));
        let errors = positions().map(|s| (until(s + half) - until(s - half)) / full - 1.0);
        WidthProfile { errors: errors.collect() }
    }
}

/// Positions at which the error is judged \[mm\].
fn positions() -> impl Iterator<Item = f64> {
    (-POSITIONS_PER_SIDE..=POSITIONS_PER_SIDE).map(|k| POSITION_SPACING_MM * f64::from(k))
}

/// Times from 0 to `until_s` in steps of a millisecond \[s\].
fn moments(until_s: f64) -> impl Iterator<Item = f64> {
    (0_u32..).map(|step| STEP_S * f64::from(step)).take_while(move |now| *now <= until_s + STEP_S)
}

fn mean_square(values: &[f64]) -> f64 {
    mean(values.iter().map(|value| value * value))
}

fn deviation(flow: &[f64], from: usize, to: usize) -> f64 {
    standard_deviation(flow.get(from..to.min(flow.len())).unwrap_or_default())
}
