use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::*;
use crate::cell::file::KeepFrames;
use crate::control::{Event, Step};
use crate::core::{Mm, MmPerS, Pixels, RobotMode, RobotState, Size};
use crate::io::foxglove::timestamp;
use crate::io::recorder::{RecordConfig, start};
use crate::run::ports::Recorder;

fn frame(seq: u64, ms: u64) -> Frame {
    let values = (0..12).map(|at| (at * 20 + seq).to_le_bytes()[0]).collect();
    Frame::new(seq, Stamp::from_ns(ms * 1_000_000), Size::new(4, 3), Pixels::Grey8(values)).unwrap()
}

struct Foreign {
    topic: &'static str,
    schema: &'static str,
    encoding: &'static str,
    data: Vec<u8>,
}

/// A file as another program might write it, a message each 0.5 s.
fn foreign(folder: &Path, messages: &[Foreign]) -> PathBuf {
    let path = folder.join("foreign.mcap");
    let mut writer = ::mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
    for (number, message) in (0u32..).zip(messages) {
        let schema = ::mcap::Schema {
            id: u16::try_from(number).unwrap() + 1,
            name: message.schema.to_string(),
            encoding: "protobuf".to_string(),
            data: Cow::Borrowed(&[]),
        };
        let channel = ::mcap::Channel {
            id: u16::try_from(number).unwrap(),
            topic: message.topic.to_string(),
            schema: Some(Arc::new(schema)),
            message_encoding: message.encoding.to_string(),
            metadata: BTreeMap::new(),
        };
        let log_time = 7_000_000_000 + u64::from(number) * 500_000_000;
        writer
            .write(&::mcap::Message {
                channel: Arc::new(channel),
                sequence: number,
                log_time,
                publish_time: log_time,
                data: Cow::Borrowed(&message.data),
            })
            .unwrap();
    }
    writer.finish().unwrap();
    path
}

fn compressed(topic: &'static str, data: Vec<u8>, ns: u64) -> Foreign {
    let image = CompressedImage {
        timestamp: (ns > 0).then(|| timestamp(ns)),
        frame_id: "x".into(),
        data,
        format: "png".into(),
    };
    Foreign { topic, schema: COMPRESSED_IMAGE, encoding: "protobuf", data: image.encode_to_vec() }
}

fn raw(topic: &'static str, encoding: &str) -> Foreign {
    let image = RawImage {
        width: 2,
        height: 1,
        step: 2,
        encoding: encoding.into(),
        data: vec![7, 9],
        ..RawImage::default()
    };
    Foreign { topic, schema: RAW_IMAGE, encoding: "protobuf", data: image.encode_to_vec() }
}

fn open(path: &Path, topic: Option<&str>) -> Result<McapSource, SourceError> {
    McapSource::open(path, topic, Channel::Grey)
}

fn all(source: &mut McapSource) -> Vec<Grab> {
    std::iter::from_fn(|| source.next_frame().unwrap()).collect()
}

#[test]
fn a_recording_gives_its_frames_back_with_their_times_and_heights() {
    let folder = tempfile::tempdir().unwrap();
    let config = RecordConfig {
        frames: KeepFrames::Every(1),
        is_live: true,
        epoch_ns: 1_700_000_000_000_000_000,
        cell_name: "cell.toml".into(),
        cell_text: String::new(),
        calibration_text: None,
        extruder_files: Vec::new(),
    };
    let (mut recorder, _alarms) = start(&config, folder.path()).unwrap();
    let given: Vec<Frame> = (0..4).map(|seq| frame(seq, 100 + seq * 20)).collect();
    for (frame, z) in given.iter().zip([20.0, 20.0, 40.0, 40.0]) {
        let state = RobotState {
            robot_time_ms: None,
            has_setpoint: false,
            mode: RobotMode::Print,
            speed_mm_per_s: MmPerS::ZERO,
            path_mm: Mm::ZERO,
            z_mm: Mm::constant(z),
        };
        recorder.record(frame.captured_at, &Event::Robot(state), &Step::default()).unwrap();
        recorder.frames().frame(Arc::new(frame.clone()));
    }
    let path = recorder.finish().unwrap().path;
    let mut source = open(&path, None).unwrap();
    assert_eq!(source.expected_frames(), Some(4));
    let heights = source.robot_z();
    for (at, given) in given.iter().enumerate() {
        let Some(Grab::Frame { frame, time_s }) = source.next_frame().unwrap() else {
            panic!("frame {at} is missing")
        };
        assert_eq!(&frame, given);
        assert!((time_s.unwrap() - 0.02 * f64::from(u32::try_from(at).unwrap())).abs() < 1e-12);
    }
    assert_eq!(source.next_frame(), Ok(None));
    let z = |at: usize| heights.z_at(given[at].captured_at).map(Mm::get);
    assert_eq!([z(1), z(2)], [Some(20.0), Some(40.0)]);
    assert_eq!(heights.z_at(Stamp::START), None);
}

