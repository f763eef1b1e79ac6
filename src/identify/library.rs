//! Models by material, nozzle and temperature.

use std::fmt;

use super::model_file::ModelFile;
use crate::core::Unit;

/// Nozzles that differ by less are the same \[mm\]: rounding of a diameter in hundredths.
const SAME_NOZZLE_MM: f64 = 0.005;
/// Temperatures that differ by less are the same \[°C\]: rounding.
const SAME_TEMPERATURE_C: f64 = 0.01;
/// Default tolerance of the temperature \[°C\]. A choice.
pub const TOLERANCE_C: f64 = 5.0;

/// A model and its file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelEntry {
    /// The file's name.
    pub name: String,
    /// Its content.
    pub model: ModelFile,
}

/// The available models, in the order of their file names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Library {
    entries: Vec<ModelEntry>,
}

/// A search for a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelQuery {
    /// Material, case-insensitive.
    pub material: String,
    /// Diameter of the nozzle \[mm\].
    pub nozzle_mm: f64,
    /// Temperature of the material \[°C\].
    pub temperature_c: f64,
    /// How far the model's temperature may be off \[°C\].
    pub tolerance_c: f64,
    /// Unit of the input, where it matters.
    pub input: Option<Unit>,
    /// Unit of the output, where it matters.
    pub output: Option<Unit>,
}

/// The model that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelMatch<'a> {
    /// The model and its file.
    pub entry: &'a ModelEntry,
    /// Its temperature less the requested one \[°C\].
    pub temperature_difference_c: f64,
}

/// No model, or more than one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LibraryError {
    /// None fits.
    #[error("no model for {wanted}; {}", list(.known))]
    Absent {
        /// The requested conditions and quantities.
        wanted: String,
        /// The available models.
        known: Vec<String>,
    },
    /// More than one fits equally well.
    #[error(
        "{} models for {wanted} fit equally well: {}; keep one of them, or name its file", .fit.len(),
        .fit.join("; ")
    )]
    Ambiguous {
        /// The requested conditions and quantities.
        wanted: String,
        /// The models that fit.
        fit: Vec<String>,
    },
}

fn list(known: &[String]) -> String {
    match known {
        [] => "there is no model at all".to_owned(),
        some => format!("there are: {}", some.join("; ")),
    }
}

impl fmt::Display for ModelQuery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { material, nozzle_mm, temperature_c, tolerance_c, .. } = self;
        write!(f, "{material}, nozzle {nozzle_mm} mm, {temperature_c} ± {tolerance_c} °C")?;
        match (self.input, self.output) {
            (None, None) => Ok(()),
            (Some(input), None) => write!(f, ", from {input}"),
            (None, Some(output)) => write!(f, ", to {output}"),
            (Some(input), Some(output)) => write!(f, ", {input} to {output}"),
        }
    }
}

impl fmt::Display for ModelEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ModelFile { conditions, input, output, .. } = &self.model;
        write!(f, "{} ({}", self.name, conditions.material.as_deref().unwrap_or("no material"))?;
        for (value, unit) in [(conditions.nozzle_mm, "mm"), (conditions.temperature_c, "°C")] {
            if let Some(value) = value {
                write!(f, ", {value} {unit}")?;
            }
        }
        write!(f, ", {} to {})", input.unit, output.unit)
    }
}

impl Library {
    /// From models in any order.
    pub fn new(mut entries: Vec<ModelEntry>) -> Self {
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Self { entries }
    }

    /// All models.
    pub fn entries(&self) -> &[ModelEntry] {
        &self.entries
    }

