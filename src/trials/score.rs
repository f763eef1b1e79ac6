//! Figures of a simulated layer.

use crate::control::{Event, Step};
use crate::core::{RobotMode, Stamp};
use crate::numeric::average::{mean, rms};
use crate::sim::cell::{FrameObservation, Observer};

/// A position along the bead and a value there.
pub type BeadPoint = (f64, f64);

/// Observes one layer and computes the figures of the 2022 paper's tables.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LayerScore {
    target: f64,
    started: Option<(Stamp, f64)>,
    ended: Option<(Stamp, f64)>,
    refused: u64,
    /// Measured width over path.
    pub widths: Vec<BeadPoint>,
    /// Widths of a perfect measurement over path, if frames are rendered.
    pub true_widths: Vec<BeadPoint>,
    /// Robot's speed over path.
    pub speeds: Vec<BeadPoint>,
}

impl LayerScore {
    /// A score against a target width \[mm\].
    pub fn new(target_mm: f64) -> Self {
        Self { target: target_mm, ..Self::default() }
    }

    /// The target width \[mm\].
    pub const fn target(&self) -> f64 {
        self.target
    }

    /// Mean absolute error over all measured widths \[mm\].
    pub fn mean_error(&self) -> f64 {
        mean(self.errors().map(f64::abs))
    }

    /// Root mean square error over all measured widths \[mm\].
    pub fn rms_error(&self) -> f64 {
        rms(self.errors())
    }

    /// Mean speed over time, start included \[mm/s\].
    pub fn mean_speed(&self) -> f64 {
        match (self.started, self.ended) {
            (Some((from, first)), Some((to, last))) if to > from => {
                (last - first) / (to - from).secs()
            }
            _ => 0.0,
        }
    }

    /// Number of rejected frames that showed bead.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    fn errors(&self) -> impl Iterator<Item = f64> {
        self.widths.iter().map(|(_, width)| width - self.target)
    }
}

impl Observer for LayerScore {
    fn step(&mut self, now: Stamp, event: &Event, _: &Step) {
        let Event::Robot(state) = event else { return };
        let path = state.path_mm.get();
        if state.mode == RobotMode::Print {
            let (_, start) = *self.started.get_or_insert((now, path));
            self.ended = Some((now, path));
            self.speeds.push((path - start, state.speed_mm_per_s.get()));
        }
    }

    fn frame(&mut self, observation: &FrameObservation<'_>) {
        // A gauge that contains the start of the bead does not measure the layer's width.
        if observation.position_mm < 0.0 {
            return;
        }
        match observation.outcome {
            Ok(measured) => self.widths.push((observation.position_mm, measured.width.get())),
            Err(_) => self.refused += 1,
        }
        if let Some(truth) = observation.truth {
            self.true_widths.push((observation.position_mm, truth.width_mm));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_never_seen_has_no_error() {
        let mut score = LayerScore::new(42.0);
        assert!(score.mean_error().is_nan() && score.rms_error().is_nan());
        score.widths = vec![(100.0, 38.6), (300.0, 41.0), (500.0, 41.6), (700.0, 42.1)];
        assert!((score.mean_error() - (3.4 + 1.0 + 0.4 + 0.1) / 4.0).abs() < 1e-12);
    }
}
