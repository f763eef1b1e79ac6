//! Figures of frames whose parameters are drawn: over all of a set, and within each
//! third of each range.

use std::collections::BTreeMap;

use serde::Serialize;

use super::table::{aligned, marked};
use crate::offline::stats::Moments;
use crate::sim::drawn::{DrawnSet, Parameter, Requirements};

/// Errors of more standard deviations than this, and of more pixels, are silent.
const SILENT_SIGMAS: f64 = 5.0;
const SILENT_PX: f64 = 0.3;
/// Frames of the largest errors that are listed.
const WORST: usize = 5;
/// Fewest measured frames of a third that are judged.
const LEAST_FRAMES: u64 = 30;

/// What became of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnOutcome {
    /// Its number within the set.
    pub frame: u64,
    /// What was drawn for it.
    pub parameters: Vec<Parameter>,
    /// Error and standard deviation \[px\], or the status of the refusal.
    pub width: Result<Deviation, &'static str>,
}

/// How far off a width is \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Measured less true width.
    pub error_px: f64,
    /// As the measurement believes it.
    pub sigma_px: f64,
}

impl Deviation {
    fn is_silent(&self) -> bool {
        self.error_px.abs() > SILENT_PX && self.error_px.abs() > SILENT_SIGMAS * self.sigma_px
    }
}

/// Figures of some frames of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrawnFigures {
    /// The set's name.
    pub set: &'static str,
    /// Which of its frames: a third of a range, or all.
    pub part: String,
    /// Their number.
    pub frames: usize,
    /// Share that gave a width.
    pub measured_share: f64,
    /// Mean error \[px\].
    pub bias_px: Option<f64>,
    /// Root of the mean square of the error \[px\].
    pub rmse_px: Option<f64>,
    /// Root of the mean square of the error over its standard deviation.
    pub z: Option<f64>,
    /// Frames whose width is off by more than 5 standard deviations and 0.3 px.
    pub silent: usize,
    /// How many frames were refused, by status.
    pub refused: BTreeMap<&'static str, usize>,
    /// Frames with the largest errors over sigma.
    pub worst: Vec<u64>,
    /// What is missed.
    pub missed: Vec<String>,
}

/// Figures of a set: over all frames first, then the thirds of each range.
pub fn figures(set: &DrawnSet, outcomes: &[DrawnOutcome]) -> Vec<DrawnFigures> {
    let all: Vec<&DrawnOutcome> = outcomes.iter().collect();
    let mut figures = vec![DrawnFigures::of(set, "all".to_owned(), &all, true)];
    let Some(first) = outcomes.first() else { return figures };
    for parameter in &first.parameters {
        let (from, to) = parameter.range;
        let third = |value: f64| libm::log(value / from) / libm::log(to / from) * 3.0;
        for part in 0..3 {
            let (low, high) = (f64::from(part), f64::from(part + 1));
            let within = |outcome: &&DrawnOutcome| {
                let same = outcome.parameters.iter().find(|other| other.name == parameter.name);
                same.is_some_and(|other| {
                    let place = third(other.value);
                    (place >= low || part == 0) && (place < high || part == 2)
                })
            };
            let some: Vec<&DrawnOutcome> = outcomes.iter().filter(within).collect();
            let end = |place: f64| from * libm::exp(place / 3.0 * libm::log(to / from));
            let name = format!("{} {:.3} to {:.3}", parameter.name, end(low), end(high));
            figures.push(DrawnFigures::of(set, name, &some, false));
        }
    }
    figures
}

impl DrawnFigures {
    fn of(set: &DrawnSet, part: String, outcomes: &[&DrawnOutcome], whole: bool) -> Self {
        let (mut errors, mut ratios) = (Moments::default(), Moments::default());
        let mut refused = BTreeMap::new();
        let mut silent = 0;
        let mut by_ratio = Vec::new();
        for outcome in outcomes {
            match outcome.width {
                Ok(found) => {
                    let ratio = found.error_px / found.sigma_px;
                    errors.add(found.error_px);
                    ratios.add(ratio);
                    silent += usize::from(found.is_silent());
                    by_ratio.push((ratio.abs(), outcome.frame));
                }
                Err(status) => *refused.entry(status).or_insert(0) += 1,
            }
        }
        by_ratio.sort_by(|one, other| other.0.total_cmp(&one.0));
        let mut figures = Self {
            set: set.name,
            part,
            frames: outcomes.len(),
            measured_share: super::share(by_ratio.len(), outcomes.len()),
            bias_px: errors.mean(),
            rmse_px: errors.rms(),
            z: ratios.rms(),
            silent,
            refused,
            worst: by_ratio.iter().take(WORST).map(|(_, frame)| *frame).collect(),
            missed: Vec::new(),
        };
        if whole || errors.count() >= LEAST_FRAMES {
            figures.missed = figures.misses(&set.requirements, whole, errors.count());
        }
        figures
    }

