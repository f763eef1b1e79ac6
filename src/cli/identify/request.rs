//! What was asked for, and the data with that.

use std::path::Path;

use anyhow::{Context, Result};

use super::bead::LAID_FLOW;
use super::{DEAD_TIME_S, DEAD_TIME_SHARE, IdentifyArgs, VALIDATE_SHARE, data};
use crate::cli::arguments::WrongArguments;
use crate::core::quantity::Quantity;
use crate::identify::experiment::Experiment;
use crate::identify::file::Setting;
use crate::identify::fit::{DeadTime, Settings, Structure};
use crate::report::identify::Logs;

/// Refuses one column that is named twice.
pub fn refuse_same(input: &str, output: &str) -> Result<(), WrongArguments> {
    if input != output {
        return Ok(());
    }
    Err(WrongArguments::new(format!(
        "--input and --output are both {input}: a model tells the one from the other; name what the \
         extruder is told, and what comes of it"
    )))
}

fn validates_with_itself(other: &Path) -> anyhow::Error {
    let what = format!(
        "--validate {}: these are the data that the model is fitted to, and a model foretells those \
         whatever it is worth; name another log, or leave --validate out: the last part of the data \
         is kept for it then",
        other.display()
    );
    WrongArguments::new(what).into()
}

impl IdentifyArgs {
    /// What the model holds for.
    pub fn setting(&self) -> Result<Setting, WrongArguments> {
        let told = [
            ("--nozzle-mm", self.nozzle_mm, 0.01..=1e3, "0.01 to 1000 mm"),
            ("--temperature-c", self.temperature_c, -100.0..=2000.0, "-100 to 2000 °C"),
        ];
        for (name, value, range, expected) in told {
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                return Err(WrongArguments::new(format!("{name} {value}: expected {expected}")));
            }
        }
        if self.material.as_ref().is_some_and(|name| name.trim().is_empty()) {
            return Err(WrongArguments::new("--material: expected a name"));
        }
        Ok(Setting {
            material: self.material.clone(),
            nozzle_mm: self.nozzle_mm,
            temperature_c: self.temperature_c,
        })
    }

    /// The output's name where it is made of other columns.
    fn made(&self) -> Option<&'static str> {
        self.bead.makes_flow().then_some(LAID_FLOW)
    }

    /// Whether no column is named.
    pub fn asks_for_columns(&self) -> bool {
        self.columns.input.is_none() && self.columns.output.is_none() && self.made().is_none()
    }

    /// The data, and what is odd about their units.
    pub fn logs(&self) -> Result<(Logs, Vec<String>)> {
        let output = self.columns.output.as_deref().or(self.made());
        let (Some(path), Some(input), Some(output)) = (&self.data, &self.columns.input, output)
        else {
            let what = "needs both --input and --output (or --area or --width with --speed); \
                        without either it lists the columns";
            return Err(WrongArguments::new(what).into());
        };
        refuse_same(input, output)?;
        let filters = data::Filters { hampel: self.hampel, smooth: self.smooth };
        let request = data::Request { columns: &self.columns, bead: &self.bead, filters };
        let read = |path| data::read(path, &request);
        let (log, mut doubts) = read(path)?;
        let source = path.display().to_string();
        let share = self.validate_share.unwrap_or(VALIDATE_SHARE);
        if !(0.0..=0.9).contains(&share) {
            let what = format!("--validate-share {share}: expected 0 to 0.9");
            return Err(WrongArguments::new(what).into());
        }
        let (estimation, validation) = match &self.validate {
            Some(other) => {
                let (rest, more) = read(other)?;
                if (&rest.input, &rest.output) == (&log.input, &log.output) {
                    return Err(validates_with_itself(other));
                }
                doubts.extend(
                    more.into_iter().filter(|doubt| !doubts.contains(doubt)).collect::<Vec<_>>(),
                );
                (log, Some((rest, other.display().to_string())))
            }
            None if share > 0.0 => {
                let (first, rest) = log.split(share).with_context(|| source.clone())?;
                (first, Some((rest, source.clone())))
            }
            None => (log, None),
        };
        let quantity =
            |column: &str| -> Result<Quantity, WrongArguments> { self.columns.quantity(column) };
        let (input, output) = (quantity(input)?, quantity(output)?);
        let from_rest = self.from_rest;
        Ok((Logs { input, output, source, estimation, validation, from_rest }, doubts))
    }

    /// The forms that are fitted.
    pub fn forms(&self, data: &Experiment) -> Vec<Settings> {
        let most_s = (DEAD_TIME_SHARE * data.duration_s()).min(DEAD_TIME_S);
        let dead_time = self.dead_time_s.0.unwrap_or(DeadTime::Estimated { least_s: 0.0, most_s });
        let mut forms: Vec<Structure> = Vec::new();
        for form in self.model.iter().flat_map(|forms| &forms.0) {
            if !forms.contains(form) {
                forms.push(*form);
            }
        }
        forms.into_iter().map(|form| Settings::new(form, dead_time)).collect()
    }
}
