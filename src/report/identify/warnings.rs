//! Warnings about a model before it is used.

use super::model::{Logs, ModelStudy};
use crate::identify::digits::three_digits;
use crate::identify::experiment::Experiment;
use crate::identify::fit::{DOMINANT_FRACTION, Fit, FitNote, Trend};

/// Ratio of the RMS errors on validation data and on the model's own data above which there is a
/// warning. Errors are compared, because fits grow with the excitation.
const OVERFIT: f64 = 1.25;
/// Fit below which there is a warning \[%\].
const POOR_PERCENT: f64 = 50.0;
/// Minimum length of validation data \[slowest time constants\].
const TIME_CONSTANTS: f64 = 5.0;
/// Minimum length of a record \[slowest time constants\]. Derived: a first-order response is
/// then 1 − exp(−3) = 95 % complete.
const RECORD_TIME_CONSTANTS: f64 = 3.0;

impl ModelStudy {
    /// All warnings for the user of the model.
    pub(super) fn all_warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> =
            self.logs.estimation.notes.iter().map(|note| format!("data: {note}")).collect();
        if let Some((data, from)) = &self.logs.validation {
            warnings.extend(data.notes.iter().map(|note| format!("{from}: {note}")));
        }
        warnings.extend(self.fit.notes.iter().map(of_note));
        let own = self.fit.quality.fit_percent;
        if own < POOR_PERCENT {
            warnings.push(format!(
                "the model explains little of the data ({own:.1} % fit): look for what else moves \
                 the output, or filter it with --hampel and --smooth"
            ));
        }
        match self.validation {
            None => warnings.push(
                "there are no validation data: a fit to its own data says little; give --validate or \
                 --validate-fraction"
                    .to_owned(),
            ),
            Some(other) if other.rmse > OVERFIT * self.fit.quality.rmse => warnings.push(format!(
                "the model is {:.1} times as far off the data to validate with as off its own: take \
                 fewer poles and zeros, log longer, or look whether the machine has changed",
                other.rmse / self.fit.quality.rmse
            )),
            Some(_) => {}
        }
        warnings.extend(self.short_validation());
        warnings.extend(self.short_record());
        warnings.extend(of_drift(&self.fit, &self.logs));
        let (gain, input, output) =
            (self.fit.model.dc_gain(), self.logs.input.unit, self.logs.output.unit);
        if gain < 0.0 {
            warnings.push(format!(
                "the gain is {gain:.4}, less {output} from more {input}: look at the sign of a column"
            ));
        }
        let outside = self.residuals.fraction_outside();
        if outside > 0.05 {
            warnings.push(format!(
                "the residuals are autocorrelated ({:.0} % of the lags outside the 99 % band; the \
                 {} samples say as much as {:.0} independent ones): the noise is correlated, or \
                 something is missing in the model; the standard errors allow for it",
                100.0 * outside,
                self.fit.residuals.len(),
                self.fit.independent_samples
            ));
        }
        warnings
    }

    fn short_validation(&self) -> Option<String> {
        let (data, _) = self.logs.validation.as_ref()?;
        let needed_s = TIME_CONSTANTS * self.slowest_s() + self.fit.model.dead_time_s();
        (data.duration_s() < needed_s).then(|| {
            format!(
                "the {:.1} s to validate with are short for a time constant of {:.2} s: {needed_s:.1} \
                 s or more would serve",
                data.duration_s(),
                self.slowest_s()
            )
        })
    }

    /// Warning of a time constant near the length of the record, which may be a drift.
    fn short_record(&self) -> Option<String> {
        let (slowest_s, record_s) = (self.slowest_s(), self.logs.estimation.duration_s());
        (record_s < RECORD_TIME_CONSTANTS * slowest_s).then(|| {
            format!(
                "the record of {record_s:.1} s is short for a time constant of {slowest_s:.2} s: the \
                 model may follow a drift, such as a machine that warms up, and not the input. Log \
                 longer once it is warm, or take fewer poles"
            )
        })
    }
}

/// Warning of a linear drift in the residuals.
fn of_drift(fit: &Fit, logs: &Logs) -> Option<String> {
    let line = Trend::significant_in(&fit.residuals)?;
    Some(drift_sentence(logs, &line, "the output less the model", "the residuals"))
}

/// Warning of an output that a linear drift dominates, while the input has none.
pub(super) fn output_drift(logs: &Logs) -> Option<String> {
    let Experiment { input, output, .. } = &logs.estimation;
    let line =
        Trend::significant_in(output).filter(|line| line.explained_fraction > DOMINANT_FRACTION)?;
    (Trend::of(input).explained_fraction < DOMINANT_FRACTION)
        .then(|| drift_sentence(logs, &line, "the output", "it"))
}

/// Says how a series drifts and how much of it, or of what else, a straight line explains.
fn drift_sentence(logs: &Logs, line: &Trend, series: &str, explained: &str) -> String {
    format!(
        "{series} drifts {} by {} {} over {:.1} s, whatever the input does: a straight line in time \
         explains {:.0} % of {explained}. Hold temperature and feed steady, use a part without the drift \
         (--from-s, --to-s), or take the line out of the log",
        if line.rise > 0.0 { "up" } else { "down" },
        three_digits(line.rise.abs()),
        logs.output.unit,
        logs.estimation.duration_s(),
        100.0 * line.explained_fraction
    )
}

fn of_note(note: &FitNote) -> String {
    match note {
        FitNote::NoDeadTime => {
            "no dead time shows; it was left out (a clock of the output that is behind the input's \
 hides one)"
                .to_owned()
        }
        FitNote::PolesAreReal => {
            "the damping is above 1: both poles are real; --model sopdt-real gives \
                               their time constants"
                .to_owned()
        }
        FitNote::DeadTimeToAStep { dead_time_s } => format!(
            "the dead time of {dead_time_s:.4} s is determined to a whole step only: the form passes its \
             input straight through"
        ),
        FitNote::Undetermined(loose) => loose.to_string(),
    }
}
