//! Shojaei Barjuei et al. 2022 beside its tables and its figure 13.

mod ahead;
mod draw;
mod experiments;

use std::path::Path;

use super::{ControlSetup, LAYERS, LayerResult, LoopRates, StandOff};
use crate::cell::Cell;
use crate::cell::file::{Purpose, RunPart};
use crate::core::units::Mm;
use crate::io::progress::Progress;
use crate::studies::barjuei2022 as paper;
use crate::studies::error::ReproduceError;
use crate::studies::publication::Publication;
use crate::studies::row::TableRows;
use crate::studies::study::{Effort, Reproduced, Section};
use crate::vision::MeasureMethod;
use crate::width_control::target::WidthTarget;
use experiments::Experiments;

const CELL: &str = include_str!("../../../cells/barjuei2022.toml");
/// Sideways error of the second of two stacked layers \[mm\].
const ASIDE_MM: f64 = 0.8;
/// What progress is told of.
pub const EXPERIMENTS: u64 = 11 + ahead::EXPERIMENTS;
/// Layers one upon the other.
const TOWER_LAYERS: u32 = 20;
const SEEDS: u64 = 40;
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
        sections.push(Section {
            heading: format!("Layer of {} mm", layer.target_mm),
            hint: String::new(),
            drawing: draw::layer(limits, layer.target_mm, &theirs.example, &ours.example),
        });
        progress.advance();
    }
    sections.push(ahead::run(&mut work, progress)?);
    for layer in &LAYERS {
        work.frames(layer)?;
        progress.advance();
    }
    let curve = work.stand_off()?;
    sections.push(Section {
        heading: "Stand-off".to_owned(),
        hint: "A bead of 42 mm that lies nearer to the camera, or farther, than where the scale \
               was taken."
            .to_owned(),
        drawing: draw::stand_off(&curve),
    });
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
    fn tables(
        &mut self,
        case: &str,
        layer: &paper::PaperLayer,
        theirs: &LayerResult,
        ours: Option<&LayerResult>,
    ) {
        let figures = |found: &LayerResult| {
            [found.mean_error_mm, found.rms_error_mm, found.mean_speed_mm_per_s]
        };
        let published = [layer.mean_error_mm, layer.rms_error_mm, layer.mean_speed_mm_per_s];
        let names = [("mean error", "mm"), ("RMS error", "mm"), ("mean speed", "mm/s")];
        for (which, (quantity, unit)) in names.into_iter().enumerate() {
            let ours = ours.map(|found| figures(found)[which]);
            let simulated = Some(figures(theirs)[which]);
            self.rows.push(case, (quantity, unit), [Some(published[which]), simulated, ours]);
        }
    }

    /// The paper's loop on its own plant, and the law by distance with the
    /// paper's camera and link.
    fn widths(
        &mut self,
        layer: &paper::PaperLayer,
    ) -> Result<(LayerResult, LayerResult), ReproduceError> {
        let target = layer.target_mm;
        let theirs = paper::lay(&self.cell, &with_width(&self.run, target), self.seeds)?;
        let (cell, run) =
            ControlSetup::by_distance(LoopRates::PAPER).enter(&self.cell, &self.run, target);
        let ours = paper::lay(&cell, &run, self.seeds)?;
        self.tables(&format!("{target} mm"), layer, &theirs, Some(&ours));
        Ok((theirs, ours))
    }

    fn frames(&mut self, layer: &paper::PaperLayer) -> Result<(), ReproduceError> {
        let lay = |method| {
            let cell = paper::with_frames(&self.cell, method);
            paper::lay(&cell, &with_width(&self.run, layer.target_mm), self.frame_seeds)
        };
        let (theirs, ours) = (lay(MeasureMethod::EdgeLines)?, lay(MeasureMethod::Caliper)?);
        let case = format!("{} mm, frames rendered", layer.target_mm);
        self.tables(&case, layer, &theirs, Some(&ours));
        #[expect(clippy::cast_precision_loss, reason = "frames are few")]
        let refused = [None, Some(theirs.refused as f64), Some(ours.refused as f64)];
        self.rows.push(&case, ("frames of all seeds refused", "1"), refused);
        Ok(())
    }

    fn stand_off(&mut self) -> Result<Vec<StandOff>, ReproduceError> {
        let curve = paper::stand_off(&self.cell)?;
        for point in &curve {
            let case = format!("stand-off {:+} mm", point.nearer_mm);
            let published =
                (point.nearer_mm.abs() == 5.0).then_some(1.2 * point.nearer_mm.signum());
            let found = [published, Some(point.scale_error_mm), Some(point.full_error_mm)];
            self.rows.push(case, ("width error", "mm"), found);
        }
        Ok(curve)
    }

    fn stack(&mut self) -> Result<(), ReproduceError> {
        let lay = |method| {
            let cell = paper::with_frames(&self.cell, method);
            paper::stack(&cell, &self.run, ASIDE_MM)
        };
        let (theirs, ours) = (lay(MeasureMethod::EdgeLines)?, lay(MeasureMethod::Caliper)?);
        let case = format!("two layers of 38 mm, truly {ASIDE_MM} mm apart");
        let offsets = [None, Some(theirs.offset_mm), Some(ours.offset_mm)];
        self.rows.push(&case, ("lateral offset", "mm"), offsets);
        for (which, name) in
            ["mean width error, layer 1", "mean width error, layer 2"].into_iter().enumerate()
        {
            let error =
                |stack: &paper::Stack| Some(stack.widths_mm[which] - stack.true_widths_mm[which]);
            self.rows.push(&case, (name, "mm"), [None, error(&theirs), error(&ours)]);
        }
        Ok(())
    }

    /// The worst of many layers, measured and laid.
    fn tower(&mut self) -> Result<(), ReproduceError> {
        let layers = paper::tower(&self.cell, &self.run, TOWER_LAYERS)?;
        let worst = |of: fn(&paper::TowerLayer) -> f64| {
            layers.iter().map(|layer| of(layer).abs()).fold(0.0, f64::max)
        };
        let case =
            format!("{TOWER_LAYERS} layers of 20 mm and 42 mm, frames rendered, by distance");
        let pairs = [
            ("mean error of the measured width, worst layer", worst(|s| s.measured_error_mm)),
            ("mean error of the bead, worst layer", worst(|s| s.laid_error_mm)),
        ];
        for (quantity, found) in pairs {
            self.rows.push(&case, (quantity, "mm"), [None, None, Some(found)]);
        }
        Ok(())
    }
}

/// The same run with another width asked for.
fn with_width(run: &RunPart, target_mm: f64) -> RunPart {
    let mut run = run.clone();
    if let Ok(width) = Mm::new(target_mm) {
        run.control.target = WidthTarget::constant(width);
    }
    run
}
