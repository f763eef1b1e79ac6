//! Messages with the topic that each belongs to.

use std::collections::HashMap;
use std::io::{self, Read, Seek};
use std::sync::Arc;

use ::mcap::records::{Metadata, Record};

use super::stream::{Integrity, RecordStream};

/// What an MCAP says of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// How messages are encoded, such as `protobuf`.
    pub encoding: String,
    /// Name of their schema; empty for none.
    pub schema: String,
}

/// One message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Its topic.
    pub topic: Arc<Topic>,
    /// Number that the writer gave it.
    pub sequence: u32,
    /// When it was recorded \[ns since 1970, as a rule\].
    pub log_time_ns: u64,
    /// Its content.
    pub data: Vec<u8>,
}

/// What a data section holds.
#[derive(Debug)]
pub enum Item {
    /// A message.
    Message(Message),
    /// A file that is attached.
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
    /// Begins a file; `Ok(None)` where it does not begin as MCAP does.
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

    /// The topics that have been described so far, by name.
    pub fn topics(&self) -> Vec<Arc<Topic>> {
        let mut topics: Vec<_> = self.topics.values().map(Arc::clone).collect();
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        topics
    }

    /// What was wrong as far as the file has been read.
    pub fn integrity(&self) -> &Integrity {
        self.stream.integrity()
    }
}
