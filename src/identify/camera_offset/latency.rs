//! The latency of a camera without a time of capture, together with its offset.
//!
//! A frame that is stamped λ after its capture shows bead that was laid the offset *and* the path
//! of that time further back. At one speed the two cannot be told apart; at two they can. For each
//! λ the best offset is fitted, with widths, noise and groups as they are; the sum of squares is
//! smallest at the latency.

use super::laid_speeds::LaidSpeeds;
use super::observation::BeadObservation;
use super::offset_profile::{OffsetFit, OffsetProfile};
use super::{
    CameraOffsetError, Converged, MAX_ITERATIONS, OffsetEstimate, OffsetSearch, PooledWidths,
    TimedWidth, changed_speeds, iterate, mm, observed,
};
use crate::core::{RobotState, Span, Stamp};
use crate::numeric::number::to_f64;

/// Latencies that are tried \[ms\]. A choice: longer than that of any camera over a network. A
/// negative one shows that the truth is near 0, or that the robot's reports are late.
const LATENCIES_MS: (f64, f64) = (-100.0, 500.0);
/// First step of the latency \[ms\]. Derived: a tenth of a gauge of 10 mm at 100 mm/s.
const STEP_MS: f64 = 10.0;
/// Step at which a minimum is refined no further \[ms\]. Derived: 1 µm of path at 100 mm/s.
const LAST_STEP_MS: f64 = 0.01;
/// Change of the latency below which the iteration has converged \[ms\]. Derived: that of the
/// offset, 0.01 mm, at 100 mm/s.
const SETTLED_MS: f64 = 0.1;
/// Largest standard deviation of a latency that is an answer \[ms\]. Derived: 2 mm of path at
/// 100 mm/s.
const MAX_SIGMA_MS: f64 = 20.0;

/// An estimated latency and offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatencyEstimate {
    /// Offset and bead. Its standard deviation contains that of the latency.
    pub offset: OffsetEstimate,
    /// How much later than its capture a frame is stamped.
    pub latency: Span,
    /// Its standard deviation.
    pub sigma: Span,
}

/// Offset and latency from the robot's reports, in order, and the measured widths with the times
/// of their frames. Fails where the speed did not change enough to tell them apart.
pub fn find_with_latency(
    states: &[(Stamp, RobotState)],
    widths: &[TimedWidth],
    search: OffsetSearch,
) -> Result<LatencyEstimate, CameraOffsetError> {
    let course = LaidSpeeds::of(states).ok_or(CameraOffsetError::NoPath)?;
    let (first, last) = LATENCIES_MS;
    // A width counts at all latencies or at none, so that sums of squares can be compared.
    let is_known = |one: &BeadObservation| {
        [first, last].iter().all(|ms| captured(&course, one, *ms).is_some())
    };
    let observations: Vec<BeadObservation> =
        widths.iter().filter_map(|width| observed(&course, width)).filter(is_known).collect();
    let speeds = changed_speeds(&course, observations.len())?;
    let mut latency_ms = 0.0;
    let mut round = 0;
    loop {
        let settled =
            iterate(&course, &with_latency(&course, &observations, latency_ms), search, speeds)?;
        let fits = LatencyFits { course: &course, settled: &settled, latency_ms, search };
        let next_ms = fits.best_ms();
        round += 1;
        let is_settled = (next_ms - latency_ms).abs() < SETTLED_MS;
        if !is_settled && round < MAX_ITERATIONS {
            latency_ms = next_ms;
            continue;
        }
        settled.check(&course, &with_latency(&course, &observations, latency_ms), search)?;
        let sigma_ms = fits.sigma_ms(latency_ms);
        let (latency, sigma) = (Span::from_secs(latency_ms / 1e3), Span::from_secs(sigma_ms / 1e3));
        if sigma_ms > MAX_SIGMA_MS {
            return Err(CameraOffsetError::UncertainLatency);
        }
        let mut offset = settled.estimate(&course, speeds, widths.len());
        let by_latency_mm = fits.offset_per_ms(latency_ms) * sigma_ms;
        offset.sigma = mm(offset.sigma.get().hypot(by_latency_mm));
        return Ok(LatencyEstimate { offset, latency, sigma });
    }
}

