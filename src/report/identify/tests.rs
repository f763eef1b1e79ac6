//! From a log with a known truth to the files, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::core::{Quantity, Unit};
use crate::identify::experiment::Rules;
use crate::identify::fit::{DeadTime, Structure};
use crate::identify::model_file::{self, Conditions};
use crate::sim::flow_log::{self, FlowLog};

fn experiment(log: &FlowLog) -> Experiment {
    let rules = Rules::default();
    Experiment::new(&log.time_s, &log.screw_rpm, &log.flow_mm3_per_s, &rules).unwrap()
}

fn logs(estimation: Experiment, validation: Option<Experiment>) -> Logs {
    Logs {
        input: Quantity { name: "screw".to_owned(), unit: Unit::Rpm },
        output: Quantity { name: "flow".to_owned(), unit: Unit::Mm3PerS },
        source: "log.csv".to_owned(),
        estimation,
        validation: validation.map(|data| (data, "other.csv".to_owned())),
        from_rest: false,
    }
}

fn settings(structure: Structure) -> FitSettings {
    FitSettings::new(structure, DeadTime::Estimated { min_s: 0.0, max_s: 3.0 })
}

#[test]
fn a_known_extruder_is_found_again_and_its_file_is_read_again() {
    let data = logs(
        experiment(&flow_log::binary().unwrap()),
        Some(experiment(&flow_log::gaussian().unwrap())),
    );
    let forms = [
        settings(Structure::FirstOrder { zero: false }),
        settings(Structure::SecondOrderOscillating { zero: false }),
    ];
    let found = study(data, &forms).unwrap();
    assert_eq!(form(found.fit.settings.structure), "sopdt");
    for (name, truth) in
        [("gain", 19.05), ("period_s", 0.81), ("damping", 0.6), ("dead_time_s", 0.25)]
    {
        let one = found.fit.parameter(name).unwrap();
        assert!(
            (one.value - truth).abs() < 3.0 * one.sigma,
            "{name}: {} ± {}",
            one.value,
            one.sigma
        );
        assert!(one.sigma < 0.05 * truth, "{name} ± {}", one.sigma);
    }
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    // In the file stands what was found.
    let setting =
        Conditions { material: Some("PLA".to_owned()), nozzle_mm: Some(0.4), temperature_c: None };
    let model = found.model(setting);
    let text = model_file::to_toml(&model, &[super::text(&found)]);
    assert_eq!(model_file::parse("model.toml", &text).unwrap(), model);
    assert_eq!((model.input_range, model.operating_point.0), ((25.0, 35.0), 30.0));
    assert!((model.operating_point.1 - 540.0).abs() < 1.0);
    // The page shows every curve, and no number that is none.
    let page = page(&found);
    for part in ["over frequency", "after a step of 1 rpm", "autocorrelation", "other.csv"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("NaN") && !page.contains(">inf"));
    let json = to_json(&found);
    assert_eq!(json["model"]["form"], "sopdt");
    assert!(json["validated"]["nrmse_percent"].as_f64().unwrap() > 70.0);
}

#[test]
fn another_machine_is_not_predicted() {
    let mut other = flow_log::gaussian().unwrap();
    for flow in &mut other.flow_mm3_per_s {
        *flow = 1080.0 - *flow;
    }
    let data = logs(experiment(&flow_log::binary().unwrap()), Some(experiment(&other)));
    let refusal = study(data, &[settings(Structure::SecondOrderOscillating { zero: false })]);
    let said = refusal.unwrap_err().to_string();
    assert!(said.contains("does not predict") && said.contains("same machine"), "{said}");
}

#[test]
fn an_output_of_noise_alone_has_no_model() {
    let mut log = flow_log::binary().unwrap();
    let still = log.flow_mm3_per_s[..250].to_vec();
    for (flow, noise) in log.flow_mm3_per_s.iter_mut().zip(still.iter().cycle()) {
        *flow = *noise;
    }
    let refusal =
        study(logs(experiment(&log), None), &[settings(Structure::FirstOrder { zero: false })]);
    let said = refusal.unwrap_err().to_string();
    assert!(said.starts_with("no model can be trusted:\n  fopdt: "), "{said}");
}

#[test]
fn one_log_alone_is_warned_of() {
    let found = study(
        logs(experiment(&flow_log::binary().unwrap()), None),
        &[settings(Structure::SecondOrderOscillating { zero: false })],
    );
    let found = found.unwrap();
    assert!(found.warnings.iter().any(|warning| warning.contains("no validation data")));
    assert!(found.validation.is_none() && found.predicted.is_none());
    let page = page(&found);
    assert!(!page.contains("What it was validated with"));
}

