//! Shojaei Barjuei et al. 2022 beside its tables 1 and 2 and its figure 13.

mod ahead;
mod draw;
mod experiments;

use std::path::Path;

use super::{ControlSetup, LAYERS, LayerResult, LoopRates};
use crate::cell::Cell;
use crate::cell::file::{Purpose, RunPart};
use crate::core::Mm;
use crate::io::progress::Progress;
use crate::studies::barjuei2022 as paper;
use crate::studies::error::ReproduceError;
use crate::studies::publication::Publication;
use crate::studies::study::{Effort, Reproduced, Section, TableRows};
use crate::vision::MeasureMethod;
use crate::width_control::target::WidthTarget;
use experiments::Experiments;

const CELL: &str = include_str!("../../../cells/barjuei2022.toml");
/// Lateral offset of the second of two stacked layers \[mm\], about 2 % of a width.
const ASIDE_MM: f64 = 0.8;
/// Steps of the progress bar. Derived: four layers, four with rendered frames, stand-off,
/// stack and tower, and those of `ahead`.
pub const EXPERIMENTS: u64 = 11 + ahead::EXPERIMENTS;
/// Number of stacked layers of the tower.
const TOWER_LAYERS: u32 = 20;
/// Seeds of the experiments: those of papers.md, "Noise in the loop, median of 40 seeds".
const SEEDS: u64 = 40;
/// Seeds of experiments with rendered frames, at least the three of papers.md.
const FRAME_SEEDS: u64 = 3;

/// Runs the experiments.
pub fn run(effort: Effort, progress: &mut Progress) -> Result<Reproduced, ReproduceError> {
    let cell = Cell::parse(Path::new("barjuei2022.toml"), CELL, Purpose::Run)?;
    let run = cell.run.clone().ok_or(ReproduceError::NoRun)?;
    let limits = run.limits;
    let seeds = effort.seeds.unwrap_or(SEEDS);
    let frame_seeds = effort.frame_seeds.unwrap_or(FRAME_SEEDS);
    let rows = TableRows::of(Publication::Barjuei2022);
    let mut work = Experiments { cell, run, seeds, frame_seeds, rows };
    let mut sections = Vec::new();
    for layer in &LAYERS {
        let (theirs, ours) = work.widths(layer)?;
        let drawing = draw::layer(limits, layer.target_mm, &theirs.example, &ours.example);
        sections.push(Section::new(format!("Layer of {} mm", layer.target_mm), "", drawing));
        progress.advance();
    }
    sections.push(ahead::run(&mut work, progress)?);
    for layer in &LAYERS {
        work.frames(layer)?;
        progress.advance();
    }
    sections.push(work.stand_off()?);
    progress.advance();
    work.stack()?;
    progress.advance();
    work.tower()?;
    progress.advance();
    let disturbed = ahead::disturbed_seeds(seeds);
    let about = format!(
        "Medians over {seeds} seeds, {frame_seeds} where every frame is rendered; means over \
         {disturbed} for flow sines and pulsations, and where it says mean. Errors are \
         those of the measured width over all bead of a 2 m layer that the camera saw, or, where \
         it says so, of the bead itself from 30 mm after control began. Ours is the controller by \
         distance, which is given the camera's distance, the noise, b = 0.25 and nothing else of \
         the plant, and gets a width 20 ms after capture; where frames are rendered, ours is the \
         measurement alone, in the paper's loop."
    );
    let title = "Shojaei Barjuei et al. 2022";
    Ok(Reproduced { title, about, rows: work.rows.into_vec(), sections })
}

impl Experiments {
    /// The three figures of a layer's tables, with the paper's method and ours.
    fn tables(&mut self, case: &str, layer: &paper::PaperLayer, found: [&LayerResult; 2]) {
        let published = [layer.mean_error_mm, layer.rms_error_mm, layer.mean_speed_mm_per_s];
        let [theirs, ours] =
            found.map(|found| [found.mean_error_mm, found.rms_error_mm, found.mean_speed_mm_per_s]);
        let names = [("mean error", "mm"), ("RMS error", "mm"), ("mean speed", "mm/s")];
        for (which, quantity) in names.into_iter().enumerate() {
            let values = [published, theirs, ours].map(|values| Some(values[which]));
            self.rows.push(case, quantity, values);
        }
    }

