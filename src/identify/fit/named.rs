//! The parameters of a fit under the names of its structure.

use nalgebra::DMatrix;

use super::error::FitError;
use super::problem::FitProblem;
use super::settings::Structure;
use crate::numeric::number::to_f64;

/// Names and values.
pub(super) struct NamedParameters {
    pub names: Vec<String>,
    pub values: Vec<f64>,
    pub poles_are_real: bool,
}

impl NamedParameters {
    /// Fails where real poles were requested and the poles are complex.
    pub fn of(problem: &FitProblem, structure: Structure, theta: &[f64]) -> Result<Self, FitError> {
        let mut named = Self { names: Vec::new(), values: Vec::new(), poles_are_real: false };
        let alpha = |i: usize| theta[problem.zeros + i];
        match structure {
            Structure::FirstOrder { zero } => {
                named.gain(theta, zero);
                named.push("time_constant_s", alpha(1));
            }
            Structure::SecondOrderReal { zero } => {
                named.gain(theta, zero);
                let (half, product) = (0.5 * alpha(1), alpha(2));
                let root = half * half - product;
                if root < 0.0 {
                    return Err(FitError::PolesNotReal { damping: half / product.sqrt() });
                }
                named.push("time_constant_1_s", half + root.sqrt());
                named.push("time_constant_2_s", product / (half + root.sqrt()));
            }
            Structure::SecondOrderOscillating { zero } => {
                named.gain(theta, zero);
                let period_s = alpha(2).sqrt();
                let damping = 0.5 * alpha(1) / period_s;
                named.push("period_s", period_s);
                named.push("damping", damping);
                named.poles_are_real = damping > 1.0;
            }
            Structure::Transfer { poles, zeros } => {
                let lead = alpha(poles);
                for i in (0..=zeros).rev() {
                    named.push(&format!("b{i}"), theta[i] / lead);
                }
                for i in (0..poles).rev() {
                    let over = if i == 0 { 1.0 } else { alpha(i) };
                    named.push(&format!("a{i}"), over / lead);
                }
            }
        }
        let layout = problem.layout();
        for (name, position) in [("dead_time_s", layout.dead_time), ("output_level", layout.level)]
        {
            if let Some(position) = position {
                named.push(name, theta[position]);
            }
        }
        Ok(named)
    }

    fn gain(&mut self, theta: &[f64], zero: bool) {
        self.push("gain", theta[0]);
        if zero {
            self.push("zero_s", theta[1] / theta[0]);
        }
    }

    fn push(&mut self, name: &str, value: f64) {
        self.names.push(name.to_owned());
        self.values.push(value);
    }

    /// Derivatives of the named parameters with those of the fit, by difference quotients.
    pub fn jacobian(
        &self,
        problem: &FitProblem,
        structure: Structure,
        theta: &[f64],
        scales: &[f64],
    ) -> DMatrix<f64> {
        let mut slopes = DMatrix::zeros(self.names.len(), theta.len());
        for (number, scale) in scales.iter().enumerate() {
            let mut moved = theta.to_vec();
            // Relative to the parameter itself, which may be far below its scale.
            let step =
                RELATIVE_STEP * if theta[number] == 0.0 { *scale } else { theta[number].abs() };
            let mut at = |by: f64| {
                moved[number] = theta[number] + by;
                Self::of(problem, structure, &moved).ok().map(|named| named.values)
            };
            let ends = [at(-step), at(step)];
            let width = step * to_f64(ends.iter().flatten().count());
            let [low, high] = ends.map(|end| end.unwrap_or_else(|| self.values.clone()));
            for (row, (low, high)) in low.iter().zip(&high).enumerate() {
                slopes[(row, number)] = if width > 0.0 { (high - low) / width } else { 0.0 };
            }
        }
        slopes
    }
}

/// Step of the difference quotients over a parameter. A choice between truncation and rounding.
const RELATIVE_STEP: f64 = 1e-6;
