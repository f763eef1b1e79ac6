use super::*;
use crate::extruder::feedforward::unpredictable_fraction;

/// Off over on, mean of five seeds and the smallest.
fn ratio(unmodelled: f64, control: WheelControl) -> (f64, f64) {
    let found = compare(5, unmodelled, control).unwrap();
    (found.ratio, found.min_ratio)
}

const PRESSURE: Sensors = Sensors { camera_mm: None, pressure: true, exponent: EXPONENT };

#[test]
fn on_and_off_differ_as_in_an_independent_simulation() {
    let (exact, _) = ratio(0.0, WheelControl::Thesis);
    assert!((exact / 66.0 - 1.0).abs() < 0.1, "{exact}");
    let (unmodelled, _) = ratio(UNMODELLED_FRACTION, WheelControl::Thesis);
    assert!((unmodelled / 5.8 - 1.0).abs() < 0.03, "{unmodelled}");
}

#[test]
fn the_drives_dead_time_compensates_that_of_the_wheel() {
    let (exact, _) = ratio(0.0, WheelControl::Ahead);
    assert!(exact > 1000.0, "{exact}");
}

#[test]
fn a_pressure_reading_gains_more_than_any_feedforward() {
    let (mean, min) = ratio(UNMODELLED_FRACTION, WheelControl::Observed(PRESSURE));
    assert!(mean > 7.5 && min > 7.0, "{mean} {min}");
    let wrong = Sensors { exponent: 1.5, ..PRESSURE };
    let (_, min) = ratio(UNMODELLED_FRACTION, WheelControl::Observed(wrong));
    assert!(min > 6.5, "{min}");
}

#[test]
fn a_camera_cannot_do_better_than_its_age_allows() {
    for behind_mm in [2.0, 10.0] {
        let sensors = Sensors { camera_mm: Some(behind_mm), pressure: false, ..PRESSURE };
        let (found, _) = ratio(UNMODELLED_FRACTION, WheelControl::Observed(sensors));
        let age = camera_age_s(behind_mm);
        let bound = 1.0 / (UNMODELLED_FRACTION * unpredictable_fraction(age, CORRELATION_S));
        // The flow with its noise is a little more than the modelled one.
        assert!(found < 1.05 * bound && found > 0.9 * bound, "{behind_mm}: {found} {bound}");
    }
}

#[test]
fn a_seed_gives_the_same_run_again() {
    let run = |seed| {
        ExtruderRun::new(seed, UNMODELLED_FRACTION).unwrap().run(WheelControl::Thesis).unwrap()
    };
    assert_eq!(run(3), run(3));
    assert_ne!(run(3), run(4));
}
