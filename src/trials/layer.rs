//! One simulated layer, and the errors of the bead's true width.

use crate::calibration::Calibration;
use crate::cell::file::{Cell, RunPart};
use crate::control::{Event, Step};
use crate::core::{Mm, RobotState, Stamp};
use crate::run::runner::NoRecorder;

use super::score::{BeadPoint, LayerScore};
use crate::numeric::average::{mean, rms};
use crate::numeric::number::to_count;
use crate::sim::cell::{FrameObservation, Observer, SimCell, SimCellError};
use crate::sim::laid::LaidBead;

/// Distance between positions at which the bead is judged \[mm\]: that of the bead's own grid.
const BEAD_SPACING_MM: f64 = 0.5;

/// A simulated layer. The figures of its bead are infinite where it was not laid to its end; those of
/// its score are of what was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerTrial {
    /// Measured widths.
    pub score: LayerScore,
    /// True width of the bead, every half millimetre.
    pub bead: Vec<BeadPoint>,
    /// Its width without roughness at the same positions.
    pub smooth: Vec<BeadPoint>,
    /// Path of the nozzle when the first controlled setpoint was sent \[mm\]; infinite if none was
    /// sent.
    pub control_start_mm: f64,
    /// Whether it was laid to its end; otherwise the controller stopped it.
    pub complete: bool,
    target_mm: f64,
}

impl LayerTrial {
    /// Lays one layer of the cell's nominal width with a seed.
    pub fn lay(
        cell: &Cell,
        run: &RunPart,
        calibration: &Calibration,
        seed: u64,
    ) -> Result<Self, SimCellError> {
        Self::lay_mismatched(cell, run, calibration, 1.0, seed)
    }

    /// As [`Self::lay`], with a controller that assumes the camera's distance wrong by a factor.
    pub fn lay_mismatched(
        cell: &Cell,
        run: &RunPart,
        calibration: &Calibration,
        factor: f64,
        seed: u64,
    ) -> Result<Self, SimCellError> {
        let mut cell = cell.clone();
        cell.simulation.seed = seed + 1;
        let target_mm = run.control.target.nominal().get();
        let mut sim = SimCell::mismatched(&cell, run, factor, calibration.clone(), NoRecorder)?;
        let mut observer = LayerObserver::new(target_mm);
        let end = sim.layer(Mm::ZERO, &mut observer);
        Ok(observer.into_trial(sim.bead(), cell.simulation.path.get(), end.complete))
    }

    /// A bead of a length that was laid elsewhere, without its measured widths: where control of it
    /// began, and its target width \[mm\]; and whether it was laid to its end.
    pub fn of_bead(
        laid: &LaidBead,
        length_mm: f64,
        control_start_mm: f64,
        target_mm: f64,
        complete: bool,
    ) -> Self {
        let (mut bead, mut smooth) = (Vec::new(), Vec::new());
        let mut at = 0.0;
        while at < length_mm {
            bead.extend(laid.width_at(at).map(|width| (at, width)));
            smooth.extend(laid.smooth_width_at(at).map(|width| (at, width)));
            at += BEAD_SPACING_MM;
        }
        let score = LayerScore::new(target_mm);
        Self { score, bead, smooth, control_start_mm, complete, target_mm }
    }

    /// The same up to a position \[mm\].
    pub fn until(&self, mm: f64) -> Self {
        let part = |points: &[BeadPoint]| {
            points.iter().copied().take_while(|(at, _)| *at < mm).collect::<Vec<BeadPoint>>()
        };
        Self { bead: part(&self.bead), smooth: part(&self.smooth), ..self.clone() }
    }

    /// Path from a position until the bead stays within a band about the target \[mm\]; infinite
    /// if it never does, or if there is no bead.
    pub fn settles_within(&self, from_mm: f64, band_mm: f64) -> f64 {
        self.settles(&self.bead, from_mm, band_mm)
    }

    /// As [`Self::settles_within`], for the width without roughness of the bead up to a position.
    pub fn smooth_settles_within(&self, from_mm: f64, to_mm: f64, band_mm: f64) -> f64 {
        let end = self.smooth.partition_point(|(at, _)| *at < to_mm);
        self.settles(&self.smooth[..end], from_mm, band_mm)
    }

