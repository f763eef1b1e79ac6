//! `identify.json`: a fitted model for programs.

use serde_json::{Value, json};

use super::model::{ModelStudy, form};
use crate::identify::experiment::Experiment;
use crate::identify::fit::{ComparedModel, FitQuality};

/// All results without the curves.
pub fn to_json(study: &ModelStudy) -> Value {
    let logs = &study.logs;
    let fit = &study.fit;
    let parameters = fit.parameters.iter().map(|one| {
        json!({
            "name": one.name,
            "value": one.value,
            "standard_error": one.sigma,
            "standard_error_if_white": one.sigma_if_white,
            "unit": study.unit_of(&one.name),
        })
    });
    json!({
        "input": { "quantity": logs.input.name, "unit": logs.input.unit.word() },
        "output": { "quantity": logs.output.name, "unit": logs.output.unit.word() },
        "estimation": data(&logs.estimation, &logs.source),
        "validation": logs.validation.as_ref().map(|(rest, from)| data(rest, from)),
        "model": {
            "form": form(fit.settings.structure),
            "numerator": fit.model.num(),
            "denominator": fit.model.den(),
            "dead_time_s": fit.model.dead_time_s(),
            "dc_gain": fit.model.dc_gain(),
            "input_level": fit.input_level,
            "output_level": fit.output_level,
            "parameters": parameters.collect::<Vec<Value>>(),
            "covariance": fit.covariance.row_iter()
                .map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>(),
        },
        "fit": quality(fit.quality),
        "validated": study.validation.map(quality),
        "residuals": {
            "sigma": fit.residual_sigma,
            "independent_samples": fit.independent_samples,
            "share_of_lags_outside_99_percent": study.residuals.fraction_outside(),
        },
        "compared": study.comparison.rows.iter().map(row).collect::<Vec<Value>>(),
        "reason": study.comparison.reason,
        "warnings": study.warnings,
    })
}

fn data(data: &Experiment, source: &str) -> Value {
    json!({
        "source": source,
        "samples": data.len(),
        "start_s": data.start_s,
        "step_s": data.step_s,
        "input_is_held": data.input_is_held,
    })
}

fn quality(quality: FitQuality) -> Value {
    json!({
        "nrmse_percent": quality.fit_percent,
        "rmse": quality.rmse,
        "mae": quality.mae,
    })
}

fn row(row: &ComparedModel) -> Value {
    let fit = row.fit.as_ref();
    json!({
        "form": form(row.settings.structure),
        "parameters": fit.map(|fit| fit.estimated).ok(),
        "nrmse_percent": fit.map(|fit| fit.quality.fit_percent).ok(),
        "validation_nrmse_percent": row.validation.map(|quality| quality.fit_percent),
        "bic": row.bic,
        "determined": fit.map(crate::identify::fit::Fit::is_determined).ok(),
        "refused": fit.err().map(ToString::to_string),
    })
}
