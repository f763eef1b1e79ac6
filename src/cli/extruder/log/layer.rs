//! Where a bead was measured, and how high its layer is.

use clap::Args;

use crate::cli::arguments::WrongArguments;
use crate::core::Mm;

/// Accepted lengths \[mm\].
const LENGTHS_MM: std::ops::RangeInclusive<f64> = 0.0..=1e5;

/// What a recording's cell says of its bead, unless it is given.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct LayerArgs {
    /// From the nozzle back to the measurement [mm] [default: the cell's]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub measured_at_offset_mm: Option<f64>,
    /// Height of a layer [mm] [default for a recording: its cell's]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub layer_height_mm: Option<f64>,
}

impl LayerArgs {
    /// The given height of a layer.
    pub fn layer_height(&self) -> Result<Option<Mm>, WrongArguments> {
        let Some(height) = self.layer_height_mm else { return Ok(None) };
        let taken = Mm::new(height).ok().filter(|_| height > 0.0 && LENGTHS_MM.contains(&height));
        taken
            .map(Some)
            .ok_or_else(|| wrong!("--layer-height-mm {height}: expected above 0 to 1e5 mm"))
    }

    /// The given offset \[mm\].
    pub fn offset(&self) -> Result<Option<f64>, WrongArguments> {
        match self.measured_at_offset_mm {
            Some(offset) if !LENGTHS_MM.contains(&offset) => {
                Err(wrong!("--measured-at-offset-mm {offset}: expected 0 to 1e5 mm"))
            }
            given => Ok(given),
        }
    }
}
