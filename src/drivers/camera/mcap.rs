//! Frames from an MCAP file: the first topic of `foxglove.CompressedImage` or `foxglove.RawImage`,
//! or a topic given by name.

mod raw;

#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use prost::Message as _;

use super::fault;
use crate::core::{Channel, Frame, Stamp};
use crate::io::foxglove::{COMPRESSED_IMAGE, CompressedImage, RAW_IMAGE, RawImage, timestamp_ns};
use crate::io::image_file;
use crate::io::recorder::format::EVENT_TOPIC;
use crate::io::recording::messages::{Message, Topic};
use crate::io::recording::{RecordedEntry, Recording, RecordingError, index};
use crate::run::ports::{FrameSource, Grab, SourceError};
use crate::run::robot_z::RobotZ;

/// Frames of one topic of an MCAP.
///
/// Times are the frames' own timestamps, otherwise those of the messages; `time_s` counts from the
/// first frame. `captured_at` is the stamp of the run in a recording of this program; otherwise it
/// counts from the first frame, too.
pub struct McapSource {
    recording: Recording,
    topic: Arc<Topic>,
    channel: Channel,
    first: Option<Message>,
    first_ns: Option<u64>,
    next_seq: u64,
    expected: Option<u64>,
    robot_z: RobotZ,
    ended: bool,
}

impl McapSource {
    /// Opens an MCAP file and finds its frames. Fails if it has no readable frames; the error
    /// lists the topics that it has.
    pub fn open(path: &Path, topic: Option<&str>, channel: Channel) -> Result<Self, SourceError> {
        let name = path.display().to_string();
        let mut recording = Recording::open(path).map_err(|error| read_fault(&name, &error))?;
        let robot_z = RobotZ::default();
        let first = loop {
            let message = recording.next_message().map_err(|error| read_fault(&name, &error))?;
            let Some(message) = message else {
                return Err(fault(&name, nothing_found(&recording, topic)));
            };
            note_robot(&recording, &robot_z, &message);
            if topic.is_none_or(|topic| topic == message.topic.name) && is_image(&message.topic) {
                break message;
            }
            if topic == Some(message.topic.name.as_str()) {
                return Err(fault(&name, wrong_kind(&message.topic)));
            }
        };
        let expected = index::messages_of(path, &first.topic.name);
        let topic = Arc::clone(&first.topic);
        Ok(Self {
            recording,
            topic,
            channel,
            first: Some(first),
            first_ns: None,
            next_seq: 0,
            expected,
            robot_z,
            ended: false,
        })
    }

    /// Heights of the robot, as far as the recording has been read: up to the capture of every
    /// frame that has been returned.
    pub fn robot_z(&self) -> RobotZ {
        self.robot_z.clone()
    }

    fn next_image(&mut self) -> Result<Option<Message>, RecordingError> {
        if let Some(first) = self.first.take() {
            return Ok(Some(first));
        }
        while let Some(message) = self.recording.next_message()? {
            note_robot(&self.recording, &self.robot_z, &message);
            if message.topic.name == self.topic.name && is_image(&message.topic) {
                return Ok(Some(message));
            }
        }
        Ok(None)
    }

    fn captured_at(&self, ns: u64, first_ns: u64) -> Stamp {
        let start = self.recording.run().map_or(first_ns, |run| run.epoch_ns);
        Stamp::from_ns(ns.saturating_sub(start))
    }

    /// Warns once about missing parts of the recording.
    fn tell_end(&mut self) {
        if !std::mem::replace(&mut self.ended, true)
            && let Some(what) = self.recording.integrity().summary()
        {
            tracing::warn!("{}: {what}", self.recording.file());
        }
    }
}

