//! Weights of the pixels of a row for the position of an edge in correlated noise: generalised
//! least squares, insensitive to the levels on either side.

/// Pixels at most. Derived: 4 · 16, the chunks of a core in textured surroundings.
pub const MAX_PIXELS: usize = 64;

/// Finds weights; keeps its buffers from frame to frame.
#[derive(Debug, Clone)]
pub struct NoiseWhitener {
    /// Lower triangle L of the covariances' Cholesky factors, row by row, with
    /// the reciprocal of the diagonal.
    rows: Vec<[f64; MAX_PIXELS]>,
    count: usize,
    level: [f64; MAX_PIXELS],
}

impl Default for NoiseWhitener {
    fn default() -> Self {
        Self { rows: vec![[0.0; MAX_PIXELS]; MAX_PIXELS], count: 0, level: [1.0; MAX_PIXELS] }
    }
}

impl NoiseWhitener {
    /// Factorises the covariances of pixels at distances of 0, 1, … Returns whether they are
    /// positive definite.
    pub fn prepare(&mut self, count: usize, covariance: impl Fn(usize) -> f64) -> bool {
        self.count = count.min(MAX_PIXELS);
        let mut by_distance = [0.0; MAX_PIXELS];
        for (distance, value) in by_distance[..self.count].iter_mut().enumerate() {
            *value = covariance(distance);
        }
        for i in 0..self.count {
            let (done, rest) = self.rows.split_at_mut(i);
            let row = &mut rest[0];
            for (j, other) in done.iter().enumerate() {
                row[j] = (by_distance[i - j] - product(&row[..j], &other[..j])) * other[j];
            }
            let square = by_distance[0] - product(&row[..i], &row[..i]);
            if square <= 1e-6 * by_distance[0] {
                return false;
            }
            row[i] = 1.0 / square.sqrt();
        }
        self.level = [1.0; MAX_PIXELS];
        let mut level = self.level;
        self.whiten(&mut level);
        self.level = level;
        true
    }

    /// Replaces the slope of a step by the weights of its position, so that their product with the
    /// slope is 1 and those with the fractions after and before the step are 0. Returns the
    /// variance of the position; `None` where the levels explain the whole slope.
    pub fn weights(&self, slope: &mut [f64; MAX_PIXELS], after: &[f64; MAX_PIXELS]) -> Option<f64> {
        let n = self.count;
        let mut after = *after;
        self.whiten(slope);
        self.whiten(&mut after);
        let level = &self.level[..n];
        take_off(&mut after[..n], level);
        take_off(&mut slope[..n], level);
        take_off(&mut slope[..n], &after[..n]);
        let square = product(&slope[..n], &slope[..n]);
        if square <= 0.0 {
            return None;
        }
        for value in &mut slope[..n] {
            *value /= square;
        }
        self.whiten_back(slope);
        Some(1.0 / square)
    }

    /// L⁻¹ times a vector.
    fn whiten(&self, values: &mut [f64; MAX_PIXELS]) {
        for (i, row) in self.rows[..self.count].iter().enumerate() {
            values[i] = (values[i] - product(&row[..i], &values[..i])) * row[i];
        }
    }

    /// L⁻ᵀ times a vector.
    fn whiten_back(&self, values: &mut [f64; MAX_PIXELS]) {
        for i in (0..self.count).rev() {
            let row = &self.rows[i];
            let value = values[i] * row[i];
            values[i] = value;
            for (other, weight) in values[..i].iter_mut().zip(&row[..i]) {
                *other -= weight * value;
            }
        }
    }
}

/// Makes values orthogonal to others.
fn take_off(values: &mut [f64], others: &[f64]) {
    let fraction = product(values, others) / product(others, others).max(f64::MIN_POSITIVE);
    for (value, other) in values.iter_mut().zip(others) {
        *value -= fraction * other;
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a_parts, b_parts) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest = a_parts.remainder().iter().zip(b_parts.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in a_parts.zip(b_parts) {
        for k in 0..4 {
            lanes[k] += a[k] * b[k];
        }
    }
    rest + (lanes[0] + lanes[2]) + (lanes[1] + lanes[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn weights_are_those_of_generalised_least_squares() {
        let n = 24;
        let covariance = |d: usize| {
            let d = f64::from(u32::try_from(d).unwrap());
            7.0 * libm::exp(-d * d / 16.0) + if d == 0.0 { 1.0 } else { 0.0 }
        };
        let table = crate::numeric::blurred_step::StepTable::default();
        let (mut slope, mut after) = ([0.0; MAX_PIXELS], [0.0; MAX_PIXELS]);
        for k in 0..n {
            let z = (f64::from(u32::try_from(k).unwrap()) - 11.3) / 1.5;
            let (step, density) = table.at(z);
            (after[k], slope[k]) = (step, density / 1.5);
        }
        let matrix = DMatrix::from_fn(n, n, |i, j| covariance(i.abs_diff(j)));
        let design = DMatrix::from_fn(n, 3, |i, j| [slope[i], 1.0 - after[i], after[i]][j]);
        let whitened = matrix.clone().cholesky().unwrap().solve(&design);
        let inverse = (design.transpose() * &whitened).try_inverse().unwrap();
        let expected: DVector<f64> = whitened * inverse.column(0);

        let mut whitener = NoiseWhitener::default();
        assert!(whitener.prepare(n, covariance));
        let variance = whitener.weights(&mut slope, &after).unwrap();
        assert!((variance / inverse[(0, 0)] - 1.0).abs() < 1e-9);
        for k in 0..n {
            assert!((slope[k] - expected[k]).abs() < 1e-9);
        }
    }

    #[test]
    fn what_cannot_be_covariances_is_told() {
        assert!(!NoiseWhitener::default().prepare(8, |d| if d < 4 { 1.0 } else { 0.0 }));
    }
}
