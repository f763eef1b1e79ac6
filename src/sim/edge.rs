//! The fraction of a pixel's light that comes from one side of a blurred straight
//! edge, in closed form.
//!
//! A step that is blurred by a Gaussian with standard deviation s has the value Φ(d/s) at the
//! distance d. Its mean over the pixel's unit square, with the edge's normal (a, b)·s, is a mixed
//! second difference of the second antiderivative G of Φ, divided by a·b. If a or b is small, the
//! difference cancels, and a series in that variable is used instead.

use crate::numeric::normal_distribution::{cumulative, density, first_integral, second_integral};

/// Blur below which an edge counts as sharp \[px\]: it moves less than a millionth of a pixel's
/// light.
const SHARP_PX: f64 = 1e-6;
/// Distance beyond which a Gaussian is zero, in standard deviations. Derived: Φ(−9) = 10⁻¹⁹, below
/// the resolution of a double.
const GAUSSIAN_END_SIGMAS: f64 = 9.0;
/// Extent of the pixel along one direction, in units of blur, below which the fourth-order
/// series is used. Derived: its next term is of the order b⁶/7!/2⁶ and 3·10⁻¹² at 0.1.
const SERIES_BELOW_BLURS: f64 = 0.1;

/// Fraction of a unit pixel on the inner side of an edge, 0 to 1. `inside_px` is the distance of
/// the pixel's centre from the edge, positive on the inner side \[px\], `normal` the unit normal
/// of the edge, `blur_px` the standard deviation of the blur \[px\].
pub fn coverage(inside_px: f64, normal: [f64; 2], blur_px: f64) -> f64 {
    let (x, y) = (normal[0].abs(), normal[1].abs());
    let (long, short) = if x >= y { (x, y) } else { (y, x) };
    // The fraction inside an edge is one minus the fraction inside the opposite edge. On the outer
    // side all terms are small and cancel less.
    let outer = |inside: f64| {
        if blur_px < SHARP_PX {
            sharp(inside, long, short)
        } else {
            blurred(inside / blur_px, long / blur_px, short / blur_px)
        }
    };
    if inside_px <= 0.0 { outer(inside_px) } else { 1.0 - outer(-inside_px) }
}

/// Area of the unit square beyond a line at distance `d` ≤ 0 from its centre.
fn sharp(d: f64, long: f64, short: f64) -> f64 {
    let corner = d + 0.5 * (long + short);
    if corner <= 0.0 {
        0.0
    } else if corner <= short {
        corner * corner / (2.0 * long * short)
    } else {
        0.5 + d / long
    }
}

/// Mean of Φ(d + a·u + b·v) over |u|, |v| ≤ ½ for d ≤ 0 and a ≥ b ≥ 0.
fn blurred(d: f64, a: f64, b: f64) -> f64 {
    if d + 0.5 * (a + b) < -GAUSSIAN_END_SIGMAS {
        return 0.0;
    }
    if a < SERIES_BELOW_BLURS {
        let slope = density(d);
        let second = -d * slope;
        let fourth = (3.0 * d - d * d * d) * slope;
        let (a2, b2) = (a * a, b * b);
        let quartic = (a2 * a2 + b2 * b2) / 1920.0 + a2 * b2 / 576.0;
        return cumulative(d) + (a2 + b2) / 24.0 * second + quartic * fourth;
    }
    // The error of the series grows as b⁶/a, that of the difference as a/b.
    let small =
        if a > 300.0 { SERIES_BELOW_BLURS * libm::cbrt(a / 300.0) } else { SERIES_BELOW_BLURS };
    if b < small.min(0.5 * a) {
        return one_way(d, a, b);
    }
    let (sum, difference) = (0.5 * (a + b), 0.5 * (a - b));
    let near = second_integral(d + sum) - second_integral(d + difference);
    let far = second_integral(d - difference) - second_integral(d - sum);
    (near - far) / (a * b)
}

