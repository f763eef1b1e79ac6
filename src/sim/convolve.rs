//! Gaussian blur of pixel values.

use crate::numeric::number::narrow_to_f32;
/// Weights of a Gaussian at the distances 0, 1, 2, … px, down to negligible ones; summed over both
/// sides they are 1.
pub fn kernel(blur_px: f64) -> Vec<f32> {
    let mut weights = vec![1.0];
    let mut sum = 1.0;
    for distance in 1..200 {
        let z = f64::from(distance) / blur_px;
        // For a blur of 0 the quotient is infinite: only the centre's weight is left.
        if z > 4.5 {
            break;
        }
        let weight = libm::exp(-0.5 * z * z);
        weights.push(weight);
        sum += 2.0 * weight;
    }
    weights.into_iter().map(|weight| narrow_to_f32(weight / sum)).collect()
}

/// Convolves lines of `width` pixels in both directions; outside the values are 0.
pub fn convolve(values: &mut [f32], width: usize, kernel: &[f32]) {
    let mut across = vec![0.0; values.len()];
    for (line, sum) in values.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        for (distance, weight) in kernel.iter().enumerate().take_while(|(d, _)| *d < width) {
            add(&mut sum[..width - distance], &line[distance..], *weight);
            if distance > 0 {
                add(&mut sum[distance..], &line[..width - distance], *weight);
            }
        }
    }
    add_lines(&across, values, width, kernel);
}

/// Convolves only from line to line.
pub fn convolve_lines(values: &mut [f32], width: usize, kernel: &[f32]) {
    let before = values.to_vec();
    add_lines(&before, values, width, kernel);
}

fn add_lines(from: &[f32], values: &mut [f32], width: usize, kernel: &[f32]) {
    let height = values.len() / width;
    for (at, sum) in values.chunks_exact_mut(width).enumerate() {
        sum.fill(0.0);
        for (distance, weight) in kernel.iter().enumerate() {
            if at + distance < height {
                add(sum, &from[(at + distance) * width..][..width], *weight);
            }
            if 0 < distance && distance <= at {
                add(sum, &from[(at - distance) * width..][..width], *weight);
            }
        }
    }
}

fn add(sum: &mut [f32], values: &[f32], weight: f32) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_gaussian() {
        let mut values = vec![0.0; 41 * 31];
        values[15 * 41 + 20] = 1.0;
        convolve(&mut values, 41, &kernel(2.0));
        let expected =
            |x: f64, y: f64| (-0.125 * (x * x + y * y)).exp() / (4.0 * std::f64::consts::TAU);
        for (row, column) in (0..31_u32).flat_map(|row| (0..41_u32).map(move |c| (row, c))) {
            let found = f64::from(values[(row * 41 + column) as usize]);
            let wanted = expected(f64::from(column) - 20.0, f64::from(row) - 15.0);
            assert!((found - wanted).abs() < 1e-5, "{row} {column}: {found} {wanted}");
        }
    }

    #[test]
    fn no_blur_changes_nothing() {
        let mut values = vec![0.0, 3.0, 1.0, 7.0];
        convolve(&mut values, 2, &kernel(0.0));
        assert_eq!(values, [0.0, 3.0, 1.0, 7.0]);
    }
}
