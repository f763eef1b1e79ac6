//! Implausible values for a unit.

use crate::core::Unit;

/// Highest pressure of extruders \[MPa\]. A choice above the melt pressures of injection
/// moulding.
const MAX_PRESSURE_MPA: f64 = 150.0;

/// A warning about a column's unit.
pub fn implausible_unit(column: &str, unit: Unit, values: &[f64]) -> Option<String> {
    let largest = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let is_beyond = unit == Unit::MPa && largest > MAX_PRESSURE_MPA;
    is_beyond.then(|| {
        format!(
            "{column} goes up to {largest:.0} MPa, and no extruder works beyond {MAX_PRESSURE_MPA:.0} MPa: \
             if it is in bar, say --unit {column}=bar"
        )
    })
}
