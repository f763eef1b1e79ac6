//! A video file as a source of frames.

use std::path::Path;

use super::{check_rate, fault, offline_stamp, seconds_at};
use crate::bridge::{VideoInput, VideoReader};
use crate::core::Channel;
use crate::run::ports::{FrameSource, Grab, SourceError};

/// Number of frames that may be missing without a warning: in some formats the count in the file's
/// header is an estimate.
const COUNT_SLACK: u64 = 2;
/// Largest number of missing frames that are listed one by one: a damaged header can give any
/// count.
const MOST_MISSING: u64 = 100_000;

/// The frames of a video file.
#[derive(Debug)]
pub struct VideoFile {
    reader: VideoReader,
    name: String,
    channel: Channel,
    fps: Option<f64>,
    promised: Option<u64>,
    next: u64,
    ended: bool,
}

impl VideoFile {
    /// Opens a video. Frame `n` has the time `n / fps`; `fps` overrides the file's own rate. Fails
    /// if the file is not a video.
    pub fn open(path: &Path, channel: Channel, fps: Option<f64>) -> Result<Self, SourceError> {
        let name = path.display().to_string();
        check_rate(&name, fps)?;
        std::fs::File::open(path).map_err(|error| fault(&name, error.to_string()))?;
        let reader = VideoReader::open(&VideoInput::File(path.to_owned()))
            .map_err(|error| fault(&name, error.to_string()))?;
        let (fps, promised) = (fps.or_else(|| reader.fps()), reader.frame_count());
        Ok(Self { reader, name, channel, fps, promised, next: 0, ended: false })
    }

    fn time_s(&self) -> Option<f64> {
        self.fps.map(|fps| seconds_at(self.next, fps))
    }

    fn decoded(&mut self) -> Grab {
        let (seq, time_s) = (self.next, self.time_s());
        let captured_at = offline_stamp(seq, time_s, 0.0);
        let reason = match self.reader.retrieve(self.channel, seq, captured_at) {
            Ok(Some(frame)) => return Grab::Frame { frame, time_s },
            Ok(None) => "the decoder gives no image".to_owned(),
            Err(error) => error.to_string(),
        };
        Grab::Unreadable { seq, time_s, reason: format!("{} frame {seq}: {reason}", self.name) }
    }

    /// A frame that the header counts but that comes after the last decodable one; `None` if there
    /// is none.
    fn missing(&self) -> Option<Grab> {
        let promised = self.promised.filter(|promised| self.next < *promised)?;
        let reason = format!(
            "{} frame {}: the stream breaks off before its {promised} frames",
            self.name, self.next
        );
        Some(Grab::Unreadable { seq: self.next, time_s: self.time_s(), reason })
    }

    fn end(&mut self) -> Result<(), SourceError> {
        if self.next == 0 {
            return Err(fault(&self.name, "no frame of this video can be decoded"));
        }
        self.ended = true;
        let missing = self.promised.map_or(0, |promised| promised.saturating_sub(self.next));
        self.promised = match missing {
            0..=COUNT_SLACK => None,
            _ => Some(self.next + missing.min(MOST_MISSING)),
        };
        Ok(())
    }
}

impl FrameSource for VideoFile {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        if !self.ended && !matches!(self.reader.grab(), Ok(true)) {
            self.end()?;
        }
        let grab = if self.ended { self.missing() } else { Some(self.decoded()) };
        self.next += u64::from(grab.is_some());
        Ok(grab)
    }

    fn expected_frames(&self) -> Option<u64> {
        self.promised.map(|promised| promised.max(self.next))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Size;
    use std::fs;

    /// Uncompressed AVI of grey images of 16x8 px, with a frame count of `promised` in its
    /// headers.
    fn avi(frames: u32, promised: u32) -> Vec<u8> {
        let (width, height, fps) = (16_u32, 8_u32, 25_u32);
        let picture = width * height * 3;
        let chunk = |id: &[u8; 4], body: &[u8]| {
            let size = u32::try_from(body.len()).unwrap();
            [id.as_slice(), &size.to_le_bytes(), body].concat()
        };
        let words =
            |values: &[u32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let main = words(&[
            1_000_000 / fps,
            picture * fps,
            0,
            0x10,
            promised,
            0,
            1,
            picture,
            width,
            height,
            0,
            0,
            0,
            0,
        ]);
        let stream =
            [b"vidsDIB ".to_vec(), words(&[0, 0, 0, 1, fps, 0, promised, picture, 0, 0, 0, 0])]
                .concat();
        let format = words(&[40, width, height, 1 | (24 << 16), 0, picture, 0, 0, 0, 0]);
        let list = |kind: &[u8; 4], body: Vec<u8>| chunk(b"LIST", &[kind.to_vec(), body].concat());
        let stream_list =
            list(b"strl", [chunk(b"strh", &stream), chunk(b"strf", &format)].concat());
        let header = list(b"hdrl", [chunk(b"avih", &main), stream_list].concat());
        let pictures = (0..frames).flat_map(|i| {
            let value = u8::try_from(i * 10).unwrap();
            chunk(b"00db", &vec![value; picture as usize])
        });
        let movie = list(b"movi", pictures.collect());
        chunk(b"RIFF", &[b"AVI ".to_vec(), header, movie].concat())
    }

    fn grabs(bytes: &[u8], fps: Option<f64>) -> Result<Vec<Grab>, SourceError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clip.avi");
        fs::write(&path, bytes).unwrap();
        let mut source = VideoFile::open(&path, Channel::Grey, fps)?;
        let mut grabs = Vec::new();
        while let Some(grab) = source.next_frame()? {
            grabs.push(grab);
        }
        Ok(grabs)
    }

    #[test]
    fn frames_have_their_number_time_and_values() {
        let all = grabs(&avi(5, 5), None).unwrap();
        assert_eq!(all.len(), 5);
        let Grab::Frame { frame, time_s } = &all[3] else { panic!("{:?}", all[3]) };
        assert_eq!((frame.seq, *time_s, frame.size()), (3, Some(0.12), Size::new(16, 8)));
        assert!(frame.to_grey8().iter().all(|&v| v == 30));
        let Grab::Frame { time_s, .. } = grabs(&avi(5, 5), Some(10.0)).unwrap()[3].clone() else {
            panic!()
        };
        assert_eq!(time_s, Some(0.3));
    }

    #[test]
    fn frames_that_the_header_promised_are_rows() {
        let all = grabs(&avi(5, 12), None).unwrap();
        let lost = all.iter().filter(|g| matches!(g, Grab::Unreadable { .. })).count();
        assert_eq!((all.len(), lost), (12, 7));
    }

    #[test]
    fn what_is_no_video_is_an_error() {
        assert!(grabs(b"frame,time_s\n", None).unwrap_err().to_string().contains("clip.avi"));
        let missing = VideoFile::open(Path::new("no/clip.mp4"), Channel::Grey, None).unwrap_err();
        assert!(missing.to_string().contains("No such file"));
    }
}
