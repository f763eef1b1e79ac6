//! Adaptive control of the speed in the nozzle, as a strategy: the demanded flow gives a speed,
//! the mass flow of the feed is commanded. Mohammadi Looey et al. 2026, eq. (8). The strand's
//! sub-system commands the plate, which is the robot's side.

use super::interface::{BadReading, CommandDemand, ExtruderController, RequiredReading};
use crate::core::{Mm2, Mm3PerS, Span, Stamp};
use crate::extruder::adaptive::{MracController, ScalarPlant};
use crate::extruder::report::ExtruderReport;

/// Metres in a millimetre. By definition.
const M_PER_MM: f64 = 1e-3;

/// The nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NozzleModel {
    /// Section, which converts flow to speed.
    pub section: Mm2,
    /// (β1/β3)·p of a constant pressure gradient, as a part of the feed \[kg/s\].
    pub pressure_kg_per_s: f64,
}

/// The controller with its nozzle. Needs the reported flow at the nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveNozzle {
    controller: MracController,
    nozzle: NozzleModel,
    reference: f64,
    demand: CommandDemand,
    begun: bool,
    /// Applied commands since the last step of the feedback.
    applied: AppliedMean,
}

/// The time mean of the applied commands, in place of the constant command that the controller's
/// model assumes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct AppliedMean {
    last: Option<(Stamp, f64)>,
    secs: f64,
    sum: f64,
}

impl AppliedMean {
    /// The last command was held until now.
    fn hold(&mut self, now: Stamp) {
        if let Some((since, value)) = &mut self.last {
            let secs = (now - *since).secs().max(0.0);
            *since = now;
            self.secs += secs;
            self.sum += secs * *value;
        }
    }

    /// Another command from now on.
    fn set(&mut self, now: Stamp, value: f64) {
        self.hold(now);
        self.last = Some((now, value));
    }

    /// The mean until now, and restarts. None where no time has passed.
    fn take(&mut self, now: Stamp) -> Option<f64> {
        self.hold(now);
        let mean = (self.secs > 0.0).then_some(self.sum / self.secs);
        (self.secs, self.sum) = (0.0, 0.0);
        mean
    }
}

impl AdaptiveNozzle {
    /// Before the first bead.
    pub fn new(controller: MracController, nozzle: NozzleModel) -> Self {
        let (demand, applied) = (CommandDemand::default(), AppliedMean::default());
        Self { controller, nozzle, reference: 0.0, demand, begun: false, applied }
    }

    /// Speed in the nozzle \[m/s\].
    fn speed(&self, flow: Mm3PerS) -> f64 {
        flow.get() / self.nozzle.section.get() * M_PER_MM
    }

    /// The feed that holds a speed in the nozzle without uncertainty \[kg/s\].
    fn holding(&self, speed: f64) -> f64 {
        let ScalarPlant { state_gain_per_s, input_gain } = self.controller.plant();
        -state_gain_per_s / input_gain * speed - self.nozzle.pressure_kg_per_s
    }
}