    /// The model for the same conditions and quantities, which [`Library::find`] could not
    /// distinguish from this one.
    pub fn same(&self, model: &ModelFile) -> Option<&ModelEntry> {
        let (setting, mut entries) = (&model.conditions, self.entries.iter());
        let material = setting.material.as_ref()?;
        let (nozzle_mm, temperature_c) = (setting.nozzle_mm?, setting.temperature_c?);
        entries.find(|entry| {
            let other = &entry.model.conditions;
            let near = |value: Option<f64>, of: f64, by| value.is_some_and(|v| (v - of).abs() < by);
            other.material.as_ref().is_some_and(|name| same_name(name, material))
                && near(other.nozzle_mm, nozzle_mm, SAME_NOZZLE_MM)
                && near(other.temperature_c, temperature_c, SAME_TEMPERATURE_C)
                && entry.model.input.unit == model.input.unit
                && entry.model.output.unit == model.output.unit
        })
    }

    /// The model of this material and nozzle with the nearest temperature within the tolerance.
    /// Models without all three conditions are ignored.
    pub fn find(&self, query: &ModelQuery) -> Result<ModelMatch<'_>, LibraryError> {
        let off = |entry: &ModelEntry| {
            let setting = &entry.model.conditions;
            let same = setting.material.as_ref().is_some_and(|m| same_name(m, &query.material))
                && setting.nozzle_mm.is_some_and(|d| (d - query.nozzle_mm).abs() < SAME_NOZZLE_MM)
                && query.input.is_none_or(|unit| unit == entry.model.input.unit)
                && query.output.is_none_or(|unit| unit == entry.model.output.unit);
            let off_c = setting.temperature_c? - query.temperature_c;
            (same && off_c.abs() <= query.tolerance_c).then_some(off_c)
        };
        let matches = |entry| Some(ModelMatch { entry, temperature_difference_c: off(entry)? });
        let near: Vec<ModelMatch<'_>> = self.entries.iter().filter_map(matches).collect();
        let distance_c = |found: &ModelMatch<'_>| found.temperature_difference_c.abs();
        let least_c = near.iter().map(distance_c).fold(f64::INFINITY, f64::min);
        let is_nearest = |found: &&ModelMatch<'_>| distance_c(found) < least_c + SAME_TEMPERATURE_C;
        let nearest: Vec<&ModelMatch<'_>> = near.iter().filter(is_nearest).collect();
        let names = |entries: &mut dyn Iterator<Item = &ModelEntry>| {
            entries.map(ModelEntry::to_string).collect()
        };
        match nearest[..] {
            [only] => Ok(*only),
            [] => {
                let known = names(&mut self.entries.iter());
                Err(LibraryError::Absent { wanted: query.to_string(), known })
            }
            _ => {
                let fit = names(&mut nearest.iter().map(|found| found.entry));
                Err(LibraryError::Ambiguous { wanted: query.to_string(), fit })
            }
        }
    }
}

/// File name of a model in a library by its conditions, such as
/// `pla-0.4mm-210c-rpm-to-mm3_per_s.toml`; `None` without material, nozzle or temperature.
pub fn file_name(model: &ModelFile) -> Option<String> {
    let setting = &model.conditions;
    let material = setting.material.as_ref()?.trim().to_lowercase();
    let plain = |c: char| if c.is_alphanumeric() { c } else { '-' };
    let material: String = material.chars().map(plain).collect();
    let (nozzle_mm, temperature_c) = (setting.nozzle_mm?, setting.temperature_c?);
    let (input, output) = (model.input.unit.word(), model.output.unit.word());
    Some(format!("{material}-{nozzle_mm}mm-{temperature_c}c-{input}-to-{output}.toml"))
}

