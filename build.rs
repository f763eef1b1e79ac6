//! Tells builds from different sources apart: sets `TRUEBEAD_SOURCES` to a hash of all files of
//! `src`, so that a recording names the program that made it.

use std::path::{Path, PathBuf};
use std::{fs, io};

/// FNV-1a, 64 bit: offset basis and prime of Fowler, Noll and Vo 1991.
const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0100_0000_01b3;

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=src");
    let mut files = Vec::new();
    collect(Path::new("src"), &mut files)?;
    files.sort();
    let mut hash = OFFSET_BASIS;
    for file in files {
        for byte in fs::read(file)? {
            hash = (hash ^ u64::from(byte)).wrapping_mul(PRIME);
        }
    }
    println!("cargo::rustc-env=TRUEBEAD_SOURCES={:08x}", hash >> 32);
    Ok(())
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { collect(&path, files)? } else { files.push(path) }
    }
    Ok(())
}
