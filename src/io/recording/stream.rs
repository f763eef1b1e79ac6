//! Reads MCAP records from a file that may be truncated or damaged anywhere. Readable records are
//! returned, other parts are noted.

use std::collections::VecDeque;
use std::io::{self, Read, Seek, SeekFrom};

use ::mcap::MAGIC;
use ::mcap::records::op;

use super::chunk::{self, OwnedRecord};

/// Largest size of a record \[bytes\]; a larger value is a damaged length.
const MAX_RECORD_BYTES: u64 = 1 << 30;
/// Bytes of opcode (1) and length (8) in front of every record (MCAP specification, § Records).
const HEAD_BYTES: u64 = 9;
/// Number of notes that are kept as text; further ones are only counted.
const MAX_NOTES: usize = 8;

/// Missing and damaged parts of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Integrity {
    /// Whether the file has its regular end.
    pub finished: bool,
    /// Position at which a file without its end breaks off \[bytes\].
    pub truncated_at: Option<u64>,
    /// Bytes after that position that are no complete record.
    pub lost_bytes: u64,
    /// Number of records and chunks before the end that were skipped as unreadable.
    pub damaged: u64,
    /// Text and position of the first few of them.
    pub notes: Vec<String>,
}

impl Integrity {
    /// A sentence about missing and damaged parts; `None` if there are none.
    pub fn summary(&self) -> Option<String> {
        let mut parts = Vec::new();
        if let Some(at) = self.truncated_at {
            parts.push(match self.lost_bytes {
                0 => format!("it was not finished and ends at byte {at}"),
                lost => format!(
                    "it was not finished: its last {lost} bytes, from byte {at} on, are not a \
                     whole record and are left out"
                ),
            });
        }
        if self.damaged > 0 {
            parts.push(format!(
                "{} damaged parts were skipped ({})",
                self.damaged,
                self.notes.join("; ")
            ));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }

    pub(super) fn note(&mut self, what: String) {
        self.damaged += 1;
        if self.notes.len() < MAX_NOTES {
            self.notes.push(what);
        }
    }
}

/// Records of a file in order; those of a chunk at the chunk's position.
pub struct RecordStream<R> {
    source: R,
    len: u64,
    at: u64,
    ended: bool,
    ready: VecDeque<OwnedRecord>,
    integrity: Integrity,
}

impl<R: Read + Seek> RecordStream<R> {
    /// Begins a file; `Ok(None)` if it does not begin with the MCAP magic bytes.
    pub fn new(mut source: R) -> io::Result<Option<Self>> {
        let len = source.seek(SeekFrom::End(0))?;
        source.seek(SeekFrom::Start(0))?;
        let mut magic = Vec::new();
        source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic)?;
        if magic != MAGIC {
            return Ok(None);
        }
        let at = magic.len() as u64;
        let ready = VecDeque::new();
        let integrity = Integrity::default();
        Ok(Some(Self { source, len, at, ended: false, ready, integrity }))
    }

    /// The next record of the data section, `None` at its end. Fails only if the file cannot be
    /// read; damage is reported in [`Self::integrity`].
    pub fn next_record(&mut self) -> io::Result<Option<OwnedRecord>> {
        loop {
            if let Some(record) = self.ready.pop_front() {
                return Ok(Some(record));
            }
            if self.ended {
                return Ok(None);
            }
            self.read_record()?;
        }
    }

    /// Missing or damaged parts, as far as the file has been read.
    pub fn integrity(&self) -> &Integrity {
        &self.integrity
    }

    /// For notes about damage in the content of records.
    pub fn integrity_mut(&mut self) -> &mut Integrity {
        &mut self.integrity
    }

    fn read_record(&mut self) -> io::Result<()> {
        let left = self.len.saturating_sub(self.at);
        let mut head = Vec::new();
        self.source.by_ref().take(HEAD_BYTES).read_to_end(&mut head)?;
        let Some((&opcode, length)) = head.split_first() else {
            self.truncate(left);
            return Ok(());
        };
        let Ok(length) = <[u8; 8]>::try_from(length).map(u64::from_le_bytes) else {
            self.truncate(left);
            return Ok(());
        };
        if opcode == 0 || length > left.saturating_sub(HEAD_BYTES) {
            self.truncate(left);
            return Ok(());
        }
        let start = self.at;
        self.at += HEAD_BYTES + length;
        if length > MAX_RECORD_BYTES {
            self.integrity.note(format!("a record of {length} bytes at byte {start}"));
            self.source.seek(SeekFrom::Start(self.at))?;
            return Ok(());
        }
        match opcode {
            op::DATA_END | op::FOOTER => {
                self.ended = true;
                self.integrity.finished = self.ends_with_magic()?;
                if !self.integrity.finished {
                    self.integrity.truncated_at = Some(self.len);
                }
            }
            op::MESSAGE_INDEX => {
                self.source.seek_relative(i64::try_from(length).unwrap_or(i64::MAX))?;
            }
            _ => {
                let mut body = Vec::new();
                self.source.by_ref().take(length).read_to_end(&mut body)?;
                self.take_record(opcode, &body, start);
            }
        }
        Ok(())
    }

    fn take_record(&mut self, opcode: u8, body: &[u8], start: u64) {
        let taken = if opcode == op::CHUNK {
            chunk::records(body, &mut self.ready)
        } else {
            chunk::parse(opcode, body).map(|record| self.ready.push_back(record))
        };
        if let Err(what) = taken {
            let kind = if opcode == op::CHUNK { "chunk" } else { "record" };
            self.integrity.note(format!("{kind} at byte {start}: {what}"));
        }
    }

    /// Whether the file ends with the magic bytes. The summary before them repeats known data and
    /// is not read.
    fn ends_with_magic(&mut self) -> io::Result<bool> {
        let magic_at = self.len.saturating_sub(MAGIC.len() as u64);
        if magic_at < self.at {
            return Ok(false);
        }
        self.source.seek(SeekFrom::Start(magic_at))?;
        let mut tail = Vec::new();
        self.source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut tail)?;
        Ok(tail == MAGIC)
    }

    fn truncate(&mut self, lost: u64) {
        self.ended = true;
        self.integrity.truncated_at = Some(self.at);
        self.integrity.lost_bytes = lost;
    }
}
