//! `strategy = "pi"`: proportional-integral control on the measured widths, as in
//! Shojaei Barjuei et al. 2022.

use std::sync::Arc;

use super::kind::{CellParameters, Registration, WidthControlSettings, WidthStrategy};
use crate::core::{Mm, MmPerS, Span, Stamp};
use crate::width_control::controller::{
    BoxedController, SpeedRequest, Tracking, WidthController, WidthSample, WidthTrace,
};
use crate::width_control::pi::{Demand, Pi, PiGains, Saturation};

/// PI control in a cell.
pub const REGISTRATION: Registration =
    Registration { name: "pi", needs_gains: true, read: |_| Some(Arc::new(PiStrategy)) };

/// PI control with the gains of the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PiStrategy;

impl WidthStrategy for PiStrategy {
    fn controller(&self, cell: &CellParameters, control: &WidthControlSettings) -> BoxedController {
        let target = control.target.nominal();
        let gains = control.gains.unwrap_or_else(|| cautious_gains(cell, target, 1.0));
        Box::new(PiControl::new(gains, control.max_gap))
    }
}

/// Gains where a cell gives none, for a bead with w = A·(v/v₀)^−`exponent`. The plant is the
/// slope |dw/dv| behind the dead time from nozzle to camera; internal model control of it
/// with a closed-loop time constant of twice the dead time θ is the integral gain
/// 1/(slope·(2θ + θ)), without a proportional part.
pub fn cautious_gains(cell: &CellParameters, target: Mm, exponent: f64) -> PiGains {
    let speed = cell.start_speed.max(MmPerS::constant(1.0));
    let slope = exponent * target.get() / speed.get();
    let dead_s = cell.camera_offset / (speed * Span::from_secs(1.0));
    let dead_s = dead_s + cell.setpoint_period.secs();
    PiGains { kp_per_s: 0.0, ki_per_s2: 1.0 / (3.0 * dead_s * slope.max(1e-6)) }
}

/// PI control that starts without a bump, and starts again after a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiControl {
    gains: PiGains,
    max_gap: Span,
    /// The integrator and the last demand, once started.
    running: Option<(Pi, MmPerS)>,
}

impl PiControl {
    /// Control before its start.
    pub fn new(gains: PiGains, max_gap: Span) -> Self {
        Self { gains, max_gap, running: None }
    }

    /// Stops control and discards the integral.
    pub fn reset(&mut self) {
        self.running = None;
    }

    /// Whether it is started.
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Starts at a width, from the robot's speed.
    pub fn start(&mut self, sample: &WidthSample, trace: &mut WidthTrace) -> Tracking {
        let mut pi = Pi::start_bumpless(self.gains, sample.driven, sample.error);
        let demand = pi.step(sample.error, Span::ZERO, Saturation::None);
        trace.note(&demand);
        self.running = Some((pi, demand.speed));
        Tracking { seen_at: sample.captured_at, is_new: true }
    }

    /// Continues with a width that is newer than `seen_at`; none where it is not.
    pub fn go_on(
        &mut self,
        seen_at: Stamp,
        sample: &WidthSample,
        trace: &mut WidthTrace,
    ) -> Option<Tracking> {
        let dt = sample.captured_at - seen_at;
        if dt <= Span::ZERO {
            return None;
        }
        match &mut self.running {
            Some((pi, demand)) if dt <= self.max_gap => {
                let next = pi.step(sample.error, dt, sample.saturation);
                trace.note(&next);
                *demand = next.speed;
                Some(Tracking::on(sample.captured_at))
            }
            _ => Some(self.start(sample, trace)),
        }
    }

    /// The last demand.
    pub fn demand(&self) -> Option<MmPerS> {
        self.running.map(|(_, demand)| demand)
    }
}

impl WidthController for PiControl {
    fn measured(&mut self, sample: &WidthSample, trace: &mut WidthTrace) -> Option<Tracking> {
        match sample.tracked {
            Some(seen_at) => self.go_on(seen_at, sample, trace),
            None => sample.may_begin.then(|| self.start(sample, trace)),
        }
    }

    fn speed(&mut self, _: &SpeedRequest, _: &mut WidthTrace) -> Option<MmPerS> {
        self.demand()
    }
}

impl WidthTrace {
    fn note(&mut self, demand: &Demand) {
        self.proportional = Some(demand.proportional);
        self.integral = Some(demand.integral);
        self.demand = Some(demand.speed);
    }
}
