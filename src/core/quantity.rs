//! The quantity in a column: its name ends with the unit.

use std::fmt;

/// Units that an extruder's quantities are logged in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Turns a minute.
    Rpm,
    /// Megapascal.
    MPa,
    /// Kilopascal.
    KPa,
    /// Bar.
    Bar,
    /// Drive voltage.
    Volt,
    /// Per cent of a drive's range.
    Percent,
    /// Volume a second.
    Mm3PerS,
    /// Litres a minute.
    LPerMin,
    /// Mass a minute.
    GPerMin,
    /// Mass a second.
    KgPerS,
    /// Speed.
    MmPerS,
    /// Area of a section.
    Mm2,
    /// Length.
    Mm,
    /// Temperature.
    Celsius,
    /// A fraction, or something without a unit.
    One,
}

/// Each unit with the end of a column's name and its symbol. A longer end comes before a shorter
/// one that it ends with.
const UNITS: [(Unit, &str, &str); 15] = [
    (Unit::Rpm, "rpm", "rpm"),
    (Unit::MPa, "mpa", "MPa"),
    (Unit::KPa, "kpa", "kPa"),
    (Unit::Bar, "bar", "bar"),
    (Unit::Volt, "v", "V"),
    (Unit::Percent, "percent", "%"),
    (Unit::Mm3PerS, "mm3_per_s", "mm³/s"),
    (Unit::LPerMin, "l_per_min", "l/min"),
    (Unit::GPerMin, "g_per_min", "g/min"),
    (Unit::KgPerS, "kg_per_s", "kg/s"),
    (Unit::MmPerS, "mm_per_s", "mm/s"),
    (Unit::Mm2, "mm2", "mm²"),
    (Unit::Mm, "mm", "mm"),
    (Unit::Celsius, "c", "°C"),
    (Unit::One, "1", "1"),
];

impl Unit {
    /// All units.
    pub fn all() -> impl Iterator<Item = Self> {
        UNITS.iter().map(|unit| unit.0)
    }

    /// The unit at the end of a column's name, such as `screw_rpm` or `rpm`; `None` without one.
    pub fn of_column(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let ends = |end: &str| {
            name.strip_suffix(end).is_some_and(|rest| rest.is_empty() || rest.ends_with('_'))
        };
        UNITS.iter().find(|unit| ends(unit.1)).map(|unit| unit.0)
    }

    /// The unit with this word, as [`Unit::word`] gives it; `None` for others.
    pub fn of_word(word: &str) -> Option<Self> {
        UNITS.iter().find(|unit| unit.1 == word).map(|unit| unit.0)
    }

    /// The unit as the end of a column's name.
    pub fn word(self) -> &'static str {
        self.entry().1
    }

    /// The unit as it is printed after a number.
    pub fn symbol(self) -> &'static str {
        self.entry().2
    }

    fn entry(self) -> (Self, &'static str, &'static str) {
        // Every unit is in the table, which a test checks.
        UNITS.into_iter().find(|unit| unit.0 == self).unwrap_or((self, "1", "1"))
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

/// A quantity by its name and its unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Its name without the unit, such as `screw`.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
}

impl Quantity {
    /// The quantity of a column. The unit is `unit`, else the one that the name ends with; `None`
    /// without either.
    pub fn of_column(column: &str, unit: Option<Unit>) -> Option<Self> {
        let unit = unit.or_else(|| Unit::of_column(column))?;
        let lower = column.to_ascii_lowercase();
        let end = lower.strip_suffix(unit.word()).map_or(column.len(), str::len);
        let name = column.get(..end).unwrap_or(column).trim_end_matches('_');
        let name = if name.is_empty() { unit.word() } else { name };
        Some(Self { name: name.to_owned(), unit })
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.name == self.unit.word() {
            return write!(f, "{}", self.unit);
        }
        write!(f, "{} [{}]", self.name.replace('_', " "), self.unit)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn a_columns_end_tells_its_unit() {
        for (name, unit) in [
            ("screw_rpm", Some(Unit::Rpm)),
            ("rpm", Some(Unit::Rpm)),
            ("flow_mm3_per_s", Some(Unit::Mm3PerS)),
            ("wheel_mm_per_s", Some(Unit::MmPerS)),
            ("Nozzle_MPa", Some(Unit::MPa)),
            ("drive_v", Some(Unit::Volt)),
            ("area_mm2", Some(Unit::Mm2)),
            ("oven", None),
            ("seqv", None),
        ] {
            assert_eq!(Unit::of_column(name), unit, "{name}");
        }
    }

    #[test]
    fn every_unit_has_a_word_of_its_own() {
        for unit in Unit::all() {
            assert_eq!(Unit::of_word(unit.word()), Some(unit));
            assert_eq!(Unit::of_column(&format!("x_{}", unit.word())), Some(unit));
        }
    }

    #[test]
    fn a_quantity_is_its_name_and_unit() {
        let flow = Quantity::of_column("flow_mm3_per_s", None).unwrap();
        assert_eq!((flow.name.as_str(), flow.to_string().as_str()), ("flow", "flow [mm³/s]"));
        let given = Quantity::of_column("nozzle", Some(Unit::Bar)).unwrap();
        assert_eq!((given.name.as_str(), given.unit), ("nozzle", Unit::Bar));
        assert_eq!(Quantity::of_column("rpm", None).unwrap().to_string(), "rpm");
        assert_eq!(Quantity::of_column("oven", None), None);
    }
}