    /// The paper's controller on its own plant, and the distance controller with the paper's
    /// camera and link.
    fn widths(
        &mut self,
        layer: &paper::PaperLayer,
    ) -> Result<(LayerResult, LayerResult), ReproduceError> {
        let target = layer.target_mm;
        let theirs = paper::lay(&self.cell, &with_width(&self.run, target), self.seeds)?;
        let ours = ControlSetup::by_distance(LoopRates::PAPER);
        let (cell, run) = ours.enter(&self.cell, &self.run, target);
        let ours = paper::lay(&cell, &run, self.seeds)?;
        self.tables(&format!("{target} mm"), layer, [&theirs, &ours]);
        Ok((theirs, ours))
    }

    /// One result with every frame rendered, measured by the paper's method and by ours.
    fn by_method<T, E>(&self, lay: impl Fn(&Cell) -> Result<T, E>) -> Result<[T; 2], E> {
        let of = |method| lay(&paper::with_frames(&self.cell, method));
        Ok([of(MeasureMethod::EdgeLines)?, of(MeasureMethod::Caliper)?])
    }

    fn frames(&mut self, layer: &paper::PaperLayer) -> Result<(), ReproduceError> {
        let run = with_width(&self.run, layer.target_mm);
        let found = self.by_method(|cell| paper::lay(cell, &run, self.frame_seeds))?;
        let case = format!("{} mm, frames rendered", layer.target_mm);
        self.tables(&case, layer, found.each_ref());
        #[expect(clippy::cast_precision_loss, reason = "frames are few")]
        let [theirs, ours] = found.map(|found| found.refused as f64);
        self.rows.compare(&case, ("frames of all seeds refused", "1"), theirs, ours);
        Ok(())
    }

    fn stand_off(&mut self) -> Result<Section, ReproduceError> {
        let curve = paper::stand_off(&self.cell)?;
        for point in &curve {
            let case = format!("stand-off {:+} mm", point.nearer_mm);
            let published =
                (point.nearer_mm.abs() == 5.0).then_some(1.2 * point.nearer_mm.signum());
            let found = [published, Some(point.scale_error_mm), Some(point.full_error_mm)];
            self.rows.push(case, ("width error", "mm"), found);
        }
        let hint = "A bead of 42 mm that lies nearer to the camera, or farther, than where the scale \
                    was taken.";
        Ok(Section::new("Stand-off", hint, draw::stand_off(&curve)))
    }

    /// Both measuring methods on two layers, of which no paper gives numbers.
    fn stack(&mut self) -> Result<(), ReproduceError> {
        let [theirs, ours] = self.by_method(|cell| paper::stack(cell, &self.run, ASIDE_MM))?;
        let case = format!("two layers of 38 mm, the upper one {ASIDE_MM} mm aside");
        self.rows.compare(&case, ("lateral offset", "mm"), theirs.offset_mm, ours.offset_mm);
        let names = ["mean width error, layer 1", "mean width error, layer 2"];
        for (which, name) in names.into_iter().enumerate() {
            let error = |stack: &paper::Stack| stack.widths_mm[which] - stack.true_widths_mm[which];
            self.rows.compare(&case, (name, "mm"), error(&theirs), error(&ours));
        }
        Ok(())
    }

    /// The largest error over the layers of the tower, measured and laid.
    fn tower(&mut self) -> Result<(), ReproduceError> {
        let layers = paper::tower(&self.cell, &self.run, TOWER_LAYERS)?;
        let worst = |of: fn(&paper::TowerLayer) -> f64| {
            layers.iter().map(|layer| of(layer).abs()).fold(0.0, f64::max)
        };
        let case =
            format!("{TOWER_LAYERS} layers of 20 mm and 42 mm, frames rendered, by distance");
        let measured = ("mean error of the measured width, worst layer", "mm");
        self.rows.ours(&case, measured, worst(|layer| layer.measured_error_mm));
        let laid = ("mean error of the bead, worst layer", "mm");
        self.rows.ours(&case, laid, worst(|layer| layer.laid_error_mm));
        Ok(())
    }
}

/// The same run with another target width.
fn with_width(run: &RunPart, target_mm: f64) -> RunPart {
    let mut run = run.clone();
    if let Ok(width) = Mm::new(target_mm) {
        run.control.target = WidthTarget::constant(width);
    }
    run
}
