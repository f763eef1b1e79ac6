//! The output of a recording's bytes, and its final name.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::format::{FILE_NAME, PARTIAL_NAME};
use crate::run::ports::RecordError;

/// A file that grows at its end.
pub trait Sink: Write + Send {
    /// Removes the bytes beyond `len`, after a write that failed halfway.
    fn cut(&mut self, len: u64) -> io::Result<()>;

    /// Syncs the file to the disk and gives it its final name.
    fn publish(&mut self) -> io::Result<()>;

    /// Current path of the recording.
    fn path(&self) -> &Path;
}

/// A recording in a folder.
#[derive(Debug)]
pub struct FileSink {
    file: File,
    partial: PathBuf,
    finished: PathBuf,
    published: bool,
}

impl FileSink {
    /// Begins a recording in `folder`, which is created if it does not exist. Fails if there
    /// already is a recording, finished or partial; it is not changed.
    pub fn create(folder: &Path) -> Result<Self, RecordError> {
        fs::create_dir_all(folder).map_err(|error| {
            RecordError(format!("cannot make the folder {}: {error}", folder.display()))
        })?;
        let (partial, finished) = (folder.join(PARTIAL_NAME), folder.join(FILE_NAME));
        if finished.exists() {
            return Err(taken(&finished, "a recording"));
        }
        let file =
            OpenOptions::new().append(true).create_new(true).open(&partial).map_err(|error| {
                match error.kind() {
                    io::ErrorKind::AlreadyExists => {
                        taken(&partial, "a recording that is being written or was cut short")
                    }
                    _ => RecordError(format!("cannot make {}: {error}", partial.display())),
                }
            })?;
        Ok(Self { file, partial, finished, published: false })
    }
}

fn taken(path: &Path, what: &str) -> RecordError {
    RecordError(format!(
        "{} is {what}, and is not overwritten; name another folder, or move the file away",
        path.display()
    ))
}

impl Write for FileSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Sink for FileSink {
    fn cut(&mut self, len: u64) -> io::Result<()> {
        self.file.set_len(len)
    }

    fn publish(&mut self) -> io::Result<()> {
        self.file.sync_all()?;
        if self.finished.exists() {
            return Err(io::Error::new(
                io::ErrorKind::AlreadyExists,
                format!("{} has appeared meanwhile", self.finished.display()),
            ));
        }
        fs::rename(&self.partial, &self.finished)?;
        self.published = true;
        // The new name is safe on the disk after the folder is synced. Not every file system can
        // do that; the recording is complete in any case.
        if let Some(folder) = self.finished.parent().and_then(|folder| File::open(folder).ok()) {
            folder.sync_all().unwrap_or_default();
        }
        Ok(())
    }

    fn path(&self) -> &Path {
        if self.published { &self.finished } else { &self.partial }
    }
}

/// Writes bytes to a sink. After a failure the sink still ends with a complete record, and the
/// same bytes can be written again.
pub struct RetryingWriter<S> {
    sink: S,
    waiting: Vec<u8>,
    written: u64,
    cut_pending: bool,
}

impl<S: Sink> RetryingWriter<S> {
    /// A writer for an empty sink.
    pub fn new(sink: S) -> Self {
        Self { sink, waiting: Vec::new(), written: 0, cut_pending: false }
    }

    /// Bytes that are still to be written. Additions to them must end with a complete record.
    pub fn waiting(&mut self) -> &mut Vec<u8> {
        &mut self.waiting
    }

    /// Writes all waiting bytes, or none of them.
    pub fn push(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        self.cut_partial()?;
        if let Err(error) = self.sink.write_all(&self.waiting).and_then(|()| self.sink.flush()) {
            self.cut_pending = true;
            // If removing the partial bytes fails, too, it is tried again at the next push.
            self.cut_partial().unwrap_or_default();
            return Err(error);
        }
        self.written += self.waiting.len() as u64;
        self.waiting.clear();
        Ok(())
    }

    fn cut_partial(&mut self) -> io::Result<()> {
        if self.cut_pending {
            self.sink.cut(self.written)?;
            self.cut_pending = false;
        }
        Ok(())
    }

    /// Number of bytes that were completely written.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// The sink itself.
    pub fn sink(&mut self) -> &mut S {
        &mut self.sink
    }
}
