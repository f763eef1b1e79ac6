//! Predicted response of each controller on the identified cell, by simulated beads.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;

use super::candidate::ControllerCandidate;
use super::plant::IdentifiedCell;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::{ImageSource, RunPart};
use crate::control::{Event, Step};
use crate::core::{Mm, MmPerS2, Span, Stamp};
use crate::numeric::rank;
use crate::run::runner::NoRecorder;
use crate::scenario::bead::{BeadModel, EdgeRoughness};
use crate::scenario::disturbance::Flow;
use crate::scenario::table::{Simulation, WidthSource};
use crate::sim::cell::{FrameObservation, Observer, SimCell, SimCellError};
use crate::width_control::target::WidthTarget;

/// Relative step of the flow. A choice.
pub const FLOW_STEP: f64 = 0.08;
/// Simulated beads per controller. A choice between time and the standard error.
pub const SEEDS: u64 = 24;
/// Smallest band about the target within which a bead counts as settled \[mm\].
const MIN_BAND_MM: f64 = 0.5;
/// Path from the first segment to the flow step, and from there to the end: at least this \[mm\],
/// and this many camera distances.
const MIN_SEGMENT_MM: f64 = 1200.0;
const SEGMENT_OFFSETS: f64 = 15.0;
/// Fraction of the path before the flow step that counts as steady.
const STEADY_FRACTION: f64 = 1.0 / 3.0;
/// Correlation length of the roughness over the gauge. A choice.
const ROUGHNESS_LENGTH_FRACTION: f64 = 0.1;
/// Spacing of the widths along the bead \[mm\].
const SAMPLE_SPACING_MM: f64 = 1.0;
/// A placeholder: widths are not rendered.
const UNUSED_SCALE: Calibration = Calibration::Scale { mm_per_px: 0.1, sigma: None };
/// Bandwidths of a simulated robot \[Hz\].
const BANDWIDTHS_HZ: (f64, f64) = (0.01, 1000.0);

/// Predicted response of a controller.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeadPrediction {
    /// The controller.
    pub name: String,
    /// Path from the start of control until the bead is settled, median over the beads \[mm\];
    /// `None` if most have not settled before the flow step.
    pub start_settles_mm: Option<f64>,
    /// Path from the flow step until the bead is settled, median over the beads \[mm\]; `None`
    /// likewise.
    pub step_settles_mm: Option<f64>,
    /// Root mean square error in the steady part before the flow step \[mm\].
    pub steady_rms_mm: f64,
    /// Root mean square error from the start of control to the end \[mm\].
    pub whole_rms_mm: f64,
    /// Number of beads that ended with a fault.
    pub stopped: usize,
    /// Fastest and slowest setpoint after control began \[mm/s\].
    pub speeds_mm_per_s: (f64, f64),
    /// Width of the first bead along the path, averaged over the gauge \[mm\].
    #[serde(skip)]
    pub bead: Vec<(f64, f64)>,
    /// Speed of the robot along the path of the first bead \[mm/s\].
    #[serde(skip)]
    pub speed: Vec<(f64, f64)>,
}

/// The identified cell as a simulation.
#[derive(Debug, Clone)]
pub struct TestCell {
    cell: Cell,
    run: RunPart,
    target_mm: f64,
    /// Band about the target within which a bead counts as settled \[mm\].
    pub band_mm: f64,
    /// Path at which the flow steps \[mm\].
    pub step_at_mm: f64,
    end_mm: f64,
}

impl TestCell {
    /// A cell with its identification. Rates, limits and first segment are those of the cell;
    /// bead, noise, drift, delays and robot are the identified ones. The robot's dead time is
    /// added to the camera's, which is equivalent in a loop; its largest acceleration limits the
    /// setpoints.
    pub fn new(cell: &Cell, run: &RunPart, plant: &IdentifiedCell) -> Self {
        let (mut cell, mut run) = (cell.clone(), run.clone());
        let target_mm = run.control.target.nominal().get();
        let way_mm = (SEGMENT_OFFSETS * plant.offset_mm.value).max(MIN_SEGMENT_MM);
        let step_at_mm = run.robot.start_length.get() + way_mm;
        let end_mm = step_at_mm + way_mm;
        apply_identified(&mut cell.simulation, plant);
        cell.simulation.path = mm(end_mm);
        cell.simulation.flow.step_at_mm = step_at_mm;
        run.extruder = None;
        if let Some(slope) = plant.robot.ok().and_then(|robot| robot.slope_mm_per_s2) {
            let slope = MmPerS2::new(slope).unwrap_or(run.limits.max_accel);
            run.limits.max_accel = run.limits.max_accel.min(slope);
        }
        run.camera.source = ImageSource::Rendered;
        run.camera.offset = mm(plant.offset_mm.value);
        run.control.target = WidthTarget::constant(mm(target_mm));
        cell.target = Some(run.control.target.clone());
        cell.run = Some(run.clone());
        let rough_mm = plant.width_noise.roughness * plant.width_mm.value;
        let band_mm = (2.0 * plant.noise_mm().hypot(rough_mm)).max(MIN_BAND_MM);
        Self { cell, run, target_mm, band_mm, step_at_mm, end_mm }
    }

