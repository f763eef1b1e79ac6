//! Reads recordings: finished or interrupted, of this program or another. A recording is read from
//! beginning to end, one chunk at a time, so that large files need no more memory than small ones.

mod chunk;
pub mod index;
pub mod messages;
pub mod stream;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::Path;

use messages::{Item, Message, Messages, Topic};
pub use stream::Integrity;

use super::recorder::format::{
    CALIBRATION_ATTACHMENT, CELL_ATTACHMENT, EVENT_TOPIC, EventMessage, FORMAT_VERSION,
    IMAGE_TOPIC, RUN_METADATA, RunInfo, STEP_TOPIC, StepMessage,
};
use crate::control::{Event, Step};
use crate::core::Stamp;

/// Size of the read buffer \[bytes\]: several pages, for fewer system calls.
const BUFFER_BYTES: usize = 1 << 16;

/// Why a recording cannot be read, or cannot be read further.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// It cannot be opened or read.
    #[error("{file}: {what}")]
    Io {
        /// The file.
        file: String,
        /// Error of the system.
        what: io::Error,
    },
    /// The file is not an MCAP file.
    #[error(
        "{file}: not an MCAP file (it does not begin with the MCAP magic bytes); expected a \
         recording such as recording.mcap"
    )]
    NotMcap {
        /// The file.
        file: String,
    },
    /// A later version of the program wrote it.
    #[error(
        "{file}: written by truebead {program} in format {found}; this version reads up to format \
         {known}, use truebead {program} or later"
    )]
    Newer {
        /// The file.
        file: String,
        /// Version of the program that wrote it.
        program: String,
        /// Format of the file.
        found: u32,
        /// Latest known format.
        known: u32,
    },
    /// The metadata about its run is incomplete.
    #[error("{file}: the metadata record \"run\" has no valid {key}")]
    BadRun {
        /// The file.
        file: String,
        /// The key that is missing or wrong.
        key: &'static str,
    },
    /// A message has not the form of its topic.
    #[error("{file}: message {sequence} of {topic}: {what}")]
    BadMessage {
        /// The file.
        file: String,
        /// The topic.
        topic: String,
        /// Number of the message.
        sequence: u32,
        /// Error in the message.
        what: String,
    },
}

/// An entry of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordedEntry {
    /// An event.
    Event {
        /// Number of the event in the run, from 0.
        n: u64,
        /// Time at which the controller handled it.
        now: Stamp,
        /// The event.
        event: Event,
    },
    /// The controller's step in response to an event.
    Step {
        /// Number of the event.
        n: u64,
        /// Time at which the controller handled the event.
        now: Stamp,
        /// The step.
        step: Box<Step>,
    },
    /// A frame, still encoded as `foxglove.CompressedImage`.
    Frame(Message),
}

trait ReadSeek: Read + Seek + Send {}
impl<T: Read + Seek + Send> ReadSeek for T {}

/// An open recording: an iterator over its entries. Messages of other programs are skipped.
pub struct Recording {
    file: String,
    messages: Messages<Box<dyn ReadSeek>>,
    first: Option<Message>,
    run: Option<RunInfo>,
    attachments: BTreeMap<String, Vec<u8>>,
}

