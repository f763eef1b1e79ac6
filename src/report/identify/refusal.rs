//! Reasons for which no model is accepted.

use crate::identify::fit::SamplesError;
use crate::identify::output_lead::OutputLead;

/// No model is accepted.
#[derive(Debug, thiserror::Error)]
pub enum NoModel {
    /// The data.
    #[error(transparent)]
    Data(#[from] SamplesError),
    /// None of the forms.
    #[error("no model can be trusted:{}{}", lines(.forms), drift_line(.drift.as_ref()))]
    None {
        /// Each form, and why it is none.
        forms: Vec<(String, String)>,
        /// Sentence about a drifting output.
        drift: Option<String>,
    },
    /// It does not predict other data.
    #[error(
        "the model ({form}, {estimation:.1} % on its own data) does not predict the data to \
         validate with: {validation:.1} %, no better than their mean. Are both of the same machine \
         and material, and is the input the one that moves the output?{}", drift_sentence(.drift.as_ref())
    )]
    PoorPrediction {
        /// Its form.
        form: String,
        /// Fit to its own data \[%\].
        estimation: f64,
        /// Fit to the others \[%\].
        validation: f64,
        /// Sentence about a drifting output.
        drift: Option<String>,
    },
    /// It follows a drift of the output.
    #[error(
        "the output drifts: the gain of the model ({form}) is {gain:.4}, but {steady:.4} ± {sigma:.4} \
         once a straight line in time is taken off input and output; what moves the output besides \
         the input is in the model. Hold temperature and feed steady, use a part without the drift \
         (--from-s, --to-s), or take the line out of the log"
    )]
    Drifts {
        /// Its form.
        form: String,
        /// Its gain.
        gain: f64,
        /// The gain without the line.
        steady: f64,
        /// Standard error of that.
        sigma: f64,
    },
    /// The output moves before the input does.
    #[error(
        "the output answers the input some {:.2} s before it comes: a model that may do so fits to \
         {:.1} %, the best that does not to {:.1} %. Are both on one clock, each sample with the \
         moment at which it was taken? A closed loop that moves the input after the output looks the \
         same", .0.lead_s, .0.fit_percent, .0.causal_fit_percent
    )]
    Ahead(OutputLead),
}

/// A line for each reason, with the forms to which it applies.
fn lines(refused: &[(String, String)]) -> String {
    let mut lines: Vec<(String, &str)> = Vec::new();
    for (form, why) in refused {
        match lines.iter_mut().find(|(_, said)| said == why) {
            Some((forms, _)) => *forms = format!("{forms}, {form}"),
            None => lines.push((form.clone(), why)),
        }
    }
    let lines: Vec<String> =
        lines.iter().map(|(forms, why)| format!("\n  {forms}: {why}")).collect();
    lines.concat()
}

fn drift_line(sentence: Option<&String>) -> String {
    sentence.map_or_else(String::new, |sentence| format!("\n  beside: {sentence}"))
}

fn drift_sentence(sentence: Option<&String>) -> String {
    sentence.map_or_else(String::new, |sentence| format!(" Further, {sentence}"))
}