impl ExtruderController for AdaptiveNozzle {
    fn required_reading(&self) -> Option<RequiredReading> {
        Some(RequiredReading::Flow)
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> CommandDemand {
        let speed = self.speed(flow);
        self.reference = self.controller.reference_for(speed);
        // The estimate of the last bead is still valid.
        self.demand =
            CommandDemand::feedforward_only(self.holding(speed) - self.controller.estimate());
        self.begun = false;
        self.applied = AppliedMean::default();
        self.demand
    }

    fn feedforward(&mut self, _dt: Span, flow: Mm3PerS) {
        self.reference = self.controller.reference_for(self.speed(flow));
    }

    fn control(&mut self, now: Stamp, dt: Span, report: &ExtruderReport) -> Result<(), BadReading> {
        let flow = report.flow_mm3_per_s.ok_or(BadReading)?;
        let (measured, known) = (self.speed(flow), self.nozzle.pressure_kg_per_s);
        if let Some(mean) = self.applied.take(now) {
            self.controller.settle(mean);
        }
        if !self.begun {
            self.begun = true;
            // The flow is not steady yet, so the last estimate is kept.
            let estimate = self.controller.estimate();
            self.controller.start(measured, self.demand.value, known);
            self.controller.set_estimate(estimate);
        }
        let action = self.controller.step(measured, self.reference, known, dt);
        let feedforward = self.holding(action.model);
        let value = action.command;
        self.demand = CommandDemand { value, feedforward, feedback: value - feedforward };
        Ok(())
    }

    fn demand(&self) -> CommandDemand {
        self.demand
    }

    fn resume(&mut self, now: Stamp, applied: f64) {
        self.begun = false;
        self.applied = AppliedMean::default();
        self.settle(now, applied);
    }

    fn settle(&mut self, now: Stamp, applied: f64) {
        self.applied.set(now, applied);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Mm2;
    use crate::extruder::adaptive::{Adaptation, AdaptiveGains, EstimateBounds};

    fn controller() -> AdaptiveNozzle {
        let plant = ScalarPlant { state_gain_per_s: -1.0, input_gain: 1.0 };
        let adaptation = Adaptation::Constant { learning_rate: 4.0, weight: 1.0 };
        let gains = AdaptiveGains {
            feedback: 1.604,
            error_feedback: 0.0,
            adaptation,
            safety: EstimateBounds::default(),
        };
        let controller = MracController::new(plant, gains, Span::from_millis(50)).unwrap();
        let nozzle = NozzleModel { section: Mm2::constant(100.0), pressure_kg_per_s: 0.0 };
        AdaptiveNozzle::new(controller, nozzle)
    }

    fn report(flow: f64) -> ExtruderReport {
        ExtruderReport {
            pump: crate::extruder::PumpMode::On,
            valve_open: true,
            screw_rpm: None,
            pressure_mpa: None,
            flow_mm3_per_s: Some(Mm3PerS::constant(flow)),
            filled_mm: None,
        }
    }

    /// Runs the controller against its plant with an unknown part; returns it and the flow at
    /// the end.
    fn run(secs: f64, unknown: f64) -> (AdaptiveNozzle, f64) {
        let (mut controller, demanded) = (controller(), Mm3PerS::constant(1000.0));
        let (mut speed, mut now) = (0.01, Stamp::START);
        let mut command = controller.begin(now, demanded).value;
        let mut dt = Span::ZERO;
        while now.secs() < secs {
            controller.feedforward(dt, demanded);
            controller.control(now, dt, &report(speed * 100.0 / M_PER_MM)).unwrap();
            command = controller.demand().value;
            controller.settle(now, command);
            dt = Span::from_millis(50);
            let kept = (-dt.secs()).exp();
            speed = kept * speed + (1.0 - kept) * (command + unknown);
            now = now + dt;
        }
        assert!(command.is_finite());
        (controller, speed * 100.0 / M_PER_MM)
    }

    fn after(secs: f64, unknown: f64) -> f64 {
        run(secs, unknown).1
    }

    #[test]
    fn the_estimate_of_one_bead_is_used_at_the_beginning_of_the_next() {
        let demanded = Mm3PerS::constant(1000.0);
        let first = controller().begin(Stamp::START, demanded).value;
        assert!((first - 0.010).abs() < 1e-9, "{first}");
        let (mut controller, _) = run(40.0, -0.004);
        let next = controller.begin(Stamp::from_secs(60.0), demanded).value;
        assert!((next - 0.014).abs() < 2e-5, "{next}");
    }

    #[test]
    fn a_command_that_rises_within_a_hold_counts_by_its_mean() {
        let (mut stepwise, mut at_once) = (controller(), controller());
        let demanded = Mm3PerS::constant(1000.0);
        let ms = Span::from_millis;
        for controller in [&mut stepwise, &mut at_once] {
            let _ = controller.begin(Stamp::START, demanded);
            controller.settle(Stamp::START, 0.004);
            controller.control(Stamp::START, Span::ZERO, &report(500.0)).unwrap();
        }
        for i in 0_u32..10 {
            let now = Stamp::START + ms(5 * i64::from(i));
            stepwise.settle(now, 0.004 + 0.0004 * f64::from(i));
            at_once.settle(now, 0.0058);
        }
        for controller in [&mut stepwise, &mut at_once] {
            controller.control(Stamp::START + ms(50), ms(50), &report(500.0)).unwrap();
        }
        let [a, b] = [stepwise, at_once].map(|controller| controller.demand().value);
        assert!((a - b).abs() < 1e-12 && a.is_finite(), "{a} {b}");
    }

    #[test]
    fn a_feed_that_slips_is_estimated_until_the_flow_is_the_demanded_one() {
        assert!((after(20.0, 0.0) - 1000.0).abs() < 0.1);
        assert!((after(40.0, -0.004) - 1000.0).abs() < 1.0);
        // ë + a·ė + 4e = 0 leaves 94.6 mm³/s less at half a second.
        assert!((after(0.5, -0.004) - 905.4).abs() < 8.0);
    }
}