    /// The response of a controller.
    pub fn predict(&self, candidate: &ControllerCandidate) -> Result<BeadPrediction, SimCellError> {
        let runs = (0..SEEDS).into_par_iter().map(|seed| self.lay(candidate, seed));
        let laid: Vec<LaidRun> = runs.collect::<Result<_, _>>()?;
        let square = |from: &dyn Fn(&LaidRun) -> f64, to_mm: f64| {
            let errors = laid.iter().flat_map(|one| {
                let from_mm = from(one);
                one.bead.iter().filter(move |(at, _)| (from_mm..to_mm).contains(at))
            });
            let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), (_, width)| {
                (sum + (width - self.target_mm).powi(2), count + 1.0)
            });
            if count > 0.0 { f64::sqrt(sum / count) } else { f64::NAN }
        };
        let median = |way: &dyn Fn(&LaidRun) -> f64| {
            rank::median_of(laid.iter().map(way)).filter(|way| way.is_finite())
        };
        // A mean over the gauge includes the flow step from half a gauge before it.
        let steady_end_mm = self.step_at_mm - 0.5 * self.cell.simulation.gauge_length.get();
        let steady = |one: &LaidRun| {
            one.control_start_mm + (1.0 - STEADY_FRACTION) * (steady_end_mm - one.control_start_mm)
        };
        let setpoints = laid.iter().map(|one| one.setpoints);
        let speeds_mm_per_s = setpoints.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)));
        Ok(BeadPrediction {
            name: candidate.name.clone(),
            start_settles_mm: median(&|one| self.settles(one, one.control_start_mm, steady_end_mm)),
            step_settles_mm: median(&|one| self.settles(one, self.step_at_mm, self.end_mm)),
            steady_rms_mm: square(&steady, steady_end_mm),
            whole_rms_mm: square(&|one| one.control_start_mm, self.end_mm),
            stopped: laid.iter().filter(|one| one.stopped).count(),
            speeds_mm_per_s: speeds_mm_per_s.unwrap_or_default(),
            bead: laid.first().map(|one| one.bead.clone()).unwrap_or_default(),
            speed: laid.into_iter().next().map(|one| one.speed).unwrap_or_default(),
        })
    }

    /// Path from `from_mm` until the bead stays within the band up to `to_mm` \[mm\]; infinite if
    /// it does not.
    fn settles(&self, one: &LaidRun, from_mm: f64, to_mm: f64) -> f64 {
        let within: Vec<_> =
            one.bead.iter().filter(|(at, _)| (from_mm..to_mm).contains(at)).collect();
        let outside = within.iter().rposition(|(_, w)| (w - self.target_mm).abs() > self.band_mm);
        match outside {
            None if within.is_empty() => f64::INFINITY,
            None => 0.0,
            Some(last) => within.get(last + 1).map_or(f64::INFINITY, |(at, _)| at - from_mm),
        }
    }

    fn lay(&self, candidate: &ControllerCandidate, seed: u64) -> Result<LaidRun, SimCellError> {
        let (mut cell, mut run) = (self.cell.clone(), self.run.clone());
        cell.simulation.seed = seed + 1;
        run.control.strategy = Arc::clone(&candidate.strategy);
        run.control.gains = candidate.gains;
        run.camera.offset_sigma = mm(candidate.offset_sigma_mm);
        let factor = candidate.offset_mm / self.run.camera.offset.get().max(1e-9);
        let mut sim = SimCell::mismatched(&cell, &run, factor, UNUSED_SCALE, NoRecorder)?;
        let mut laid = LaidRun {
            control_start_mm: f64::INFINITY,
            setpoints: (0.0, f64::INFINITY),
            ..LaidRun::default()
        };
        let _ = sim.layer(Mm::ZERO, &mut laid);
        // A controller sees only the mean over the gauge.
        let half_mm = 0.5 * cell.simulation.gauge_length.get();
        let mut at = 0.0;
        while at < self.end_mm {
            let width = sim.bead().mean_width(at - half_mm, at + half_mm);
            laid.bead.extend(width.map(|width| (at, width)));
            at += SAMPLE_SPACING_MM;
        }
        Ok(laid)
    }
}

