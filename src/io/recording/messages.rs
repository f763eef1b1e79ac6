//! Messages with their topics.

use std::collections::HashMap;
use std::io::{self, Read, Seek};
use std::sync::Arc;

use ::mcap::records::{Metadata, Record};

use super::stream::{Integrity, RecordStream};

/// Description of a topic in an MCAP file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// Encoding of the messages, such as `protobuf`.
    pub encoding: String,
    /// Name of their schema; empty for none.
    pub schema: String,
}

/// One message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Its topic.
    pub topic: Arc<Topic>,
    /// Sequence number of the writer.
    pub sequence: u32,
    /// Time of recording \[usually ns since 1970\].
    pub log_time_ns: u64,
    /// Its content.
    pub data: Vec<u8>,
}

/// An item of the data section.
#[derive(Debug)]
pub enum Item {
    /// A message.
    Message(Message),
    /// An attached file.
    Attachment {
        /// Its name.
        name: String,
        /// Its content.
        data: Vec<u8>,
    },
    /// Key-value pairs.
    Metadata(Metadata),
}

/// Reads messages in the order of the file.
pub struct Messages<R> {
    stream: RecordStream<R>,
    schemas: HashMap<u16, String>,
    topics: HashMap<u16, Arc<Topic>>,
}

impl<R: Read + Seek> Messages<R> {
    /// Begins a file; `Ok(None)` if it does not begin with the MCAP magic bytes.
    pub fn new(source: R) -> io::Result<Option<Self>> {
        let stream = RecordStream::new(source)?;
        Ok(stream.map(|stream| Self { stream, schemas: HashMap::new(), topics: HashMap::new() }))
    }

    /// The next item, `None` at the end.
    pub fn next_item(&mut self) -> io::Result<Option<Item>> {
        while let Some(record) = self.stream.next_record()? {
            match record {
                Record::Schema { header, .. } => {
                    self.schemas.insert(header.id, header.name);
                }
                Record::Channel(channel) => {
                    let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                    let topic =
                        Topic { name: channel.topic, encoding: channel.message_encoding, schema };
                    self.topics.insert(channel.id, Arc::new(topic));
                }
                Record::Message { header, data } => {
                    let Some(topic) = self.topics.get(&header.channel_id) else {
                        self.stream.integrity_mut().note(format!(
                            "message {} is of channel {}, which is not described",
                            header.sequence, header.channel_id
                        ));
                        continue;
                    };
                    return Ok(Some(Item::Message(Message {
                        topic: Arc::clone(topic),
                        sequence: header.sequence,
                        log_time_ns: header.log_time,
                        data: data.into_owned(),
                    })));
                }
                Record::Attachment { header, data, .. } => {
                    let (name, data) = (header.name, data.into_owned());
                    return Ok(Some(Item::Attachment { name, data }));
                }
                Record::Metadata(metadata) => return Ok(Some(Item::Metadata(metadata))),
                _ => {}
            }
        }
        Ok(None)
    }

    /// The topics that were described so far, by name.
    pub fn topics(&self) -> Vec<Arc<Topic>> {
        let mut topics: Vec<_> = self.topics.values().map(Arc::clone).collect();
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        topics
    }

    /// Missing or damaged parts, as far as the file has been read.
    pub fn integrity(&self) -> &Integrity {
        self.stream.integrity()
    }
}
