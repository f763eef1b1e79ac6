//! Files that appear under their name only when they are complete.

use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// A file that could not be written; a file of its name has not changed.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {what}", path.display())]
pub struct WriteError {
    /// Its intended path.
    pub path: PathBuf,
    /// Error of the system. It is part of the message, and therefore not a source.
    pub what: io::Error,
}

/// Permissions of a new file: read and write for all, less the umask (IEEE 1003.1, ``creat()``).
const MODE: u32 = 0o666;

/// Writes a temporary file beside the final name and renames it when all bytes are on the disk. An
/// older file of this name is replaced.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    write_and_rename(path, bytes)
        .map_err(|error| WriteError { path: path.to_owned(), what: without_temporary_name(error) })
}

/// Removes the name of the temporary file from the error: the user does not know it.
fn without_temporary_name(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what),
        None => error,
    }
}

fn write_and_rename(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // The target of a link is replaced, not the link; a device is never replaced.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if target.exists() && !target.is_file() {
        return Err(io::Error::other("there is something of this name that is no file"));
    }
    let path = target.as_path();
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::Builder::new()
        .prefix(".truebead-")
        .permissions(Permissions::from_mode(MODE))
        .tempfile_in(folder)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_file_is_there_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calib.toml");
        write_atomic(&path, b"old").unwrap();
        write_atomic(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert_ne!(fs::metadata(&path).unwrap().permissions().mode() & 0o044, 0, "others may read");
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = write_atomic(Path::new("no/such/folder/x.toml"), b"").unwrap_err();
        let said = error.to_string();
        assert!(said.starts_with("cannot write no/such/folder/x.toml: No such file"), "{said}");
        assert!(!said.contains(".truebead-") && std::error::Error::source(&error).is_none());
    }
}
