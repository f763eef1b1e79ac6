//! The interface of an extruder driver: its registration, its settings, and its start.

use std::fmt::Debug;
use std::path::Path;
use std::sync::Arc;

use crossbeam_channel::Sender;

use crate::document::Table;
use crate::drivers::StartError;
use crate::extruder::{CommandQuantity, ExtruderLimits};
use crate::io::clock::RunClock;
use crate::run::ports::{ExtruderEvent, ExtruderPort};

/// An extruder driver as a cell chooses it.
#[derive(Debug)]
pub struct ExtruderRegistration {
    /// Its name in `driver` of `[extruder]`.
    pub name: &'static str,
    /// Reads its own keys of `[extruder]`; `None` if they are wrong. Relative paths start from the
    /// folder.
    pub read: fn(&Table<'_>, &Path) -> Option<Arc<dyn ExtruderDriver>>,
}

/// An extruder with its driver's settings.
pub trait ExtruderDriver: Debug + Send + Sync {
    /// Address of the extruder in messages and reports, such as `host:port`.
    fn address(&self) -> String;

    /// A command rounded to the steps of the link, as the extruder receives it.
    fn as_received(&self, command: f64) -> f64 {
        command
    }

    /// Starts to connect. From then on the extruder's reports arrive on `start.events`.
    fn start(&self, start: ExtruderStart) -> Result<Box<dyn ExtruderPort>, StartError>;
}

/// What an extruder driver is given at its start.
#[derive(Debug)]
pub struct ExtruderStart {
    /// The clock of the run.
    pub clock: RunClock,
    /// The commands of the cell.
    pub range: DriveRange,
    /// Time for which a command is valid after the report that it refers to \[ms\].
    pub valid_ms: u64,
    /// Receives the extruder's reports. Unbounded: a driver never waits for it.
    pub events: Sender<ExtruderEvent>,
}

/// Quantity and range of a cell's commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveRange {
    /// The commanded quantity.
    pub quantity: CommandQuantity,
    /// Smallest command, in the unit of `quantity`.
    pub min: f64,
    /// Largest command, in the same unit.
    pub max: f64,
}

impl DriveRange {
    /// Why this cell cannot command an extruder; `None` if it can. `as_received` rounds a command
    /// as the extruder receives it.
    pub fn unfit(
        &self,
        extruder: &ExtruderLimits,
        as_received: impl Fn(f64) -> f64,
    ) -> Option<String> {
        let ExtruderLimits { name, quantity, min, max } = extruder;
        let (unit, cell) = (quantity.unit_word(), self.quantity.unit_word());
        if *quantity != self.quantity {
            return Some(format!(
                "extruder `{name}` is commanded in {unit}, [extruder] of the cell commands {cell}; \
                 both must be the same"
            ));
        }
        let fits = *min <= as_received(self.min) && as_received(self.max) <= *max;
        (!fits).then(|| {
            format!(
                "extruder `{name}` takes {min} to {max} {unit}, [extruder] of the cell allows \
                 {} to {}; make them lie within the extruder's",
                self.min, self.max
            )
        })
    }
}
