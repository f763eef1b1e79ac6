//! The strategies of the extruder side, behind one trait, [`ExtruderController`].

mod interface;
mod inverse_model;
mod nozzle_speed;
mod playback;
mod pressure_loop;
mod screw_fill;

pub use interface::{BadReading, CommandDemand, ExtruderController, RequiredReading};
pub use inverse_model::{InverseFeedforward, OperatingPoint};
pub use nozzle_speed::{AdaptiveNozzle, NozzleModel};
pub use playback::{ConstantCommand, Playback};
pub use pressure_loop::{PressureChoice, PressureLoop, PressureSettings};
pub use screw_fill::ScrewFill;

/// A strategy with its state.
#[derive(Debug, Clone, PartialEq)]
pub enum ExtruderStrategy {
    /// One command for as long as bead is laid.
    Constant(ConstantCommand),
    /// Commands of a table, for an experiment.
    Profile(Playback),
    /// The inverse of a model.
    Feedforward(Box<InverseFeedforward>),
    /// Control of the pressure at the nozzle.
    Pressure(Box<PressureLoop>),
    /// Control of the filled length of a screw, predicted over its delay.
    Screw(ScrewFill),
    /// Model-reference adaptive control of the speed in the nozzle.
    Adaptive(AdaptiveNozzle),
}

impl ExtruderStrategy {
    /// The controller of the strategy.
    pub fn controller(&self) -> &dyn ExtruderController {
        match self {
            Self::Constant(controller) => controller,
            Self::Profile(controller) => controller,
            Self::Feedforward(controller) => controller.as_ref(),
            Self::Pressure(controller) => controller.as_ref(),
            Self::Screw(controller) => controller,
            Self::Adaptive(controller) => controller,
        }
    }

    /// The controller of the strategy, mutable.
    pub fn controller_mut(&mut self) -> &mut dyn ExtruderController {
        match self {
            Self::Constant(controller) => controller,
            Self::Profile(controller) => controller,
            Self::Feedforward(controller) => controller.as_mut(),
            Self::Pressure(controller) => controller.as_mut(),
            Self::Screw(controller) => controller,
            Self::Adaptive(controller) => controller,
        }
    }
}

#[cfg(test)]
mod tests;
