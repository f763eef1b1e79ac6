//! A folder of images as a source of frames.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::{check_rate, fault, offline_stamp, seconds_at};
use crate::core::Channel;
use crate::io::image_file;
use crate::run::ports::{FrameSource, Grab, SourceError};

/// Name of the file with the frames' times.
const TIMES: &str = "times.csv";

/// The images of a folder in natural order (`2.png` before `10.png`).
#[derive(Debug)]
pub struct Folder {
    files: Vec<PathBuf>,
    channel: Channel,
    times_s: Times,
    first_s: f64,
    next: usize,
}

#[derive(Debug)]
enum Times {
    Table(BTreeMap<u64, f64>),
    Rate(f64),
    Unknown,
}

impl Times {
    fn of(&self, seq: u64) -> Option<f64> {
        match self {
            Self::Table(table) => table.get(&seq).copied(),
            Self::Rate(rate_hz) => Some(seconds_at(seq, *rate_hz)),
            Self::Unknown => None,
        }
    }
}

impl Folder {
    /// Opens a folder. Times are those in its `times.csv` (`frame,time_s`; frames by number from
    /// 0, or by file name), otherwise they follow from `fps`; without both there are none. Fails
    /// if the folder is missing or has no images, or if `times.csv` cannot be read.
    pub fn open(path: &Path, channel: Channel, fps: Option<f64>) -> Result<Self, SourceError> {
        let name = path.display().to_string();
        check_rate(&name, fps)?;
        let files = list_images(path)?;
        let table = path.join(TIMES);
        let times_s = if table.exists() {
            Times::Table(read_times(&table, &files)?)
        } else {
            fps.map_or(Times::Unknown, Times::Rate)
        };
        let first_s = match &times_s {
            Times::Table(table) => table.values().next().copied().unwrap_or(0.0),
            _ => 0.0,
        };
        Ok(Self { files, channel, times_s, first_s, next: 0 })
    }
}

impl FrameSource for Folder {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        let Some(path) = self.files.get(self.next) else { return Ok(None) };
        let seq = self.next as u64;
        self.next += 1;
        let time_s = self.times_s.of(seq);
        let captured_at = offline_stamp(seq, time_s, self.first_s);
        Ok(Some(match image_file::read(path, self.channel, seq, captured_at) {
            Ok(frame) => Grab::Frame { frame, time_s },
            Err(error) => Grab::Unreadable { seq, time_s, reason: error.to_string() },
        }))
    }

    fn expected_frames(&self) -> Option<u64> {
        Some(self.files.len() as u64)
    }
}

/// The image files of a folder in natural order; other files and folders are ignored. Fails if the
/// folder cannot be read or has no image.
pub fn list_images(folder: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let name = folder.display().to_string();
    let entries = fs::read_dir(folder).map_err(|error| fault(&name, error.to_string()))?;
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(|error| fault(&name, error.to_string()))?.path();
        if image_file::has_image_extension(&path) && !path.is_dir() {
            files.push(path);
        }
    }
    if files.is_empty() {
        let endings = image_file::EXTENSIONS.join(", ");
        return Err(fault(&name, format!("no image in this folder (looked for {endings})")));
    }
    let key = |path: &PathBuf| path.file_name().map(|n| n.to_string_lossy().into_owned());
    files.sort_by(|a, b| {
        let (a, b) = (key(a).unwrap_or_default(), key(b).unwrap_or_default());
        natord::compare(&a, &b).then_with(|| a.cmp(&b))
    });
    Ok(files)
}

fn read_times(path: &Path, files: &[PathBuf]) -> Result<BTreeMap<u64, f64>, SourceError> {
    let name = path.display().to_string();
    let open = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path);
    let mut reader = open.map_err(|error| fault(&name, error.to_string()))?;
    let headers = reader.headers().map_err(|error| fault(&name, error.to_string()))?.clone();
    let column = |wanted: &str| {
        headers
            .iter()
            .position(|header| header.trim_start_matches('\u{feff}') == wanted)
            .ok_or_else(|| {
                let found = headers.iter().collect::<Vec<_>>().join(",");
                fault(
                    &name,
                    format!("line 1: found \"{found}\", expected the columns frame,time_s"),
                )
            })
    };
    let (frame, time) = (column("frame")?, column("time_s")?);
    let mut times = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(|error| fault(&name, error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |index: usize| record.get(index).unwrap_or_default();
        let seq = frame_number(cell(frame), files).ok_or_else(|| {
            let found = cell(frame);
            fault(&name, format!("line {line}: frame \"{found}\" is neither a number from 0 nor an image of this folder"))
        })?;
        let seconds = cell(time).parse().ok().filter(|t: &f64| t.is_finite()).ok_or_else(|| {
            fault(
                &name,
                format!("line {line}: time_s \"{}\" is not a finite number of seconds", cell(time)),
            )
        })?;
        if times.insert(seq, seconds).is_some() {
            return Err(fault(
                &name,
                format!("line {line}: frame {} has a time already", cell(frame)),
            ));
        }
    }
    Ok(times)
}

