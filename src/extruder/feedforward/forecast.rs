//! The flow at the nozzle from the extruder's command, or from its measured speed.

use super::{FeedforwardError, positive};
use crate::core::{Mm3PerS, Rpm, Span};
use crate::numeric::lti::{Between, Simulator, TransferFunction};

/// Model of an extruder.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderModel {
    /// G1: turns of the screw \[rpm\] over the command, as the drive's voltage
    /// \[V\]. With a command in rpm and a fast drive it is a gain of 1.
    pub drive: TransferFunction,
    /// G2: flow at the nozzle \[mm³/s\] over turns of the screw \[rpm\].
    pub flow: TransferFunction,
}

/// Where the screw's speed comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScrewSpeed {
    /// From the drive's model; there is no encoder.
    Modelled,
    /// From the encoder (bcs-thesis, section 5.3.1); the change until the forecast from the
    /// drive's model.
    Measured,
}

/// Forecast of the flow.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowForecast {
    /// The drive ahead and now.
    drives: [Simulator; 2],
    flow: Simulator,
    screw: ScrewSpeed,
    ahead_s: f64,
}

impl FlowForecast {
    /// A forecast `ahead` of now on a grid of `period`. Fails where that exceeds the dead times,
    /// beyond which the flow depends on later commands, and where a model is not stable.
    pub fn new(
        model: &ExtruderModel,
        screw: ScrewSpeed,
        ahead: Span,
        period: Span,
    ) -> Result<Self, FeedforwardError> {
        let period_s = positive("the period", period.secs())?;
        let ahead_s = ahead.secs();
        super::usable_gain(&model.drive)?;
        super::usable_gain(&model.flow)?;
        let dead_time_s = model.drive.dead_time_s() + model.flow.dead_time_s();
        if !(0.0..=dead_time_s).contains(&ahead_s) {
            return Err(FeedforwardError::TooFarAhead { ahead_s, dead_time_s });
        }
        let from_drive = ahead_s.min(model.drive.dead_time_s());
        let from_flow = ahead_s - from_drive;
        let drive = |earlier: f64| {
            let tf = model.drive.with_dead_time(model.drive.dead_time_s() - earlier)?;
            Simulator::new(&tf, period_s, Between::Held)
        };
        let flow = model.flow.with_dead_time(model.flow.dead_time_s() - from_flow)?;
        let flow = Simulator::new(&flow, period_s, Between::Linear)?;
        Ok(Self { drives: [drive(from_drive)?, drive(0.0)?], flow, screw, ahead_s })
    }

    /// Starts in the steady state of a command.
    pub fn start(&mut self, command: f64) -> Result<(), FeedforwardError> {
        for drive in &mut self.drives {
            drive.settle(command)?;
        }
        // These steps do not change a steady state.
        let rpm = self.drives[1].step(command);
        let _ = self.drives[0].step(command);
        self.flow.settle(rpm)?;
        Ok(())
    }

    /// One period with the command from now on and the measured speed of the screw, if available.
    /// Returns the flow [`Self::ahead_s`] from now.
    pub fn step(&mut self, command: f64, measured: Option<Rpm>) -> Mm3PerS {
        let [ahead, now] = &mut self.drives;
        let (ahead, now) = (ahead.step(command), now.step(command));
        let rpm = match (self.screw, measured) {
            (ScrewSpeed::Measured, Some(measured)) => measured.get() + ahead - now,
            _ => ahead,
        };
        Mm3PerS::new(self.flow.step(rpm)).unwrap_or_default()
    }

    /// Where the screw's speed comes from.
    pub const fn screw(&self) -> ScrewSpeed {
        self.screw
    }

    /// How far ahead the forecast is \[s\].
    pub fn ahead_s(&self) -> f64 {
        self.ahead_s
    }
}
