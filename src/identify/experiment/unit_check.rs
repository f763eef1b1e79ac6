//! Values that can hardly be what they are said to be.

use crate::core::quantity::Unit;

/// No extruder works beyond this, in megapascal.
const MAX_PRESSURE_MPA: f64 = 150.0;

/// A doubt about a column's unit, in words.
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