/// The mean of [`blurred`] for small b: exact in a, a series in b.
fn one_way(d: f64, a: f64, b: f64) -> f64 {
    let (upper, lower) = (d + 0.5 * a, d - 0.5 * a);
    let (at_upper, at_lower) = (density(upper), density(lower));
    let level = first_integral(upper) - first_integral(lower);
    let second = at_upper - at_lower;
    let fourth = (upper * upper - 1.0) * at_upper - (lower * lower - 1.0) * at_lower;
    let b2 = b * b;
    (level + b2 / 24.0 * second + b2 * b2 / 1920.0 * fourth) / a
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Mean over the pixel by Gauss–Legendre quadrature with five points in
    /// each of n·n cells.
    fn by_quadrature(inside: f64, [x, y]: [f64; 2], blur: f64, n: i32) -> f64 {
        const NODES: [(f64, f64); 5] = [
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
            (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ];
        let cells = f64::from(n);
        let position = |cell: i32, node: f64| (f64::from(cell) + 0.5 + 0.5 * node) / cells - 0.5;
        let mut sum = 0.0;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            for (u, wu) in NODES {
                for (v, wv) in NODES {
                    let d = inside + x * position(i, u) + y * position(j, v);
                    sum += wu * wv * cumulative(d / blur);
                }
            }
        }
        sum / (4.0 * cells * cells)
    }

    fn direction(angle: f64) -> [f64; 2] {
        [angle.cos(), angle.sin()]
    }

    proptest! {
        #[test]
        fn it_is_the_integral_over_the_pixel(
            inside in -6.0..6.0, angle in 0.0..6.3, blur in 0.2..20.0,
        ) {
            let normal = direction(angle);
            let expected = by_quadrature(inside, normal, blur, 8);
            prop_assert!((coverage(inside, normal, blur) - expected).abs() < 1e-9);
        }

        #[test]
        fn nearly_upright_edges_lose_nothing(
            inside in -3.0..3.0, log_angle in -12.0..0.0, blur in 0.2..20.0,
        ) {
            let normal = direction(10_f64.powf(log_angle));
            let expected = by_quadrature(inside, normal, blur, 8);
            prop_assert!((coverage(inside, normal, blur) - expected).abs() < 1e-9);
        }

        #[test]
        fn both_sides_of_an_edge_make_a_pixel(
            inside in -8.0..8.0_f64, angle in 0.0..6.3, log_blur in -8.0..1.3_f64,
        ) {
            let blur = 10_f64.powf(log_blur);
            let both = coverage(inside, direction(angle), blur)
                + coverage(-inside, direction(angle), blur);
            prop_assert!((both - 1.0).abs() < 1e-12);
        }

        #[test]
        fn less_blur_leads_to_the_sharp_edge(
            inside in -1.0..1.0, angle in 0.0..6.3, log_blur in -6.0..-2.0,
        ) {
            let blur = 10_f64.powf(log_blur);
            let sharp = coverage(inside, direction(angle), 0.0);
            // A blur changes the light only in a strip of its own size.
            prop_assert!((coverage(inside, direction(angle), blur) - sharp).abs() < 0.5 * blur + 1e-9);
        }

        #[test]
        fn a_row_of_pixels_holds_the_length_of_the_bead_in_it(
            left in -0.5..0.5_f64, width in 1.0..20.0_f64, slope in -0.4..0.4_f64, log_blur in -8.0..0.5_f64,
        ) {
            // Along a row the covered fractions of an infinite bead sum to its length along the
            // row, for any blur.
            let blur = 10_f64.powf(log_blur);
            let long = f64::hypot(1.0, slope);
            let normal = [1.0 / long, -slope / long];
            let sum: f64 = (-60..100_i32)
                .map(|x| {
                    let x = f64::from(x);
                    coverage((x - left) / long, normal, blur)
                        - coverage((x - left - width) / long, normal, blur)
                })
                .sum();
            prop_assert!((sum - width).abs() < 1e-9, "{sum} {width}");
        }
    }

    #[test]
    fn known_areas() {
        let slant = direction(std::f64::consts::FRAC_PI_4);
        assert!((coverage(0.0, slant, 0.0) - 0.5).abs() < 1e-15);
        assert!((coverage(-0.25, [1.0, 0.0], 0.0) - 0.25).abs() < 1e-15);
        // A corner of side ½ is cut off at ¼·√2 from the centre.
        assert!((coverage(-0.125_f64.sqrt(), slant, 0.0) - 0.125).abs() < 1e-15);
        assert!((coverage(1e3, slant, 1.5) - 1.0).abs() < 1e-15);
        assert!(coverage(-1e3, slant, 1.5).abs() < 1e-15);
    }

    #[test]
    fn series_and_closed_form_meet_where_one_takes_over() {
        for a in [0.1, 0.5, 2.0, 30.0, 1e3, 1e5] {
            let border =
                SERIES_BELOW_BLURS.max(SERIES_BELOW_BLURS * f64::cbrt(a / 300.0)).min(0.5 * a);
            for d in [-0.5 * a - 2.0, -0.5 * a, -0.3 * a, 0.0] {
                let below = blurred(d, a, border * (1.0 - 1e-12));
                let above = blurred(d, a, border * (1.0 + 1e-12));
                assert!((below - above).abs() < 2e-9, "a {a} d {d}: {below} {above}");
            }
        }
    }
}
