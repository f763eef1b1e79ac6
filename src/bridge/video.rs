//! Video files, cameras and GStreamer pipelines.

use std::path::PathBuf;

use opencv::core::{CV_8U, CV_16U, Mat, MatTraitConst, MatTraitConstManual};
use opencv::videoio::{
    CAP_FFMPEG, CAP_GSTREAMER, CAP_PROP_BUFFERSIZE, CAP_PROP_CODEC_PIXEL_FORMAT,
    CAP_PROP_CONVERT_RGB, CAP_PROP_FPS, CAP_PROP_FRAME_COUNT, CAP_V4L2, VideoCapture,
    VideoCaptureTrait, VideoCaptureTraitConst,
};

use super::{BridgeError, during, prepare};
use crate::core::{Channel, Frame, Pixels, SampleLayout, Size, Stamp};

/// Source of a video.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum VideoInput {
    /// A video file.
    File(PathBuf),
    /// A camera by its number.
    Camera(i32),
    /// A GStreamer pipeline. It may end in an `appsink`; otherwise one is added that keeps only
    /// the newest image.
    Pipeline(String),
}

/// Reads images one after the other.
#[derive(Debug)]
pub struct VideoReader {
    capture: VideoCapture,
    image: Mat,
}

const OPEN: &str = "opening a video source";
const READ: &str = "reading an image";
const APPSINK: &str = " ! appsink drop=true max-buffers=1 sync=false";

impl VideoReader {
    /// Opens a source; fails where OpenCV finds no decoder, device or pipeline for it.
    pub fn open(input: &VideoInput) -> Result<Self, BridgeError> {
        prepare();
        // By name: `CAP_ANY` would try GStreamer, too, which is slow to refuse a file or a
        // device, and prints errors.
        let capture = match input {
            VideoInput::File(path) => VideoCapture::from_file(path, CAP_FFMPEG),
            VideoInput::Camera(index) => VideoCapture::new(*index, CAP_V4L2),
            VideoInput::Pipeline(text) => {
                let sink = if text.contains("appsink") { "" } else { APPSINK };
                VideoCapture::from_file(format!("{text}{sink}"), CAP_GSTREAMER)
            }
        };
        let mut capture = capture.map_err(during(OPEN))?;
        if !capture.is_opened().map_err(during(OPEN))? {
            return Err(BridgeError { task: OPEN, what: refusal(input).to_owned() });
        }
        match input {
            VideoInput::File(_) => keep_grey_grey(&mut capture),
            // A short queue keeps images recent. Not every driver supports it.
            VideoInput::Camera(_) => drop(capture.set(CAP_PROP_BUFFERSIZE, 1.0)),
            VideoInput::Pipeline(_) => {}
        }
        Ok(Self { capture, image: Mat::default() })
    }

    /// Waits for the next image without decoding it, so that its time can be recorded. `false`
    /// at the end, or without an image.
    pub fn grab(&mut self) -> Result<bool, BridgeError> {
        self.capture.grab().map_err(during(READ))
    }

    /// Decodes the grabbed image. `None` if that fails.
    pub fn retrieve(
        &mut self,
        channel: Channel,
        seq: u64,
        captured_at: Stamp,
    ) -> Result<Option<Frame>, BridgeError> {
        let decoded = self.capture.retrieve(&mut self.image, 0).map_err(during(READ))?;
        if !decoded || self.image.empty() {
            return Ok(None);
        }
        frame_of(&self.image, channel, seq, captured_at).map(Some)
    }

    /// Frame rate, if the source states it.
    pub fn fps(&self) -> Option<f64> {
        let fps = self.capture.get(CAP_PROP_FPS).ok()?;
        (fps.is_finite() && fps > 0.0).then_some(fps)
    }

    /// Number of images in the file by its header, which may be an estimate.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive number; the cast saturates"
    )]
    pub fn frame_count(&self) -> Option<u64> {
        let count = self.capture.get(CAP_PROP_FRAME_COUNT).ok()?;
        (count.is_finite() && count >= 1.0).then_some(count as u64)
    }
}

fn refusal(input: &VideoInput) -> &'static str {
    match input {
        VideoInput::File(_) => "no decoder takes it; is it a whole video file?",
        VideoInput::Camera(_) => {
            "there is no such camera, it is in use, or this user may not open it"
        }
        VideoInput::Pipeline(_) => {
            "the pipeline does not start, or this OpenCV has no GStreamer; try it with gst-launch-1.0"
        }
    }
}

/// Requests 16-bit grey images as they are stored; by default images are converted to 8-bit
/// colour. OpenCV supports it from 4.7 on.
fn keep_grey_grey(capture: &mut VideoCapture) {
    let deep_grey = f64::from(u32::from_le_bytes(*b"Y1\0\x10"));
    let format = capture.get(CAP_PROP_CODEC_PIXEL_FORMAT).unwrap_or(-1.0);
    let is_deep = (format - deep_grey).abs() < 0.5;
    if is_deep && !capture.set(CAP_PROP_CONVERT_RGB, 0.0).unwrap_or(false) {
        tracing::warn!(
            "this OpenCV reads 16-bit grey videos with 8 bits; images or an MCAP keep all 16"
        );
    }
}

fn frame_of(
    image: &Mat,
    channel: Channel,
    seq: u64,
    captured_at: Stamp,
) -> Result<Frame, BridgeError> {
    let fault = |what: String| BridgeError { task: READ, what };
    let layout = match image.channels() {
        1 => SampleLayout::Grey,
        3 => SampleLayout::Bgr,
        4 => SampleLayout::Bgra,
        other => return Err(fault(format!("an image with {other} channels is not known"))),
    };
    let flat = image.reshape(1, 0).map_err(during(READ))?;
    let pixels = match image.depth() {
        CV_8U => {
            let samples = flat.data_typed::<u8>().map_err(during(READ))?;
            Pixels::Grey8(channel.extract(samples, layout))
        }
        CV_16U => {
            let samples = flat.data_typed::<u16>().map_err(during(READ))?;
            Pixels::Grey16(channel.extract(samples, layout))
        }
        _ => return Err(fault("only samples of 8 and 16 bits are measured".to_owned())),
    };
    let side = |px: i32| usize::try_from(px).unwrap_or(0);
    Frame::new(seq, captured_at, Size::new(side(image.cols()), side(image.rows())), pixels)
        .map_err(|error| fault(error.to_string()))
}
