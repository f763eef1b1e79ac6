//! What the camera sees of a bead whose speed steps twice.

use super::*;
use crate::core::Stamp;
use crate::sim::hash;
use crate::width_control::bead_noise::BeadRoughness;
use crate::width_control::controller::BeadReport;
use crate::width_control::watch::{BeadWatch, WatchSettings};

const OFFSET_MM: f64 = 88.4;
const GAUGE_MM: f64 = 12.7;
const FRAME_S: f64 = 0.02;

/// What the camera sees of a bead whose speed steps to 80 mm/s and then once more.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Exponent of the bead that is seen; 0 for one that does not answer.
    exponent: f64,
    /// By how much farther back the camera looks than is known \[mm\].
    farther_mm: f64,
    /// Standard deviation of the offset \[mm\].
    offset_sigma_mm: f64,
    /// Amplitude of a wave of 100 mm of the flow.
    wave: f64,
    /// Its width over the target, before the step.
    ratio: f64,
    /// Speed of its beginning, which every bead answers \[mm/s\].
    begins_at: f64,
    /// Speed after the step \[mm/s\].
    ends_at: f64,
    /// Length of bead over which the speed changes to that one \[mm\].
    ramp_mm: f64,
    /// Whether control has an exponent.
    is_modelled: bool,
}

/// Path of the nozzle at the first step \[mm\].
const FIRST_MM: f64 = 300.0;

/// Path of the nozzle at the step \[mm\].
const STEP_MM: f64 = 900.0;

/// Path beyond the step until it is noticed that the width does not answer \[mm\].
fn noticed_after(seen: Seen) -> Option<f64> {
    let mut test = BeadWatch::new(WatchSettings {
        offset: Mm::constant(OFFSET_MM),
        offset_sigma: Mm::constant(seen.offset_sigma_mm),
        gauge: Mm::constant(GAUGE_MM),
        reference_speed: MmPerS::constant(100.0),
        exponent: seen.is_modelled.then_some(0.25),
        roughness: BeadRoughness { ratio: 0.0025, length_mm: 5.0 },
    });
    let (mut path, mut at) = (0.0, 0.0);
    while path < STEP_MM + 600.0 {
        let ramp = |mm: f64| ((mm - STEP_MM) / seen.ramp_mm).clamp(0.0, 1.0);
        let speed = match path {
            ..FIRST_MM => seen.begins_at,
            ..STEP_MM => 80.0,
            _ => 80.0 * (seen.ends_at / 80.0).powf(ramp(path)),
        };
        (path, at) = (path + speed * FRAME_S, at + FRAME_S);
        test.reported(&BeadReport {
            at: Stamp::from_secs(at),
            path: Mm::constant(path),
            speed: MmPerS::constant(speed),
            flow_ratio: 1.0,
        });
        let middle = path - OFFSET_MM - seen.farther_mm;
        let before = |mm: f64| ((mm - middle) / GAUGE_MM + 0.5).clamp(0.0, 1.0);
        let changed = if seen.ramp_mm > GAUGE_MM { ramp(middle) } else { 1.0 - before(STEP_MM) };
        let ln_speed = changed * (seen.ends_at / 80.0).ln();
        let begin = 0.25 * before(FIRST_MM) * (seen.begins_at / 80.0).ln();
        let flow = seen.wave * (std::f64::consts::TAU * middle / 100.0).sin();
        let [rough, _] = hash::normal_pair(hash::mix(&[5, (middle / 8.0).floor().to_bits()]));
        let ln_width = flow - begin - seen.exponent * ln_speed + 0.0013 * rough;
        let reading = WidthReading {
            width: Mm::constant(42.0 * seen.ratio * ln_width.exp()),
            sigma: Mm::constant(0.003),
        };
        let found = test.measured(Mm::constant(path), reading, Mm::constant(42.0)).no_response;
        if let Some(found) = found {
            assert!((0.05..0.26).contains(&found.speed_change), "{found:?}");
            assert!(found.width_change.abs() < 0.01, "{found:?}");
            assert!((found.speed_before.get() - 80.0).abs() < 1.0, "{found:?}");
            return Some(path - STEP_MM);
        }
    }
    None
}

