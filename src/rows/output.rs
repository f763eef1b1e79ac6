//! Files in the output folder: complete under their final name, or absent.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::io::atomic_file;

/// Why an output cannot be written, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// A file has the output folder's name.
    #[error("{}: this is a file, but a folder is needed here; name another with --out", path.display())]
    NotAFolder {
        /// The requested folder.
        path: PathBuf,
    },
    /// The output folder cannot be created.
    #[error("{}: cannot make this folder ({})", path.display(), advice(source))]
    Folder {
        /// The requested folder.
        path: PathBuf,
        /// Error of the system.
        #[source]
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot write this file ({})", path.display(), advice(source))]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        #[source]
        source: io::Error,
    },
}

fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space, or name a folder on another disk with --out"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "name a folder that you may write to with --out"
        }
        io::ErrorKind::IsADirectory => "there is a folder of this name; move it away",
        io::ErrorKind::NotADirectory => "a part of this path is a file; name another with --out",
        _ => "look at the folder and its disk, or name another with --out",
    }
}

/// Creates the output folder if it does not exist.
pub fn make_folder(folder: &Path) -> Result<(), LogError> {
    if folder.exists() && !folder.is_dir() {
        return Err(LogError::NotAFolder { path: folder.to_path_buf() });
    }
    fs::create_dir_all(folder)
        .map_err(|source| LogError::Folder { path: folder.to_path_buf(), source })
}

/// A file that is written as `NAME.partial` and gets its name when it is complete.
#[derive(Debug)]
pub struct Partial {
    file: File,
    growing: PathBuf,
    path: PathBuf,
}

impl Partial {
    /// Begins a file in a folder; an old partial file of the same name is overwritten.
    pub fn create(folder: &Path, name: &str) -> Result<Self, LogError> {
        let growing = folder.join(format!("{name}.partial"));
        let file = File::create(&growing)
            .map_err(|source| LogError::Write { path: growing.clone(), source })?;
        Ok(Self { file, growing, path: folder.join(name) })
    }

    /// Gives the file its final name.
    pub fn finish(self) -> Result<PathBuf, LogError> {
        let growing = self.growing;
        self.file.sync_all().map_err(|source| LogError::Write { path: growing.clone(), source })?;
        match fs::rename(&growing, &self.path) {
            Ok(()) => Ok(self.path),
            Err(source) => Err(LogError::Write { path: self.path, source }),
        }
    }
}

impl Write for Partial {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A table that is written as `NAME.partial` and gets its name when it is complete.
#[derive(Debug)]
pub struct PartialTable {
    csv: csv::Writer<Partial>,
    path: PathBuf,
}

impl PartialTable {
    /// Begins the table in an existing folder, with its header.
    pub fn create(
        folder: &Path,
        name: &str,
        head: impl IntoIterator<Item: AsRef<[u8]>>,
    ) -> Result<Self, LogError> {
        let partial = Partial::create(folder, name)?;
        let path = partial.growing.clone();
        let mut table = Self { csv: csv::Writer::from_writer(partial), path };
        table.row(head)?;
        Ok(table)
    }

    /// Adds a row.
    pub fn row(&mut self, row: impl IntoIterator<Item: AsRef<[u8]>>) -> Result<(), LogError> {
        self.csv.write_record(row).map_err(|error| self.error(error.into()))
    }

    /// Passes all rows to the operating system.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.csv.flush().map_err(|error| self.error(error))
    }

    /// Gives the file its final name; returns its path.
    pub fn finish(mut self) -> Result<PathBuf, LogError> {
        self.flush()?;
        let path = self.path;
        let partial = self
            .csv
            .into_inner()
            .map_err(|error| LogError::Write { path, source: error.into_error() })?;
        partial.finish()
    }

    fn error(&self, source: io::Error) -> LogError {
        LogError::Write { path: self.path.clone(), source }
    }
}

/// Writes a file whose content is complete. After a failure no partial file is left.
pub fn write_whole(folder: &Path, name: &str, content: &[u8]) -> Result<PathBuf, LogError> {
    let path = folder.join(name);
    atomic_file::write_atomic(&path, content)
        .map_err(|error| LogError::Write { path: error.path, source: error.what })?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_a_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        fs::write(&path, "x").unwrap();
        let error = make_folder(&path).unwrap_err();
        assert!(matches!(error, LogError::NotAFolder { .. }));
        assert!(error.to_string().contains("out: this is a file"), "{error}");
        let below = make_folder(&path.join("deeper")).unwrap_err();
        assert!(below.to_string().contains("deeper"), "{below}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "x");
    }

    #[test]
    fn a_name_that_is_taken_by_a_folder_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("summary.json")).unwrap();
        let error = write_whole(folder.path(), "summary.json", b"{}").unwrap_err();
        assert!(error.to_string().contains("summary.json: cannot write"), "{error}");
        assert!(!folder.path().join("summary.json.partial").exists());
    }

    #[test]
    fn a_full_disk_is_answered_with_advice() {
        let source = io::Error::from(io::ErrorKind::StorageFull);
        let error = LogError::Write { path: "a/b.csv".into(), source };
        assert_eq!(
            error.to_string(),
            "a/b.csv: cannot write this file \
             (free some space, or name a folder on another disk with --out)"
        );
    }

    #[test]
    fn the_final_name_appears_with_the_whole_content() {
        let folder = tempfile::tempdir().unwrap();
        let mut partial = Partial::create(folder.path(), "a.txt").unwrap();
        partial.write_all(b"half").unwrap();
        assert!(!folder.path().join("a.txt").exists());
        assert_eq!(fs::read(folder.path().join("a.txt.partial")).unwrap(), b"half");
        let path = partial.finish().unwrap();
        assert_eq!(fs::read(path).unwrap(), b"half");
        assert!(!folder.path().join("a.txt.partial").exists());
    }
}
