//! `report.html` of a model.

use maud::{Markup, html};

use super::curves;
use super::model::{ModelStudy, form};
use super::table::{independent, significant, transfer};
use crate::report::chart::legend;
use crate::report::chart::palette::MODEL;
use crate::report::html::{VerdictLevel, about, number, titled_page, verdict};

/// The page.
pub fn page(study: &ModelStudy) -> String {
    let logs = &study.logs;
    let title = format!("Model {} → {}", logs.input, logs.output);
    let body = html! {
        (about([
            ("data", logs.source.clone()),
            ("samples", logs.estimation.len().to_string()),
            ("rate", format!("{:.2} Hz", 1.0 / logs.estimation.step_s)),
            ("form", form(study.fit.settings.structure)),
        ]))
        (judged(study))
        (parameters(study))
        (compared(study))
        section {
            h2 { "What the model was fitted to" }
            (curves::over_time(study, &logs.estimation, &study.fit.predicted))
        }
        @if let (Some((data, from)), Some(predicted)) = (&logs.validation, &study.predicted) {
            section {
                h2 { "What it was validated with" }
                p.hint { (from) ", from " (format!("{:.2}", data.start_s)) " s on" }
                (curves::over_time(study, data, predicted))
            }
        }
        (answers(study))
        (residuals(study))
    };
    titled_page(&title, &body, ". The numbers are in identify.json, the model is in model.toml.")
}

fn judged(study: &ModelStudy) -> Markup {
    let own = format!("The model fits its own data to {:.1} %", study.fit.quality.fit_percent);
    let text = match study.validation {
        Some(other) => format!("{own} and predicts other data to {:.1} %.", other.fit_percent),
        None => format!("{own}."),
    };
    verdict(VerdictLevel::with_caution(!study.warnings.is_empty()), &text, &study.warnings)
}

fn parameters(study: &ModelStudy) -> Markup {
    let fit = &study.fit;
    html! {
        section {
            h2 { "The model" }
            p.hint { code { (transfer(fit)) } }
            div.wide { table {
                thead { tr {
                    th { "parameter" } th.number { "value" } th.number { "standard error" }
                    th.number { "if the noise were white" } th { "unit" }
                } }
                tbody { @for one in &fit.parameters { tr {
                    td { (one.name) }
                    td.number { (significant(one.value)) }
                    td.number { (significant(one.sigma)) }
                    td.number { (significant(one.sigma_if_white)) }
                    td { (study.unit_of(&one.name)) }
                } } }
            } }
        }
    }
}

fn compared(study: &ModelStudy) -> Markup {
    let comparison = &study.comparison;
    if comparison.rows.len() < 2 {
        return html! {};
    }
    html! {
        section {
            h2 { "Forms that were compared" }
            p.hint { "Taken: " (form(study.fit.settings.structure)) ": " (comparison.reason) "." }
            div.wide { table {
                thead { tr {
                    th { "form" } th.number { "parameters" } th.number { "fit [%]" }
                    th.number { "validation [%]" } th.number { "BIC" } th { "" }
                } }
                tbody { @for row in &comparison.rows { tr {
                    td { (form(row.settings.structure)) }
                    @match &row.fit {
                        Ok(fit) => {
                            td.number { (fit.estimated) }
                            td.number { (number(Some(fit.quality.fit_percent), 2)) }
                            td.number { (number(row.validation.map(|q| q.fit_percent), 2)) }
                            td.number { (number(row.bic, 1)) }
                            td { @if !fit.is_determined() { "not determined by the data" } }
                        }
                        Err(why) => td colspan="5" { (why) },
                    }
                } } }
            } }
        }
    }
}

fn answers(study: &ModelStudy) -> Markup {
    html! {
        section {
            h2 { "Responses" }
            p.hint { "The bands are two standard deviations wide to either side; they come from the \
                noise of the data, not from unmodelled dynamics." }
            (legend(&[("model", MODEL, ""), ("± 2 standard deviations", MODEL, "area")]))
            (curves::step(study))
            (curves::bode(study))
        }
    }
}

fn residuals(study: &ModelStudy) -> Markup {
    html! {
        section {
            h2 { "Residuals" }
            p.hint { (independent(&study.fit)) }
            (curves::residuals(study))
            (curves::autocorrelation(study))
        }
    }
}
