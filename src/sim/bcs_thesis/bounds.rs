//! How well parameters can be known at all from two experiments: the
//! Cramér–Rao bounds, from the slopes of the output over every parameter.

use nalgebra::DMatrix;

use super::{drive, flow};
use crate::model::{Between, FirstOrder, ModelError, Simulator, TransferFunction, simulate};

/// The least standard deviation of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Its name.
    pub name: &'static str,
    /// Its true value.
    pub value: f64,
    /// The least standard deviation of any estimate without bias, in the
    /// parameter's own unit.
    pub sigma: f64,
}

/// Gain, time constant \[s\] and dead time \[s\] of K = 1, τ = 0.84 s,
/// L = 0.41 s from a step of 0.6 over 10 s at 50 Hz with white noise of
/// variance 4.98·10⁻⁵.
pub fn first_order() -> Result<[Bound; 3], ModelError> {
    let input = vec![0.6; 500];
    let truth = [1.0, 0.84, 0.41];
    let output = |p: &[f64; 3]| {
        let model =
            FirstOrder { gain: p[0], time_constant_s: p[1], zero_s: 0.0, dead_time_s: p[2] };
        simulate(&model.transfer()?, &input, 0.02)
    };
    let sigmas = bounds(&truth, 4.98e-5_f64.sqrt(), output)?;
    let names = ["K", "τ", "L"];
    Ok(std::array::from_fn(|i| Bound { name: names[i], value: truth[i], sigma: sigmas[i] }))
}

/// Denominator a1, a0 and numerator b2, b1, b0 of G2 from 60 s of a ten-bit
/// PRBS with bits of 1 s, sampled every 20 ms, with white noise of 17 % of the
/// flow's standard deviation.
pub fn flow_model() -> Result<[Bound; 5], ModelError> {
    const SAMPLES_A_BIT: usize = 50;
    // Maximal-length sequence with taps at 10 and 7.
    let mut bits = vec![true; 10];
    while let Some([old, .., newer, _, _]) = bits.len().checked_sub(10).and_then(|i| bits.get(i..))
        && bits.len() < 60
    {
        let next = old ^ newer;
        bits.push(next);
    }
    let volts: Vec<f64> =
        bits.iter().flat_map(|bit| [if *bit { 0.4 } else { -0.4 }; SAMPLES_A_BIT]).collect();
    let rpm = simulate(&drive()?, &volts, 0.02)?;
    let model = flow()?;
    let (num, den) = (model.num(), model.den());
    let truth = [den[1], den[2], num[0], num[1], num[2]];
    let output = |p: &[f64; 5]| -> Result<Vec<f64>, ModelError> {
        let model = TransferFunction::new(&[p[2], p[3], p[4]], &[1.0, p[0], p[1]], 0.0)?;
        let mut simulator = Simulator::new(&model, 0.02, Between::Linear)?;
        Ok(rpm.iter().map(|u| simulator.step(*u)).collect::<Vec<f64>>())
    };
    let clean = output(&truth)?;
    let noise = 0.17 * spread(&clean);
    let sigmas = bounds(&truth, noise, output)?;
    let names = ["a1", "a0", "b2", "b1", "b0"];
    Ok(std::array::from_fn(|i| Bound { name: names[i], value: truth[i], sigma: sigmas[i] }))
}

/// Square roots of the diagonal of σ²(SᵀS)⁻¹, with slopes S by central
/// differences.
fn bounds<const N: usize>(
    truth: &[f64; N],
    noise: f64,
    output: impl Fn(&[f64; N]) -> Result<Vec<f64>, ModelError>,
) -> Result<[f64; N], ModelError> {
    let mut columns = Vec::with_capacity(N);
    for i in 0..N {
        let step = 1e-5 * truth[i].abs();
        let moved = |by: f64| {
            let mut p = *truth;
            p[i] += by;
            output(&p)
        };
        let (above, below) = (moved(step)?, moved(-step)?);
        let slope = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step));
        columns.push(nalgebra::DVector::from_iterator(above.len(), slope));
    }
    let slopes = DMatrix::from_columns(&columns);
    let inverse = (slopes.transpose() * &slopes).try_inverse();
    // Parameters that the output does not tell apart have no bound.
    let variance = |i: usize| inverse.as_ref().map_or(f64::INFINITY, |m| m[(i, i)]);
    Ok(std::array::from_fn(|i| noise * variance(i).sqrt()))
}

fn spread(values: &[f64]) -> f64 {
    let mean = crate::sim::score::mean(values.iter().copied());
    crate::sim::score::mean(values.iter().map(|v| (v - mean).powi(2))).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_tells_gain_and_times_as_well_as_an_independent_tool_says() {
        for (bound, wanted) in first_order().unwrap().iter().zip([6.7e-4, 4.9e-3, 3.1e-3]) {
            assert!((bound.sigma / wanted - 1.0).abs() < 0.03, "{bound:?}");
        }
    }

    #[test]
    fn a_minute_of_prbs_tells_the_flow_model_as_an_independent_tool_says() {
        let found = flow_model().unwrap();
        let independent = [("a0", 1.7), ("a1", 1.5), ("b0", 1.9), ("b1", 6.4), ("b2", 20.0)];
        for (name, percent) in independent {
            let bound = found.iter().find(|bound| bound.name == name).unwrap();
            let share = 100.0 * bound.sigma / bound.value;
            assert!((share / percent - 1.0).abs() < 0.1, "{bound:?} {share}");
        }
    }
}
