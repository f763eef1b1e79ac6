//! Whether counting the pulses of a screw has an effect in a cell.

use super::file::RunPart;
use crate::core::Rpm;
use crate::extruder::CommandQuantity;
use crate::width_control::distance::{PERIODS_S, ScrewPulses};
use crate::width_control::strategy::distance::DistanceStrategy;

/// Why `pulses_per_turn` of `[extruder]` has no effect.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PulsesIgnored {
    /// The strategy cancels no pulsation.
    #[error("only [control] strategy = \"distance\" cancels a pulsation")]
    Strategy,
    /// The cell says that a pulsation is left alone.
    #[error("[control] pulsation is \"ignore\"")]
    Pulsation,
    /// At every rpm that may be commanded they follow too fast to be cancelled.
    #[error("they follow within {longest_s:.3} s at every rpm, and {} s is the shortest period", PERIODS_S.0)]
    TooFast {
        /// Period at the smallest rpm \[s\].
        longest_s: f64,
    },
    /// At every rpm that may be commanded they follow too slowly.
    #[error("they follow after {shortest_s:.1} s at every rpm, and {} s is the longest period", PERIODS_S.1)]
    TooSlow {
        /// Period at the largest rpm \[s\].
        shortest_s: f64,
    },
}

impl RunPart {
    /// The pulses that are counted; `None` where the cell states none.
    pub fn counted_pulses(&self) -> Option<Result<ScrewPulses, PulsesIgnored>> {
        let extruder = &self.extruder.as_ref()?.extruder;
        let pulses = extruder.screw_pulses()?;
        let Some(strategy) = self.control.strategy.as_kind::<DistanceStrategy>() else {
            return Some(Err(PulsesIgnored::Strategy));
        };
        if !strategy.cancels_pulsation {
            return Some(Err(PulsesIgnored::Pulsation));
        }
        if extruder.drive == CommandQuantity::Rpm {
            let (min, max) = extruder.limits.range();
            let period_s = |rpm| 1.0 / pulses.hz(Rpm::new(rpm).unwrap_or_default());
            let (longest_s, shortest_s) = (period_s(min), period_s(max));
            if longest_s < PERIODS_S.0 {
                return Some(Err(PulsesIgnored::TooFast { longest_s }));
            }
            if shortest_s > PERIODS_S.1 {
                return Some(Err(PulsesIgnored::TooSlow { shortest_s }));
            }
        }
        Some(Ok(pulses))
    }
}
