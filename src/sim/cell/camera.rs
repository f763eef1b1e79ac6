//! The camera of a simulated cell: it measures rendered frames, or gives the true width with
//! noise.

use nalgebra::Vector2;

use crate::calibration::{Calibration, SurfaceMap};
use crate::cell::Cell;
use crate::cell::file::Mount;
use crate::control::Step;
use crate::core::{Frame, ImagePoint, Mm, MmPerS, Stamp, WidthRange};
use crate::scenario::table::WidthSource;
use crate::sim::hash;
use crate::sim::laid::LaidBead;
use crate::sim::render::{RenderError, Renderer};
use crate::sim::truth::Truth;
use crate::sim::view::gauge_middle;
use crate::vision::{BeadAxis, Edges, Hints, Measurer, Reject, WidthMeasurement};

/// The result of one frame, for an observer.
#[derive(Debug)]
pub struct FrameObservation<'a> {
    /// Number of the frame, counted over all layers.
    pub seq: u64,
    /// Time of capture.
    pub captured_at: Stamp,
    /// The width, or the status of a rejected frame.
    pub outcome: Result<WidthMeasurement, &'static str>,
    /// The frame, if one was rendered.
    pub frame: Option<&'a Frame>,
    /// The edges from which the width was measured, if a frame was measured.
    pub edges: Option<Edges<'a>>,
    /// The result of a perfect measurement; `None` unless the bead runs through the whole gauge.
    pub truth: Option<Truth>,
    /// Position of the middle of the gauge along the bead \[mm\].
    pub position_mm: f64,
    /// Step of the controller in response.
    pub step: &'a Step,
    /// Last speed that the robot reported.
    pub speed: Option<MmPerS>,
    /// Last setpoint.
    pub setpoint: Option<MmPerS>,
}

/// One image and its width.
#[derive(Debug)]
pub struct CapturedFrame {
    /// Its number.
    pub seq: u64,
    /// The width, or why the frame was rejected.
    pub outcome: Result<WidthMeasurement, Reject>,
    /// The image, if one was rendered.
    pub frame: Option<Frame>,
    /// The result of a perfect measurement of that image.
    pub truth: Option<Truth>,
}

/// The camera, and what measures its images.
pub struct SimCamera {
    level: WidthSource,
    seed: u64,
    seq: u64,
    gauge_length: f64,
    noise: Mm,
    /// Fraction of the widths that are outliers, and the largest relative error of an outlier.
    outlier_rate_and_size: (f64, f64),
    missing_fraction: f64,
    /// Widths that are plausible.
    width_range: WidthRange,
    rides_on_robot: bool,
    calibration: Calibration,
    surface_height: Mm,
    /// Height of the bead above that of the first layer.
    rise: Mm,
    middle: ImagePoint,
    across: Vector2<f64>,
    renderer: Renderer,
    measurer: Measurer,
}

impl SimCamera {
    /// The camera of a cell. Fails if the cell's bead cannot be rendered.
    pub fn new(cell: &Cell, calibration: Calibration) -> Result<Self, RenderError> {
        let simulation = &cell.simulation;
        let renderer = Renderer::of_cell(cell, &calibration)?;
        Ok(Self {
            level: simulation.width_source,
            seed: simulation.seed,
            seq: 0,
            gauge_length: simulation.gauge_length.get(),
            noise: simulation.width_noise,
            outlier_rate_and_size: (simulation.outlier_fraction, simulation.outlier_size),
            missing_fraction: simulation.missing_fraction,
            width_range: cell.gauge.width_range,
            rides_on_robot: cell.mount != Some(Mount::Fixed),
            calibration,
            surface_height: cell.surface_height,
            rise: Mm::ZERO,
            middle: gauge_middle(&cell.gauge.roi),
            across: match cell.gauge.axis {
                BeadAxis::Vertical => Vector2::x(),
                BeadAxis::Horizontal => Vector2::y(),
            },
            renderer,
            measurer: Measurer::new(cell.gauge, cell.white),
        })
    }

    /// Sets the height of the bead above that of the first layer.
    pub fn raise(&mut self, rise: Mm) {
        self.rise = rise;
        self.renderer.raise(rise);
    }

