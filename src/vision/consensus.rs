//! Line or parabola through values many of which may be wrong (RANSAC, Fischler and Bolles 1981).
//! What occludes an edge pulls positions to one side, so that the mean and the median are biased.

use crate::numeric::normal_equations::NormalEquations;
use crate::numeric::number::to_f32;

/// Samples of three values that are tried. Derived: with a fraction w = 0.4 of true values, all
/// samples hold a wrong one with the probability (1 − w³)^160 = 3·10⁻⁵ (RANSAC, Fischler and Bolles
/// 1981).
const TRIALS: usize = 160;
/// Margin by which the score of a parabola must exceed the line's: a smaller gain may be chance,
/// because it has one term more.
const PARABOLA_SCORE_MARGIN: f32 = 3.0;
/// Least-squares fits through the consensus set; the second one changes hardly anything.
const REFITS: usize = 2;

/// A parabola over the indices of the values.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    middle: f32,
    terms: [f32; 3],
}

/// Sets values farther than a tolerance from the curve of the consensus set to NaN. Returns how
/// many are left.
pub fn keep_consensus(values: &mut [f32], tolerance: f32) -> usize {
    let Some(mut found) = search(values, tolerance) else { return count(values) };
    for _ in 0..REFITS {
        found = found.fitted(values, tolerance).unwrap_or(found);
    }
    for (k, value) in values.iter_mut().enumerate() {
        let off = (*value - found.at(k)).abs();
        if off.is_nan() || off > tolerance {
            *value = f32::NAN;
        }
    }
    count(values)
}

fn count(values: &[f32]) -> usize {
    values.iter().filter(|value| value.is_finite()).count()
}

/// The best curve through values picked by a pseudo-random sequence, the same every time; `None`
/// for fewer than four values.
fn search(values: &[f32], tolerance: f32) -> Option<Parabola> {
    let mut state = 0x2545_f491_u32;
    let mut pick = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        usize::try_from(state >> 8).unwrap_or(0) % values.len()
    };
    if count(values) < 4 {
        return None;
    }
    let mut best: [Option<(f32, Parabola)>; 2] = [None; 2];
    for _ in 0..TRIALS {
        let mut positions = [pick(), pick(), pick()];
        positions.sort_unstable();
        let [first, second, third] = positions;
        if first == second || second == third || positions.iter().any(|&k| !values[k].is_finite()) {
            continue;
        }
        let line = Parabola::line(values, first, third);
        for (best, curve) in best.iter_mut().zip([line, line.bent_to(values, second, first, third)])
        {
            let score = curve.score(values, tolerance);
            if best.is_none_or(|(most, _)| score > most) {
                *best = Some((score, curve));
            }
        }
    }
    let [line, bent] = best;
    match (line, bent) {
        (Some((few, _)), Some((many, curve))) if many > few + PARABOLA_SCORE_MARGIN => Some(curve),
        (line, _) => line.map(|(_, curve)| curve),
    }
}

impl Parabola {
    fn line(values: &[f32], first: usize, third: usize) -> Self {
        let middle = to_f32(values.len() - 1) / 2.0;
        let slope = (values[third] - values[first]) / to_f32(third - first);
        let level = values[first] + slope * (middle - to_f32(first));
        Self { middle, terms: [level, slope, 0.0] }
    }

    /// Parabola through the line's two values and a third one.
    fn bent_to(self, values: &[f32], at: usize, first: usize, third: usize) -> Self {
        let bend = (values[at] - self.at(at)) / (to_f32(at - first) * -to_f32(third - at));
        // bend · (x − first) · (x − third), about the middle.
        let (a, b) = (self.middle - to_f32(first), self.middle - to_f32(third));
        let [level, slope, _] = self.terms;
        Self { terms: [level + bend * a * b, slope + bend * (a + b), bend], ..self }
    }

    fn at(&self, k: usize) -> f32 {
        let x = to_f32(k) - self.middle;
        let [level, slope, bend] = self.terms;
        level + x * (slope + x * bend)
    }

    /// Sum over the values of 1 − (residual / tolerance)², 0 beyond the tolerance.
    fn score(&self, values: &[f32], tolerance: f32) -> f32 {
        let one = |(k, value): (usize, &f32)| {
            let off = (value - self.at(k)) / tolerance;
            // NaN counts nothing.
            (1.0 - off * off).max(0.0)
        };
        values.iter().enumerate().map(one).sum()
    }

    /// Least-squares fit of the same order through the values within the tolerance.
    fn fitted(&self, values: &[f32], tolerance: f32) -> Option<Self> {
        let mut normal = NormalEquations::<3>::default();
        for (k, &value) in values.iter().enumerate() {
            let miss = value - self.at(k);
            if miss.abs() <= tolerance {
                let x = f64::from(to_f32(k) - self.middle);
                normal.add([1.0, x, x * x], miss.into(), 1.0);
            }
        }
        if self.terms[2] == 0.0 {
            normal.add_prior(2, 1e12, 0.0);
        }
        let moved = normal.solve()?.unknowns;
        let mut terms = self.terms;
        for (term, moved) in terms.iter_mut().zip(moved.iter()) {
            #[expect(clippy::cast_possible_truncation, reason = "the quantity needs no more")]
            let moved = *moved as f32;
            *term += moved;
        }
        if self.terms[2] == 0.0 {
            terms[2] = 0.0;
        }
        Some(Self { terms, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(of: impl Fn(f32) -> f32) {
        let mut values: Vec<f32> = (0..30).map(|k| of(to_f32(k))).collect();
        let wrong = [1, 2, 3, 9, 10, 14, 15, 16, 17, 22, 25, 26, 28];
        for (n, &k) in wrong.iter().enumerate() {
            values[k] += 1.5 + 0.3 * to_f32(n);
        }
        values[5] = f32::NAN;
        assert_eq!(keep_consensus(&mut values, 0.8), 30 - wrong.len() - 1);
        assert!(wrong.iter().all(|&k| values[k].is_nan()));
    }

    #[test]
    fn two_values_in_five_may_be_wrong_to_the_same_side() {
        check(|x| 40.0 + 0.2 * x);
        check(|x| 40.0 + 0.2 * x - 0.03 * x * x);
    }

    #[test]
    fn few_values_are_left_as_they_are() {
        let mut values = [1.0, f32::NAN, 9.0, 3.0];
        assert_eq!(keep_consensus(&mut values, 0.8), 3);
    }

    /// Fischler and Bolles 1981: with a fraction w of true values, n samples of three all hold a
    /// wrong one with the probability (1 − w³)ⁿ.
    #[test]
    fn so_many_samples_hardly_ever_miss_the_consensus() {
        let miss = (1.0 - 0.4f64.powi(3)).powi(i32::try_from(TRIALS).unwrap());
        assert!((2e-5..4e-5).contains(&miss), "{miss}");
    }
}
