//! Reasons for which no model is accepted.

use crate::identify::fit::SamplesError;
use crate::identify::output_lead::OutputLead;

/// Why no model is accepted.
#[derive(Debug, thiserror::Error)]
pub enum NoModel {
    /// The data are not suitable.
    #[error(transparent)]
    Data(#[from] SamplesError),
    /// No form is accepted.
    #[error("no model can be trusted:{}{}", lines(.forms), drift_line(.drift.as_ref()))]
    None {
        /// Each form, and why it is not accepted.
        forms: Vec<(String, String)>,
        /// Sentence about a drift of the output, if there is one.
        drift: Option<String>,
    },
    /// The model does not predict the validation data.
    #[error(
        "the model ({form}, {estimation:.1} % on its own data) does not predict the data to \
         validate with: {validation:.1} %, no better than their mean. Are both of the same machine \
         and material, and is the input the one that moves the output?{}", drift_sentence(.drift.as_ref())
    )]
    PoorPrediction {
        /// Form of the model.
        form: String,
        /// Fit to its own data \[%\].
        estimation: f64,
        /// Fit to the validation data \[%\].
        validation: f64,
        /// Sentence about a drift of the output, if there is one.
        drift: Option<String>,
    },
    /// The model follows a drift of the output.
    #[error(
        "the output drifts: the gain of the model ({form}) is {gain:.4}, but {steady:.4} ± {sigma:.4} \
         once a straight line in time is taken off input and output; what moves the output besides \
         the input is in the model. Hold temperature and feed steady, use a part without the drift \
         (--from-s, --to-s), or take the line out of the log"
    )]
    Drifts {
        /// Form of the model.
        form: String,
        /// Gain of the model.
        gain: f64,
        /// Gain after removal of a straight line in time.
        steady: f64,
        /// Standard error of that gain.
        sigma: f64,
    },
    /// The output responds before the input changes.
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
