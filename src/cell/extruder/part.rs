//! `[extruder]` with `[extruder_plant]`: the command, the demanded flow, and the plant of a
//! simulated cell.

use std::path::Path;

use super::{ExtruderPlant, ExtruderSettings, PlantKind, Strategy};
use crate::cell::drivers::DriverTables;
use crate::core::{Mm, Mm3PerS, MmPerS};
use crate::document::Table;
use crate::extruder::strategy::RequiredReading;
use crate::extruder::{CommandQuantity, FlowDemand};
use crate::scenario::table::Simulation;

/// The extruder side of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderPart {
    /// Command, limits and strategy.
    pub extruder: ExtruderSettings,
    /// The demanded flow.
    pub demand: FlowDemand,
    /// The plant of a simulated cell, if the file has one.
    pub plant: Option<ExtruderPlant>,
    /// Flow at which the simulated bead is as wide as `[bead]` says.
    pub plant_nominal: Mm3PerS,
}

/// Width and speed of a bead at its beginning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadStart {
    /// Its width.
    pub width: Mm,
    /// Speed at which it begins.
    pub speed: MmPerS,
}

/// Other parts of the cell that the extruder side needs; `None` where one could not be read.
#[derive(Debug, Clone, Copy)]
pub struct CellContext<'a> {
    /// The bead.
    pub bead: Option<BeadStart>,
    /// The simulated bead.
    pub simulation: Option<&'a Simulation>,
}

impl ExtruderPart {
    /// Reads both tables. `None` without `[extruder]`, and where a violation was reported.
    pub fn read(
        root: &Table<'_>,
        folder: &Path,
        context: &CellContext<'_>,
        drivers: &mut dyn DriverTables,
    ) -> Option<Self> {
        let plant_table = root.optional_run_table("extruder_plant");
        let plant = plant_table.as_ref().and_then(ExtruderPlant::read);
        let Some(table) = root.optional_run_table("extruder") else {
            if plant_table.is_some() {
                root.report(
                    "extruder_plant",
                    "a plant of no extruder",
                    "a table [extruder] beside it",
                );
            }
            return None;
        };
        drivers.read_extruder(&table, folder);
        let extruder = ExtruderSettings::read(&table, folder)?;
        if let (Some(plant), Some(plant_table)) = (&plant, &plant_table) {
            check_plant(&extruder, &table, &plant.kind, plant_table);
        }
        let BeadStart { width, speed } = context.bead?;
        let demand = extruder.demand(&table, width, speed)?;
        let model = context.simulation?.bead;
        let (width, at) =
            (Mm::new(model.width_mm).ok()?, MmPerS::new(model.at_speed_mm_per_s).ok()?);
        let plant_nominal = extruder.demand(&table, width, at)?.nominal();
        Some(Self { extruder, demand, plant, plant_nominal })
    }
}

/// Reports a plant for another command quantity, or without a reading that the strategy needs: such
/// a cell cannot be simulated.
fn check_plant(
    extruder: &ExtruderSettings,
    table: &Table<'_>,
    kind: &PlantKind,
    plant_table: &Table<'_>,
) {
    let taken = match kind {
        PlantKind::Linear(plant) => plant.screw_lag_s.map(|_| CommandQuantity::Rpm),
        PlantKind::Pressure(_) => Some(CommandQuantity::Rpm),
        PlantKind::Screw(_) => Some(CommandQuantity::Filling),
        PlantKind::Melt(_) => None,
    };
    if let Some(taken) = taken.filter(|taken| *taken != extruder.drive) {
        let found = format!("a plant that takes \"{}\"", taken.word());
        let given = extruder.drive.word();
        plant_table.report(
            "kind",
            found,
            format!("one that takes \"{given}\", as [extruder] says"),
        );
        return;
    }
    let needed = match extruder.strategy {
        Strategy::Pressure(_) => Some(RequiredReading::Pressure),
        Strategy::Screw(_) => Some(RequiredReading::Filled),
        Strategy::Adaptive(_) => Some(RequiredReading::Flow),
        Strategy::Feedforward(ref keys) => keys.predicted_from.required_reading(),
        Strategy::Constant { .. } | Strategy::Profile { .. } => None,
    };
    let limited = extruder.max_pressure.map(|_| RequiredReading::Pressure);
    let key = if let Strategy::Feedforward(_) = extruder.strategy {
        "predicted_from"
    } else {
        "strategy"
    };
    let counted = extruder.pulses_per_turn.map(|_| RequiredReading::Screw);
    let needs = [(key, needed), ("max_pressure_mpa", limited), ("pulses_per_turn", counted)];
    for (key, need) in needs {
        if let Some(need) = need.filter(|need| !kind.reports(*need)) {
            let (reading, plant) = match need {
                RequiredReading::Pressure => ("a pressure", "kind = \"pressure\""),
                RequiredReading::Filled => ("a filled length", "kind = \"screw\""),
                RequiredReading::Flow => ("a flow", "flow_sensor_noise_mm3_per_s"),
                RequiredReading::Screw => (
                    "the screw's speed",
                    "kind = \"pressure\", or \"direct\" or \"linear\" and screw_lag_s",
                ),
            };
            let found = format!("{reading} to go by, which [extruder_plant] never reports");
            table.report(key, found, format!("a plant with {plant}, or no [extruder_plant]"));
        }
    }
}
