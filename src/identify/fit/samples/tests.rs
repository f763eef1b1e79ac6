#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;

fn sine(n: u32) -> Vec<f64> {
    (0..n).map(|k| libm::sin(0.1 * f64::from(k))).collect()
}

#[test]
fn gaps_are_told_with_their_place() {
    let mut times: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k)).collect();
    assert!((Samples::at_times(&times, sine(100), sine(100)).unwrap().dt_s() - 0.02).abs() < 1e-12);
    for time in times.iter_mut().skip(40) {
        *time += 0.5;
    }
    let words = Samples::at_times(&times, sine(100), sine(100)).unwrap_err().to_string();
    assert!(words.contains("1 of the time steps") && words.contains("sample 39"), "{words}");
    assert!(words.contains("0.520000 s at 0.7800 s"), "{words}");
}

#[test]
fn what_is_no_record_is_refused() {
    let mut bad = sine(50);
    bad[17] = f64::NAN;
    let error = Samples::new(sine(50), bad, 0.1).unwrap_err();
    assert!(matches!(error, DataError::NotFinite { what: "output", at: 17, .. }));
    assert!(matches!(
        Samples::new(sine(5), sine(5), 0.1),
        Err(DataError::TooFew { found: 5, needed: 10 })
    ));
    assert!(matches!(Samples::new(sine(20), sine(21), 0.1), Err(DataError::Lengths { .. })));
    assert!(matches!(Samples::new(sine(20), sine(20), 0.0), Err(DataError::Step { .. })));
}

#[test]
fn an_input_that_does_not_change_is_refused() {
    let with = |input: Vec<f64>| {
        Samples::new(input, sine(50), 0.1).unwrap().check_input(Before::SettledAtFirst)
    };
    assert_eq!(with(vec![3.0; 50]), Err(DataError::ConstantInput { value: 3.0 }));
    let hardly = sine(50).iter().map(|u| 1000.0 + 0.01 * u).collect();
    assert!(matches!(with(hardly), Err(DataError::InputHardlyChanges { .. })));
    assert_eq!(with(sine(50)), Ok(()));
    let still = Samples::new(sine(50), vec![1.0; 50], 0.1).unwrap();
    assert_eq!(
        still.check_input(Before::SettledAtFirst),
        Err(DataError::ConstantOutput { value: 1.0 })
    );
}
