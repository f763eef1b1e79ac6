//! How well widths are measured: figures of sets of pictures with their truth.

use serde::Serialize;

use super::stats::Moments;
use crate::sim::sets::{Limits, Set};

/// Error from which a width that was reported is silently wrong \[px\].
const SILENT_PX: f64 = 0.5;
/// Ends of the 95 % interval, in standard deviations.
const INTERVAL: f64 = 1.96;
const HEADS: [&str; 9] = [
    "frames",
    "bias px",
    "RMSE px",
    "RMSE/bound",
    "measured %",
    "silent %",
    "RMS e/σ",
    "in 95 %",
    "limits",
];

/// Error and standard deviation of one measured width \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Measured less true width.
    pub error_mm: f64,
    /// As the measurement believes it.
    pub sigma_mm: f64,
}

/// The figures of one set. Without a measured frame most of them are none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetFigures {
    /// The set's name.
    pub set: &'static str,
    /// Frames that were rendered.
    pub frames: usize,
    /// Mean error \[px\].
    pub bias_px: Option<f64>,
    /// Root of the mean square of the error \[px\].
    pub rmse_px: Option<f64>,
    /// The same over the smallest standard deviation that is possible.
    pub rmse_over_bound: Option<f64>,
    /// Mean error \[mm\].
    pub bias_mm: Option<f64>,
    /// Root of the mean square of the error \[mm\].
    pub rmse_mm: Option<f64>,
    /// Share of the frames that gave a width.
    pub measured_share: f64,
    /// Share of the frames that gave a width more than half a pixel off.
    pub silent_share: f64,
    /// Root of the mean square of the error over its standard deviation.
    pub rms_over_sigma: Option<f64>,
    /// Share of the widths whose 95 % interval holds the true one.
    pub within_interval: Option<f64>,
    /// Whether the set's limits are kept; none where it has none.
    pub kept: Option<bool>,
}

impl SetFigures {
    /// Of a set with a pixel of `mm_per_px`; `None` stands for a frame that was
    /// refused.
    pub fn of(set: &Set, mm_per_px: f64, outcomes: &[Option<Outcome>]) -> Self {
        let (mut errors, mut ratios) = (Moments::default(), Moments::default());
        let (mut silent, mut within) = (0_usize, 0_usize);
        for outcome in outcomes.iter().flatten() {
            let ratio = outcome.error_mm / outcome.sigma_mm;
            errors.add(outcome.error_mm);
            ratios.add(ratio);
            silent += usize::from(outcome.error_mm.abs() > SILENT_PX * mm_per_px);
            within += usize::from(ratio.abs() <= INTERVAL);
        }
        let (bias_mm, rmse_mm) = (errors.mean(), errors.rms());
        let rmse_px = rmse_mm.map(|rmse| rmse / mm_per_px);
        let measured = outcomes.iter().flatten().count();
        Self {
            set: set.name,
            frames: outcomes.len(),
            bias_px: bias_mm.map(|bias| bias / mm_per_px),
            rmse_px,
            rmse_over_bound: rmse_px.map(|rmse| rmse / set.bound_px()),
            bias_mm,
            rmse_mm,
            measured_share: share(measured, outcomes.len()),
            silent_share: share(silent, outcomes.len()),
            rms_over_sigma: ratios.rms(),
            within_interval: (measured > 0).then(|| share(within, measured)),
            kept: kept(&set.limits, bias_mm, rmse_mm),
        }
    }

    fn cells(&self) -> [String; 9] {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
        };
        [
            self.frames.to_string(),
            number(self.bias_px, 4),
            number(self.rmse_px, 4),
            number(self.rmse_over_bound, 2),
            number(Some(100.0 * self.measured_share), 2),
            number(Some(100.0 * self.silent_share), 3),
            number(self.rms_over_sigma, 2),
            number(self.within_interval.map(|share| 100.0 * share), 1),
            match self.kept {
                None => "–",
                Some(true) => "kept",
                Some(false) => "missed",
            }
            .to_owned(),
        ]
    }
}

/// A limit that nothing was measured against is missed.
fn kept(limits: &Limits, bias_mm: Option<f64>, rmse_mm: Option<f64>) -> Option<bool> {
    let within = |figure: Option<f64>, limit: Option<f64>| {
        limit.map(|limit| figure.is_some_and(|figure| figure.abs() <= limit))
    };
    let verdicts = [within(bias_mm, limits.bias_mm), within(rmse_mm, limits.rmse_mm)];
    verdicts.into_iter().flatten().reduce(|a, b| a && b)
}

#[expect(clippy::cast_precision_loss, reason = "no set has 2^53 frames")]
fn share(part: usize, of: usize) -> f64 {
    part as f64 / of.max(1) as f64
}

/// The figures as a table for a terminal.
pub fn table(figures: &[SetFigures]) -> String {
    let width = figures.iter().map(|f| f.set.len()).max().unwrap_or(3);
    let line = |set: &str, cells: [String; 9]| {
        let cells = cells.map(|cell| format!("{cell:>10}"));
        format!("{set:width$}  {}\n", cells.join("  "))
    };
    let head = line("set", HEADS.map(str::to_owned));
    figures.iter().fold(head, |text, figures| text + &line(figures.set, figures.cells()))
}

/// The figures as a table in Markdown.
pub fn markdown(figures: &[SetFigures]) -> String {
    let rule = format!("|---|{}\n", "---:|".repeat(HEADS.len()));
    let head = format!("| set | {} |\n{rule}", HEADS.join(" | "));
    figures.iter().fold(head, |text, figures| {
        text + &format!("| {} | {} |\n", figures.set, figures.cells().join(" | "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::sets;

    #[test]
    fn figures_are_counted_over_the_frames_they_are_of() {
        let set = sets::all().into_iter().find(|set| set.name == "tilted").unwrap();
        let outcome = |error_mm| Some(Outcome { error_mm, sigma_mm: 0.01 });
        let outcomes = [outcome(0.003), outcome(-0.005), outcome(0.062), None];
        let figures = SetFigures::of(&set, 0.1, &outcomes);
        assert!((figures.bias_px.unwrap() - 0.2).abs() < 1e-12);
        let mean_square = (0.003_f64.powi(2) + 0.005_f64.powi(2) + 0.062_f64.powi(2)) / 3.0;
        assert!((figures.rmse_mm.unwrap() - mean_square.sqrt()).abs() < 1e-12);
        assert_eq!((figures.measured_share, figures.silent_share), (0.75, 0.25));
        assert!((figures.within_interval.unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(figures.kept, Some(false));
        assert_eq!(SetFigures::of(&set, 0.1, &outcomes[..2]).kept, Some(true));
        assert_eq!(SetFigures::of(&set, 0.1, &[None]).kept, Some(false));
    }

    #[test]
    fn tables_have_a_line_a_set() {
        let set = &sets::all()[0];
        let figures = [SetFigures::of(set, 0.1, &[None]), SetFigures::of(set, 0.1, &[None])];
        assert_eq!(table(&figures).lines().count(), 3);
        let markdown = markdown(&figures);
        assert!(markdown.lines().all(|line| line.matches('|').count() == 11), "{markdown}");
    }
}