    /// The edges behind the last measured frame.
    pub fn edges(&self) -> Edges<'_> {
        self.measurer.edges()
    }

    /// Takes an image with the middle of the gauge at `position_mm` along the bead.
    pub fn take(&mut self, now: Stamp, position_mm: f64, z: Mm, bead: &LaidBead) -> CapturedFrame {
        let seq = self.seq;
        self.seq += 1;
        let z = self.rides_on_robot.then_some(z);
        let surface = self.calibration.surface(self.surface_height + self.rise, z);
        match self.level {
            WidthSource::Widths => {
                let outcome = self.width(seq, position_mm, bead, &surface);
                CapturedFrame { seq, outcome, frame: None, truth: None }
            }
            WidthSource::Frames => {
                let edges = |along: f64| bead.edges_at(position_mm + along);
                match self.renderer.render(seq, now, z, &edges) {
                    Err(_) => {
                        let outcome = Err(Reject::OffSurface);
                        CapturedFrame { seq, outcome, frame: None, truth: None }
                    }
                    Ok(rendered) => {
                        let outcome = self.measurer.measure(&rendered.frame, &surface);
                        let (frame, truth) = (Some(rendered.frame), rendered.truth);
                        CapturedFrame { seq, outcome, frame, truth }
                    }
                }
            }
        }
    }

    /// The true width over the gauge, with noise.
    fn width(
        &self,
        seq: u64,
        position_mm: f64,
        bead: &LaidBead,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let half = self.gauge_length / 2.0;
        let truth = if half > 0.0 {
            bead.mean_width(position_mm - half, position_mm + half)
        } else {
            bead.width_at(position_mm)
        };
        let refused = Reject::NoPair { got: 0.0, need: 1.0 };
        let truth = truth.ok_or(refused)?;
        let [noise, _] = hash::normal_pair(hash::mix(&[self.seed, NOISE_STREAM, seq]));
        if hash::unit(hash::mix(&[self.seed, MISSING_STREAM, seq])) < self.missing_fraction {
            return Err(refused);
        }
        let seen = (truth + noise * self.noise.get()) * self.outlier(seq);
        let width = Mm::new(seen).map_err(|_| refused)?;
        let WidthRange { min, max } = self.width_range;
        if !(min..=max).contains(&width) {
            let (got_mm, min_mm, max_mm) = (width.get(), min.get(), max.get());
            return Err(Reject::WidthOutOfRange { got_mm, min_mm, max_mm });
        }
        let (left, right) = self.edge_points(width, surface).ok_or(refused)?;
        Ok(WidthMeasurement {
            width,
            sigma: self.noise,
            left,
            right,
            slant_rad: 0.0,
            hints: Hints { used_fraction: 1.0, ..Hints::default() },
        })
    }

    /// Factor on a measured width; 1 unless it is an outlier.
    fn outlier(&self, seq: u64) -> f64 {
        let (fraction, size) = self.outlier_rate_and_size;
        if hash::unit(hash::mix(&[self.seed, OUTLIER_STREAM, seq])) < fraction {
            1.0 + size * (2.0 * hash::unit(hash::mix(&[self.seed, OUTLIER_STREAM, seq, 1])) - 1.0)
        } else {
            1.0
        }
    }

    /// Image points of the edges of a bead in the middle of the gauge.
    fn edge_points(&self, width: Mm, surface: &SurfaceMap) -> Option<(ImagePoint, ImagePoint)> {
        let middle = surface.to_mm(self.middle)?;
        let beside = surface.to_mm(self.middle + self.across)?;
        let half = (beside - middle).try_normalize(1e-12)? * (width.get() / 2.0);
        Some((surface.to_px(middle - half)?, surface.to_px(middle + half)?))
    }
}

/// Random stream of outliers. Derived: the bytes of "outlier".
const OUTLIER_STREAM: u64 = 0x6f75_746c_6965_7200;
/// Random stream of missing widths. Derived: the bytes of "missing".
const MISSING_STREAM: u64 = 0x006d_6973_7369_6e67;
/// Random stream of the noise of widths. Derived: the bytes of "noise".
const NOISE_STREAM: u64 = 0x006e_6f69_7365;