fn same_name(a: &str, b: &str) -> bool {
    a.trim().to_lowercase() == b.trim().to_lowercase()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::core::Quantity;
    use crate::identify::model_file::Conditions;
    use crate::numeric::lti::TransferFunction;

    fn entry(
        name: &str,
        material: &str,
        nozzle_mm: f64,
        temperature_c: f64,
        output: Unit,
    ) -> ModelEntry {
        let setting = Conditions {
            material: Some(material.to_owned()),
            nozzle_mm: Some(nozzle_mm),
            temperature_c: Some(temperature_c),
        };
        let model = ModelFile {
            conditions: setting,
            kind: "fopdt".to_owned(),
            input: Quantity { name: "screw".to_owned(), unit: Unit::Rpm },
            output: Quantity { name: "out".to_owned(), unit: output },
            input_range: (0.0, 1.0),
            operating_point: (0.0, 0.0),
            transfer: TransferFunction::new(&[1.0], &[1.0, 1.0], 0.1).unwrap(),
            uncertainty: None,
            fit: None,
        };
        ModelEntry { name: name.to_owned(), model }
    }

    fn library() -> Library {
        Library::new(vec![
            entry("pla-210.toml", "PLA", 0.4, 210.0, Unit::Mm3PerS),
            entry("pla-200.toml", "PLA", 0.4, 200.0, Unit::Mm3PerS),
            entry("pla-wide.toml", "PLA", 0.6, 205.0, Unit::Mm3PerS),
            entry("pla-pressure.toml", "PLA", 0.4, 203.0, Unit::MPa),
            entry("petg.toml", "PETG", 0.4, 240.0, Unit::Mm3PerS),
        ])
    }

    fn wanted(material: &str, temperature_c: f64) -> ModelQuery {
        ModelQuery {
            material: material.to_owned(),
            nozzle_mm: 0.4,
            temperature_c,
            tolerance_c: TOLERANCE_C,
            input: Some(Unit::Rpm),
            output: Some(Unit::Mm3PerS),
        }
    }

    #[test]
    fn the_nearest_temperature_of_the_same_material_and_nozzle_is_meant() {
        let library = library();
        let found = library.find(&wanted("pla", 204.0)).unwrap();
        assert_eq!(
            (found.entry.name.as_str(), found.temperature_difference_c),
            ("pla-200.toml", -4.0)
        );
        assert_eq!(library.find(&wanted("PLA ", 214.0)).unwrap().entry.name, "pla-210.toml");
        let any = ModelQuery { output: None, ..wanted("PLA", 204.0) };
        assert_eq!(library.find(&any).unwrap().entry.name, "pla-pressure.toml");
    }

    #[test]
    fn absence_says_what_is_there() {
        let said = library().find(&wanted("PLA", 220.0)).unwrap_err().to_string();
        assert!(
            said.starts_with("no model for PLA, nozzle 0.4 mm, 220 ± 5 °C, rpm to mm³/s"),
            "{said}"
        );
        assert!(said.contains("petg.toml (PETG, 0.4 mm, 240 °C, rpm to mm³/s); pla-200"), "{said}");
        let none = Library::default().find(&wanted("PLA", 220.0)).unwrap_err().to_string();
        assert!(none.ends_with("there is no model at all"), "{none}");
    }

    #[test]
    fn a_model_is_kept_under_what_it_holds_for() {
        let model = |material, nozzle| entry("", material, nozzle, 210.0, Unit::Mm3PerS).model;
        let name = file_name(&model("PLA+/grey ", 0.4)).unwrap();
        assert_eq!(name, "pla--grey-0.4mm-210c-rpm-to-mm3_per_s.toml");
        assert_eq!(library().same(&model("pla", 0.4)).unwrap().name, "pla-210.toml");
        assert_eq!(library().same(&model("PLA", 0.8)), None);
        let nothing = ModelFile { conditions: Conditions::default(), ..model("PLA", 0.4) };
        assert!(file_name(&nothing).is_none() && library().same(&nothing).is_none());
    }

    #[test]
    fn two_that_fit_equally_well_are_both_named() {
        let said = library().find(&wanted("PLA", 205.0)).unwrap_err().to_string();
        assert!(said.starts_with("2 models for PLA"), "{said}");
        assert!(said.contains("pla-200.toml") && said.contains("pla-210.toml"), "{said}");
        assert!(!said.contains("pla-wide"), "{said}");
    }
}