    fn settles(&self, points: &[BeadPoint], from_mm: f64, band_mm: f64) -> f64 {
        let outside =
            |(at, width): &BeadPoint| *at >= from_mm && (width - self.target_mm).abs() > band_mm;
        let settled = match points.iter().rposition(outside) {
            None if points.last().is_none_or(|(at, _)| *at < from_mm) => f64::INFINITY,
            None => 0.0,
            Some(last) => points.get(last + 1).map_or(f64::INFINITY, |(at, _)| at - from_mm),
        };
        self.if_complete(settled)
    }

    /// A figure of the bead, if it was laid to its end: what is missing could be anything.
    const fn if_complete(&self, figure: f64) -> f64 {
        if self.complete { figure } else { f64::INFINITY }
    }

    /// Mean square error of the mean width over pieces of a length, from a position on \[mm²\].
    pub fn mean_square_over(&self, length_mm: f64, from_mm: f64) -> f64 {
        let errors: Vec<f64> = self.errors(from_mm).collect();
        let points = to_count(length_mm / BEAD_SPACING_MM).max(1);
        let mean_over = |piece: &[f64]| mean(piece.iter().copied());
        self.if_complete(mean(errors.windows(points).map(|piece| mean_over(piece).powi(2))))
    }

    /// Root mean square error of the width without roughness, from a position on \[mm\].
    pub fn smooth_rms_error(&self, from_mm: f64) -> f64 {
        let after = self.smooth.iter().filter(|(at, _)| *at >= from_mm);
        self.if_complete(rms(after.map(|(_, width)| width - self.target_mm)))
    }

    /// Integral of the absolute error over the path from a position on \[mm²\]. This and the
    /// following figures are NaN if there is no bead from there on.
    pub fn error_integral(&self, from_mm: f64) -> f64 {
        if self.errors(from_mm).next().is_none() {
            return f64::NAN;
        }
        self.if_complete(self.errors(from_mm).map(|error| error.abs() * BEAD_SPACING_MM).sum())
    }

    /// Mean absolute error of the bead from a position on \[mm\].
    pub fn mean_error(&self, from_mm: f64) -> f64 {
        self.if_complete(mean(self.errors(from_mm).map(f64::abs)))
    }

    /// Root mean square of the bead's error from a position on \[mm\].
    pub fn rms_error(&self, from_mm: f64) -> f64 {
        self.if_complete(rms(self.errors(from_mm)))
    }

    /// Standard deviation of the bead's width from a position on \[mm\].
    pub fn standard_deviation(&self, from_mm: f64) -> f64 {
        let middle = mean(self.errors(from_mm));
        self.if_complete(mean(self.errors(from_mm).map(|error| (error - middle).powi(2))).sqrt())
    }

    fn errors(&self, from_mm: f64) -> impl Iterator<Item = f64> {
        let after = self.bead.iter().filter(move |(at, _)| *at >= from_mm);
        after.map(|(_, width)| width - self.target_mm)
    }
}

/// Observes a layer, and the first setpoint that the controller computes.
pub struct LayerObserver {
    score: LayerScore,
    /// Path at the bead's start, the newest report, and its time of arrival.
    newest: Option<(f64, RobotState, Stamp)>,
    control_start_mm: Option<f64>,
}

impl LayerObserver {
    /// For a target width \[mm\].
    pub fn new(target_mm: f64) -> Self {
        Self { score: LayerScore::new(target_mm), newest: None, control_start_mm: None }
    }

    /// The trial of the bead that was laid, of a length, to its end or not.
    pub fn into_trial(self, laid: &LaidBead, length_mm: f64, complete: bool) -> LayerTrial {
        let start_mm = self.control_start_mm.unwrap_or(f64::INFINITY);
        let target_mm = self.score.target();
        let trial = LayerTrial::of_bead(laid, length_mm, start_mm, target_mm, complete);
        LayerTrial { score: self.score, ..trial }
    }
}

impl Observer for LayerObserver {
    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.score.step(now, event, step);
        match event {
            Event::Robot(state) if state.mode.lays_bead() => {
                let start = self.newest.map_or(state.path_mm.get(), |(start, ..)| start);
                self.newest = Some((start, *state, now));
            }
            Event::Tick if step.state.name() == "tracking" && step.command.is_some() => {
                let path = self.newest.map(|(start, state, at)| {
                    (state.path_mm + state.speed_mm_per_s * (now - at)).get() - start
                });
                self.control_start_mm = self.control_start_mm.or(path);
            }
            _ => {}
        }
    }

    fn frame(&mut self, observation: &FrameObservation<'_>) {
        self.score.frame(observation);
    }
}
