//! Where a recording's bytes go, and how it gets its final name.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::format::{FILE_NAME, PARTIAL_NAME};
use crate::run::ports::RecordError;

/// A file that grows at its end.
pub trait Sink: Write + Send {
    /// Takes away what lies beyond `len` bytes, after a write that failed
    /// half-way.
    fn cut(&mut self, len: u64) -> io::Result<()>;

    /// Makes the file safe on the disk and gives it its final name.
    fn publish(&mut self) -> io::Result<()>;

    /// Where the recording is now.
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
    /// Begins a recording in `folder`, which is made if it is missing. A
    /// recording that is there already is never touched, be it finished or cut
    /// short: that is an error.
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
        // The name itself is safe once the folder is; not every file system
        // can say so, and the recording is whole either way.
        if let Some(folder) = self.finished.parent().and_then(|folder| File::open(folder).ok()) {
            folder.sync_all().unwrap_or_default();
        }
        Ok(())
    }

    fn path(&self) -> &Path {
        if self.published { &self.finished } else { &self.partial }
    }
}

/// Hands bytes to a sink so that after a failure the sink still ends with a
/// whole record, and the same bytes can be tried again.
pub struct RetryingWriter<S> {
    sink: S,
    waiting: Vec<u8>,
    written: u64,
    cut_pending: bool,
}

impl<S: Sink> RetryingWriter<S> {
    /// Over an empty sink.
    pub fn new(sink: S) -> Self {
        Self { sink, waiting: Vec::new(), written: 0, cut_pending: false }
    }

    /// Bytes that are still to be written. Whoever adds to them ends with a
    /// whole record.
    pub fn waiting(&mut self) -> &mut Vec<u8> {
        &mut self.waiting
    }

    /// Writes all that waits, or nothing of it.
    pub fn push(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        self.cut_partial()?;
        if let Err(error) = self.sink.write_all(&self.waiting).and_then(|()| self.sink.flush()) {
            self.cut_pending = true;
            // A cut that fails too is tried again at the next push.
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

    /// Bytes in the sink that count.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// The sink itself.
    pub fn sink(&mut self) -> &mut S {
        &mut self.sink
    }
}
