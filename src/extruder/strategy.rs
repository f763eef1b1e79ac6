//! The strategies of the extruder side behind one face, [`Strategy`].

mod interface;
mod inverse_model;
mod nozzle_speed;
mod playback;
mod pressure_loop;
mod screw_fill;

pub use interface::{Need, Strategy, Unusable, Wish};
pub use inverse_model::{Foreseen, OperatingPoint};
pub use nozzle_speed::{AdaptiveNozzle, NozzleModel};
pub use playback::{Constant, Played};
pub use pressure_loop::{PressureChoice, PressureLoop, PressureSettings};
pub use screw_fill::ScrewFill;

/// A strategy with its memory.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// One command for as long as bead is laid.
    Constant(Constant),
    /// Commands that were written down beforehand, for an experiment.
    Profile(Played),
    /// The inverse of a model.
    Feedforward(Box<Foreseen>),
    /// The pressure at the nozzle.
    Pressure(Box<PressureLoop>),
    /// The filled length of a screw, foretold over its delay.
    Screw(ScrewFill),
    /// Model-reference adaptive control of the speed in the nozzle.
    Adaptive(AdaptiveNozzle),
}

impl Law {
    /// The law behind the name.
    pub fn strategy(&self) -> &dyn Strategy {
        match self {
            Self::Constant(law) => law,
            Self::Profile(law) => law,
            Self::Feedforward(law) => law.as_ref(),
            Self::Pressure(law) => law.as_ref(),
            Self::Screw(law) => law,
            Self::Adaptive(law) => law,
        }
    }

    /// The same, to be stepped.
    pub fn strategy_mut(&mut self) -> &mut dyn Strategy {
        match self {
            Self::Constant(law) => law,
            Self::Profile(law) => law,
            Self::Feedforward(law) => law.as_mut(),
            Self::Pressure(law) => law.as_mut(),
            Self::Screw(law) => law,
            Self::Adaptive(law) => law,
        }
    }
}

#[cfg(test)]
mod tests;
