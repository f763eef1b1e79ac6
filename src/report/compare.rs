//! Controllers beside each other: a table, `compare.json` and a page.

use std::fmt::Write as _;

use maud::{Markup, html};
use serde::Serialize;

use super::chart::area::{Area, XAxis};
use super::chart::legend::legend;
use super::chart::palette;
use super::chart::palette::Ink;
use super::chart::plot::{Plot, PlotLayer, y_range};
use super::chart::series::Curve;
use super::html::whole_page;
use crate::trials::compare::{Figures, JUDGED_AFTER_MM, SIGMA_AFTER_MM, SeedStatistics};

/// One number of one controller at one width, as `compare.json` has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedNumber {
    /// The controller.
    pub controller: String,
    /// Width that was asked for \[mm\].
    pub width_mm: f64,
    /// What was found.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Mean over the seeds.
    pub mean: Option<f64>,
    /// Half the interval that holds the mean with 95 % confidence.
    pub confidence_95: Option<f64>,
    /// Median over the seeds.
    pub median: Option<f64>,
}

/// All that was compared.
#[derive(Debug)]
pub struct ControllerComparison {
    /// Names of the controllers.
    pub controllers: Vec<String>,
    /// Seeds of every controller and width.
    pub seeds: u64,
    /// For each width \[mm\] the figures of all controllers.
    pub widths: Vec<(f64, Vec<Figures>)>,
}

/// What is told of a controller: name, unit, and how it is told.
const QUANTITIES: [(&str, &str, Average); 6] = [
    ("mean size of the error", "mm", Average::Mean),
    ("RMS error", "mm", Average::Mean),
    ("RMS error over that of the first", "1", Average::Mean),
    ("settled within 0.5 mm after", "mm", Average::Median),
    ("integral of the error's size", "mm²", Average::Mean),
    ("scatter once settled", "mm", Average::Mean),
];

/// What is told of controllers that failed.
const FAILED: &str = "seeds never controlled, or stopped";

/// How a number over seeds is told in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Average {
    /// Mean and confidence.
    Mean,
    /// Median: some seeds may have none.
    Median,
}

fn estimates(figures: &Figures) -> [SeedStatistics; 6] {
    [
        figures.mean_error_mm,
        figures.rms_error_mm,
        figures.ratio,
        figures.settled_mm,
        figures.integral_mm2,
        figures.sigma_mm,
    ]
}

fn average(estimate: &SeedStatistics, how: Average) -> String {
    match (how, estimate.mean, estimate.confidence) {
        (Average::Median, ..) => estimate.median.map_or("never".to_owned(), short),
        (Average::Mean, Some(mean), Some(confidence)) => {
            format!("{} ± {}", short(mean), short(confidence))
        }
        (Average::Mean, mean, _) => mean.map_or("–".to_owned(), short),
    }
}

/// Digits that are worth comparing: thousandths below 2, tenths from 20 on.
fn short(value: f64) -> String {
    match value.abs() {
        size if size < 2.0 => format!("{value:.3}"),
        size if size < 20.0 => format!("{value:.2}"),
        _ => format!("{value:.1}"),
    }
}

impl ControllerComparison {
    /// The numbers, one by one.
    pub fn numbers(&self) -> Vec<ComparedNumber> {
        let mut numbers = Vec::new();
        for (width_mm, all) in &self.widths {
            for (controller, figures) in self.controllers.iter().zip(all) {
                #[expect(clippy::cast_precision_loss, reason = "seeds are few")]
                let failed = Some(figures.failed_seeds as f64);
                numbers.push(ComparedNumber {
                    controller: controller.clone(),
                    width_mm: *width_mm,
                    quantity: FAILED,
                    unit: "1",
                    mean: failed,
                    confidence_95: None,
                    median: failed,
                });
                for ((quantity, unit, _), estimate) in QUANTITIES.iter().zip(estimates(figures)) {
                    numbers.push(ComparedNumber {
                        controller: controller.clone(),
                        width_mm: *width_mm,
                        quantity,
                        unit,
                        mean: estimate.mean,
                        confidence_95: estimate.confidence,
                        median: estimate.median,
                    });
                }
            }
        }
        numbers
    }

    /// A table for a terminal: a block for each quantity, a line for each
    /// controller, a column for each width.
    pub fn plain(&self) -> String {
        let widest = self.controllers.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        // Writing to a string cannot fail.
        let mut text = format!("{:widest$}", "");
        for (width, _) in &self.widths {
            let head = format!("{width} mm");
            let _ = write!(text, "  {head:>16}");
        }
        for (at, (quantity, unit, how)) in QUANTITIES.iter().enumerate() {
            let unit = if *unit == "1" { String::new() } else { format!(" [{unit}]") };
            let _ = write!(text, "\n{quantity}{unit}\n");
            self.lines(&mut text, widest, |found| average(&estimates(found)[at], *how));
        }
        if self.has_failures() {
            let _ = writeln!(text, "\n{FAILED}");
            self.lines(&mut text, widest, |found| found.failed_seeds.to_string());
        }
        text
    }

