//! A fitted model as text.

use std::fmt::Write;

use super::model::{ModelStudy, form};
use crate::identify::experiment::Experiment;
use crate::identify::fit::{ComparedModel, Fit, FitNote, FitQuality};
use crate::report::html::number;

/// Minimum width of the column with the names of forms \[letters\].
const NAME: usize = 10;

/// A short table.
pub fn text(study: &ModelStudy) -> String {
    let mut text = String::new();
    data(&mut text, study);
    compared(&mut text, study);
    parameters(&mut text, study);
    quality(&mut text, study);
    for warning in &study.warnings {
        put(&mut text, "warning", warning);
    }
    text
}

/// Adds a line with a heading.
pub fn put(text: &mut String, head: &str, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}", format!("{head:<11}{line}").trim_end());
}

fn data(text: &mut String, study: &ModelStudy) {
    let logs = &study.logs;
    let described = |data: &Experiment| {
        format!(
            "{} samples, {:.1} s at {:.2} Hz from {:.2} s on",
            data.len(),
            data.duration_s(),
            1.0 / data.step_s,
            data.start_s
        )
    };
    put(text, "data", &format!("{}: {}", logs.source, described(&logs.estimation)));
    if let Some((validation, from)) = &logs.validation {
        put(text, "validation", &format!("{from}: {}", described(validation)));
    }
    let held = if logs.estimation.input_is_held { ", held from sample to sample" } else { "" };
    put(text, "input", &format!("{}{held}", logs.input));
    put(text, "output", &logs.output.to_string());
}

fn compared(text: &mut String, study: &ModelStudy) {
    let rows = &study.comparison.rows;
    if rows.len() > 1 {
        let names = rows.iter().map(|row| form(row.settings.structure).len());
        let width = names.fold(NAME, usize::max) + 1;
        let line = format!(
            "{:<width$}{:>10}{:>10}{:>13}{:>12}",
            "form", "parameters", "fit %", "validation %", "BIC"
        );
        put(text, "compared", &line);
        for row in rows {
            put(text, "", &one(row, width));
        }
        let chosen = form(study.fit.settings.structure);
        put(text, "chosen", &format!("{chosen}: {}", study.comparison.reason));
    } else {
        put(text, "form", &form(study.fit.settings.structure));
    }
}

fn one(row: &ComparedModel, width: usize) -> String {
    let name = form(row.settings.structure);
    match &row.fit {
        Err(why) => format!("{name:<width$}{why}"),
        Ok(fit) => {
            let loose = if fit.is_determined() { "" } else { "  not determined by the data" };
            format!(
                "{name:<width$}{:>10}{:>10.2}{:>13}{:>12}{loose}",
                fit.estimated,
                fit.quality.fit_percent,
                number(row.validation.map(|quality| quality.fit_percent), 2),
                number(row.bic, 1)
            )
        }
    }
}

fn parameters(text: &mut String, study: &ModelStudy) {
    let fit = &study.fit;
    let line = format!("{:<18}{:>12}{:>14}  {}", "", "value", "std. error", "unit");
    put(text, "model", &line);
    for one in &fit.parameters {
        let [value, sigma] = [one.value, one.sigma].map(significant);
        let unit = study.unit_of(&one.name);
        put(text, "", &format!("{:<18}{value:>12}{sigma:>14}  {unit}", one.name));
    }
    if fit.parameter("dead_time_s").is_none() {
        let to_a_step = |note: &FitNote| matches!(note, FitNote::DeadTimeToAStep { .. });
        let known = if fit.notes.contains(&FitNote::NoDeadTime) {
            "none shows"
        } else if fit.notes.iter().any(to_a_step) {
            "to a step"
        } else {
            "given"
        };
        let dead_time = significant(fit.model.dead_time_s());
        put(text, "", &format!("{:<18}{dead_time:>12}{known:>14}  s", "dead_time_s"));
    }
    put(text, "", &transfer(fit));
}

/// The transfer function in one line.
pub fn transfer(fit: &Fit) -> String {
    let row = |row: &[f64]| {
        let powers = (0..row.len()).rev();
        let term = |(value, power): (&f64, usize)| match power {
            0 => significant(*value),
            1 => format!("{} s", significant(*value)),
            _ => format!("{} s^{power}", significant(*value)),
        };
        row.iter().zip(powers).map(term).collect::<Vec<_>>().join(" + ")
    };
    let dead_time_s = fit.model.dead_time_s();
    let dead_time = if dead_time_s > 0.0 {
        format!(" e^(-{} s)", significant(dead_time_s))
    } else {
        String::new()
    };
    format!("({}) / ({}){dead_time}", row(fit.model.num()), row(fit.model.den()))
        .replace("+ -", "- ")
}

/// A number with five significant digits.
pub fn significant(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.3e}");
    }
    let before = size.log10().floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 8")]
    let places = (4.0 - before).clamp(0.0, 8.0) as usize;
    format!("{value:.places$}")
}

fn quality(text: &mut String, study: &ModelStudy) {
    let unit = study.logs.output.unit;
    let words = |of: FitQuality| {
        let [rmse, mae] = [of.rmse, of.mae].map(significant);
        format!("{:.2} % NRMSE, RMSE {rmse} {unit}, MAE {mae} {unit}", of.fit_percent)
    };
    put(text, "fit", &words(study.fit.quality));
    put(text, "residuals", &independent(&study.fit));
    if let Some(other) = study.validation {
        put(text, "validated", &words(other));
    }
}

/// Number of residuals, and the number of independent ones with the same information.
pub fn independent(fit: &Fit) -> String {
    format!(
        "{} samples that say as much as {:.0} independent ones",
        fit.residuals.len(),
        fit.independent_samples
    )
}
