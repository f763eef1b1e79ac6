#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;

fn file() -> StartStopFile {
    let setting = Conditions { material: Some("PLA".to_owned()), ..Conditions::default() };
    StartStopFile {
        conditions: setting,
        parameters: assemble([1.0 / 3.0, 0.25, 640.0, 21.5], [0.2, 0.15, 0.11, 0.7]),
        sigma: assemble([0.01, 0.002, 8.0, 1e-7], [0.0, 0.001, 0.002, 0.03]),
        data: FitData {
            starts: 11,
            stops: 12,
            idle_range_s: [0.5, 240.0],
            flow_range_mm3_per_s: [398.0, 401.5],
            delay_sigma_s: 0.012,
        },
    }
}

#[test]
fn what_is_written_is_read_again() {
    let text = to_toml(&file(), &["Fitted to a log.\n\nOf two lines.".to_owned()]);
    assert!(text.starts_with("# Fitted to a log.\n#\n# Of two lines.\nversion = 1\n"), "{text}");
    assert!(text.contains("void_mm3 = 640.0\nvoid_sigma_mm3 = 8.0\n"), "{text}");
    assert_eq!(parse("starts.toml", &text).unwrap(), file());
}

#[test]
fn everything_that_is_wrong_is_told_at_once() {
    let text = to_toml(&file(), &[])
        .replace("version = 1", "version = 2")
        .replace("void_mm3 = 640.0", "void_mm3 = -640.0")
        .replace("rise_sigma_s = 0.002\n", "")
        .replace("fall_s = 0.15", "fall_s = 0.0\nfell_s = 0.15")
        .replace("stops = 12", "stops = 1.5");
    let said = parse("starts.toml", &text).unwrap_err().to_string();
    for part in [
        "starts.toml: 6 problems",
        "line 1: version: found 2",
        "start.void_mm3: found -640.0, expected a number from 0 to",
        "start.rise_sigma_s: found nothing",
        "stop.fall_s: found 0.0, expected a number from 0.000001",
        "stop.fell_s: found an unknown key, expected \"fall_s\"?",
        "data.stops: found 1.5, expected a whole number",
    ] {
        assert!(said.contains(part), "{part} in {said}");
    }
}

#[test]
fn more_drool_than_flow_is_refused_where_it_stands() {
    let text = to_toml(&file(), &[]).replace("drool_s = 0.11", "drool_s = 1.1");
    let said = parse("starts.toml", &text).unwrap_err().to_string();
    assert!(said.contains("stop.drool_s: found 1.1") && said.contains("line "), "{said}");
}
