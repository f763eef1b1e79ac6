//! Polynomials with real coefficients, highest power first.

use nalgebra::{Complex, DMatrix};

use crate::numeric::number::to_f64;

/// The coefficients without leading zeros; one is kept of a zero polynomial.
pub fn trim(coefficients: &[f64]) -> &[f64] {
    let leading = coefficients.iter().take_while(|c| **c == 0.0).count();
    let first = leading.min(coefficients.len().saturating_sub(1));
    coefficients.get(first..).unwrap_or_default()
}

/// Value at a complex number (Horner's scheme).
pub fn evaluate(coefficients: &[f64], at: Complex<f64>) -> Complex<f64> {
    coefficients.iter().fold(Complex::new(0.0, 0.0), |sum, c| sum * at + c)
}

/// Product of two polynomials.
pub fn multiply(a: &[f64], b: &[f64]) -> Vec<f64> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let mut product = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (position, y) in product.iter_mut().skip(i).zip(b) {
            *position += x * y;
        }
    }
    product
}

/// Sum of two polynomials.
pub fn add(a: &[f64], b: &[f64]) -> Vec<f64> {
    let (long, short) = if a.len() >= b.len() { (a, b) } else { (b, a) };
    let mut sum = long.to_vec();
    for (position, y) in sum.iter_mut().rev().zip(short.iter().rev()) {
        *position += y;
    }
    sum
}

/// The monic polynomial of these roots. Complex roots must come in conjugate pairs; imaginary
/// parts of the result are dropped.
pub fn from_roots(roots: &[Complex<f64>]) -> Vec<f64> {
    let mut product = vec![Complex::new(1.0, 0.0)];
    for root in roots {
        product.push(Complex::new(0.0, 0.0));
        for i in (1..product.len()).rev() {
            let lower = product[i - 1];
            product[i] -= root * lower;
        }
    }
    product.iter().map(|c| c.re).collect()
}

/// Geometric mean of the magnitudes of the roots; 1 if one of them is zero or there are none.
pub(super) fn mean_size_of_roots(coefficients: &[f64]) -> f64 {
    let (Some(first), Some(last)) = (coefficients.first(), coefficients.last()) else {
        return 1.0;
    };
    let order = to_f64(coefficients.len() - 1);
    let mean = libm::pow((last / first).abs(), 1.0 / order.max(1.0));
    if mean.is_finite() && mean > 0.0 { mean } else { 1.0 }
}

/// Roots as eigenvalues of the companion matrix, scaled by the mean magnitude of the roots,
/// each improved by Newton's steps.
pub fn roots(coefficients: &[f64]) -> Vec<Complex<f64>> {
    let p = trim(coefficients);
    let zeros_at_origin = p.iter().rev().take_while(|c| **c == 0.0).count();
    let p = &p[..p.len() - zeros_at_origin];
    let mut found = vec![Complex::new(0.0, 0.0); zeros_at_origin];
    if p.len() < 2 {
        found.truncate(coefficients.len().saturating_sub(1));
        return if p.is_empty() { Vec::new() } else { found };
    }
    let order = p.len() - 1;
    let size = mean_size_of_roots(p);
    let mut scale = p[0];
    let mut monic = Vec::with_capacity(order);
    for c in &p[1..] {
        scale *= size;
        monic.push(c / scale);
    }
    let companion = DMatrix::from_fn(order, order, |row, column| match row {
        0 => -monic[column],
        _ if row == column + 1 => 1.0,
        _ => 0.0,
    });
    found.extend(companion.complex_eigenvalues().iter().map(|root| polish(p, root * size)));
    found
}

/// Two Newton steps, each kept only if it reduces the residual.
fn polish(p: &[f64], mut root: Complex<f64>) -> Complex<f64> {
    for _ in 0..2 {
        let (mut value, mut slope) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
        for c in p {
            slope = slope * root + value;
            value = value * root + c;
        }
        let next = root - value / slope;
        let nearer = evaluate(p, next).norm_sqr() < value.norm_sqr();
        if !nearer {
            break;
        }
        root = next;
    }
    root
}

/// Whether all roots have negative real parts, by the criterion of Routh 1877. A constant has
/// none and passes.
pub fn is_hurwitz(coefficients: &[f64]) -> bool {
    let p = trim(coefficients);
    let mut upper: Vec<f64> = p.iter().step_by(2).copied().collect();
    let mut lower: Vec<f64> = p.iter().skip(1).step_by(2).copied().collect();
    let Some(sign) = upper.first().map(|first| first.signum()) else { return false };
    for _ in 1..p.len() {
        let (Some(&a), Some(&b)) = (upper.first(), lower.first()) else { return false };
        if b * sign <= 0.0 || b.is_nan() {
            return false;
        }
        let of = |row: &[f64], i: usize| row.get(i).copied().unwrap_or(0.0);
        let next: Vec<f64> =
            (1..upper.len()).map(|i| of(&upper, i) - a / b * of(&lower, i)).collect();
        upper = lower;
        lower = next;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(mut roots: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        roots.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        roots
    }

    #[test]
    fn roots_of_a_product_are_those_of_its_factors() {
        let p = multiply(&[2.0, 6.0], &multiply(&[1.0, 1.476, 1.530_693], &[1.0e-4, 1.0]));
        let found = sorted(roots(&p));
        let wanted = [
            Complex::new(-1.0e4, 0.0),
            Complex::new(-3.0, 0.0),
            Complex::new(-0.738, -0.993),
            Complex::new(-0.738, 0.993),
        ];
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).norm() < 1e-9 * wanted.norm(), "{found} {wanted}");
        }
        assert_eq!(found.len(), 4);
    }

    #[test]
    fn leading_and_trailing_zeros_are_no_trouble() {
        assert_eq!(roots(&[0.0, 1.0, 2.0, 0.0]).len(), 2);
        assert!(roots(&[0.0, 0.0]).is_empty());
        assert!(roots(&[5.0]).is_empty());
        assert!(roots(&[]).is_empty());
        assert_eq!(trim(&[0.0, 0.0, 3.0, 1.0]), [3.0, 1.0]);
        assert_eq!(trim(&[0.0]), [0.0]);
    }

    #[test]
    fn a_polynomial_comes_back_from_its_roots() {
        let p = [1.0, 7.0, 21.0, 37.0, 30.0];
        for (back, c) in from_roots(&roots(&p)).iter().zip(p) {
            assert!((back - c).abs() < 1e-11 * c, "{back} {c}");
        }
    }

    #[test]
    fn rouths_table_agrees_with_the_roots() {
        for k in 0..4000_u32 {
            let c = |i: u32| f64::from((k * 2_654_435 + i * 40_503) % 2001) / 100.0 - 2.0;
            let p = [1.0, c(1), c(2), c(3), c(4)];
            let right = roots(&p).iter().map(|root| root.re).fold(f64::MIN, f64::max);
            assert_eq!(is_hurwitz(&p), right < 0.0, "{p:?} {right}");
        }
        assert!(is_hurwitz(&[-1.0, -2.0]));
        assert!(is_hurwitz(&[3.0]));
        assert!(!is_hurwitz(&[1.0, 0.0, 1.0]));
    }
}