fn frame_number(text: &str, files: &[PathBuf]) -> Option<u64> {
    text.parse().ok().or_else(|| {
        let named = |path: &PathBuf| path.file_name().is_some_and(|name| name == text);
        files.iter().position(named).map(|index| index as u64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Frame, Pixels, Size, Stamp};

    fn folder_of(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (i, name) in names.iter().enumerate() {
            let values = vec![u8::try_from(i).unwrap(); 6];
            let frame =
                Frame::new(0, Stamp::START, Size::new(3, 2), Pixels::Grey8(values)).unwrap();
            fs::write(folder.path().join(name), image_file::encode_png(&frame).unwrap()).unwrap();
        }
        folder
    }

    fn all(mut source: Folder) -> Vec<Grab> {
        std::iter::from_fn(|| source.next_frame().unwrap()).collect()
    }

    fn times(grabs: &[Grab]) -> Vec<Option<f64>> {
        let time = |grab: &Grab| match grab {
            Grab::Frame { time_s, .. } | Grab::Unreadable { time_s, .. } => *time_s,
            Grab::Waiting { .. } => None,
        };
        grabs.iter().map(time).collect()
    }

    #[test]
    fn frames_come_in_natural_order_and_other_files_are_ignored() {
        let folder = folder_of(&["f10.png", "f2.PNG", "f1.png"]);
        fs::write(folder.path().join("notes.txt"), "no image").unwrap();
        fs::create_dir(folder.path().join("more.png")).unwrap();
        let source = Folder::open(folder.path(), Channel::Grey, None).unwrap();
        assert_eq!(source.expected_frames(), Some(3));
        let grabs = all(source);
        let first_pixels: Vec<u8> = grabs
            .iter()
            .map(|grab| match grab {
                Grab::Frame { frame, time_s: None } => frame.to_grey8()[0],
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(first_pixels, [2, 1, 0]);
    }

    #[test]
    fn a_file_that_cannot_be_read_is_a_row_and_not_the_end() {
        let folder = folder_of(&["1.png", "3.png"]);
        let whole = fs::read(folder.path().join("1.png")).unwrap();
        fs::write(folder.path().join("2.png"), &whole[..40]).unwrap();
        fs::write(folder.path().join("4.jpg"), "").unwrap();
        let grabs = all(Folder::open(folder.path(), Channel::Grey, Some(50.0)).unwrap());
        assert_eq!(times(&grabs), [Some(0.0), Some(0.02), Some(0.04), Some(0.06)]);
        assert!(
            matches!(&grabs[1], Grab::Unreadable { seq: 1, reason, .. } if reason.contains("2.png"))
        );
        assert!(matches!(&grabs[2], Grab::Frame { frame, .. } if frame.seq == 2));
        assert!(
            matches!(&grabs[3], Grab::Unreadable { reason, .. } if reason.ends_with("it is empty"))
        );
    }

    #[test]
    fn times_come_from_the_table_before_the_rate() {
        let folder = folder_of(&["a.png", "b.png", "c.png"]);
        fs::write(folder.path().join(TIMES), "frame,time_s\n0,10.5\nc.png, 10.75\n").unwrap();
        let grabs = all(Folder::open(folder.path(), Channel::Grey, Some(50.0)).unwrap());
        assert_eq!(times(&grabs), [Some(10.5), None, Some(10.75)]);
        let Grab::Frame { frame, .. } = &grabs[2] else { panic!() };
        assert_eq!(frame.captured_at, Stamp::from_secs(0.25), "the run starts at the first frame");
    }

    #[test]
    fn bad_times_are_named_with_their_line() {
        let said = |text: &str| {
            let folder = folder_of(&["a.png"]);
            fs::write(folder.path().join(TIMES), text).unwrap();
            Folder::open(folder.path(), Channel::Grey, None).unwrap_err().to_string()
        };
        assert!(said("frame,t\n0,1\n").contains("line 1: found \"frame,t\""));
        assert!(said("frame,time_s\n0,1\n1,nan\n").contains("line 3: time_s \"nan\""));
        assert!(said("frame,time_s\n0,1\n0,2\n").contains("line 3: frame 0 has a time already"));
        assert!(said("frame,time_s\nz.png,1\n").contains("line 2: frame \"z.png\""));
    }

    #[test]
    fn a_folder_without_images_or_without_being_there_says_so() {
        let empty = tempfile::tempdir().unwrap();
        let said = |path: &Path| Folder::open(path, Channel::Grey, None).unwrap_err().to_string();
        assert!(said(empty.path()).contains("no image in this folder"));
        assert!(said(&empty.path().join("gone")).contains("No such file"));
        assert!(Folder::open(empty.path(), Channel::Grey, Some(0.0)).is_err());
    }
}
