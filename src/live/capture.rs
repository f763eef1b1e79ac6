//! Camera and measurement: one thread takes frames, another measures the newest one.

use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::mailbox::Mailbox;
use crate::calibration::{Calibration, SurfaceMap};
use crate::cell::Cell;
use crate::core::{Frame, ImagePoint, Span, Stamp};
use crate::io::clock::RunClock;
use crate::io::recorder::FrameTap;
use crate::run::ports::{FrameSource, Grab};
use crate::run::robot_z::RobotZ;
use crate::vision::{
    Measurer, Reject, RepeatDetector, Roughness, RoughnessEstimator, WidthMeasurement,
};

/// Data of the cell for the measurement.
pub struct Optics {
    /// The cell.
    pub cell: Cell,
    /// The calibration of its images.
    pub calibration: Calibration,
    /// How much later than its capture a frame has its time stamp.
    pub latency: Span,
    /// The robot's z over time.
    pub robot_z: RobotZ,
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
        let latency = optics.latency;
        let camera = Builder::new()
            .name("camera".to_owned())
            .spawn(move || take_frames(source, latency, &filling, &camera_messages, clock))?;
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
    latency: Span,
    mailbox: &Mailbox<Taken>,
    messages: &Sender<CameraMessage>,
    clock: RunClock,
) {
    let why = loop {
        let taken = match source.next_frame() {
            Ok(Some(Grab::Frame { mut frame, .. })) => {
                frame.captured_at = frame.captured_at - latency;
                Taken::Frame(frame, clock.now())
            }
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
                let surface = optics.surface_at(frame.captured_at);
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
    /// The map of the surface that a frame shows which was captured at a time.
    fn surface_at(&self, captured_at: Stamp) -> SurfaceMap {
        self.cell.surface(&self.calibration, self.robot_z.z_at(captured_at))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use std::f64::consts::PI;
    use std::path::Path;

    use nalgebra::Vector3;

    use super::*;
    use crate::calibration::Camera;
    use crate::cell::file::Purpose;
    use crate::control::Event;
    use crate::core::{Mm, MmPerS, Pose, RobotMode, RobotState};

    #[test]
    fn a_frame_that_waits_over_a_layer_change_is_measured_at_the_height_of_its_capture() {
        let text = include_str!("../../cells/extruder-pressure.toml");
        let cell = Cell::parse(Path::new("cell.toml"), text, Purpose::Measure).unwrap();
        let calibration = Calibration::Full {
            image_size_px: [720, 540],
            camera: Camera {
                focal_px: [2500.0, 2500.0],
                centre_px: [359.5, 269.5],
                distortion: [0.0; 8],
            },
            bed: Pose::new(Vector3::new(PI, 0.0, 0.0), Vector3::new(0.0, 0.0, 400.0)),
            robot_z: Mm::ZERO,
            quality: None,
        };
        let robot_z = RobotZ::default();
        let optics = Optics { cell, calibration, latency: Span::ZERO, robot_z };
        for (at, z) in [(1.0, 20.0), (1.5, 40.0)] {
            let state = RobotState {
                robot_time_ms: None,
                has_setpoint: false,
                mode: RobotMode::Print,
                speed_mm_per_s: MmPerS::constant(40.0),
                path_mm: Mm::constant(100.0),
                z_mm: Mm::constant(z),
            };
            optics.robot_z.note(Stamp::from_secs(at), &Event::Robot(state));
        }
        let [lower, upper] =
            [20.0, 40.0].map(|z| optics.cell.surface(&optics.calibration, Some(Mm::constant(z))));
        assert_ne!(lower, upper);
        // It is measured after 1.5 s, when the newest height is that of the next layer.
        assert_eq!(optics.surface_at(Stamp::from_secs(1.4)), lower);
        assert_eq!(optics.surface_at(Stamp::from_secs(1.5)), upper);
    }
}
