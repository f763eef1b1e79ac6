//! The records of one chunk: all of them, or the reason why it is damaged.

use std::collections::VecDeque;

use ::mcap::records::{Record, op};
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// Largest size of a chunk \[bytes\]; a larger value is a damaged length.
const MAX_CHUNK_BYTES: usize = 1 << 28;
/// Shortest attachment (MCAP specification, § Attachment): two times, two empty strings, a length
/// and a CRC: 8 + 8 + 4 + 4 + 8 + 4.
const MIN_ATTACHMENT_BYTES: usize = 36;

/// A record that owns its data.
pub type OwnedRecord = Record<'static>;

/// Decompresses a chunk and checks its CRC; only then returns its records.
pub fn records(body: &[u8], out: &mut VecDeque<OwnedRecord>) -> Result<(), String> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MAX_CHUNK_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let mut head = vec![op::CHUNK];
    head.extend((body.len() as u64).to_le_bytes());
    let (mut head, mut rest) = (head.as_slice(), body);
    let mut found = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| error.to_string())? {
            LinearReadEvent::ReadRequest(wanted) => {
                let part = if head.is_empty() { &mut rest } else { &mut head };
                let (now, later) = part.split_at(wanted.min(part.len()));
                for (to, from) in reader.insert(now.len()).iter_mut().zip(now) {
                    *to = *from;
                }
                reader.notify_read(now.len());
                *part = later;
            }
            LinearReadEvent::Record { opcode, data } => found.push(parse(opcode, data)?),
        }
    }
    out.extend(found);
    Ok(())
}

/// Reads one record and copies its data.
pub fn parse(opcode: u8, body: &[u8]) -> Result<OwnedRecord, String> {
    if opcode == op::ATTACHMENT && !attachment_fits(body) {
        return Err(format!("an attachment that does not fit its {} bytes", body.len()));
    }
    let record = ::mcap::parse_record(opcode, body).map_err(|error| error.to_string())?;
    Ok(record.into_owned())
}

/// Whether an attachment's lengths leave room for its CRC; the parser does not check it.
fn attachment_fits(body: &[u8]) -> bool {
    let text_len = |at: usize| {
        let bytes = body.get(at..at.checked_add(4)?)?.try_into().ok()?;
        usize::try_from(u32::from_le_bytes(bytes)).ok()
    };
    let head = || {
        let name = text_len(16)?;
        let media_type = text_len(name.checked_add(20)?)?;
        name.checked_add(media_type)?.checked_add(MIN_ATTACHMENT_BYTES)
    };
    head().is_some_and(|needed| needed <= body.len())
}