impl Recording {
    /// Opens a file and reads up to its first message: the run and the attachments.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = path.display().to_string();
        let opened = File::open(path).and_then(|opened| {
            if opened.metadata()?.is_dir() {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
            }
            Ok(opened)
        });
        match opened {
            Ok(opened) => Self::read(BufReader::with_capacity(BUFFER_BYTES, opened), file),
            Err(what) => Err(RecordingError::Io { file, what }),
        }
    }

    /// As [`Self::open`], from any source; `file` is its name in messages.
    pub fn read(
        source: impl Read + Seek + Send + 'static,
        file: String,
    ) -> Result<Self, RecordingError> {
        let source: Box<dyn ReadSeek> = Box::new(source);
        let messages = match Messages::new(source) {
            Ok(Some(messages)) => messages,
            Ok(None) => return Err(RecordingError::NotMcap { file }),
            Err(what) => return Err(RecordingError::Io { file, what }),
        };
        let attachments = BTreeMap::new();
        let mut recording = Self { file, messages, first: None, run: None, attachments };
        recording.first = recording.next_message()?;
        Ok(recording)
    }

    /// Metadata about the run; `None` if another program wrote the recording.
    pub fn run(&self) -> Option<&RunInfo> {
        self.run.as_ref()
    }

    /// The cell file's text, if it is attached.
    pub fn cell(&self) -> Option<&str> {
        self.attachment(CELL_ATTACHMENT)
    }

    /// The calibration file's text, if it is attached.
    pub fn calibration(&self) -> Option<&str> {
        self.attachment(CALIBRATION_ATTACHMENT)
    }

    /// The text of the attachment with this name; `None` if there is none.
    pub fn attachment(&self, name: &str) -> Option<&str> {
        self.attachments.get(name).and_then(|data| std::str::from_utf8(data).ok())
    }

    /// Name of the file in messages.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The topics of the messages read so far, by name.
    pub fn topics(&self) -> Vec<std::sync::Arc<Topic>> {
        self.messages.topics()
    }

    /// Missing or damaged parts of the file, as far as it has been read; complete after the last
    /// entry.
    pub fn integrity(&self) -> &Integrity {
        self.messages.integrity()
    }

    /// The next message of any topic, `None` at the end.
    pub fn next_message(&mut self) -> Result<Option<Message>, RecordingError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        loop {
            let item = self.messages.next_item();
            match item.map_err(|what| RecordingError::Io { file: self.file.clone(), what })? {
                None => return Ok(None),
                Some(Item::Message(message)) => return Ok(Some(message)),
                Some(Item::Attachment { name, data }) => {
                    self.attachments.entry(name).or_insert(data);
                }
                Some(Item::Metadata(metadata)) if metadata.name == RUN_METADATA => {
                    self.take_run(&metadata.metadata)?;
                }
                Some(Item::Metadata(_)) => {}
            }
        }
    }

    fn take_run(&mut self, metadata: &BTreeMap<String, String>) -> Result<(), RecordingError> {
        let file = self.file.clone();
        let run = match RunInfo::from_metadata(metadata) {
            Ok(Some(run)) => run,
            Ok(None) => return Ok(()),
            Err(key) => return Err(RecordingError::BadRun { file, key }),
        };
        if run.format_version > FORMAT_VERSION {
            let (program, found) = (run.program_version, run.format_version);
            return Err(RecordingError::Newer { file, program, found, known: FORMAT_VERSION });
        }
        self.run = Some(run);
        Ok(())
    }

    /// Decodes a message; `None` for a message of another topic.
    pub fn entry(&self, message: Message) -> Result<Option<RecordedEntry>, RecordingError> {
        let bad = |error: serde_json::Error| RecordingError::BadMessage {
            file: self.file.clone(),
            topic: message.topic.name.clone(),
            sequence: message.sequence,
            what: error.to_string(),
        };
        Ok(match message.topic.name.as_str() {
            EVENT_TOPIC => {
                let EventMessage { n, now_ns, event } =
                    serde_json::from_slice(&message.data).map_err(bad)?;
                Some(RecordedEntry::Event { n, now: Stamp::from_ns(now_ns), event })
            }
            STEP_TOPIC => {
                let StepMessage { n, now_ns, step, .. } =
                    serde_json::from_slice(&message.data).map_err(bad)?;
                Some(RecordedEntry::Step { n, now: Stamp::from_ns(now_ns), step: Box::new(step) })
            }
            IMAGE_TOPIC => Some(RecordedEntry::Frame(message)),
            _ => None,
        })
    }
}

impl Iterator for Recording {
    type Item = Result<RecordedEntry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.next_message() {
                Ok(None) => return None,
                Err(error) => return Some(Err(error)),
                Ok(Some(message)) => match self.entry(message).transpose() {
                    None => {}
                    entry => return entry,
                },
            }
        }
    }
}
