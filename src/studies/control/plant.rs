//! The four cells of the study, and one bead in one of them.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use crate::cell::file::{Cell, Purpose, RunPart};
use crate::core::{Mm, MmPerS, Span};
use crate::numeric::root::{BISECTIONS, bisect};
use crate::rehearsal::fault::Fault;
use crate::rehearsal::{PAUSE, Rehearsal, Rehearsed};
use crate::run::runner::NoRecorder;
use crate::sim::cell::{LayerEnd, Observer, SimCell};
use crate::sim::hash;
use crate::studies::barjuei2022::scale;
use crate::studies::error::ReproduceError;
use crate::trials::layer::{LayerObserver, LayerTrial};
use crate::width_control::strategy::constant::ConstantStrategy;
use crate::width_control::strategy::pi::PiStrategy;

/// Target width \[mm\]: that of the nozzle, Shojaei Barjuei et al. 2022, section 3.2.
pub const TARGET_MM: f64 = 42.0;
/// Length of the first part of the bead, at the start speed \[mm\]: papers.md, "004".
pub const START_MM: f64 = 200.0;
/// Error within which a bead has its width \[mm\]: the paper's own band, section 5.
pub const BAND_MM: f64 = 0.5;

/// Time after the end of a bead until its run is over. Derived: until the last report has arrived,
/// 20 ms after the robot became idle, with as much to spare as a robot needs to stop.
const END: Span = Span::from_millis(500);

/// Gauge and rates of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopCell {
    /// Length of the gauge \[mm\].
    pub gauge_mm: f64,
    /// Frames per second.
    pub vision_hz: f64,
    /// Setpoints per second.
    pub link_hz: f64,
}

impl LoopCell {
    /// The paper's rates and those of a current camera and link, each with a short gauge and with
    /// the paper's.
    pub const ALL: [Self; 4] = [
        Self { gauge_mm: 12.7, vision_hz: 10.0, link_hz: 5.0 },
        Self { gauge_mm: 12.7, vision_hz: 50.0, link_hz: 20.0 },
        Self { gauge_mm: 63.0, vision_hz: 10.0, link_hz: 5.0 },
        Self { gauge_mm: 63.0, vision_hz: 50.0, link_hz: 20.0 },
    ];

    /// Whether its gauge is longer than the bead's roughness by far.
    pub const fn is_gauge_long(self) -> bool {
        self.gauge_mm > 30.0
    }

    /// Whether it has a current camera and link.
    pub const fn is_fast(self) -> bool {
        self.vision_hz > 30.0
    }
}

impl From<LoopCell> for String {
    fn from(cell: LoopCell) -> Self {
        format!("{} mm, {}/{} Hz", cell.gauge_mm, cell.vision_hz, cell.link_hz)
    }
}

/// What sets the speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// The controller of the study's cell.
    Distance,
    /// The paper's PI controller.
    Pi,
    /// A constant speed, from the start of the bead on.
    None,
}

/// How the bead of a plan is laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Execution {
    /// In the loop of `truebead simulate`.
    Simulated,
    /// By the control thread of a live run, on a virtual clock.
    Rehearsed,
}

impl Execution {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Simulated, Self::Rehearsed];

    /// The name of a case whose beads are laid so.
    pub fn case(self, name: &str) -> String {
        match self {
            Self::Simulated => name.to_owned(),
            Self::Rehearsed => format!("{REHEARSED}: {name}"),
        }
    }
}

/// The circumstance of beads that are laid live on a virtual clock.
pub const REHEARSED: &str = "live, virtual clock";

/// A bead to lay.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The cell.
    pub cell: Cell,
    /// Its run part.
    pub run: RunPart,
    /// The offset that the controller assumes, over the true one.
    pub assumed_offset: f64,
    /// How it is laid.
    pub execution: Execution,
}

impl Plan {
    /// The study's cell with a gauge and rates, and a controller. Fails if the cell that comes
    /// with the program cannot be read.
    pub fn new(cell: LoopCell, control: Control) -> Result<Self, ReproduceError> {
        let text = include_str!("cell.toml");
        let mut file = Cell::parse(Path::new("cell.toml"), text, Purpose::Run)?;
        let mut run = file.run.clone().ok_or(ReproduceError::NoRun)?;
        file.simulation.gauge_length = Mm::constant(cell.gauge_mm);
        (run.camera.rate_hz, run.robot.rate_hz) = (cell.vision_hz, cell.link_hz);
        match control {
            Control::Distance => {}
            Control::Pi => run.control.strategy = Arc::new(PiStrategy),
            Control::None => {
                let speed = MmPerS::constant(speed_for_target(&file));
                run.robot.start_speed = speed;
                run.control.strategy = Arc::new(ConstantStrategy { speed });
            }
        }
        Ok(Self { cell: file, run, assumed_offset: 1.0, execution: Execution::Simulated })
    }

    /// Sets the length of the bead \[mm\].
    pub fn long(mut self, mm: f64) -> Self {
        self.cell.simulation.path = Mm::new(mm).unwrap_or(self.cell.simulation.path);
        self
    }

