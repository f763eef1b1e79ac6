//! Conditions for which a model is valid.

use clap::Args;

use crate::cli::arguments::WrongArguments;
use crate::identify::model_file::Conditions;

/// Material, nozzle and temperature.
#[derive(Debug, Args)]
pub struct SettingArgs {
    /// Material that the model holds for
    #[arg(long)]
    pub material: Option<String>,
    /// Diameter of the nozzle that it holds for [mm]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub nozzle_mm: Option<f64>,
    /// Temperature of the material that it holds for [°C]
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    pub temperature_c: Option<f64>,
}

impl SettingArgs {
    /// The conditions of the model.
    pub fn setting(&self) -> Result<Conditions, WrongArguments> {
        let given = [
            ("--nozzle-mm", self.nozzle_mm, 0.01..=1e3, "0.01 to 1000 mm"),
            ("--temperature-c", self.temperature_c, -100.0..=2000.0, "-100 to 2000 °C"),
        ];
        for (name, value, range, expected) in given {
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                refuse!("{name} {value}: expected {expected}");
            }
        }
        if self.material.as_ref().is_some_and(|name| name.trim().is_empty()) {
            refuse!("--material: expected a name");
        }
        Ok(Conditions {
            material: self.material.clone(),
            nozzle_mm: self.nozzle_mm,
            temperature_c: self.temperature_c,
        })
    }
}
