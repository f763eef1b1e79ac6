//! Encodes frames as PNG within `foxglove.CompressedImage`, in a separate thread, so that an event
//! never waits for an image.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crossbeam_channel::{Receiver, Sender};
use prost::Message as _;

use super::state::RecorderState;
use crate::core::{Frame, Stamp};
use crate::io::foxglove::{CompressedImage, timestamp};
use crate::io::image_file::{EncodeError, encode_png};

/// A job for the encoder.
pub enum FrameJob {
    /// Encode this frame.
    Encode(Arc<Frame>),
    /// No more frames will come.
    Close,
}

/// A frame ready to be written.
pub struct EncodedFrame {
    /// Number of the frame.
    pub seq: u64,
    /// Time of capture.
    pub captured_at: Stamp,
    /// The protobuf message.
    pub message: Vec<u8>,
}

/// Encodes until it is closed or the receiver of encoded frames is gone.
pub fn run(
    jobs: &Receiver<FrameJob>,
    out: &Sender<EncodedFrame>,
    epoch_ns: u64,
    shared: &RecorderState,
) {
    while let Ok(FrameJob::Encode(frame)) = jobs.recv() {
        match encode(&frame, epoch_ns) {
            Ok(encoded) => {
                if out.send(encoded).is_err() {
                    return;
                }
            }
            Err(error) => {
                tracing::warn!("frame {} is not recorded: {error}", frame.seq);
                shared.frames_dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

fn encode(frame: &Frame, epoch_ns: u64) -> Result<EncodedFrame, EncodeError> {
    let image = CompressedImage {
        timestamp: Some(timestamp(epoch_ns.saturating_add(frame.captured_at.ns()))),
        frame_id: "camera".to_string(),
        data: encode_png(frame)?,
        format: "png".to_string(),
    };
    let message = image.encode_to_vec();
    Ok(EncodedFrame { seq: frame.seq, captured_at: frame.captured_at, message })
}
