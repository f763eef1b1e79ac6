//! `strategy = "distance"`: control by distance, with PI control as the fallback.

use std::sync::Arc;

use super::kind::{CellParameters, Registration, WidthControlSettings, WidthStrategy};
use super::pi::{PiControl, cautious_gains};
use crate::core::{Mm, MmPerS, Rpm, Stamp};
use crate::document::Table;
use crate::width_control::controller::{
    BeadReport, BoxedController, Outlook, SpeedRequest, Tracking, WidthController, WidthSample,
    WidthTrace,
};
use crate::width_control::distance::{DistanceController, DistanceSettings, FallbackReason};

/// Control by distance in a cell.
pub const REGISTRATION: Registration = Registration { name: "distance", needs_gains: false, read };

/// Standard deviation of the flow's drift over a metre of path where the cell gives none, as
/// a fraction. A larger value follows the flow faster and passes more noise of the width to
/// the speed.
const DRIFT_PER_ROOT_M: f64 = 0.002;

/// Control by distance with its model of the bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceStrategy {
    /// b in w = A·(v/v₀)^−b.
    pub exponent: f64,
    /// Whether b is estimated from the widths.
    pub learns_exponent: bool,
    /// Standard deviation of the flow's drift over a metre of path, as a fraction.
    pub drift_per_root_m: f64,
    /// Whether a pulsation of the flow is cancelled.
    pub cancels_pulsation: bool,
}

fn read(control: &Table<'_>) -> Option<Arc<dyn WidthStrategy>> {
    let exponent = control.number("exponent", 0.02..=2.0);
    let learns = control.choice("exponent_learns", &[("yes", true), ("no", false)]);
    let drift = control.number_or("drift_per_root_m", 1e-5..=1.0, DRIFT_PER_ROOT_M);
    let pulsation = control.choice("pulsation", &[("cancel", true), ("ignore", false)]);
    Some(Arc::new(DistanceStrategy {
        exponent: exponent?,
        learns_exponent: learns?,
        drift_per_root_m: drift?,
        cancels_pulsation: pulsation?,
    }))
}

impl WidthStrategy for DistanceStrategy {
    fn controller(&self, cell: &CellParameters, control: &WidthControlSettings) -> BoxedController {
        let target = control.target.nominal();
        let settings = DistanceSettings {
            offset: cell.camera_offset,
            offset_sigma: cell.camera_offset_sigma,
            gauge: cell.gauge_length,
            reference_speed: cell.start_speed,
            exponent: self.exponent,
            learns_exponent: self.learns_exponent,
            drift_per_root_m: self.drift_per_root_m,
            roughness: cell.bead_noise.roughness_at(target),
            cancels_pulsation: self.cancels_pulsation,
            screw_pulses: cell.screw_pulses,
        };
        let gains = control.gains.unwrap_or_else(|| cautious_gains(cell, target, self.exponent));
        Box::new(DistanceControl {
            by_distance: DistanceController::new(settings),
            pi: PiControl::new(gains, control.max_gap),
            fallback: None,
            start_length: cell.start_length,
            camera_offset: cell.camera_offset,
        })
    }

    fn exponent(&self) -> Option<f64> {
        Some(self.exponent)
    }

    fn sees_only_laid_bead(&self) -> bool {
        true
    }
}

/// Control by distance, and PI control for the rest of a bead whose widths cannot be matched to the
/// speeds at which it was laid.
#[derive(Debug, Clone, PartialEq)]
struct DistanceControl {
    by_distance: DistanceController,
    pi: PiControl,
    fallback: Option<FallbackReason>,
    start_length: Mm,
    camera_offset: Mm,
}

impl DistanceControl {
    /// The first reason to fall back stays for the bead.
    fn look_for_fallback(&mut self) {
        self.fallback = self.fallback.or(self.by_distance.fallback_reason());
    }

    fn learn(&mut self, sample: &WidthSample, trace: &mut WidthTrace) {
        if let Some(path) = sample.nozzle_path
            && sample.is_own_bead
        {
            trace.distance = Some(self.by_distance.measured(path, sample.reading));
            self.look_for_fallback();
        }
    }

    fn is_ready(&self) -> bool {
        self.by_distance.is_ready() && self.fallback.is_none()
    }
}

impl WidthController for DistanceControl {
    fn begin_bead(&mut self) {
        self.fallback = None;
        self.pi.reset();
        self.by_distance.begin_bead();
    }

    /// What was learned of the bead stays, with a larger variance; its speeds are recorded anew.
    fn bead_interrupted(&mut self) {
        self.by_distance.begin_bead();
    }

    fn path_is_estimated(&mut self) {
        self.fallback = self.fallback.or(Some(FallbackReason::NoPath));
    }

    fn robot_reported(&mut self, report: &BeadReport) {
        self.by_distance.reported(report.at, report.path, report.speed, report.flow_ratio);
        self.look_for_fallback();
    }

    fn screw_reported(&mut self, at: Stamp, speed: Rpm) {
        self.by_distance.screw_reported(at, speed);
    }

    /// Updates the model with every width, also while PI control sets the speed. Tracking
    /// begins once a whole gauge of bead has been measured.
    fn measured(&mut self, sample: &WidthSample, trace: &mut WidthTrace) -> Option<Tracking> {
        self.learn(sample, trace);
        let is_ready = self.is_ready();
        match sample.tracked {
            Some(seen_at) if self.pi.is_running() => self.pi.go_on(seen_at, sample, trace),
            Some(seen_at) if is_ready => Some(Tracking::on(sample.captured_at.max(seen_at))),
            Some(_) => Some(self.pi.start(sample, trace)),
            None if sample.may_begin && is_ready => {
                self.pi.reset();
                Some(Tracking::on(sample.captured_at))
            }
            None if sample.may_begin && self.fallback.is_some() => {
                Some(self.pi.start(sample, trace))
            }
            None => None,
        }
    }

    /// Begins to track as soon as the first part of the bead is laid and the model is
    /// known, also from the bead before: no width has to be waited for.
    fn before_setpoint(&mut self, outlook: &Outlook) -> Option<Stamp> {
        if self.fallback.is_some() {
            return None;
        }
        let primed = outlook.laid.is_some_and(|laid| laid >= self.start_length);
        let seen_at = match outlook.tracked {
            Some(seen_at) if !self.pi.is_running() => seen_at,
            None if primed && self.by_distance.is_ready() => {
                self.pi.reset();
                outlook.now
            }
            _ => return None,
        };
        let Some(laid) = outlook.laid else { return Some(seen_at) };
        // Until the bead reaches the camera, no width is missing.
        Some(if laid < self.camera_offset { outlook.now } else { seen_at })
    }

    fn speed(&mut self, request: &SpeedRequest, _: &mut WidthTrace) -> Option<MmPerS> {
        match self.pi.demand() {
            Some(demand) => Some(demand),
            None => self.by_distance.speed(request.target?, request.from, request.lasts),
        }
    }

    fn fallback(&self) -> Option<FallbackReason> {
        self.fallback
    }
}
