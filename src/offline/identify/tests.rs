//! From a log with a known truth to the files, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::identify::experiment::Rules;
use crate::identify::fit::DeadTime;
use crate::identify::quantity::Unit;
use crate::sim::logged::{self, Logged};

fn experiment(log: &Logged) -> Experiment {
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

fn settings(structure: Structure) -> Settings {
    Settings::new(structure, DeadTime::Estimated { least_s: 0.0, most_s: 3.0 })
}

#[test]
fn a_known_extruder_is_found_again_and_its_file_is_read_again() {
    let data = logs(
        experiment(&logged::binary().unwrap()),
        Some(experiment(&logged::gaussian().unwrap())),
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
        Setting { material: Some("PLA".to_owned()), nozzle_mm: Some(0.4), temperature_c: None };
    let model = found.model(setting);
    let text = file::to_toml(&model, &[super::text(&found)]);
    assert_eq!(file::parse("model.toml", &text).unwrap(), model);
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
fn another_machine_is_not_foretold() {
    let mut other = logged::gaussian().unwrap();
    for flow in &mut other.flow_mm3_per_s {
        *flow = 1080.0 - *flow;
    }
    let data = logs(experiment(&logged::binary().unwrap()), Some(experiment(&other)));
    let refusal = study(data, &[settings(Structure::SecondOrderOscillating { zero: false })]);
    let said = refusal.unwrap_err().to_string();
    assert!(said.contains("does not foretell") && said.contains("same machine"), "{said}");
}

#[test]
fn an_output_of_noise_alone_has_no_model() {
    let mut log = logged::binary().unwrap();
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
        logs(experiment(&logged::binary().unwrap()), None),
        &[settings(Structure::SecondOrderOscillating { zero: false })],
    );
    let found = found.unwrap();
    assert!(found.warnings.iter().any(|warning| warning.contains("nothing was validated with")));
    assert!(found.validation.is_none() && found.foretold.is_none());
    let page = page(&found);
    assert!(!page.contains("What it was validated with"));
}