/// The observation with a latency; `None` if its frame was captured before the bead.
fn captured(course: &LaidSpeeds, one: &BeadObservation, ms: f64) -> Option<BeadObservation> {
    let (bead, path_mm) = course.path_at(one.at - Span::from_secs(ms / 1e3))?;
    let since_capture_mm = one.path_mm - path_mm;
    (bead == one.bead).then_some(BeadObservation { since_capture_mm, ..*one })
}

fn with_latency(course: &LaidSpeeds, all: &[BeadObservation], ms: f64) -> Vec<BeadObservation> {
    all.iter().filter_map(|one| captured(course, one, ms)).collect()
}

/// Fits at each latency, for widths and a noise model that have converged at one.
struct LatencyFits<'a> {
    course: &'a LaidSpeeds,
    settled: &'a Converged,
    /// The latency at which they have converged \[ms\].
    latency_ms: f64,
    search: OffsetSearch,
}

impl LatencyFits<'_> {
    /// The best offset at a latency.
    fn fit_at(&self, ms: f64) -> OffsetFit {
        let Converged { used, noise, best, .. } = self.settled;
        let looks = with_latency(self.course, used, ms);
        let data = PooledWidths::of(self.course, &looks, best.exponent, self.search.gauge);
        let mean = |looks: &[BeadObservation]| {
            looks.iter().map(|look| look.since_capture_mm).sum::<f64>() / to_f64(looks.len())
        };
        let near_mm = best.offset_mm + mean(used) - mean(&looks);
        OffsetProfile::new(data, *noise).near(near_mm)
    }

    fn squares(&self, ms: f64) -> f64 {
        self.fit_at(ms).sum_of_squares
    }

    /// The latency with the smallest sum of squares \[ms\].
    fn best_ms(&self) -> f64 {
        let (first, last) = LATENCIES_MS;
        let mut best = (self.latency_ms, self.squares(self.latency_ms));
        let mut ms = first;
        while ms <= last {
            best = better(best, (ms, self.squares(ms)));
            ms += STEP_MS;
        }
        let mut step = 0.5 * STEP_MS;
        while step > LAST_STEP_MS {
            let around = [-step, step].map(|by| (best.0 + by).clamp(first, last));
            let next =
                around.into_iter().fold(best, |best, ms| better(best, (ms, self.squares(ms))));
            if next.0 == best.0 {
                step *= 0.5;
            }
            best = next;
        }
        best.0
    }

    /// Half the interval of latencies in which the sum of squares grows by one noise variance
    /// \[ms\].
    fn sigma_ms(&self, best_ms: f64) -> f64 {
        let limit = self.squares(best_ms) + self.settled.profile.variance(&self.settled.best);
        let [below, above] = [-1.0, 1.0].map(|side| {
            let mut near = 0.0;
            let mut far = LAST_STEP_MS;
            while self.squares(best_ms + side * far) <= limit && far < MAX_SIGMA_MS * 2.0 {
                (near, far) = (far, 2.0 * far);
            }
            for _ in 0..6 {
                let middle = 0.5 * (near + far);
                if self.squares(best_ms + side * middle) > limit {
                    far = middle;
                } else {
                    near = middle;
                }
            }
            0.5 * (near + far)
        });
        0.5 * (below + above)
    }

    /// By how much the best offset changes for a latency that is a millisecond longer \[mm\].
    fn offset_per_ms(&self, ms: f64) -> f64 {
        let [before, after] = [-1.0, 1.0].map(|by| self.fit_at(ms + by).offset_mm);
        0.5 * (after - before)
    }
}

fn better(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    if b.1 < a.1 { b } else { a }
}
