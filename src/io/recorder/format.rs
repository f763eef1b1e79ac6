//! The layout of a recording, common to the recorder and the reader: topics, schemas, metadata and
//! attachments.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of this layout; a reader refuses a newer one. By definition 1 is the first.
pub const FORMAT_VERSION: u32 = 1;

/// Version of the program with a hash of its sources: only the same program gives the same steps bit
/// for bit.
pub const PROGRAM_VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("TRUEBEAD_SOURCES"));

/// Events, as JSON.
pub const EVENT_TOPIC: &str = "/truebead/event";
/// Steps, as JSON.
pub const STEP_TOPIC: &str = "/truebead/step";
/// Frames, as protobuf `foxglove.CompressedImage`.
pub const IMAGE_TOPIC: &str = "/camera/image";
/// Metadata record about the run.
pub const RUN_METADATA: &str = "run";
/// Attachment that holds the cell file.
pub const CELL_ATTACHMENT: &str = "cell.toml";
/// Attachment that holds the calibration file.
pub const CALIBRATION_ATTACHMENT: &str = "calibration.toml";
/// Attachment with the extruder's model of the cell.
pub const MODEL_ATTACHMENT: &str = "extruder-model.toml";
/// Attachment with the profile of commands of the cell.
pub const PROFILE_ATTACHMENT: &str = "extruder-profile.csv";
/// Attachment with the start-stop model of the cell's extruder.
pub const STARTS_ATTACHMENT: &str = "extruder-starts.toml";
/// Attachment with the planned job of the cell.
pub const PLAN_ATTACHMENT: &str = "plan.csv";
/// Name of a finished recording.
pub const FILE_NAME: &str = "recording.mcap";
/// Name of a recording that is being written or was interrupted.
pub const PARTIAL_NAME: &str = "recording.mcap.partial";

/// JSON schema of [`EVENT_TOPIC`].
pub const EVENT_SCHEMA: &str = include_str!("event.schema.json");
/// JSON schema of [`STEP_TOPIC`].
pub const STEP_SCHEMA: &str = include_str!("step.schema.json");

/// A message on [`EVENT_TOPIC`]: written with `&Event`, read with [`Event`](crate::control::Event).
#[derive(Debug, Serialize, Deserialize)]
pub struct EventMessage<E> {
    /// Number of the event in the run, from 0.
    pub n: u64,
    /// Time at which the controller handled the event \[ns since the start of the run\].
    pub now_ns: u64,
    /// The event.
    pub event: E,
}

/// A message on [`STEP_TOPIC`]: written with `&Step`, read with [`Step`](crate::control::Step).
#[derive(Debug, Serialize, Deserialize)]
pub struct StepMessage<S> {
    /// Number of the event to which this step responds.
    pub n: u64,
    /// Time at which the controller handled the event \[ns since the start of the run\].
    pub now_ns: u64,
    /// Name of the state after the step, for viewers; not read back.
    #[serde(skip_deserializing)]
    pub state: &'static str,
    /// The step.
    pub step: S,
}

/// Metadata of a recording about its run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunInfo {
    /// Version of the recording's layout.
    pub format_version: u32,
    /// Version of the program that recorded it.
    pub program_version: String,
    /// Whether frames were measured live, and not by `simulate`.
    pub is_live: bool,
    /// Wall-clock time at stamp 0 \[ns since 1970\].
    pub epoch_ns: u64,
    /// Path of the cell file in the command.
    pub cell_name: String,
}

impl RunInfo {
    /// The metadata record [`RUN_METADATA`].
    pub fn to_metadata(&self) -> BTreeMap<String, String> {
        [
            ("format_version", self.format_version.to_string()),
            ("program", "truebead".to_string()),
            ("program_version", self.program_version.clone()),
            ("live", self.is_live.to_string()),
            ("epoch_ns", self.epoch_ns.to_string()),
            ("cell_file", self.cell_name.clone()),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_string(), value))
        .collect()
    }

    /// Reads the metadata record; `Ok(None)` if another program wrote it. Fails with the name of a
    /// missing or invalid key.
    pub fn from_metadata(map: &BTreeMap<String, String>) -> Result<Option<Self>, &'static str> {
        if map.get("program").map(String::as_str) != Some("truebead") {
            return Ok(None);
        }
        let text = |key| map.get(key).cloned().ok_or(key);
        Ok(Some(Self {
            format_version: text("format_version")?.parse().map_err(|_| "format_version")?,
            program_version: text("program_version")?,
            // A recording of before has no such key; what it says of its cell held for both.
            is_live: map.get("live").is_some_and(|live| live == "true"),
            epoch_ns: text("epoch_ns")?.parse().map_err(|_| "epoch_ns")?,
            cell_name: text("cell_file")?,
        }))
    }
}
