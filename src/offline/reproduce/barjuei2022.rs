//! Shojaei Barjuei et al. 2022 beside its tables and its figure 13.

use std::path::Path;

use maud::{Markup, html};

use super::{Effort, ReproduceError, Reproduced, Rows, Section, Source, series};
use crate::config::Cell;
use crate::config::cell::{Purpose, RunPart};
use crate::control::limiter::Limits;
use crate::control::target::Target;
use crate::offline::Progress;
use crate::offline::report::area::{Area, XAxis};
use crate::offline::report::palette;
use crate::offline::report::plot::{Layer as Drawn, Plot, y_range};
use crate::offline::report::sections::legend;
use crate::sim::barjuei2022::{self as experiments, LAYERS, LayerResult, StandOff};
use crate::sim::score::Score;
use crate::units::Mm;
use crate::vision::Method;

const CELL: &str = include_str!("../../../cells/barjuei2022.toml");
/// Sideways error of the second of two stacked layers \[mm\].
const ASIDE_MM: f64 = 0.8;
/// What progress is told of.
pub const EXPERIMENTS: u64 = 11;
const SEEDS: u64 = 40;
const FRAME_SEEDS: u64 = 3;

/// The experiments' cell, how often they are run and what came out.
struct Experiments {
    cell: Cell,
    run: RunPart,
    seeds: u64,
    frame_seeds: u64,
    rows: Rows,
}

/// Runs the experiments.
pub fn run(effort: Effort, progress: &mut Progress) -> Result<Reproduced, ReproduceError> {
    let cell = Cell::parse(Path::new("barjuei2022.toml"), CELL, Purpose::Run)?;
    let run = cell.run.clone().ok_or(ReproduceError::NoRun)?;
    let limits = run.limits;
    let seeds = effort.seeds.unwrap_or(SEEDS);
    let frame_seeds = effort.frame_seeds.unwrap_or(FRAME_SEEDS);
    let rows = Rows::of(Source::Barjuei2022);
    let mut work = Experiments { cell, run, seeds, frame_seeds, rows };
    let mut sections = Vec::new();
    for layer in &LAYERS {
        let example = work.widths(layer)?;
        sections.push(Section {
            heading: format!("Layer of {} mm", layer.target_mm),
            hint: String::new(),
            drawing: draw_layer(limits, layer.target_mm, &example),
        });
        progress.advance();
    }
    work.without_noise()?;
    progress.advance();
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
        drawing: draw_stand_off(&curve),
    });
    progress.advance();
    work.stack()?;
    progress.advance();
    let about = format!(
        "Medians over {seeds} seeds, {frame_seeds} where every frame is rendered. Errors are \
         those of the measured width over all bead of a 2 m layer that the camera saw."
    );
    let title = "Shojaei Barjuei et al. 2022";
    Ok(Reproduced { title, about, rows: work.rows.into_vec(), sections })
}