/// The example's log with its flow changed, from time \[s\] and flow.
fn with(more: impl Fn(f64, f64) -> f64) -> Experiment {
    let mut log = flow_log::binary().unwrap();
    for (time_s, flow) in log.time_s.iter().zip(&mut log.flow_mm3_per_s) {
        *flow = more(*time_s, *flow);
    }
    experiment(&log)
}

#[test]
fn a_drift_is_no_answer() {
    let forms = [
        settings(Structure::FirstOrder { zero: false }),
        settings(Structure::SecondOrderOscillating { zero: false }),
    ];
    for slope in [2.0, -5.0] {
        // The output's own noise about a line.
        let drifting = with(|time_s, flow| 500.0 + slope * time_s + 0.02 * (flow - 540.0));
        let (first, rest) = drifting.split(0.3).unwrap();
        let said = study(logs(first, Some(rest)), &forms).unwrap_err().to_string();
        assert!(said.contains("the output drifts: a straight line in time explains"), "{said}");
        assert!(said.contains(if slope > 0.0 { "(up by 13" } else { "(down by 34" }), "{said}");
    }
}

/// All forms that are compared by default.
fn usual_forms() -> Vec<FitSettings> {
    [
        Structure::FirstOrder { zero: false },
        Structure::FirstOrder { zero: true },
        Structure::SecondOrderOscillating { zero: false },
        Structure::SecondOrderOscillating { zero: true },
        Structure::Transfer { poles: 3, zeros: 2 },
    ]
    .map(settings)
    .to_vec()
}

#[test]
fn a_drift_that_poles_and_zeros_take_up_is_refused_with_the_gain_without_it() {
    // True gain: 19.05.
    for slope in [0.5, 3.0] {
        let (first, rest) = with(|time_s, flow| flow + slope * time_s).split(0.3).unwrap();
        let answer = study(logs(first, Some(rest)), &usual_forms());
        match answer {
            Err(NoModel::Drifts { steady, sigma, .. }) => {
                assert!((steady - 19.05).abs() < 4.0 * sigma + 0.2, "{slope}: {steady}");
            }
            // The smallest of them may be reported beside the result.
            Ok(found) => {
                let off = (found.fit.model.dc_gain() / 19.05 - 1.0).abs();
                let is_reported = found.warnings.iter().any(|warning| warning.contains("drift"));
                assert!(off < 0.2 && is_reported, "{slope}: {off} {:?}", found.warnings);
            }
            Err(other) => assert!(other.to_string().contains("drift"), "{other}"),
        }
    }
}

#[test]
fn a_log_without_drift_has_the_same_gain_without_its_line() {
    for seed in 0..8_u64 {
        let sound = with(|time_s, flow| {
            let at = (time_s * 50.0).round().to_bits();
            flow + 4.0 * crate::sim::hash::normal_pair(crate::sim::hash::mix(&[seed, at]))[0]
        });
        let form = settings(Structure::SecondOrderOscillating { zero: false });
        let found = study(logs(sound, None), &[form]).unwrap();
        assert!(!found.warnings.iter().any(|warning| warning.contains("drift")), "{seed}");
    }
}

#[test]
fn a_drift_behind_another_refusal_is_reported() {
    let (first, rest) = with(|time_s, flow| flow + 5.0 * time_s).split(0.3).unwrap();
    let data = logs(first, Some(rest));
    let said = study(data, &[settings(Structure::FirstOrder { zero: false })]).unwrap_err();
    let said = said.to_string();
    assert!(said.contains("upper end") && said.contains("the output drifts up by 3"), "{said}");
}

#[test]
fn a_drift_beside_the_result_is_reported() {
    let drifting = with(|time_s, flow| flow + 0.25 * time_s);
    let found =
        study(logs(drifting, None), &[settings(Structure::SecondOrderOscillating { zero: false })]);
    let warnings = found.unwrap().warnings;
    for words in
        ["the output less the model drifts up by", "once a straight line in time is taken off"]
    {
        assert!(warnings.iter().any(|warning| warning.contains(words)), "{warnings:?}");
    }
}

#[test]
fn an_output_on_a_clock_that_is_behind_is_refused() {
    let mut log = flow_log::binary().unwrap();
    log.flow_mm3_per_s.rotate_left(50);
    let forms = [settings(Structure::SecondOrderOscillating { zero: false })];
    let said = study(logs(experiment(&log), None), &forms).unwrap_err().to_string();
    assert!(said.starts_with("the output answers the input some 0."), "{said}");
    assert!(said.contains("Are both on one clock"), "{said}");
}

#[test]
fn forms_that_are_refused_alike_are_reported_once() {
    let one = |form: &str, why: &str| (form.to_owned(), why.to_owned());
    let forms = vec![one("fopdt", "a"), one("3,2", "b"), one("sopdt", "a")];
    let refusal = NoModel::None { forms, drift: None };
    assert_eq!(refusal.to_string(), "no model can be trusted:\n  fopdt, sopdt: a\n  3,2: b");
}
