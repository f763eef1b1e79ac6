//! Writes events, steps and frames as MCAP into memory. The output always ends with a complete
//! record, so that a failed write can be repeated.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::write::NoSeek;
use ::mcap::{Attachment, Compression, McapError, WriteOptions, Writer};

use super::encode::EncodedFrame;
use super::format::{
    EVENT_SCHEMA, EVENT_TOPIC, EventMessage, IMAGE_TOPIC, PROFILE_ATTACHMENT, RUN_METADATA,
    RunInfo, STEP_SCHEMA, STEP_TOPIC, StepMessage,
};
use super::report::Counts;
use super::state::AnsweredEvent;
use crate::core::Stamp;
use crate::io::foxglove;

/// Size of a chunk before compression \[bytes\]; the flush period usually ends a chunk earlier.
const CHUNK_BYTES: u64 = 1 << 20;

/// Why a record could not be made. Memory does not fail; a value may have no JSON form.
#[derive(Debug, thiserror::Error)]
pub enum MuxError {
    /// The MCAP writer refused.
    #[error("MCAP: {0}")]
    Mcap(#[from] McapError),
    /// A value has no JSON form.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Bytes that the MCAP writer has written.
#[derive(Debug, Clone, Default)]
struct SharedBuffer(Arc<Mutex<Vec<u8>>>);

impl SharedBuffer {
    fn bytes(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn len(&self) -> usize {
        self.bytes().len()
    }
}

impl Write for SharedBuffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[derive(Debug, Clone, Copy)]
struct Channels {
    event: u16,
    step: u16,
    image: u16,
}

/// The MCAP writer and its channels.
pub struct Mux {
    writer: Writer<NoSeek<SharedBuffer>>,
    buffer: SharedBuffer,
    channels: Channels,
    epoch_ns: u64,
    counts: Counts,
    complete: Counts,
}

impl Mux {
    /// Writes the beginning of a recording: run, attached texts by name (cell, calibration, files
    /// of the extruder), channels. The channels have a small chunk of their own, so that later
    /// damage does not make messages unreadable.
    pub fn new(run: &RunInfo, attachments: &[(&str, &str)]) -> Result<Self, MuxError> {
        let buffer = SharedBuffer::default();
        let mut writer = WriteOptions::new()
            .library(concat!("truebead ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .create(NoSeek::new(buffer.clone()))?;
        writer.write_metadata(&Metadata {
            name: RUN_METADATA.to_string(),
            metadata: run.to_metadata(),
        })?;
        for (name, text) in attachments {
            let table = *name == PROFILE_ATTACHMENT;
            writer.attach(&Attachment {
                log_time: run.epoch_ns,
                create_time: run.epoch_ns,
                name: (*name).to_string(),
                media_type: if table { "text/csv" } else { "application/toml" }.to_string(),
                data: Cow::Borrowed(text.as_bytes()),
            })?;
        }
        let channels = add_channels(&mut writer)?;
        writer.flush()?;
        Ok(Self {
            writer,
            buffer,
            channels,
            epoch_ns: run.epoch_ns,
            counts: Counts::default(),
            complete: Counts::default(),
        })
    }

    /// Adds an event and the controller's step in response.
    pub fn answered(&mut self, item: &AnsweredEvent) -> Result<(), MuxError> {
        let (n, now_ns) = (item.n, item.now.ns());
        let event = serde_json::to_vec(&EventMessage { n, now_ns, event: &item.event })?;
        let state = item.step.state.name();
        let step = serde_json::to_vec(&StepMessage { n, now_ns, state, step: &item.step })?;
        self.message(self.channels.event, n, item.now, &event)?;
        self.counts.events += 1;
        self.message(self.channels.step, n, item.now, &step)?;
        self.counts.steps += 1;
        Ok(())
    }

    /// Adds a frame.
    pub fn frame(&mut self, frame: &EncodedFrame) -> Result<(), MuxError> {
        self.message(self.channels.image, frame.seq, frame.captured_at, &frame.message)?;
        self.counts.frames += 1;
        Ok(())
    }

    /// Ends the chunk, so that [`Self::take`] returns all data so far.
    pub fn flush(&mut self) -> Result<(), MuxError> {
        self.writer.flush()?;
        self.complete = self.counts;
        Ok(())
    }

    /// Ends the recording with its index.
    pub fn finish(&mut self) -> Result<(), MuxError> {
        self.writer.finish()?;
        self.complete = self.counts;
        Ok(())
    }

    /// Appends the written bytes to `bytes`; they end with a complete record.
    pub fn take(&mut self, bytes: &mut Vec<u8>) {
        bytes.append(&mut self.buffer.bytes());
    }

    /// Numbers of events, steps and frames in the completed chunks.
    pub fn complete(&self) -> Counts {
        self.complete
    }

    #[expect(clippy::cast_possible_truncation, reason = "MCAP counts messages modulo 2^32")]
    fn message(
        &mut self,
        channel: u16,
        number: u64,
        at: Stamp,
        data: &[u8],
    ) -> Result<(), MuxError> {
        let wall_ns = self.epoch_ns.saturating_add(at.ns());
        let header = MessageHeader {
            channel_id: channel,
            sequence: number as u32,
            log_time: wall_ns,
            publish_time: wall_ns,
        };
        let before = self.buffer.len();
        self.writer.write_to_known_channel(&header, data)?;
        if self.buffer.len() > before {
            // The chunk was full and ended just before this message.
            self.complete = self.counts;
        }
        Ok(())
    }
}

fn add_channels(writer: &mut Writer<NoSeek<SharedBuffer>>) -> Result<Channels, McapError> {
    let none = BTreeMap::new();
    let event = writer.add_schema("truebead.Event", "jsonschema", EVENT_SCHEMA.as_bytes())?;
    let step = writer.add_schema("truebead.Step", "jsonschema", STEP_SCHEMA.as_bytes())?;
    let image = writer.add_schema(
        foxglove::COMPRESSED_IMAGE,
        "protobuf",
        &foxglove::compressed_image_schema(),
    )?;
    Ok(Channels {
        event: writer.add_channel(event, EVENT_TOPIC, "json", &none)?,
        step: writer.add_channel(step, STEP_TOPIC, "json", &none)?,
        image: writer.add_channel(image, IMAGE_TOPIC, "protobuf", &none)?,
    })
}
