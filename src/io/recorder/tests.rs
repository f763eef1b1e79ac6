use std::io::Cursor;
use std::time::Duration;

use super::*;
use crate::cell::file::KeepFrames;
use crate::control::{State, Trace};
use crate::core::{
    Channel, Frame, Mm, MmPerS, Pixels, RefusalReason, RobotLimits, RobotMode, RobotState, Size,
};
use crate::io::image_file;
use crate::io::recording::{RecordedEntry, Recording};

mod disk;
mod disk_faults;

use disk::Disk;

const EPOCH_NS: u64 = 1_763_683_200_000_000_000;

fn config() -> RecordConfig {
    RecordConfig {
        frames: KeepFrames::Every(1),
        is_live: true,
        epoch_ns: EPOCH_NS,
        cell_name: "cells/a.toml".into(),
        cell_text: "[control]\ntarget_width_mm = 42.0\n".into(),
        calibration_text: Some("version = 1\n".into()),
        extruder_files: Vec::new(),
    }
}

fn quick() -> RecorderLimits {
    RecorderLimits { flush_every: Duration::from_millis(5), ..RecorderLimits::default() }
}

fn event(n: u64) -> Event {
    Event::Rejected { frame: n, captured_at: Stamp::from_ns(n), reason: "no_pair".into() }
}

fn frame(seq: u64) -> Arc<Frame> {
    let pixels = (0..48).map(|at| u8::try_from((at * 5 + seq) % 256).unwrap()).collect();
    Arc::new(
        Frame::new(seq, Stamp::from_ns(seq * 1000), Size::new(8, 6), Pixels::Grey8(pixels))
            .unwrap(),
    )
}

fn read(bytes: Vec<u8>) -> Recording {
    Recording::read(Cursor::new(bytes), "test.mcap".into()).unwrap()
}

fn event_numbers(recording: &mut Recording) -> Vec<u64> {
    let entries = recording.map(Result::unwrap);
    entries
        .filter_map(|entry| if let RecordedEntry::Event { n, .. } = entry { Some(n) } else { None })
        .collect()
}

fn awkward_floats() -> Vec<f64> {
    vec![
        0.1,
        -0.0,
        1.0 / 3.0,
        5e-324,
        f64::MIN_POSITIVE,
        f64::MAX,
        f64::MIN,
        9_007_199_254_740_993.0,
        1e23,
        0.1 + 0.2,
        112.499_999_999_999_99,
        2.225_073_858_507_201e-308,
    ]
}

