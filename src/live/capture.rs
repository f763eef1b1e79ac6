//! Camera and measurement: one thread takes frames, another measures the newest one.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{Builder, JoinHandle};

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::mailbox::Mailbox;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::core::{Frame, ImagePoint, Mm, Stamp};
use crate::io::clock::RunClock;
use crate::io::recorder::FrameTap;
use crate::run::ports::{FrameSource, Grab};
use crate::vision::{
    Measurer, Reject, RepeatDetector, Roughness, RoughnessEstimator, WidthMeasurement,
};

/// Data of the cell for the measurement.
pub struct Optics {
    /// The cell.
    pub cell: Cell,
    /// The calibration of its images.
    pub calibration: Calibration,
    /// The robot's newest z \[mm\], as bits; NaN before its first report.
    pub robot_z: Arc<AtomicU64>,
}

/// A message from the capture pipeline to control.
#[derive(Debug)]
pub enum CameraMessage {
    /// A frame was measured or rejected.
    Frame(Box<MeasuredFrame>),
    /// A frame cannot be read.
    Unreadable {
        /// Its number.
        seq: u64,
        /// Time at which that was known.
        at: Stamp,
        /// Why it cannot be read.
        reason: String,
    },
    /// The camera is not there yet, for this reason.
    Waiting(String),
    /// No more frames: `None` is the regular end of the source, otherwise the reason.
    Ended(Option<String>),
}

/// A frame that was measured or rejected.
#[derive(Debug)]
pub struct MeasuredFrame {
    /// The frame.
    pub frame: Arc<Frame>,
    /// Time at which the program received it.
    pub had_at: Stamp,
    /// Capture time of the first of several frames in a row that are equal to this one; `None`
    /// if it is new.
    pub first_equal_at: Option<Stamp>,
    /// The width, or why the frame was rejected.
    pub outcome: Result<WidthMeasurement, Reject>,
    /// Roughness of the bead from all frames up to this one; `None` while it is not determined.
    pub roughness: Option<Roughness>,
    /// Points of the left and the right edge.
    pub edges: (Vec<ImagePoint>, Vec<ImagePoint>),
}

enum Taken {
    Frame(Frame, Stamp),
    Unreadable { seq: u64, at: Stamp, reason: String },
    Waiting { reason: String },
}

/// The running threads.
pub struct CapturePipeline {
    /// Messages of the pipeline.
    pub seen: Receiver<CameraMessage>,
    mailbox: Arc<Mailbox<Taken>>,
    threads: Vec<JoinHandle<()>>,
}

impl CapturePipeline {
    /// Starts the threads.
    pub fn start(
        source: Box<dyn FrameSource>,
        optics: Optics,
        tap: FrameTap,
        clock: RunClock,
    ) -> std::io::Result<Self> {
        let (messages, seen) = unbounded();
        let mailbox = Arc::new(Mailbox::default());
        let (filling, camera_messages) = (Arc::clone(&mailbox), messages.clone());
        let camera = Builder::new()
            .name("camera".to_owned())
            .spawn(move || take_frames(source, &filling, &camera_messages, clock))?;
        let taking = Arc::clone(&mailbox);
        let measure = Builder::new()
            .name("measure".to_owned())
            .spawn(move || measure_frames(&taking, &optics, &tap, &messages))?;
        Ok(Self { seen, mailbox, threads: vec![camera, measure] })
    }

    /// Ends the threads; the source must be about to end. Returns the number of frames that were
    /// never measured.
    pub fn stop(self) -> u64 {
        self.mailbox.close();
        for thread in self.threads {
            if thread.join().is_err() {
                tracing::error!("a thread of the camera had failed");
            }
        }
        self.mailbox.superseded()
    }
}

fn take_frames(
    mut source: Box<dyn FrameSource>,
    mailbox: &Mailbox<Taken>,
    messages: &Sender<CameraMessage>,
    clock: RunClock,
) {
    let why = loop {
        let taken = match source.next_frame() {
            Ok(Some(Grab::Frame { frame, .. })) => Taken::Frame(frame, clock.now()),
            Ok(Some(Grab::Unreadable { seq, reason, .. })) => {
                Taken::Unreadable { seq, at: clock.now(), reason }
            }
            Ok(Some(Grab::Waiting { reason })) => Taken::Waiting { reason },
            Ok(None) => break None,
            Err(error) => break Some(error.to_string()),
        };
        if !mailbox.put(taken) {
            break None;
        }
    };
    mailbox.close();
    // If the run has ended first, nobody receives the message.
    let _ = messages.send(CameraMessage::Ended(why));
}

fn measure_frames(
    mailbox: &Mailbox<Taken>,
    optics: &Optics,
    tap: &FrameTap,
    messages: &Sender<CameraMessage>,
) {
    let mut measurer = Measurer::new(optics.cell.gauge, optics.cell.white);
    let mut estimator = RoughnessEstimator::default();
    let mut repeats = RepeatDetector::new(optics.cell.gauge.roi);
    while let Some(taken) = mailbox.take() {
        let seen = match taken {
            Taken::Frame(frame, had_at) => {
                let surface = optics.surface();
                let outcome = measurer.measure(&frame, &surface);
                let outcome = outcome.map(|found| measurer.with_skew(found));
                estimator.frame(&measurer, outcome.as_ref().ok(), &surface);
                let roughness = estimator.estimate();
                let edges = measurer.edges();
                let frame = Arc::new(frame);
                let edges = (edges.left.to_vec(), edges.right.to_vec());
                let measured = MeasuredFrame {
                    frame: Arc::clone(&frame),
                    had_at,
                    first_equal_at: repeats.first_of_equal(&frame),
                    outcome,
                    roughness,
                    edges,
                };
                if messages.send(CameraMessage::Frame(Box::new(measured))).is_err() {
                    return;
                }
                tap.frame(frame);
                continue;
            }
            Taken::Unreadable { seq, at, reason } => CameraMessage::Unreadable { seq, at, reason },
            Taken::Waiting { reason } => CameraMessage::Waiting(reason),
        };
        if messages.send(seen).is_err() {
            return;
        }
    }
}

impl Optics {
    fn surface(&self) -> crate::calibration::SurfaceMap {
        let z = Mm::new(f64::from_bits(self.robot_z.load(Ordering::Relaxed))).ok();
        self.cell.surface(&self.calibration, z)
    }
}
