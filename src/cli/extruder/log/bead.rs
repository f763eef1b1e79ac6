//! Options for an output that was measured on the bead behind the nozzle: the time of its
//! extrusion, and its flow.

use anyhow::{Context, Result, anyhow};
use clap::Args;

use super::layer::LayerArgs;
use super::rows::TableColumns;
use crate::cli::arguments::WrongArguments;
use crate::core::{Mm, Unit};
use crate::extruder::demand::section;
use crate::identify::align::{AlignError, to_extruded};
use crate::identify::flow::at_moments;

/// Name of the computed column of the flow, as in a recording.
pub const LAID_FLOW: &str = "laid_flow_mm3_per_s";
/// What was measured on the bead.
#[derive(Debug, Args)]
pub struct BeadArgs {
    #[command(flatten)]
    pub layer: LayerArgs,
    /// Column of the path length [mm], for --measured-at-offset-mm
    #[arg(long, value_name = "COLUMN", requires = "measured_at_offset_mm")]
    pub position: Option<String>,
    /// Column of the bead's area [mm²]; output is area times speed
    #[arg(long, value_name = "COLUMN", requires = "speed", conflicts_with_all = ["output", "width"])]
    pub area: Option<String>,
    /// Column of its width [mm], in place of the area
    #[arg(
        long,
        value_name = "COLUMN",
        requires = "speed",
        requires = "layer_height_mm",
        conflicts_with = "output"
    )]
    pub width: Option<String>,
    /// Column of the speed that laid the bead [mm/s]
    #[arg(long, value_name = "COLUMN")]
    pub speed: Option<String>,
}

impl BeadArgs {
    /// Whether the output is a flow that is computed from other columns.
    pub const fn makes_flow(&self) -> bool {
        self.area.is_some() || self.width.is_some()
    }

    /// Refuses options that do not apply to a recording.
    pub fn refuse_columns(&self) -> Result<(), WrongArguments> {
        let given = [
            ("--position", &self.position),
            ("--area", &self.area),
            ("--width", &self.width),
            ("--speed", &self.speed),
        ];
        match given.iter().find(|(_, column)| column.is_some()) {
            Some((option, _)) => Err(wrong!(
                "{option} is for tables: a recording has the flow of its bead already, brought to \
                 when it was laid, as --output {LAID_FLOW}"
            )),
            None => Ok(()),
        }
    }

    /// The output of a table: the column of this name, or a flow that is computed from others. One
    /// value for each row from the first on; the last rows have none if their bead was not
    /// measured yet.
    pub fn output(&self, rows: &TableColumns<'_>, output: Option<&str>) -> Result<Vec<f64>> {
        if self.position.is_none() && self.layer.measured_at_offset_mm.is_some_and(|mm| mm > 0.0) {
            refuse!("--measured-at-offset-mm needs --position, the way along the bead");
        }
        let measured = match (&self.area, &self.width) {
            (Some(area), _) => rows.in_unit(area, Unit::Mm2)?,
            (None, Some(width)) => self.areas(rows, width)?,
            (None, None) => rows.column(output.unwrap_or_default())?,
        };
        let extruded = match &self.position {
            Some(position) => self.aligned(rows, &measured, position)?,
            None => measured,
        };
        match self.speed.as_ref().filter(|_| self.makes_flow()) {
            Some(speed) => {
                let speed_mm_per_s = rows.in_unit(speed, Unit::MmPerS)?;
                Ok(at_moments(&speed_mm_per_s, &extruded))
            }
            None => Ok(extruded),
        }
    }

    /// The measured values at the times of extrusion.
    fn aligned(
        &self,
        rows: &TableColumns<'_>,
        measured: &[f64],
        position: &str,
    ) -> Result<Vec<f64>> {
        let path = rows.in_unit(position, Unit::Mm)?;
        let offset = self.layer.offset()?.unwrap_or(0.0);
        let found = to_extruded(&path, measured, offset).map_err(|error| match error {
            AlignError::Falls { at, .. } | AlignError::NotFinite { at, .. } => {
                let line = rows.table.line(at.saturating_sub(1));
                anyhow!(error).context(format!("{}, line {line}, column {position}", rows.name))
            }
            other => anyhow!(other).context(rows.name.to_owned()),
        })?;
        let found: Vec<f64> = found.into_iter().map_while(|value| value).collect();
        if found.is_empty() {
            let went = path.last().copied().unwrap_or(0.0) - path.first().copied().unwrap_or(0.0);
            return Err(anyhow!(
                "{}: nothing of the bead comes to where it is measured: {position} goes on by \
                 {went} mm, and --measured-at-offset-mm is {offset}",
                rows.name
            ));
        }
        Ok(found)
    }

    /// Areas of a bead with round sides.
    fn areas(&self, rows: &TableColumns<'_>, width: &str) -> Result<Vec<f64>> {
        let height = self.layer.layer_height()?.unwrap_or_default();
        let area = |(row, width_mm): (usize, &f64)| -> Result<f64> {
            let position =
                || format!("{}, line {}, column {width}", rows.name, rows.table.line(row));
            let bead = Mm::new(*width_mm).with_context(position)?;
            Ok(section(bead, height).with_context(position)?.get())
        };
        rows.in_unit(width, Unit::Mm)?.iter().enumerate().map(area).collect()
    }
}
