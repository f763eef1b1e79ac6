//! One case of each kind, without noise; `tests/output_lead.rs` has many, with noise.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::identify::excitation::{Excitation, Waveform};
use crate::numeric::lti::{TransferFunction, simulate};

const DT_S: f64 = 0.2;

/// The answer of a machine with a dead time to an input of random levels, `lead` samples early.
fn samples_with_lead(lead: usize) -> Samples {
    let shape = Waveform::Gaussian { mean: 0.0, sigma: 2.0, low: -6.0, high: 6.0, seed: 1 };
    let levels = Excitation { shape, hold_s: 0.8, duration_s: Some(60.0) };
    let input = levels.profile().unwrap().sampled(DT_S, 300);
    let machine = TransferFunction::new(&[2.0], &[0.36, 0.72, 1.0], 0.4).unwrap();
    let output = simulate(&machine, &input, DT_S).unwrap();
    let count = input.len() - lead;
    Samples::new(input[..count].to_vec(), output[lead..].to_vec(), DT_S).unwrap()
}

fn reported(lead: usize) -> Option<OutputLead> {
    let range = DeadTime::Estimated { min_s: 0.0, max_s: 5.0 };
    let settings = FitSettings::new(Structure::SecondOrderOscillating { zero: false }, range);
    output_lead(&samples_with_lead(lead), &settings, None)
}

#[test]
fn a_clock_that_is_behind_is_reported_with_its_lead() {
    let reported = reported(7).unwrap();
    assert!((reported.lead_s - (7.0 * DT_S - 0.4)).abs() < DT_S, "{reported:?}");
    assert!(reported.fit_percent > reported.causal_fit_percent + 5.0, "{reported:?}");
}

#[test]
fn a_machine_that_only_answers_is_never_ahead() {
    assert_eq!(reported(0), None);
}
