//! Comparison of controllers: a table, `compare.json` and a page.

use std::fmt::Write as _;

use maud::{Markup, html};
use serde::Serialize;

use super::chart::{Ink, PlotCurve, PlotLayer, XAxis, legend, palette, wide_plot, y_range};
use super::html::titled_page;
use crate::numeric::number::to_f64;
use crate::trials::compare::{Figures, JUDGED_AFTER_MM, SIGMA_AFTER_MM, SeedStatistics};

/// One number of one controller at one width, as in `compare.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedNumber {
    /// The controller.
    pub controller: String,
    /// Target width \[mm\].
    pub width_mm: f64,
    /// The quantity.
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

/// The figures of all controllers.
#[derive(Debug)]
pub struct ControllerComparison {
    /// Names of the controllers.
    pub controllers: Vec<String>,
    /// Seeds of every controller and width.
    pub seeds: u64,
    /// Width \[mm\] and figures of all controllers, for each width.
    pub widths: Vec<(f64, Vec<Figures>)>,
}

/// A compared quantity: its name, its unit, how seeds are averaged, and its value.
struct Quantity(&'static str, &'static str, Average, fn(&Figures) -> SeedStatistics);

/// The quantities that are compared.
const QUANTITIES: [Quantity; 6] = [
    Quantity("mean size of the error", "mm", Average::Mean, |one| one.mean_error_mm),
    Quantity("RMS error", "mm", Average::Mean, |one| one.rms_error_mm),
    Quantity("RMS error over that of the first", "1", Average::Mean, |one| one.ratio),
    Quantity("settled within 0.5 mm after", "mm", Average::Median, |one| one.settled_mm),
    Quantity("integral of the error's size", "mm²", Average::Mean, |one| one.integral_mm2),
    Quantity("scatter once settled", "mm", Average::Mean, |one| one.sigma_mm),
];

impl Quantity {
    /// Its name and its unit.
    fn title(&self) -> String {
        if self.1 == "1" { self.0.to_owned() } else { format!("{} [{}]", self.0, self.1) }
    }

    /// Its average over the seeds of a controller, as text.
    fn average(&self, figures: &Figures) -> String {
        average(&(self.3)(figures), self.2)
    }
}

/// Name of the count of failed seeds.
const FAILED: &str = "seeds never controlled, or stopped";

/// How a quantity is averaged over the seeds in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Average {
    /// Mean with its confidence interval.
    Mean,
    /// Median, for quantities that some seeds do not have.
    Median,
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

/// A number with three decimals below 2, two below 20, otherwise one.
fn short(value: f64) -> String {
    match value.abs() {
        size if size < 2.0 => format!("{value:.3}"),
        size if size < 20.0 => format!("{value:.2}"),
        _ => format!("{value:.1}"),
    }
}

impl ControllerComparison {
    /// All numbers, for `compare.json`.
    pub fn numbers(&self) -> Vec<ComparedNumber> {
        let mut numbers = Vec::new();
        for (width_mm, all) in &self.widths {
            for (controller, figures) in self.controllers.iter().zip(all) {
                let number = |quantity, unit, over: SeedStatistics| ComparedNumber {
                    controller: controller.clone(),
                    width_mm: *width_mm,
                    quantity,
                    unit,
                    mean: over.mean,
                    confidence_95: over.confidence,
                    median: over.median,
                };
                let failed = Some(to_f64(figures.failed_seeds));
                let failed = SeedStatistics { mean: failed, confidence: None, median: failed };
                numbers.push(number(FAILED, "1", failed));
                numbers.extend(QUANTITIES.iter().map(|one| number(one.0, one.1, (one.3)(figures))));
            }
        }
        numbers
    }

    /// A table for a terminal: a block for each quantity, a line for each controller, a column for
    /// each width.
    pub fn plain(&self) -> String {
        let widest = self.controllers.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        // Writing to a string cannot fail.
        let mut text = format!("{:widest$}", "");
        for (width, _) in &self.widths {
            let head = format!("{width} mm");
            let _ = write!(text, "  {head:>16}");
        }
        for quantity in &QUANTITIES {
            let _ = write!(text, "\n{}\n", quantity.title());
            self.lines(&mut text, widest, |found| quantity.average(found));
        }
        if self.has_failures() {
            let _ = writeln!(text, "\n{FAILED}");
            self.lines(&mut text, widest, |found| found.failed_seeds.to_string());
        }
        text
    }

    /// A line for each controller, with a cell for each width.
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
            p.hint { "The same bead and the same disturbances for all, " (self.seeds) " seeds each. \
                Errors are those of the bead itself, from " (JUDGED_AFTER_MM) " mm after control \
                began, standard deviations from " (SIGMA_AFTER_MM) " mm after; ± is 95 % confidence of the mean \
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
        };
        titled_page("Controllers beside each other", &body, ". The numbers are in compare.json.")
    }

    fn table(&self) -> Markup {
        html! {
            table {
                thead { tr {
                    th { "quantity" } th { "controller" }
                    @for (width, _) in &self.widths { th.number { (width) " mm" } }
                } }
                tbody { @for quantity in &QUANTITIES {
                    (self.rows(&quantity.title(), |found| quantity.average(found)))
                } }
                @if self.has_failures() {
                    tbody { (self.rows(FAILED, |found| found.failed_seeds.to_string())) }
                }
            }
        }
    }

    /// A row for each controller, with a cell for each width.
    fn rows(&self, title: &str, word: impl Fn(&Figures) -> String) -> Markup {
        html! { @for (who, name) in self.controllers.iter().enumerate() { tr {
            td { @if who == 0 { (title) } }
            td { (name) }
            @for (_, all) in &self.widths { td.number { @if let Some(found) = all.get(who) { (word(found)) } } }
        } } }
    }

    fn draw(&self, width: f64, all: &[Figures]) -> Markup {
        let errors: Vec<PlotCurve> =
            all.iter().map(|found| found.error_profile.iter().copied().collect()).collect();
        let beads: Vec<PlotCurve> =
            all.iter().map(|found| found.example.iter().copied().collect()).collect();
        let Some(range) = errors.iter().find_map(PlotCurve::extent) else { return html! {} };
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
    of: &[PlotCurve],
    shown: &[f64],
    level: Option<PlotLayer<'_>>,
) -> Markup {
    let all: Vec<&PlotCurve> = of.iter().collect();
    let curves = of.iter().zip(palette::CONTROLLERS).map(|(one, ink)| PlotLayer::Curve(one, ink));
    wide_plot(axis, y_title, 240.0, y_range(&all, shown), curves.chain(level).collect())
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