#[test]
fn the_first_image_topic_is_taken_or_the_one_that_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let png = image_file::encode_png(&frame(0, 0)).unwrap();
    let path = foreign(
        folder.path(),
        &[
            Foreign { topic: "/chat", schema: "a.Text", encoding: "json", data: vec![] },
            raw("/left", "mono8"),
            compressed("/right", png.clone(), 0),
            raw("/left", "bayer_rggb8"),
            compressed("/right", png, 0),
        ],
    );
    let mut source = open(&path, None).unwrap();
    let grabs = all(&mut source);
    let Grab::Frame { frame, time_s: Some(first_s) } = &grabs[0] else { panic!("{grabs:?}") };
    assert_eq!((frame.pixels(), *first_s), (&Pixels::Grey8(vec![7, 9]), 0.0));
    let Grab::Unreadable { seq: 1, time_s: Some(second_s), reason } = &grabs[1] else {
        panic!("{grabs:?}")
    };
    assert!(reason.contains("bayer_rggb8") && (*second_s - 1.0).abs() < 1e-12, "{reason}");
    assert_eq!(grabs.len(), 2);
    assert_eq!(all(&mut open(&path, Some("/right")).unwrap()).len(), 2);

    let message = |topic| open(&path, Some(topic)).err().unwrap().what;
    assert!(message("/chat").starts_with("topic /chat (a.Text, json): expected foxglove."));
    assert!(message("/up").contains("no topic /up; found /chat (a.Text, json), /left"));
}

#[test]
fn capture_times_count_where_there_are_any() {
    let folder = tempfile::tempdir().unwrap();
    let png = image_file::encode_png(&frame(0, 0)).unwrap();
    let path = foreign(
        folder.path(),
        &[
            compressed("/a", png.clone(), 5_000_000_000),
            compressed("/a", png[..png.len() / 2].to_vec(), 5_040_000_000),
            compressed("/a", png, 5_080_000_000),
        ],
    );
    let grabs = all(&mut open(&path, None).unwrap());
    assert!(matches!(&grabs[1], Grab::Unreadable { seq: 1, time_s: Some(t), reason }
        if (t - 0.04).abs() < 1e-12 && reason.contains("message 1 of /a: its format is \"png\"")));
    let Grab::Frame { frame, time_s: Some(time_s) } = &grabs[2] else { panic!("{grabs:?}") };
    assert_eq!((frame.seq, frame.captured_at.ns()), (2, 80_000_000));
    assert!((time_s - 0.08).abs() < 1e-12);
}

#[test]
fn without_frames_it_says_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let ros = Foreign {
        topic: "/cam/image_raw",
        schema: "sensor_msgs/msg/Image",
        encoding: "cdr",
        data: vec![],
    };
    let path = foreign(folder.path(), &[ros]);
    let what = open(&path, None).err().unwrap().what;
    assert!(what.contains("found /cam/image_raw (sensor_msgs/msg/Image, cdr)"), "{what}");

    std::fs::write(&path, b"no mcap").unwrap();
    let error = open(&path, None).err().unwrap().to_string();
    assert_eq!(error.matches("foreign.mcap").count(), 1, "{error}");
    assert!(error.contains("not an MCAP file"));
}