impl Experiments {
    /// The three figures of a layer's tables, with the paper's method and ours.
    fn tables(
        &mut self,
        case: &str,
        layer: &experiments::Layer,
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

    fn widths(&mut self, layer: &experiments::Layer) -> Result<Score, ReproduceError> {
        let target = layer.target_mm;
        let found = experiments::lay(&self.cell, &asked(&self.run, target), self.seeds)?;
        let case = format!("{target} mm");
        self.tables(&case, layer, &found, None);
        if layer.target_mm == 42.0 {
            let what = ("width noise of the bead", "mm");
            self.rows.push(case, what, [None, Some(found.bead_scatter_mm), None]);
        }
        Ok(found.example)
    }

    fn without_noise(&mut self) -> Result<(), ReproduceError> {
        let mut quiet = self.cell.clone();
        quiet.simulation.width_noise = Mm::ZERO;
        for layer in &LAYERS {
            let found = experiments::lay(&quiet, &asked(&self.run, layer.target_mm), self.seeds)?;
            let case = format!("{} mm, without noise", layer.target_mm);
            let what = ("settles to 0.5 mm after", "mm");
            self.rows.push(case, what, [None, found.settled_mm, None]);
        }
        Ok(())
    }

    fn frames(&mut self, layer: &experiments::Layer) -> Result<(), ReproduceError> {
        let lay = |method| {
            let cell = experiments::with_frames(&self.cell, method);
            experiments::lay(&cell, &asked(&self.run, layer.target_mm), self.frame_seeds)
        };
        let (theirs, ours) = (lay(Method::EdgeLines)?, lay(Method::Caliper)?);
        let case = format!("{} mm, frames rendered", layer.target_mm);
        self.tables(&case, layer, &theirs, Some(&ours));
        Ok(())
    }

    fn stand_off(&mut self) -> Result<Vec<StandOff>, ReproduceError> {
        let curve = experiments::stand_off(&self.cell)?;
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
            let cell = experiments::with_frames(&self.cell, method);
            experiments::stack(&cell, &self.run, ASIDE_MM)
        };
        let (theirs, ours) = (lay(Method::EdgeLines)?, lay(Method::Caliper)?);
        let case = format!("two layers of 38 mm, truly {ASIDE_MM} mm apart");
        let offsets = [None, Some(theirs.offset_mm), Some(ours.offset_mm)];
        self.rows.push(&case, ("lateral offset", "mm"), offsets);
        for (which, name) in
            ["mean width error, layer 1", "mean width error, layer 2"].into_iter().enumerate()
        {
            let error = |stack: &experiments::Stack| {
                Some(stack.widths_mm[which] - stack.true_widths_mm[which])
            };
            self.rows.push(&case, (name, "mm"), [None, error(&theirs), error(&ours)]);
        }
        Ok(())
    }
}

/// The same run with another width asked for.
fn asked(run: &RunPart, target_mm: f64) -> RunPart {
    let mut run = run.clone();
    if let Ok(width) = Mm::new(target_mm) {
        run.control.target = Target::constant(width);
    }
    run
}

fn draw_layer(limits: Limits, target: f64, score: &Score) -> Markup {
    let (width, speed) = (series(&score.widths), series(&score.speeds));
    let Some(range) = speed.extent() else { return html! {} };
    let axis = XAxis::path(range);
    let name = format!("{target} mm");
    let bounds = [limits.min_speed.get(), limits.max_speed.get()];
    let names = bounds.map(|bound| format!("{bound} mm/s"));
    let widths = Plot {
        area: Area::wide(220.0),
        x: &axis,
        y_title: "width [mm]",
        y_range: y_range(&[&width], &[target]),
        layers: vec![
            Drawn::Curve(&width, palette::WIDTH),
            Drawn::Level(target, palette::TARGET, &name),
        ],
    };
    let speeds = Plot {
        area: Area::wide(220.0),
        x: &axis,
        y_title: "speed [mm/s]",
        y_range: y_range(&[&speed], &bounds),
        layers: vec![
            Drawn::Curve(&speed, palette::SPEED),
            Drawn::Level(bounds[0], palette::LIMIT, &names[0]),
            Drawn::Level(bounds[1], palette::LIMIT, &names[1]),
        ],
    };
    html! {
        (legend(&[("measured width", palette::WIDTH, ""), ("target", palette::TARGET, "dash")]))
        (widths.draw())
        (legend(&[("robot", palette::SPEED, ""), ("limits of the cell", palette::LIMIT, "dash")]))
        (speeds.draw())
    }
}

fn draw_stand_off(curve: &[StandOff]) -> Markup {
    let pick = |value: fn(&StandOff) -> f64| {
        series(&curve.iter().map(|point| (point.nearer_mm, value(point))).collect::<Vec<_>>())
    };
    let (scale, full) = (pick(|p| p.scale_error_mm), pick(|p| p.full_error_mm));
    let Some(range) = scale.extent() else { return html! {} };
    let axis =
        XAxis { title: "height above the calibrated one [mm]".to_owned(), range, divisor: 1.0 };
    let plot = Plot {
        area: Area::wide(260.0),
        x: &axis,
        y_title: "error of the width [mm]",
        y_range: y_range(&[&scale, &full], &[]),
        layers: vec![Drawn::Curve(&scale, palette::PAPER), Drawn::Curve(&full, palette::OURS)],
    };
    html! {
        (legend(&[
            ("single scale, as in the paper", palette::PAPER, ""),
            ("ours: full calibration, height given", palette::OURS, ""),
        ]))
        (plot.draw())
    }
}
