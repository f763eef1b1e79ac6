//! Options for an output that was measured on the bead, some way behind the
//! nozzle: when it was extruded, and the flow that laid it.

use anyhow::{Context, Result, anyhow};
use clap::Args;

use super::data::Rows;
use crate::cli::arguments::WrongArguments;
use crate::core::quantity::Unit;
use crate::core::units::Mm;
use crate::extruder::demand::section;
use crate::identify::align::{AlignError, to_extruded};
use crate::identify::flow::at_moments;

/// The column that a flow gets that is made of others, as in a recording.
pub const LAID_FLOW: &str = "laid_flow_mm3_per_s";
/// Lengths that are taken \[mm\].
const LENGTHS_MM: std::ops::RangeInclusive<f64> = 0.0..=1e5;

/// What was measured on the bead.
#[derive(Debug, Args)]
pub struct Bead {
    /// Column of the way along the bead [mm]; the output was measured
    /// --measured-at-offset-mm behind the nozzle and is brought to when it was extruded
    #[arg(long, value_name = "COLUMN", requires = "measured_at_offset_mm")]
    pub position: Option<String>,
    /// Way from the nozzle back to where the bead is measured [mm]
    /// [default for a recording: what its cell says]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub measured_at_offset_mm: Option<f64>,
    /// Column of the bead's area [mm²]: the output is the flow, area times speed
    #[arg(long, value_name = "COLUMN", requires = "speed", conflicts_with_all = ["output", "width"])]
    pub area: Option<String>,
    /// Column of the bead's width [mm]: the output is the flow, the area of a bead so wide
    /// and --layer-height-mm high times speed
    #[arg(
        long,
        value_name = "COLUMN",
        requires = "speed",
        requires = "layer_height_mm",
        conflicts_with = "output"
    )]
    pub width: Option<String>,
    /// Column of the speed at which the bead was laid [mm/s]
    #[arg(long, value_name = "COLUMN")]
    pub speed: Option<String>,
    /// Height of a layer [mm]
    /// [default for a recording: what its cell says]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub layer_height_mm: Option<f64>,
}

impl Bead {
    /// Whether the output is a flow that is made of other columns.
    pub const fn makes_flow(&self) -> bool {
        self.area.is_some() || self.width.is_some()
    }

    /// Height of a layer as it was told.
    pub fn layer_height(&self) -> Result<Option<Mm>, WrongArguments> {
        let Some(height) = self.layer_height_mm else { return Ok(None) };
        let taken = Mm::new(height).ok().filter(|_| height > 0.0 && LENGTHS_MM.contains(&height));
        taken.map(Some).ok_or_else(|| {
            WrongArguments::new(format!("--layer-height-mm {height}: expected above 0 to 1e5 mm"))
        })
    }

    /// The offset as it was told \[mm\].
    pub fn offset(&self) -> Result<Option<f64>, WrongArguments> {
        match self.measured_at_offset_mm {
            Some(offset) if !LENGTHS_MM.contains(&offset) => Err(WrongArguments::new(format!(
                "--measured-at-offset-mm {offset}: expected 0 to 1e5 mm"
            ))),
            told => Ok(told),
        }
    }

    /// Refuses options that a recording has no use for.
    pub fn refuse_columns(&self) -> Result<(), WrongArguments> {
        let told = [
            ("--position", &self.position),
            ("--area", &self.area),
            ("--width", &self.width),
            ("--speed", &self.speed),
        ];
        match told.iter().find(|(_, column)| column.is_some()) {
            Some((option, _)) => Err(WrongArguments::new(format!(
                "{option} is for tables: a recording has the flow of its bead already, brought to \
                 when it was laid, as --output {LAID_FLOW}"
            ))),
            None => Ok(()),
        }
    }

    /// The output of a table, one value a row from its beginning; fewer where
    /// the bead has not come to its measurement when the table ends.
    pub fn output(&self, rows: &Rows<'_>) -> Result<Vec<f64>> {
        if self.position.is_none() && self.measured_at_offset_mm.is_some_and(|mm| mm > 0.0) {
            let what = "--measured-at-offset-mm needs --position, the way along the bead";
            return Err(WrongArguments::new(what).into());
        }
        let measured = match (&self.area, &self.width) {
            (Some(area), _) => rows.in_unit(area, Unit::Mm2)?,
            (None, Some(width)) => self.areas(rows, width)?,
            (None, None) => rows.column(rows.columns.output.as_deref().unwrap_or_default())?,
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

    /// What was measured, at the moments of extrusion.
    fn aligned(&self, rows: &Rows<'_>, measured: &[f64], position: &str) -> Result<Vec<f64>> {
        let way = rows.in_unit(position, Unit::Mm)?;
        let offset = self.offset()?.unwrap_or(0.0);
        let found = to_extruded(&way, measured, offset).map_err(|error| match error {
            AlignError::Falls { at, .. } | AlignError::NotFinite { at, .. } => {
                let line = rows.table.line(at.saturating_sub(1));
                anyhow!(error).context(format!("{}, line {line}, column {position}", rows.name))
            }
            other => anyhow!(other).context(rows.name.to_owned()),
        })?;
        let found: Vec<f64> = found.into_iter().map_while(|value| value).collect();
        if found.is_empty() {
            let went = way.last().copied().unwrap_or(0.0) - way.first().copied().unwrap_or(0.0);
            return Err(anyhow!(
                "{}: nothing of the bead comes to where it is measured: {position} goes on by \
                 {went} mm, and --measured-at-offset-mm is {offset}",
                rows.name
            ));
        }
        Ok(found)
    }

    /// Areas of a bead with round sides.
    fn areas(&self, rows: &Rows<'_>, width: &str) -> Result<Vec<f64>> {
        let height = self.layer_height()?.unwrap_or_default();
        let area = |(row, width_mm): (usize, &f64)| -> Result<f64> {
            let place = || format!("{}, line {}, column {width}", rows.name, rows.table.line(row));
            let bead = Mm::new(*width_mm).with_context(place)?;
            Ok(section(bead, height).with_context(place)?.get())
        };
        rows.in_unit(width, Unit::Mm)?.iter().enumerate().map(area).collect()
    }
}
