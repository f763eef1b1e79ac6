//! What bad data are answered with.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::core::Unit;

/// Ten seconds at 100 Hz of a screw that is stepped, and a flow that follows.
fn columns() -> [Vec<f64>; 3] {
    let times: Vec<f64> = (0_u32..1000).map(|k| f64::from(k) * 0.01).collect();
    let input: Vec<f64> =
        times.iter().map(|t| if (t * 0.7).sin() > 0.0 { 40.0 } else { 20.0 }).collect();
    let mut flow = 500.0;
    let output = input.iter().zip(0_u32..).map(|(rpm, k)| {
        flow += 0.03 * (25.0 * rpm - flow);
        flow + (f64::from(k) * 12.9).sin()
    });
    let output = output.collect();
    [times, input, output]
}

fn taken(columns: &[Vec<f64>; 3]) -> Result<Experiment, ExperimentError> {
    let [time_s, input, output] = columns;
    Experiment::new(time_s, input, output, &Rules::default())
}

fn refusal(columns: &[Vec<f64>; 3]) -> String {
    taken(columns).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn good_data_stay_as_they_are() {
    let columns = columns();
    let taken = taken(&columns).unwrap();
    assert!(taken.notes.is_empty() && taken.input_is_held);
    assert_eq!((&taken.input, &taken.output), (&columns[1], &columns[2]));
    assert!((taken.step_s - 0.01).abs() < 1e-9 && (taken.duration_s() - 9.99).abs() < 1e-6);
}

#[test]
fn the_last_part_validates() {
    let (fit, rest) = taken(&columns()).unwrap().split(0.3).unwrap();
    assert_eq!((fit.len(), rest.len()), (700, 300));
    assert!((rest.start_s - 7.0).abs() < 1e-6);
    let mut stands = columns();
    stands[1][650..].fill(30.0);
    let said = taken(&stands).unwrap().split(0.3).unwrap_err().to_string();
    assert!(said.contains("from 7.0 s to 10.0 s, the part that is kept to validate"), "{said}");
    let short = taken(&columns()).unwrap().split(0.04).unwrap_err();
    assert!(short.to_string().contains("40 samples are left to validate with: 50"), "{short}");
    assert!(matches!(
        taken(&columns()).unwrap().split(0.99),
        Err(ExperimentError::TooFew { got: 10 })
    ));
}

#[test]
fn too_few_samples() {
    let few = columns().map(|column| column[..49].to_vec());
    assert_eq!(refusal(&few), "49 samples: a model takes 50 or more");
}

#[test]
fn time_that_does_not_run_on() {
    let mut data = columns();
    data[0][400] = data[0][399];
    assert!(refusal(&data).contains("time repeats at sample 401: 3.99 s, then 3.99 s"));
    data[0][400] = 1.0;
    assert!(refusal(&data).contains("time falls at sample 401"));
}

#[test]
fn milliseconds_that_are_called_seconds_and_the_reverse() {
    let scaled = |factor: f64| {
        let [times, input, output] = columns();
        [times.iter().map(|t| t * factor).collect(), input, output]
    };
    assert!(refusal(&scaled(1000.0)).contains("Is the column in ms?"));
    assert!(refusal(&scaled(0.001)).contains("Is the column in s?"));
    let [time_s, input, output] = scaled(1000.0);
    let reported = Rules { is_time_unit_known: true, ..Rules::default() };
    assert!(Experiment::new(&time_s, &input, &output, &reported).is_ok());
}

#[test]
fn gaps_are_bridged_up_to_a_limit() {
    let without = |from: usize, to: usize| {
        columns().map(|mut column| {
            column.drain(from..to);
            column
        })
    };
    let bridged = taken(&without(500, 504)).unwrap();
    assert_eq!(bridged.len(), 1000);
    let said = bridged.notes[0].to_string();
    assert!(
        said.starts_with("1 gap bridged by straight lines, the longest of 0.050 s after 4.99"),
        "{said}"
    );
    let long = without(500, 600);
    let said = refusal(&long);
    assert!(said.contains("gap of 1.010 s after 4.990 s (sample 500)"), "{said}");
    assert!(said.contains("up to 0.050 s are bridged"), "{said}");
    let [time_s, input, output] = long;
    let rules = Rules { max_gap_s: Some(2.0), ..Rules::default() };
    assert_eq!(Experiment::new(&time_s, &input, &output, &rules).unwrap().len(), 1000);
}

#[test]
fn uneven_sampling_is_taken_to_a_grid() {
    let [mut times, input, output] = columns();
    for (time, k) in times.iter_mut().zip(0_u32..) {
        *time += 0.003 * (f64::from(k) * 1.7).sin();
    }
    let even = taken(&[times, input, output]).unwrap();
    assert!(
        matches!(even.notes[..], [DataNote::Resampled { step_s }] if (step_s - 0.01).abs() < 1e-4)
    );
    assert!(even.input.iter().all(|rpm| *rpm == 20.0 || *rpm == 40.0));
}

#[test]
fn constant_columns() {
    let [times, input, output] = columns();
    let still = vec![30.0; 1000];
    let said = refusal(&[times.clone(), still.clone(), output]);
    assert!(
        said.contains("the input is 30 all the time") && said.contains("truebead extruder excite")
    );
    let said = refusal(&[times, input, still]);
    assert!(said.contains("the output is 30 all the time") && said.contains("sensor"), "{said}");
}

#[test]
fn one_column_twice() {
    let [times, input, _] = columns();
    let said = refusal(&[times, input.clone(), input]);
    assert!(said.contains("the same from sample to sample"), "{said}");
}

#[test]
fn bar_that_is_called_megapascal() {
    let said = implausible_unit("nozzle_mpa", Unit::MPa, &[12.0, -230.0]).unwrap();
    assert!(said.contains("up to 230 MPa") && said.contains("--unit nozzle_mpa=bar"), "{said}");
    assert_eq!(implausible_unit("nozzle_mpa", Unit::MPa, &[70.0]), None);
    assert_eq!(implausible_unit("nozzle_bar", Unit::Bar, &[700.0]), None);
}