/// A simulated bead.
#[derive(Debug, Clone, Default)]
struct LaidRun {
    bead: Vec<(f64, f64)>,
    speed: Vec<(f64, f64)>,
    control_start_mm: f64,
    stopped: bool,
    /// Fastest and slowest setpoint \[mm/s\].
    setpoints: (f64, f64),
}

impl Observer for LaidRun {
    fn step(&mut self, _: Stamp, event: &Event, step: &Step) {
        if let Event::Robot(state) = event
            && state.mode.lays_bead()
        {
            self.speed.push((state.path_mm.get(), state.speed_mm_per_s.get()));
        }
        self.stopped |= step.state.name() == "fault";
        let Some(crate::control::Command::Speed(speed)) = step.command else { return };
        if step.state.name() != "tracking" {
            return;
        }
        if self.control_start_mm.is_infinite() {
            self.control_start_mm = self.speed.last().map_or(f64::INFINITY, |(path, _)| *path);
        }
        let (fastest, slowest) = self.setpoints;
        self.setpoints = (fastest.max(speed.get()), slowest.min(speed.get()));
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}
}

/// Applies the identified bead, noise, delays and robot.
fn apply_identified(simulation: &mut Simulation, plant: &IdentifiedCell) {
    let robot = plant.robot_dynamics();
    simulation.width_source = WidthSource::Widths;
    simulation.latency = Span::from_secs(plant.timing.latency_s + robot.dead_time_s);
    simulation.report = Span::from_secs(plant.timing.report_s.clamp(0.001, 1.0));
    simulation.step = Span::from_millis(1);
    let bandwidth_hz = 1.0 / (std::f64::consts::TAU * robot.lag_s.max(1e-6));
    simulation.robot_bandwidth_hz = bandwidth_hz.clamp(BANDWIDTHS_HZ.0, BANDWIDTHS_HZ.1);
    simulation.gauge_length = mm(plant.gauge_mm);
    simulation.width_noise = mm(plant.noise_mm());
    simulation.outlier_fraction = 0.0;
    simulation.missing_fraction = 0.0;
    simulation.bead = BeadModel {
        width_mm: plant.width_mm.value,
        at_speed_mm_per_s: plant.at_speed_mm_per_s,
        exponent: plant.exponent.value,
        slow_below_mm_per_s: 0.0,
        slow_exponent: plant.exponent.value,
    };
    simulation.roughness = roughness(plant);
    simulation.flow = Flow {
        step_ratio: 1.0 + FLOW_STEP,
        drift_per_root_m: plant.drift_per_root_m(),
        ..Flow::STEADY
    };
}

/// Shortest correlation length of a simulated roughness \[mm\].
const MIN_ROUGHNESS_LENGTH_MM: f64 = 0.1;

/// A roughness whose means over the gauge have the identified standard deviation: with the
/// autocorrelation exp(−(distance/l)²), a mean over a long gauge G keeps √π·l/G of the variance.
fn roughness(plant: &IdentifiedCell) -> EdgeRoughness {
    let measured_mm = plant.width_noise.roughness * plant.width_mm.value;
    let length_mm = ROUGHNESS_LENGTH_FRACTION * plant.gauge_mm;
    if length_mm < MIN_ROUGHNESS_LENGTH_MM {
        // A mean over a very short gauge has the full roughness.
        return EdgeRoughness { sigma_mm: measured_mm, length_mm: MIN_ROUGHNESS_LENGTH_MM };
    }
    let kept_fraction = std::f64::consts::PI.sqrt() * ROUGHNESS_LENGTH_FRACTION;
    EdgeRoughness { sigma_mm: measured_mm / kept_fraction.sqrt(), length_mm }
}

fn mm(value: f64) -> Mm {
    Mm::new(value).unwrap_or(Mm::ZERO)
}