impl FrameSource for McapSource {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        let message =
            self.next_image().map_err(|error| read_fault(self.recording.file(), &error))?;
        let Some(message) = message else {
            self.tell_end();
            return Ok(None);
        };
        let seq = self.next_seq;
        self.next_seq += 1;
        let picture = Picture::read(&message);
        let stamped = picture.as_ref().ok().and_then(Picture::timestamp_ns);
        let ns = stamped.unwrap_or(message.log_time_ns);
        let first_ns = *self.first_ns.get_or_insert(ns);
        let time_s = Some(seconds_between(first_ns, ns));
        let captured_at = self.captured_at(ns, first_ns);
        let decoded = picture.and_then(|picture| picture.decode(self.channel, seq, captured_at));
        Ok(Some(match decoded {
            Ok(frame) => Grab::Frame { frame, time_s },
            Err(what) => {
                let reason = format!("message {} of {}: {what}", message.sequence, self.topic.name);
                Grab::Unreadable { seq, time_s, reason }
            }
        }))
    }

    fn expected_frames(&self) -> Option<u64> {
        self.expected
    }
}

enum Picture {
    Compressed(CompressedImage),
    Raw(RawImage),
}

impl Picture {
    fn read(message: &Message) -> Result<Self, String> {
        let data = message.data.as_slice();
        let picture = if message.topic.schema == COMPRESSED_IMAGE {
            CompressedImage::decode(data).map(Self::Compressed)
        } else {
            RawImage::decode(data).map(Self::Raw)
        };
        picture.map_err(|error| format!("it is not a {}: {error}", message.topic.schema))
    }

    fn timestamp_ns(&self) -> Option<u64> {
        timestamp_ns(match self {
            Self::Compressed(image) => image.timestamp.as_ref(),
            Self::Raw(image) => image.timestamp.as_ref(),
        })
    }

    fn decode(&self, channel: Channel, seq: u64, captured_at: Stamp) -> Result<Frame, String> {
        match self {
            Self::Compressed(image) => image_file::decode(&image.data, channel, seq, captured_at)
                .map_err(|error| format!("its format is \"{}\": {error}", image.format)),
            Self::Raw(image) => raw::decode(image, channel, seq, captured_at),
        }
    }
}

fn is_image(topic: &Topic) -> bool {
    topic.encoding == "protobuf" && [COMPRESSED_IMAGE, RAW_IMAGE].contains(&topic.schema.as_str())
}

fn note_robot(recording: &Recording, robot_z: &RobotZ, message: &Message) {
    if recording.run().is_none() || message.topic.name != EVENT_TOPIC {
        return;
    }
    if let Ok(Some(RecordedEntry::Event { now, event, .. })) = recording.entry(message.clone()) {
        robot_z.note(now, &event);
    }
}

#[expect(clippy::cast_precision_loss, reason = "exact to the nanosecond for 104 days")]
fn seconds_between(first_ns: u64, ns: u64) -> f64 {
    let (size, sign) = (ns.abs_diff(first_ns) as f64 / 1e9, if ns < first_ns { -1.0 } else { 1.0 });
    sign * size
}

fn read_fault(name: &str, error: &RecordingError) -> SourceError {
    let text = error.to_string();
    let what = text.strip_prefix(name).and_then(|rest| rest.strip_prefix(": ")).unwrap_or(&text);
    fault(name, what)
}

fn describe(topic: &Topic) -> String {
    let schema = if topic.schema.is_empty() { "no schema" } else { &topic.schema };
    format!("{} ({schema}, {})", topic.name, topic.encoding)
}

fn wrong_kind(topic: &Topic) -> String {
    format!(
        "topic {}: expected {COMPRESSED_IMAGE} or {RAW_IMAGE} in protobuf; convert it, or name \
         another topic",
        describe(topic)
    )
}

fn nothing_found(recording: &Recording, topic: Option<&str>) -> String {
    let topics = recording.topics();
    let damage = recording.integrity().summary().map(|what| format!("; {what}"));
    let damage = damage.unwrap_or_default();
    if let Some(empty) =
        topics.iter().find(|found| is_image(found) && topic.is_none_or(|name| name == found.name))
    {
        return format!("topic {} is there, but holds no frames{damage}", empty.name);
    }
    let found = if topics.is_empty() {
        "no topics".to_string()
    } else {
        topics.iter().map(|topic| describe(topic)).collect::<Vec<_>>().join(", ")
    };
    match topic {
        Some(name) => format!("no topic {name}; found {found}{damage}"),
        None => format!(
            "no frames: expected a topic of {COMPRESSED_IMAGE} or {RAW_IMAGE} in protobuf, found \
             {found}{damage}"
        ),
    }
}
