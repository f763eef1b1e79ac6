//! Cramér–Rao bounds of the parameters of two experiments, from the sensitivities of the output,
//! compared with the errors of many fits.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::flow;
use crate::identify::fit::{
    DeadTime, FitSettings, InitialCondition, OutputLevel, Samples, Structure, fit,
};
use crate::numeric::average::{rms, standard_deviation};
use crate::numeric::lti::{FirstOrder, ModelError, TransferFunction, simulate};
use crate::sim::hash::{mix, normal_pair};
use crate::studies::error::ReproduceError;

/// Sample time of both experiments \[s\]: papers.md, "001, bounds", 50 Hz and 20 ms.
const DT_S: f64 = 0.02;

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterBound {
    /// Its name.
    pub name: &'static str,
    /// Its true value.
    pub value: f64,
    /// Cramér–Rao bound of its standard deviation, in the parameter's own unit.
    pub sigma: f64,
    /// Root mean square error of the fits, in the same unit.
    pub spread: f64,
}

/// An experiment whose parameters are estimated.
struct BoundExperiment<'a, const N: usize> {
    truth: [f64; N],
    names: [&'static str; N],
    /// Their names in the result of a fit.
    fitted: [&'static str; N],
    input: Vec<f64>,
    settings: FitSettings,
    model: &'a (dyn Fn(&[f64; N]) -> Result<TransferFunction, ModelError> + Sync),
}

/// Gain, time constant \[s\] and dead time \[s\] of the plant of Ma et al. 2026 (K = 1,
/// τ = 0.84 s, L = 0.41 s) from a step of 0.6 over 10 s at 50 Hz with white noise of variance
/// 4.98·10⁻⁵; with `trials` fits.
pub fn first_order(trials: u64) -> Result<[ParameterBound; 3], ReproduceError> {
    let dead_time = DeadTime::Estimated { min_s: 0.0, max_s: 2.0 };
    let experiment = BoundExperiment {
        truth: [1.0, 0.84, 0.41],
        names: ["K", "τ", "L"],
        fitted: ["gain", "time_constant_s", "dead_time_s"],
        input: vec![0.6; 500],
        settings: at_rest(Structure::FirstOrder { zero: false }, dead_time),
        model: &|&[gain, time_constant_s, dead_time_s]| {
            FirstOrder { gain, time_constant_s, zero_s: 0.0, dead_time_s }.transfer()
        },
    };
    experiment.bounds(4.98e-5_f64.sqrt(), trials)
}

/// Denominator a1, a0 and numerator b2, b1, b0 of G2 from 60 s of a nine-bit PRBS with bits
/// of 1 s, sampled every 20 ms, with white noise of 17 % of the flow's standard deviation;
/// with `trials` fits.
pub fn flow_model(trials: u64) -> Result<[ParameterBound; 5], ReproduceError> {
    /// Derived: 1 s of samples of 20 ms.
    const SAMPLES_A_BIT: usize = 50;
    // Maximal-length sequence with taps at 9 and 5.
    let mut bits = vec![true; 9];
    while let Some(&[old, _, _, _, _, newer, ..]) =
        bits.len().checked_sub(9).and_then(|i| bits.get(i..))
        && bits.len() < 60
    {
        bits.push(old ^ newer);
    }
    let input: Vec<f64> =
        bits.iter().flat_map(|bit| [if *bit { 1.0 } else { -1.0 }; SAMPLES_A_BIT]).collect();
    let model = flow()?;
    let clean = simulate(&model, &input, DT_S)?;
    let (num, den) = (model.num(), model.den());
    let names = ["a1", "a0", "b2", "b1", "b0"];
    let experiment = BoundExperiment {
        truth: [den[1], den[2], num[0], num[1], num[2]],
        names,
        fitted: names,
        input,
        settings: at_rest(Structure::Transfer { poles: 2, zeros: 2 }, DeadTime::Known(0.0)),
        model: &|p| TransferFunction::new(&[p[2], p[3], p[4]], &[1.0, p[0], p[1]], 0.0),
    };
    experiment.bounds(0.17 * standard_deviation(&clean), trials)
}

/// Settings of a fit that begins at rest, with a known output level.
fn at_rest(structure: Structure, dead_time: DeadTime) -> FitSettings {
    FitSettings {
        initial_state: InitialCondition::Settled { input: 0.0 },
        level: OutputLevel::Known(0.0),
        ..FitSettings::new(structure, dead_time)
    }
}

impl<const N: usize> BoundExperiment<'_, N> {
    fn bounds(&self, noise: f64, trials: u64) -> Result<[ParameterBound; N], ReproduceError> {
        let clean = self.output(&self.truth)?;
        let sigmas = self.sigmas(noise)?;
        let trials = (0..trials.max(1)).into_par_iter();
        let errors: Result<Vec<[f64; N]>, ReproduceError> =
            trials.map(|seed| self.trial(&clean, noise, seed)).collect();
        let errors = errors?;
        Ok(std::array::from_fn(|i| {
            let spread = rms(errors.iter().map(|error| error[i]));
            let (name, value, sigma) = (self.names[i], self.truth[i], sigmas[i]);
            ParameterBound { name, value, sigma, spread }
        }))
    }

    /// The errors of one fit.
    fn trial(&self, clean: &[f64], noise: f64, seed: u64) -> Result<[f64; N], ReproduceError> {
        let white = |k: u64| noise * normal_pair(mix(&[seed, 4, k]))[0];
        let seen = (0_u64..).zip(clean).map(|(k, y)| y + white(k)).collect();
        let samples = Samples::new(self.input.clone(), seen, DT_S)?;
        let fitted = fit(&samples, &self.settings)?;
        Ok(std::array::from_fn(|i| {
            fitted.parameter(self.fitted[i]).map_or(f64::NAN, |p| p.value - self.truth[i])
        }))
    }

    fn output(&self, parameters: &[f64; N]) -> Result<Vec<f64>, ModelError> {
        simulate(&(self.model)(parameters)?, &self.input, DT_S)
    }

    /// Square roots of the diagonal of σ²(SᵀS)⁻¹, the sensitivities S by central differences.
    fn sigmas(&self, noise: f64) -> Result<[f64; N], ModelError> {
        let mut columns = Vec::with_capacity(N);
        for i in 0..N {
            let step = 1e-5 * self.truth[i].abs();
            let moved = |by: f64| {
                let mut parameters = self.truth;
                parameters[i] += by;
                self.output(&parameters)
            };
            let (above, below) = (moved(step)?, moved(-step)?);
            let slope = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step));
            columns.push(DVector::from_iterator(above.len(), slope));
        }
        let slopes = DMatrix::from_columns(&columns);
        let inverse = (slopes.transpose() * &slopes).try_inverse();
        // Parameters that the output cannot distinguish have an infinite bound.
        let variance = |i: usize| inverse.as_ref().map_or(f64::INFINITY, |m| m[(i, i)]);
        Ok(std::array::from_fn(|i| noise * variance(i).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four standard errors of a standard deviation from 40 fits.
    fn near_the_bound(bound: &ParameterBound) -> bool {
        let allowance = 4.0 / f64::sqrt(80.0);
        (bound.spread / bound.sigma - 1.0).abs() < allowance
    }

    #[test]
    fn the_bounds_of_the_step_are_those_of_an_independent_tool() {
        for (bound, wanted) in first_order(40).unwrap().iter().zip([6.7e-4, 4.9e-3, 3.1e-3]) {
            assert!((bound.sigma / wanted - 1.0).abs() < 0.03, "{bound:?}");
            assert!(near_the_bound(bound), "{bound:?}");
        }
    }

    #[test]
    fn the_bounds_of_a_minute_of_prbs_are_those_of_an_independent_tool() {
        let found = flow_model(40).unwrap();
        let independent = [("a0", 1.7), ("a1", 1.5), ("b0", 1.9), ("b1", 6.4), ("b2", 20.0)];
        for (name, percent) in independent {
            let bound = found.iter().find(|bound| bound.name == name).unwrap();
            let found = 100.0 * bound.sigma / bound.value;
            assert!((found / percent - 1.0).abs() < 0.1, "{bound:?} {found}");
            assert!(near_the_bound(bound), "{bound:?}");
        }
    }
}