    /// What is missed; figures of few frames may be off by three of their own
    /// standard errors.
    fn misses(&self, asked: &Requirements, whole: bool, measured: u64) -> Vec<String> {
        let mut missed = Vec::new();
        #[expect(clippy::cast_precision_loss, reason = "no set has 2^53 frames")]
        let (frames, count) = (self.frames as f64, measured.max(1) as f64);
        if let Some(least) = asked.measured.filter(|_| whole) {
            let chance = 3.0 * (least * (1.0 - least) / frames.max(1.0)).sqrt();
            if self.measured_share < least - chance {
                missed.push(format!("measured {:.1} %", 100.0 * self.measured_share));
            }
        }
        if let (Some(most), Some(bias), Some(rmse)) = (asked.bias_px, self.bias_px, self.rmse_px)
            && bias.abs() > most + 3.0 * rmse / count.sqrt()
        {
            missed.push(format!("bias {bias:.3} px"));
        }
        if let (Some((least, most)), Some(z)) = (asked.z, self.z) {
            let chance = 3.0 / (2.0 * count).sqrt();
            if z < least - chance || z > most + chance {
                missed.push(format!("z {z:.2}"));
            }
        }
        if let Some(most) = asked.silent.filter(|_| whole) {
            #[expect(clippy::cast_precision_loss, reason = "a count")]
            let silent = self.silent as f64;
            if silent > (most * frames).floor() {
                missed.push(format!("silent {}", self.silent));
            }
        }
        missed
    }

    fn cells(&self) -> [String; COLUMNS] {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
        };
        let refused: Vec<String> =
            self.refused.iter().map(|(status, count)| format!("{status} {count}")).collect();
        let verdict = match self.missed.as_slice() {
            [] => "kept".to_owned(),
            missed => format!("MISSED: {}", missed.join("; ")),
        };
        [
            self.set.to_owned(),
            self.part.clone(),
            self.frames.to_string(),
            number(Some(100.0 * self.measured_share), 2),
            number(self.bias_px, 3),
            number(self.rmse_px, 3),
            number(self.z, 2),
            self.silent.to_string(),
            if refused.is_empty() { "–".to_owned() } else { refused.join(", ") },
            verdict,
        ]
    }
}

const COLUMNS: usize = 10;
const HEADS: [&str; COLUMNS] = [
    "set",
    "part",
    "frames",
    "measured %",
    "bias px",
    "RMSE px",
    "z",
    "silent",
    "refused",
    "requirements",
];

/// The figures as a table for a terminal.
pub fn table(figures: &[DrawnFigures]) -> String {
    aligned(&HEADS, figures.iter().map(DrawnFigures::cells))
}

/// The figures as a table in Markdown.
pub fn markdown(figures: &[DrawnFigures]) -> String {
    marked(&HEADS, figures.iter().map(DrawnFigures::cells))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::drawn;

    #[test]
    fn frames_are_counted_within_thirds_and_judged() {
        let set = drawn::all().into_iter().find(|set| set.name == "blur").unwrap();
        let outcome = |frame: u32, width| {
            let value = 0.5 * libm::exp(f64::from(frame) / 300.0 * libm::log(12.0));
            let parameters = vec![Parameter { name: "blur_px", value, range: (0.5, 6.0) }];
            DrawnOutcome { frame: frame.into(), parameters, width }
        };
        let deviation = |error_px| Ok(Deviation { error_px, sigma_px: 0.1 });
        let sign = |frame: u32| if frame.is_multiple_of(2) { 0.1 } else { -0.1 };
        let mut outcomes: Vec<DrawnOutcome> =
            (0..300).map(|frame| outcome(frame, deviation(sign(frame)))).collect();
        let good = figures(&set, &outcomes);
        assert_eq!(good.len(), 4);
        assert!(good.iter().all(|part| part.missed.is_empty()), "{good:?}");
        assert_eq!(good[1].frames + good[2].frames + good[3].frames, 300);
        outcomes[299].width = deviation(4.0);
        for outcome in &mut outcomes[..40] {
            outcome.width = Err("unsure");
        }
        let bad = figures(&set, &outcomes);
        assert_eq!((bad[0].silent, bad[0].worst[0], bad[0].refused["unsure"]), (1, 299, 40));
        let missed = &bad[0].missed;
        assert!(
            missed[0].starts_with("measured 86.7") && missed[1].starts_with("z 2."),
            "{missed:?}"
        );
        assert!(bad[1].missed.is_empty() && !bad[3].missed.is_empty(), "{bad:?}");
    }
}