#[test]
fn every_number_comes_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (mut recorder, _alarms) = start(&config(), folder.path()).unwrap();
    let floats = awkward_floats();
    for (n, &value) in floats.iter().enumerate() {
        let event = Event::Measured {
            frame: u64::MAX - n as u64,
            captured_at: Stamp::from_ns(u64::MAX),
            width_mm: Mm::constant(value),
            sigma_mm: Mm::constant(-value),
        };
        let trace = Trace {
            error_mm: Some(Mm::constant(value)),
            demand_mm_per_s: Some(MmPerS::constant(-value)),
            ..Trace::default()
        };
        let step = Step { state: State::Tracking, trace, ..Step::default() };
        recorder.record(Stamp::from_ns(n as u64), &event, &step).unwrap();
    }
    let path = recorder.finish().unwrap().path;
    let mut widths = Vec::new();
    let mut demands = Vec::new();
    for entry in Recording::open(&path).unwrap() {
        match entry.unwrap() {
            RecordedEntry::Event { event: Event::Measured { frame, width_mm, .. }, n, .. } => {
                assert_eq!(frame, u64::MAX - n);
                widths.push(width_mm.get().to_bits());
            }
            RecordedEntry::Step { step, .. } => {
                demands.push(step.trace.demand_mm_per_s.unwrap().get().to_bits());
            }
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(widths, floats.iter().map(|value| value.to_bits()).collect::<Vec<_>>());
    assert_eq!(demands, floats.iter().map(|value| (-value).to_bits()).collect::<Vec<_>>());
}

#[test]
fn every_kind_of_event_comes_back_and_is_described_by_the_schema() {
    let schema: serde_json::Value = serde_json::from_str(format::EVENT_SCHEMA).unwrap();
    let known = schema["properties"]["event"]["properties"].as_object().unwrap();
    let state = RobotState {
        robot_time_ms: Some(1),
        has_setpoint: true,
        mode: RobotMode::Print,
        speed_mm_per_s: MmPerS::constant(112.5),
        path_mm: Mm::constant(3.25),
        z_mm: Mm::constant(20.0),
    };
    let robot = RobotLimits {
        name: "sim".into(),
        min_mm_per_s: MmPerS::ZERO,
        max_mm_per_s: MmPerS::constant(150.0),
        hold_mm_per_s: MmPerS::constant(60.0),
    };
    let measured = Event::Measured {
        frame: 0,
        captured_at: Stamp::START,
        width_mm: Mm::ZERO,
        sigma_mm: Mm::ZERO,
    };
    let repeated = Event::Repeated {
        frame: 2,
        captured_at: Stamp::from_ns(2),
        first_at: Stamp::START,
        width_mm: Mm::ZERO,
        sigma_mm: Mm::ZERO,
    };
    let events = [
        measured,
        repeated,
        event(3),
        Event::Robot(state),
        Event::LinkUp { robot },
        Event::LinkDown { reason: "gone \"away\"\n".into() },
        Event::SetpointRefused { reason: RefusalReason::Expired, text: "line 4: STALE".into() },
        Event::Tick,
        Event::CameraLost { reason: "ü".into() },
        Event::RecordingLost,
        Event::Stop,
    ];
    let disk = Disk::default();
    let (mut recorder, _alarms) = start_with(&config(), disk.clone(), quick()).unwrap();
    for (n, event) in (0u64..).zip(&events) {
        let json = serde_json::to_value(event).unwrap();
        for key in json.as_object().unwrap().keys() {
            assert!(known.contains_key(key), "{key} is not in the schema");
        }
        recorder.record(Stamp::from_ns(n), event, &Step::default()).unwrap();
    }
    recorder.finish().unwrap();
    let back = read(disk.bytes()).map(Result::unwrap).filter_map(|entry| match entry {
        RecordedEntry::Event { event, .. } => Some(event),
        _ => None,
    });
    assert_eq!(back.collect::<Vec<_>>(), events);
}

#[test]
fn the_step_schema_names_what_a_trace_holds() {
    let schema: serde_json::Value = serde_json::from_str(format::STEP_SCHEMA).unwrap();
    let known = &schema["properties"]["step"]["properties"]["trace"]["properties"];
    let trace = Trace {
        frame: Some(1),
        captured_at: Some(Stamp::START),
        bead_path_mm: Some(Mm::ZERO),
        nozzle_path_mm: Some(Mm::ZERO),
        frame_repeated: true,
        report_ignored: true,
        error_mm: Some(Mm::ZERO),
        proportional_mm_per_s: Some(MmPerS::ZERO),
        integral_mm_per_s: Some(MmPerS::ZERO),
        demand_mm_per_s: Some(MmPerS::ZERO),
        ..Trace::default()
    };
    let json = serde_json::to_value(trace).unwrap();
    assert!(json.as_object().unwrap().keys().eq(known.as_object().unwrap().keys()));
}

#[test]
fn a_recording_stands_alone_and_has_its_final_name_only_when_finished() {
    let folder = tempfile::tempdir().unwrap();
    let partial = folder.path().join(format::PARTIAL_NAME);
    let finished = folder.path().join(format::FILE_NAME);
    let (mut recorder, _alarms) = start(&config(), folder.path()).unwrap();
    recorder.record(Stamp::START, &event(0), &Step::default()).unwrap();
    assert!(partial.exists() && !finished.exists());
    let busy = start(&config(), folder.path()).err().unwrap();
    assert!(busy.0.contains("recording.mcap.partial"), "{busy}");
    let report = recorder.finish().unwrap();
    assert!(!partial.exists() && report.path == finished);
    assert_eq!(report.bytes, finished.metadata().unwrap().len());
    let taken = start(&config(), folder.path()).err().unwrap();
    assert!(taken.0.contains("not overwritten"), "{taken}");

    let recording = Recording::open(&finished).unwrap();
    let run = recording.run().unwrap();
    assert_eq!((run.epoch_ns, run.cell_name.as_str()), (EPOCH_NS, "cells/a.toml"));
    assert_eq!(recording.cell(), Some("[control]\ntarget_width_mm = 42.0\n"));
    assert_eq!(recording.calibration(), Some("version = 1\n"));
}

#[test]
fn a_handle_that_is_dropped_finishes_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let (mut recorder, _alarms) = start(&config(), folder.path()).unwrap();
    recorder.record(Stamp::START, &event(0), &Step::default()).unwrap();
    drop(recorder);
    let mut recording = Recording::open(&folder.path().join(format::FILE_NAME)).unwrap();
    assert_eq!(event_numbers(&mut recording), [0]);
    assert_eq!(recording.integrity().summary(), None);
}

#[test]
fn frames_of_both_depths_are_kept_without_loss() {
    let deep = Pixels::Grey16(vec![0, 1, 255, 256, 4095, 65535]);
    let deep = Arc::new(Frame::new(2, Stamp::from_ns(77), Size::new(3, 2), deep).unwrap());
    let disk = Disk::default();
    let config = RecordConfig { frames: KeepFrames::Every(2), ..config() };
    let (recorder, _alarms) = start_with(&config, disk.clone(), quick()).unwrap();
    for given in [frame(0), frame(1), Arc::clone(&deep)] {
        recorder.frames().frame(given);
    }
    let report = recorder.finish().unwrap();
    assert_eq!((report.frames_kept, report.frames_dropped), (2, 0));
    let mut back = Vec::new();
    for entry in read(disk.bytes()) {
        let RecordedEntry::Frame(message) = entry.unwrap() else {
            panic!("only frames were given")
        };
        let image: crate::io::foxglove::CompressedImage =
            prost::Message::decode(message.data.as_slice()).unwrap();
        assert_eq!(image.format, "png");
        let ns = crate::io::foxglove::timestamp_ns(image.timestamp.as_ref()).unwrap();
        assert_eq!(ns, message.log_time_ns);
        let at = Stamp::from_ns(ns - EPOCH_NS);
        let seq = u64::from(message.sequence);
        back.push(image_file::decode(&image.data, Channel::Grey, seq, at).unwrap());
    }
    assert_eq!(back, [frame(0).as_ref().clone(), deep.as_ref().clone()]);
}
