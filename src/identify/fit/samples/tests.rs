#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;

fn sine(n: u32) -> Vec<f64> {
    (0..n).map(|k| libm::sin(0.1 * f64::from(k))).collect()
}

#[test]
fn what_is_no_record_is_refused() {
    let mut bad = sine(50);
    bad[17] = f64::NAN;
    let error = Samples::new(sine(50), bad, 0.1).unwrap_err();
    assert!(matches!(error, SamplesError::NotFinite { what: "output", at: 17, .. }));
    assert!(matches!(
        Samples::new(sine(5), sine(5), 0.1),
        Err(SamplesError::TooFew { found: 5, needed: 10 })
    ));
    assert!(matches!(Samples::new(sine(20), sine(21), 0.1), Err(SamplesError::Lengths { .. })));
    assert!(matches!(Samples::new(sine(20), sine(20), 0.0), Err(SamplesError::Step { .. })));
}

#[test]
fn an_input_that_does_not_change_is_refused() {
    let with = |input: Vec<f64>| {
        Samples::new(input, sine(50), 0.1).unwrap().check_input(InitialCondition::SettledAtFirst)
    };
    assert_eq!(with(vec![3.0; 50]), Err(SamplesError::ConstantInput { value: 3.0 }));
    let hardly = sine(50).iter().map(|u| 1000.0 + 0.01 * u).collect();
    assert!(matches!(with(hardly), Err(SamplesError::InputHardlyChanges { .. })));
    assert_eq!(with(sine(50)), Ok(()));
    let still = Samples::new(sine(50), vec![1.0; 50], 0.1).unwrap();
    assert_eq!(
        still.check_input(InitialCondition::SettledAtFirst),
        Err(SamplesError::ConstantOutput { value: 1.0 })
    );
}