    /// A bead without roughness.
    pub fn smooth(mut self) -> Self {
        self.cell.simulation.roughness.sigma_mm = 0.0;
        self
    }

    /// Sets how it is laid.
    pub const fn laid(mut self, execution: Execution) -> Self {
        self.execution = execution;
        self
    }

    /// Standard deviation of the mean width over the gauge by the roughness alone \[mm\]: that of
    /// the mean of a process whose autocorrelation is exp(−(distance/length)²).
    pub fn roughness_over_gauge_mm(&self) -> f64 {
        let roughness = self.cell.simulation.roughness;
        let ratio = self.cell.simulation.gauge_length.get() / roughness.length_mm;
        let mean_correlation = std::f64::consts::PI.sqrt() / ratio * libm::erf(ratio)
            + libm::expm1(-ratio * ratio) / (ratio * ratio);
        roughness.sigma_mm * mean_correlation.sqrt()
    }

    /// Lays it with one seed.
    pub fn lay(&self, seed: u64) -> Result<LayerTrial, ReproduceError> {
        let Self { cell, run, assumed_offset, execution } = self;
        match execution {
            Execution::Simulated => {
                Ok(LayerTrial::lay_mismatched(cell, run, &scale(), *assumed_offset, seed)?)
            }
            Execution::Rehearsed => {
                let run = self.rehearse(seed, Vec::new(), self.longest())?;
                let mut observer = LayerObserver::new(TARGET_MM);
                let end = run.replay(&mut observer);
                let length_mm = cell.simulation.path.get();
                Ok(observer.into_trial(&run.bead, length_mm, end.complete))
            }
        }
    }

    /// Lays it with one seed for an observer.
    pub fn observe(
        &self,
        seed: u64,
        observer: &mut impl Observer,
    ) -> Result<LayerEnd, ReproduceError> {
        match self.execution {
            Execution::Simulated => {
                let cell = self.with_seed(seed);
                let (run, factor) = (&self.run, self.assumed_offset);
                let mut sim = SimCell::mismatched(&cell, run, factor, scale(), NoRecorder)?;
                Ok(sim.layer(Mm::ZERO, observer))
            }
            Execution::Rehearsed => {
                Ok(self.rehearse(seed, Vec::new(), self.longest())?.replay(observer))
            }
        }
    }

    /// Duration of a run within which the bead is laid, even at its slowest speed.
    fn longest(&self) -> Span {
        let slowest_s = self.cell.simulation.path.get() / self.run.limits.min_speed.get();
        PAUSE + Span::from_secs(slowest_s) + END
    }

    fn with_seed(&self, seed: u64) -> Cell {
        let mut cell = self.cell.clone();
        cell.simulation.seed = seed + 1;
        cell
    }

    /// Lays it with one seed in a live run on a virtual clock, in which something may fail.
    pub fn rehearse(
        &self,
        seed: u64,
        faults: Vec<Fault>,
        duration: Span,
    ) -> Result<Rehearsed, ReproduceError> {
        let mut assumed_run = self.run.clone();
        assumed_run.camera.offset = assumed_run.camera.offset * self.assumed_offset;
        let rehearsal = Rehearsal {
            cell: &self.with_seed(seed),
            run: &self.run,
            assumed_run: &assumed_run,
            calibration: &scale(),
            extruder: None,
            faults,
            duration,
        };
        Ok(rehearsal.run()?)
    }

    /// A number for each seed, in parallel.
    pub fn each<T: Send>(
        &self,
        seeds: &Range<u64>,
        of: impl Fn(&LayerTrial) -> T + Send + Sync,
    ) -> Result<Vec<T>, ReproduceError> {
        seeds.clone().into_par_iter().map(|seed| Ok(of(&self.lay(seed)?))).collect()
    }
}

/// Speed at which the bead has the target width \[mm/s\].
fn speed_for_target(cell: &Cell) -> f64 {
    let bead = cell.simulation.bead;
    bisect(|speed| bead.width_at(speed) - TARGET_MM, 1.0, 1000.0, BISECTIONS)
}

/// Numbers that a seed draws, of a random stream.
#[derive(Debug, Clone, Copy)]
pub struct Draw {
    /// The stream.
    pub stream: u64,
    /// The seed.
    pub seed: u64,
}

impl Draw {
    /// The number of an index, uniform between two.
    pub fn between(self, index: u64, low: f64, high: f64) -> f64 {
        low + (high - low) * hash::unit(hash::mix(&[self.stream, self.seed, index]))
    }

    /// As [`Self::between`], uniform in the logarithm.
    pub fn ratio_between(self, index: u64, low: f64, high: f64) -> f64 {
        self.between(index, low.ln(), high.ln()).exp()
    }

    /// 1 or −1.
    pub fn sign(self, index: u64) -> f64 {
        if self.between(index, -1.0, 1.0) < 0.0 { -1.0 } else { 1.0 }
    }
}
