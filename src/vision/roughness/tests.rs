use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::numeric::number::to_f64;

const SPACING_MM: f64 = 4.0;
const LINES: usize = 25;
const NOISE_MM: f64 = 0.1;
/// Positions of the process in a line.
const PLACES: usize = 16;

/// Widths of a long bead, line by line: means of an exponential process, with noise.
fn bead(roughness: f64, length: f64, lines: usize, seed: u64) -> Vec<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let keep = (-SPACING_MM / to_f64(PLACES) / length).exp();
    let mut last = normal();
    let mut line = || {
        let mut sum = 0.0;
        for _ in 0..PLACES {
            last = keep * last + (1.0 - keep * keep).sqrt() * normal();
            sum += roughness * last;
        }
        30.0 + sum / to_f64(PLACES) + NOISE_MM * normal()
    };
    (0..lines).map(|_| line()).collect()
}

fn frame(widths: &[f64]) -> LocalWidths {
    LocalWidths {
        widths_mm: widths.to_vec(),
        spacing_mm: SPACING_MM,
        noise_mm2: NOISE_MM * NOISE_MM,
        filter_mm: 0.0,
        blur_mm: 0.0,
    }
}

fn estimate(widths: &[f64], advance: usize, moved: Option<Mm>) -> Option<Roughness> {
    let mut estimator = RoughnessEstimator::default();
    for start in (0..=widths.len() - LINES).step_by(advance) {
        estimator.add(&frame(&widths[start..start + LINES]), moved);
    }
    estimator.estimate()
}

/// Beads of a kind.
const SEEDS: u64 = 100;

/// Estimates of beads of the same roughness over their truth.
struct Quality {
    /// Beads whose roughness was determined.
    found: f64,
    /// Median of |found/true − 1|.
    roughness_error: f64,
    length_error: f64,
    /// Root of the mean square of the error of the logarithm over its sigma.
    roughness_z: f64,
    length_z: f64,
}

/// Of beads of 50 correlation lengths that move on so many lines a frame.
fn quality(length: f64, advance: usize) -> Quality {
    let lines = whole_lines(50.0 * length);
    let (mut errors, mut squares, mut found) = ([Vec::new(), Vec::new()], [0.0; 2], 0.0);
    for seed in 0..SEEDS {
        let Some(rough) = estimate(&bead(2.0, length, lines, seed), advance, None) else {
            for errors in &mut errors {
                errors.push(1.0);
            }
            continue;
        };
        found += 1.0;
        let ratios = [
            (rough.roughness.get() / 2.0, rough.roughness_sigma.get() / rough.roughness.get()),
            (rough.length.get() / length, rough.length_sigma.get() / rough.length.get()),
        ];
        for (((ratio, sigma), errors), square) in ratios.iter().zip(&mut errors).zip(&mut squares) {
            errors.push((ratio - 1.0).abs());
            *square += (ratio.ln() / sigma).powi(2);
        }
    }
    let [roughness_error, length_error] = errors.map(|mut errors| {
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    });
    let [roughness_z, length_z] = squares.map(|square: f64| (square / found).sqrt());
    Quality { found, roughness_error, length_error, roughness_z, length_z }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred")]
fn whole_lines(length_mm: f64) -> usize {
    (length_mm / SPACING_MM).ceil() as usize
}

#[test]
fn fifty_correlation_lengths_tell_roughness_and_length_however_frames_follow_each_other() {
    for length in [6.0, 12.0, 25.0, 40.0] {
        for advance in [LINES, 2] {
            let found = quality(length, advance);
            let case = format!("{length} mm, {advance} lines");
            assert!(found.found >= 95.0, "{case}: {}", found.found);
            assert!(found.roughness_error < 0.2, "{case}: {}", found.roughness_error);
            assert!(found.length_error < 0.3, "{case}: {}", found.length_error);
            assert!((0.7..1.25).contains(&found.roughness_z), "{case}: {}", found.roughness_z);
            assert!((0.75..1.25).contains(&found.length_z), "{case}: {}", found.length_z);
        }
    }
}

#[test]
fn the_same_piece_again_and_again_is_no_more_bead() {
    let widths = bead(2.0, 12.0, 5 * LINES, 3);
    let once = estimate(&widths, LINES, None).unwrap();
    let mut estimator = RoughnessEstimator::default();
    for start in (0..=widths.len() - LINES).step_by(LINES) {
        for _ in 0..30 {
            estimator.add(&frame(&widths[start..start + LINES]), None);
        }
    }
    assert_eq!(estimator.estimate(), Some(once));
}

#[test]
fn a_path_that_is_known_tells_how_much_is_new() {
    let widths = bead(2.0, 12.0, 10 * LINES, 4);
    let moved = Mm::constant(5.0 * SPACING_MM);
    let known = estimate(&widths, 5, Some(moved)).unwrap();
    let found = estimate(&widths, 5, None).unwrap();
    let ratio = known.length_sigma.get() / found.length_sigma.get();
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn noise_is_no_roughness() {
    let found = (0..SEEDS).filter(|&seed| {
        let mut smooth = bead(0.0, 10.0, 20 * LINES, seed);
        // The bead's own width changes from gauge to gauge.
        for (line, width) in smooth.iter_mut().enumerate() {
            *width += 3.0 * to_f64(line / LINES);
        }
        estimate(&smooth, LINES, None).is_some()
    });
    assert_eq!(found.count(), 0);
}

#[test]
fn a_mean_over_a_gauge_scatters_as_the_closed_form_says() {
    let mm = Mm::constant;
    let rough = Roughness {
        roughness: mm(2.0),
        roughness_sigma: mm(0.1),
        length: mm(10.0),
        length_sigma: mm(1.0),
    };
    let of = |gauge: f64| rough.of_gauge_mean(mm(gauge)).get();
    // Short gauges have all of it, long ones that of G/2L independent positions.
    assert!((of(1e-6) - 2.0).abs() < 1e-6 && (of(0.01) - 2.0).abs() < 1e-3);
    assert!((of(1e5) / (2.0 * (20.0_f64 / 1e5).sqrt()) - 1.0).abs() < 1e-3);
    let means: Vec<f64> = bead(2.0, 10.0, 40_000, 5)
        .chunks_exact(LINES)
        .map(|gauge| gauge.iter().sum::<f64>() / to_f64(LINES) - 30.0)
        .collect();
    let square = means.iter().map(|mean| mean * mean).sum::<f64>() / to_f64(means.len());
    assert!((square.sqrt() / of(100.0) - 1.0).abs() < 0.06, "{}", square.sqrt());
}
