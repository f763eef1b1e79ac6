//! The index at the end of a finished file.

use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;

use ::mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

/// Largest size of a record in an index \[bytes\].
const MAX_INDEX_RECORD_BYTES: usize = 1 << 26;

/// Number of messages of a topic; `None` if the file has no statistics of it.
pub fn messages_of(path: &Path, topic: &str) -> Option<u64> {
    let mut file = File::open(path).ok()?;
    let options = SummaryReaderOptions::default()
        .with_file_size(file.metadata().ok()?.len())
        .with_record_length_limit(MAX_INDEX_RECORD_BYTES);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            SummaryReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted)).ok()?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to).ok()?),
        }
    }
    let summary = reader.finish()?;
    let counts = summary.stats?.channel_message_counts;
    let channels = summary.channels.values().filter(|channel| channel.topic == topic);
    Some(channels.filter_map(|channel| counts.get(&channel.id)).sum())
}