    /// A line for each controller with a word for each width.
    fn lines(&self, text: &mut String, widest: usize, word: impl Fn(&Figures) -> String) {
        for (who, name) in self.controllers.iter().enumerate() {
            let _ = write!(text, "{name:widest$}");
            for (_, all) in &self.widths {
                let word = all.get(who).map(&word).unwrap_or_default();
                let _ = write!(text, "  {word:>16}");
            }
            text.push('\n');
        }
    }

    fn has_failures(&self) -> bool {
        self.widths.iter().flat_map(|(_, all)| all).any(|found| found.failed_seeds > 0)
    }

    /// The page.
    pub fn page(&self) -> String {
        let body = html! {
            h1 { "Controllers beside each other" }
            p.hint { "The same bead and the same disturbances for all, " (self.seeds) " seeds each. \
                Errors are those of the bead itself, from " (JUDGED_AFTER_MM) " mm after control \
                began, scatter from " (SIGMA_AFTER_MM) " mm after; ± is 95 % confidence of the mean \
                over seeds. Where it settled is the median." }
            section {
                h2 { "Numbers" }
                div.wide { (self.table()) }
            }
            @for (width, all) in &self.widths {
                section {
                    h2 { (width) " mm" }
                    (self.draw(*width, all))
                }
            }
            footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
                ". The numbers are in compare.json." }
        };
        whole_page("Controllers beside each other", &body).into_string()
    }

    fn table(&self) -> Markup {
        html! {
            table {
                thead { tr {
                    th { "quantity" } th { "controller" }
                    @for (width, _) in &self.widths { th.number { (width) " mm" } }
                } }
                tbody { @for (at, (quantity, unit, how)) in QUANTITIES.iter().enumerate() {
                    @for (who, name) in self.controllers.iter().enumerate() { tr {
                        td { @if who == 0 {
                            (quantity) @if *unit != "1" { " [" (unit) "]" }
                        } }
                        td { (name) }
                        @for (_, all) in &self.widths { td.number {
                            @if let Some(found) = all.get(who) {
                                (average(&estimates(found)[at], *how))
                            }
                        } }
                    } }
                } }
                @if self.has_failures() {
                    tbody { @for (who, name) in self.controllers.iter().enumerate() { tr {
                        td { @if who == 0 { (FAILED) } }
                        td { (name) }
                        @for (_, all) in &self.widths { td.number {
                            @if let Some(found) = all.get(who) { (found.failed_seeds) }
                        } }
                    } } }
                }
            }
        }
    }

    fn draw(&self, width: f64, all: &[Figures]) -> Markup {
        let errors: Vec<Curve> =
            all.iter().map(|found| found.error_profile.iter().copied().collect()).collect();
        let beads: Vec<Curve> =
            all.iter().map(|found| found.example.iter().copied().collect()).collect();
        let Some(range) = errors.iter().find_map(Curve::extent) else { return html! {} };
        let axis = XAxis::path(range);
        let name = format!("{width} mm");
        let target = PlotLayer::Level(width, palette::TARGET, name.as_str());
        let entries: Vec<(&str, Ink, &str)> = self
            .controllers
            .iter()
            .zip(palette::CONTROLLERS)
            .map(|(name, ink)| (name.as_str(), ink, ""))
            .collect();
        html! {
            (legend(&entries))
            (curves(&axis, "RMS error of all seeds [mm]", &errors, &[0.0], None))
            (curves(&axis, "width of the first seed [mm]", &beads, &[width], Some(target)))
        }
    }
}

fn curves(
    axis: &XAxis,
    y_title: &str,
    of: &[Curve],
    shown: &[f64],
    level: Option<PlotLayer<'_>>,
) -> Markup {
    let all: Vec<&Curve> = of.iter().collect();
    let curves = of.iter().zip(palette::CONTROLLERS).map(|(one, ink)| PlotLayer::Curve(one, ink));
    let plot = Plot {
        area: Area::wide(240.0),
        x: axis,
        y_title,
        y_range: y_range(&all, shown),
        layers: curves.chain(level).collect(),
    };
    plot.draw()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_controller_that_mostly_never_settles_says_so() {
        let never = SeedStatistics { mean: None, confidence: None, median: None };
        assert_eq!(average(&never, Average::Median), "never");
        let some = SeedStatistics { mean: Some(0.1), confidence: Some(0.02), median: Some(0.09) };
        assert_eq!(average(&some, Average::Mean), "0.100 ± 0.020");
    }
}
