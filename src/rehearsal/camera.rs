//! The camera of a rehearsed run: widths of the bead that is laid, without images.

use std::sync::Arc;

use super::fault::{FaultKind, Faults};
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::core::{Frame, Mm, Pixels, Roi, Size, Span, Stamp};
use crate::live::capture::{CameraMessage, MeasuredFrame};
use crate::sim::cell::camera::SimCamera;
use crate::sim::laid::LaidBead;
use crate::sim::render::RenderError;
use crate::vision::{Reject, RepeatDetector, WidthMeasurement};

/// Side of a frame \[px\]. Derived: eight pixels hold the number of a frame.
const SIDE_PX: usize = 3;

/// The camera and what measures its frames.
pub struct Camera {
    device: SimCamera,
    repeats: RepeatDetector,
    offset: Mm,
    /// From the capture of a frame to its width.
    latency: Span,
    /// How much later than its capture a frame is for the program: the delay of its stamp, less the
    /// latency that the cell states.
    stamp_delay: Span,
    /// The newest image and its width, again and again while the camera is frozen.
    image: Option<Image>,
    last_arrival: Stamp,
    has_failed: bool,
    has_answered: bool,
}

/// An image: its pixels are those of its number.
#[derive(Debug, Clone, Copy)]
struct Image {
    number: u64,
    outcome: Result<WidthMeasurement, Reject>,
}

/// A moment at which a frame is due.
#[derive(Debug, Clone, Copy)]
pub struct Shot {
    /// When.
    pub now: Stamp,
    /// The nozzle's path since the start of the bead \[mm\].
    pub path_mm: f64,
    /// The nozzle's height.
    pub z: Mm,
    /// Time for which its width is on the way.
    pub on_the_way: Span,
}

impl Camera {
    /// The camera of a cell.
    pub fn new(cell: &Cell, run: &RunPart, calibration: &Calibration) -> Result<Self, RenderError> {
        let simulation = &cell.simulation;
        Ok(Self {
            device: SimCamera::new(cell, calibration.clone())?,
            repeats: RepeatDetector::new(Roi { x: 0, y: 0, width: SIDE_PX, height: SIDE_PX }),
            offset: run.camera.offset,
            latency: simulation.latency.max(simulation.stamp_delay),
            stamp_delay: simulation.stamp_delay - run.camera.latency,
            image: None,
            last_arrival: Stamp::START,
            has_failed: false,
            has_answered: false,
        })
    }

    /// The bead rises, with its height above the first layer.
    pub fn raise(&mut self, rise: Mm) {
        self.device.raise(rise);
    }

    /// One period: what reaches the PC, and when.
    pub fn capture(
        &mut self,
        shot: Shot,
        bead: &LaidBead,
        faults: &Faults,
    ) -> Option<(Stamp, CameraMessage)> {
        let Shot { now, path_mm, z, on_the_way } = shot;
        if self.has_failed {
            return None;
        }
        if faults.has(now, FaultKind::CameraFails) {
            self.has_failed = true;
            let why = "it does not answer any more".to_owned();
            return Some((now, CameraMessage::Ended(Some(why))));
        }
        if faults.has(now, FaultKind::CameraSilent) {
            let first = !std::mem::replace(&mut self.has_answered, true);
            return first.then(|| (now, CameraMessage::Waiting("it does not answer".to_owned())));
        }
        self.has_answered = true;
        let under_mm = path_mm - self.offset.get();
        let taken = self.device.take(now, under_mm, z, bead);
        let is_frozen = faults.has(now, FaultKind::CameraFrozen);
        let image = self
            .image
            .take()
            .filter(|_| is_frozen)
            .unwrap_or(Image { number: taken.seq, outcome: taken.outcome });
        let mut arrival = now + self.latency + on_the_way;
        for kind in faults.at(now) {
            if let FaultKind::CameraLate(by) = kind {
                arrival = arrival + by;
            }
        }
        self.last_arrival = self.last_arrival.max(arrival);
        let message = self.measured(now, taken.seq, &image);
        self.image = Some(image);
        Some((self.last_arrival, message?))
    }

    fn measured(&mut self, now: Stamp, seq: u64, image: &Image) -> Option<CameraMessage> {
        let mut pixels = image.number.to_le_bytes().to_vec();
        pixels.resize(SIDE_PX * SIDE_PX, 0);
        let size = Size::new(SIDE_PX, SIDE_PX);
        let frame = Frame::new(seq, now + self.stamp_delay, size, Pixels::Grey8(pixels)).ok()?;
        let frame = Arc::new(frame);
        Some(CameraMessage::Frame(Box::new(MeasuredFrame {
            had_at: self.last_arrival,
            first_equal_at: self.repeats.first_of_equal(&frame),
            frame,
            outcome: image.outcome,
            roughness: None,
            edges: (Vec::new(), Vec::new()),
        })))
    }
}
