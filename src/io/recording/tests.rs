use std::io::Cursor;
use std::sync::Arc;

use super::*;
use crate::cell::file::KeepFrames;
use crate::core::{Frame, Pixels, Size};
use crate::io::recorder::{RecordConfig, start};
use crate::run::ports::Recorder;

const EVENTS: u64 = 800;

/// A recording of [`EVENTS`] events with steps and some frames, of several
/// chunks.
fn recorded() -> Vec<u8> {
    record(EVENTS, 300)
}

/// A recording of so many events, each with so many times 16 bytes of text.
fn record(events: u64, text: usize) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let config = RecordConfig {
        frames: KeepFrames::Every(1),
        is_live: true,
        epoch_ns: 1_700_000_000_000_000_000,
        cell_name: "cell.toml".into(),
        cell_text: "a = 1\n".into(),
        calibration_text: Some("b = 2\n".into()),
        extruder_files: Vec::new(),
    };
    let (mut recorder, _alarms) = start(&config, folder.path()).unwrap();
    for n in 0..events {
        let now = Stamp::from_ns(n * 10_000_000);
        let noise = n.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let reason = format!("{:x}", noise.wrapping_mul(noise | 1));
        let event = Event::Rejected { frame: n, captured_at: now, reason: reason.repeat(text) };
        recorder.record(now, &event, &Step::default()).unwrap();
        if n % 40 == 0 {
            let values = (0..600).map(|at| (at * n % 251).to_le_bytes()[0]).collect();
            let frame = Frame::new(n, now, Size::new(30, 20), Pixels::Grey8(values)).unwrap();
            recorder.frames().frame(Arc::new(frame));
        }
    }
    std::fs::read(recorder.finish().unwrap().path).unwrap()
}

struct Read {
    events: Vec<u64>,
    steps: usize,
    integrity: Integrity,
}

fn read(bytes: &[u8]) -> Read {
    let mut recording = Recording::read(Cursor::new(bytes.to_vec()), "test".into()).unwrap();
    let (mut events, mut steps) = (Vec::new(), 0);
    for entry in recording.by_ref() {
        match entry.unwrap() {
            RecordedEntry::Event { n, .. } => events.push(n),
            RecordedEntry::Step { .. } => steps += 1,
            RecordedEntry::Frame(_) => {}
        }
    }
    Read { events, steps, integrity: recording.integrity().clone() }
}

/// Start and end of every chunk.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut at = ::mcap::MAGIC.len();
    let mut found = Vec::new();
    while at + 9 <= bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        let end = at + 9 + usize::try_from(length).unwrap();
        match bytes[at] {
            ::mcap::records::op::CHUNK => found.push((at, end)),
            ::mcap::records::op::DATA_END => break,
            _ => {}
        }
        at = end;
    }
    found
}

fn is_beginning(events: &[u64]) -> bool {
    events.iter().zip(0u64..).all(|(&n, expected)| n == expected)
}

#[test]
fn a_whole_recording_is_whole() {
    let read = read(&recorded());
    assert_eq!((read.events.len(), read.steps), (800, 800));
    assert!(is_beginning(&read.events));
    assert!(read.integrity.finished && read.integrity.summary().is_none());
}

#[test]
fn cut_anywhere_everything_before_the_cut_chunk_reads_back() {
    let bytes = recorded();
    let chunks = chunks(&bytes);
    assert!(chunks.len() > 3, "{} chunks", chunks.len());
    let whole: Vec<usize> =
        chunks.iter().map(|&(_, end)| read(&bytes[..end]).events.len()).collect();
    let edges = chunks
        .iter()
        .flat_map(|&(start, end)| [start, start + 1, start + 9, start + 40, end - 1, end, end + 1]);
    let spread = (::mcap::MAGIC.len()..bytes.len()).step_by(bytes.len() / 150);
    for cut in edges.chain(spread).chain([bytes.len() - 1]) {
        let read = read(&bytes[..cut]);
        let complete = chunks.iter().filter(|&&(_, end)| end <= cut).count();
        let expected = complete.checked_sub(1).map_or(0, |last| whole[last]);
        assert_eq!(read.events.len(), expected, "cut at {cut}");
        assert!(is_beginning(&read.events));
        assert!(!read.integrity.finished && read.integrity.damaged == 0, "cut at {cut}");
        assert!(read.integrity.summary().is_some());
    }
}

#[test]
fn a_short_recording_reads_back_cut_at_every_single_byte() {
    let bytes = record(20, 2);
    let mut before = 0;
    for cut in ::mcap::MAGIC.len()..bytes.len() {
        let read = read(&bytes[..cut]);
        assert!(is_beginning(&read.events) && read.events.len() >= before, "cut at {cut}");
        assert!(!read.integrity.finished && read.integrity.damaged == 0, "cut at {cut}");
        before = read.events.len();
    }
    assert_eq!(before, 20);
}

#[test]
fn before_the_magic_is_whole_it_is_no_recording() {
    let whole = record(1, 1);
    for cut in 0..::mcap::MAGIC.len() {
        let bytes = Cursor::new(whole[..cut].to_vec());
        let error = Recording::read(bytes, "x.mcap".into()).err().unwrap();
        assert!(error.to_string().contains("x.mcap: not an MCAP file"));
    }
}

#[test]
fn a_damaged_chunk_is_skipped_and_reported() {
    let mut bytes = recorded();
    let chunks = chunks(&bytes);
    let (start, end) = chunks[2];
    bytes[usize::midpoint(start, end)] ^= 0x10;
    let read = read(&bytes);
    assert_eq!((read.integrity.damaged, read.integrity.finished), (1, true));
    assert!(read.integrity.notes[0].contains(&format!("chunk at byte {start}")));
    assert!(read.integrity.summary().is_some());
    assert!(!is_beginning(&read.events));
    assert_eq!(read.events.last(), Some(&(EVENTS - 1)));
}

#[test]
fn no_bit_that_flips_makes_it_panic() {
    let bytes = record(20, 2);
    for at in ::mcap::MAGIC.len()..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        let Ok(recording) = Recording::read(Cursor::new(damaged), "test".into()) else { continue };
        recording.filter_map(Result::ok).for_each(drop);
    }
}

#[test]
fn a_later_format_is_refused_with_what_to_do() {
    let mut bytes = record(1, 1);
    let key = b"format_version\x01\0\0\0";
    let at = bytes.windows(key.len()).position(|window| window == key).unwrap();
    bytes[at + key.len()] = b'9';
    let error = Recording::read(Cursor::new(bytes), "x.mcap".into()).err().unwrap();
    assert!(matches!(error, RecordingError::Newer { found: 9, .. }), "{error}");
}

#[test]
fn a_folder_and_a_missing_file_are_named() {
    let folder = tempfile::tempdir().unwrap();
    assert!(Recording::open(folder.path()).err().unwrap().to_string().contains("folder"));
    let missing = folder.path().join("no.mcap");
    let error = Recording::open(&missing).err().unwrap().to_string();
    assert!(error.contains("no.mcap: ") && error.contains("No such file"), "{error}");
}
