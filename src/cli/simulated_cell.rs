//! Extruder and recorder of a simulated cell.

use std::path::PathBuf;

use super::print::warn;
use crate::assembly::LoadedCell;
use crate::cell::file::KeepFrames;
use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::io::recorder::{self, RecordConfig, RecorderHandle};
use crate::run::ports::{RecordError, Recorder};
use crate::sim::cell::CommandedExtruder;

/// The extruder side of a simulated cell; prints its warnings.
pub fn simulated_extruder(loaded: &LoadedCell) -> anyhow::Result<Option<CommandedExtruder>> {
    let side = loaded.simulated_extruder()?;
    if let Some(side) = &side {
        warn(&side.warnings);
    }
    Ok(side.map(|side| side.extruder))
}

/// Records the simulation if a folder is given.
pub struct SimRecorder(Option<RecorderHandle>);

impl SimRecorder {
    /// Begins the recording.
    pub fn of(folder: Option<&PathBuf>, loaded: &LoadedCell) -> anyhow::Result<Self> {
        let Some(folder) = folder else { return Ok(Self(None)) };
        let config = RecordConfig {
            frames: KeepFrames::None,
            is_live: false,
            epoch_ns: 0,
            cell_name: loaded.path.display().to_string(),
            cell_text: loaded.text.clone(),
            calibration_text: loaded.calibration_text.clone(),
            extruder_files: loaded.extruder()?.map_or_else(Vec::new, |side| side.files),
        };
        let (recorder, _) = recorder::start(&config, folder)?;
        Ok(Self(Some(recorder.waiting())))
    }

    /// Gives the recording its final name.
    pub fn finish(self) -> anyhow::Result<()> {
        if let Some(recorder) = self.0 {
            recorder.finish()?;
        }
        Ok(())
    }
}

impl Recorder for SimRecorder {
    fn record(&mut self, now: Stamp, event: &Event, step: &Step) -> Result<(), RecordError> {
        self.0.as_mut().map_or(Ok(()), |recorder| recorder.record(now, event, step))
    }
}