const ANSWERS: Seen = Seen {
    exponent: 0.25,
    farther_mm: 0.0,
    offset_sigma_mm: 0.1 * OFFSET_MM,
    wave: 0.0,
    ratio: 1.05,
    begins_at: 80.0,
    ends_at: 100.0,
    ramp_mm: 1e-3,
    is_modelled: true,
};

#[test]
fn a_width_that_does_not_answer_is_noticed_within_the_offset_and_two_gauges() {
    let after = noticed_after(Seen { exponent: 0.0, ..ANSWERS }).unwrap();
    assert!(after <= OFFSET_MM + 2.0 * GAUGE_MM, "{after}");
}

#[test]
fn a_bead_that_has_shown_where_the_camera_looks_is_waited_for_no_longer() {
    let unknown = noticed_after(Seen { exponent: 0.0, ..ANSWERS }).unwrap();
    let known = Seen { exponent: 0.0, begins_at: 110.0, ..ANSWERS };
    let after = noticed_after(known).unwrap();
    assert!(after <= OFFSET_MM + GAUGE_MM && after < unknown - 5.0, "{after} {unknown}");
    // Where it is said to look makes no difference to that.
    let farther = noticed_after(Seen { farther_mm: 12.0, ..known }).unwrap();
    assert!((farther - 12.0 - after).abs() < 6.0, "{after} {farther}");
}

#[test]
fn an_offset_that_is_known_well_is_waited_for_no_longer() {
    let unknown = Seen { exponent: 0.0, ..ANSWERS };
    let known = Seen { offset_sigma_mm: 2.0, ..unknown };
    let [unknown, after] = [unknown, known].map(|seen| noticed_after(seen).unwrap());
    assert!(after <= OFFSET_MM + GAUGE_MM && after < unknown - 8.0, "{after} {unknown}");
    for farther_mm in [-4.0, 4.0] {
        assert_eq!(noticed_after(Seen { exponent: 0.25, farther_mm, ..known }), None);
    }
}

#[test]
fn widths_that_answer_are_not_reported_whatever_the_exponent_and_the_error_of_the_offset() {
    for exponent in [0.175, 0.25, 0.5, 1.0] {
        for farther_mm in [0.0, 6.6, 17.0, -2.2, -17.0] {
            for begins_at in [60.0, 80.0, 110.0] {
                let seen = Seen { exponent, farther_mm, begins_at, ..ANSWERS };
                assert_eq!(noticed_after(seen), None, "{seen:?}");
            }
        }
    }
}

#[test]
fn a_slow_change_without_an_answer_is_noticed_where_control_has_a_model() {
    let slow = Seen { exponent: 0.0, ratio: 1.025, ends_at: 95.0, ramp_mm: 500.0, ..ANSWERS };
    let after = noticed_after(slow).unwrap();
    // ln v has changed by 0.10 after three fifths of the ramp.
    assert!(after <= 300.0 + OFFSET_MM + 2.0 * GAUGE_MM, "{after}");
    assert_eq!(noticed_after(Seen { is_modelled: false, ..slow }), None);
    for exponent in [0.175, 0.25, 0.5] {
        assert_eq!(noticed_after(Seen { exponent, ..slow }), None, "{exponent}");
    }
}

#[test]
fn a_width_on_target_is_not_reported() {
    assert_eq!(noticed_after(Seen { exponent: 0.0, ratio: 1.0, ..ANSWERS }), None);
}

#[test]
fn half_of_the_answer_to_a_small_change_of_the_speed_is_an_answer() {
    let seen = Seen { exponent: 0.08, ends_at: 87.0, ..ANSWERS };
    assert_eq!(noticed_after(seen), None);
}

#[test]
fn a_flow_that_varies_as_much_anyway_may_have_cancelled_the_speed() {
    assert_eq!(noticed_after(Seen { exponent: 0.0, wave: 0.02, ..ANSWERS }), None);
}
