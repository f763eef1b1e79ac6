//! What is written is read again, and what is wrong is told.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;

fn model() -> ModelFile {
    let parameter = |name: &str, value, standard_error| SavedParameter {
        name: name.to_owned(),
        value,
        standard_error,
    };
    ModelFile {
        conditions: Conditions {
            material: Some("PLA \"silk\" é".to_owned()),
            nozzle_mm: Some(0.4),
            temperature_c: Some(210.0),
        },
        kind: "fopdt".to_owned(),
        input: Quantity { name: "screw".to_owned(), unit: Unit::Rpm },
        output: Quantity { name: "flow".to_owned(), unit: Unit::Mm3PerS },
        input_range: (20.0, 40.0),
        operating_point: (30.123_456_789_012_345, 512.0),
        transfer: TransferFunction::new(&[25.0], &[0.84, 1.0], 1.0 / 3.0).unwrap(),
        uncertainty: Some(ParameterUncertainty {
            parameters: vec![parameter("gain", 25.0, 0.1), parameter("dead time [s]", 0.4, 1e-7)],
            covariance: vec![0.01, -1e-9, -1e-9, 1e-14],
        }),
        fit: Some(FitSummary {
            step_s: 0.02,
            estimation_percent: 91.25,
            validation_percent: Some(90.0),
        }),
    }
}

#[test]
fn what_is_written_is_read_again() {
    let all = model();
    let text = to_toml(&all, &["Fitted to a log.\nOf two lines.".to_owned()]);
    assert!(text.starts_with("# Fitted to a log.\n# Of two lines.\nversion = 1\n"), "{text}");
    assert_eq!(parse("model.toml", &text).unwrap(), all);
    let setting = Conditions::default();
    let bare = ModelFile { conditions: setting, uncertainty: None, fit: None, ..all };
    assert_eq!(parse("model.toml", &to_toml(&bare, &[])).unwrap(), bare);
}

#[test]
fn everything_that_is_wrong_is_told_at_once() {
    let text = to_toml(&model(), &[])
        .replace("version = 1", "version = 2\nmatrial = \"PLA\"")
        .replace("unit = \"rpm\"", "unit = \"turns\"")
        .replace("[20.0, 40.0]", "[40.0, 20.0]")
        .replace("[0.84, 1.0]", "[-0.84, 1.0]")
        .replace("covariance = [0.01, ", "covariance = [nan, ")
        .replace("step_s = 0.02\n", "");
    let said = parse("model.toml", &text).unwrap_err().to_string();
    for part in [
        "model.toml: 7 problems",
        "line 1: version: found 2",
        "line 2: matrial: found an unknown key, expected \"material\"?",
        "input.unit: found \"turns\", expected \"rpm\" or \"mpa\"",
        "input.range: found [40, 20]",
        "transfer.denominator: found [-0.84, 1.0], which is unstable, expected poles",
        "uncertainty.covariance: found [nan, ",
        "fit.step_s: found nothing",
    ] {
        assert!(said.contains(part), "{part} in {said}");
    }
}

#[test]
fn a_model_that_differentiates_is_refused() {
    let text = to_toml(&model(), &[]).replace("[25.0]", "[1.0, 2.0, 25.0]");
    let said = parse("model.toml", &text).unwrap_err().to_string();
    assert!(said.contains("2 zeros and only 1 poles"), "{said}");
}
