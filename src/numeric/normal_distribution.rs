//! The standard normal distribution Φ, its density φ and its antiderivatives, fast: Taylor
//! series about the nearest of equidistant nodes. Rendering evaluates some 100,000 per frame.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::sync::LazyLock;

/// Derived: √(2π), the ratio of the height of a Gaussian edge to the product of its slope and
/// blur.
pub const ROOT_TWO_PI: f64 = 2.506_628_274_631_000_5;
/// Nodes per unit. Derived: |u − node| is at most 1/32, so that the fourth-order remainder of φ
/// is below 3·φ(0)·(1/32)⁴/24 = 5e-8.
const NODES_PER_UNIT: f64 = 16.0;
/// The nodes extend from −`MAX_NODE` to `MAX_NODE`. Derived: beyond, the tail is Φ(−10) <
/// 1e-23.
const MAX_NODE: f64 = 10.0;

/// Coefficients of the series about a node.
struct Node {
    at: f64,
    /// φ and its first three derivatives.
    density: [f64; 4],
    cumulative: f64,
    first: f64,
    second: f64,
}

static NODES: LazyLock<Vec<Node>> = LazyLock::new(|| {
    let mut nodes = Vec::new();
    let mut at = -MAX_NODE;
    while at <= MAX_NODE {
        let density = libm::exp(-0.5 * at * at) / TAU.sqrt();
        let cumulative = cumulative(at);
        nodes.push(Node {
            at,
            density: [
                density,
                -at * density,
                (at * at - 1.0) * density,
                (3.0 * at - at * at * at) * density,
            ],
            cumulative,
            first: at * cumulative + density,
            second: 0.5 * ((at * at + 1.0) * cumulative + at * density),
        });
        at += 1.0 / NODES_PER_UNIT;
    }
    nodes
});

/// The nearest node and the distance from it; `None` outside the nodes.
fn near(u: f64) -> Option<(&'static Node, f64)> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let number = ((u + MAX_NODE) * NODES_PER_UNIT + 0.5) as usize;
    let node = NODES.get(number).filter(|_| u >= -MAX_NODE)?;
    Some((node, u - node.at))
}

/// Φ(u), to double precision.
pub fn cumulative(u: f64) -> f64 {
    0.5 * libm::erfc(-u * FRAC_1_SQRT_2)
}

/// φ(u), to 2·10⁻⁷.
pub fn density(u: f64) -> f64 {
    near(u).map_or(0.0, |(node, h)| {
        let [d0, d1, d2, d3] = node.density;
        d0 + h * (d1 + h / 2.0 * (d2 + h / 3.0 * d3))
    })
}

/// u·Φ(u) + φ(u), the antiderivative of Φ, to 10⁻¹¹.
pub fn first_integral(u: f64) -> f64 {
    near(u).map_or(u.max(0.0), |(node, h)| {
        let [d0, d1, d2, d3] = node.density;
        let tail = d0 + h / 3.0 * (d1 + h / 4.0 * (d2 + h / 5.0 * d3));
        node.first + h * (node.cumulative + h / 2.0 * tail)
    })
}

/// ((u² + 1)·Φ(u) + u·φ(u))/2, the antiderivative of [`first_integral`], to 10⁻¹³.
pub fn second_integral(u: f64) -> f64 {
    near(u).map_or(if u > 0.0 { 0.5 * (u * u + 1.0) } else { 0.0 }, |(node, h)| {
        let [d0, d1, d2, d3] = node.density;
        let tail = d0 + h / 4.0 * (d1 + h / 5.0 * (d2 + h / 6.0 * d3));
        node.second + h * (node.first + h / 2.0 * (node.cumulative + h / 3.0 * tail))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constant_is_the_root_of_two_pi() {
        assert!((ROOT_TWO_PI - TAU.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn the_series_are_the_formulas() {
        for i in -12_000..12_000 {
            let u = f64::from(i) * 1e-3 + 1e-4;
            let phi = libm::exp(-0.5 * u * u) / TAU.sqrt();
            let first = u * cumulative(u) + phi;
            let second = 0.5 * ((u * u + 1.0) * cumulative(u) + u * phi);
            assert!((density(u) - phi).abs() < 2e-7, "{u}");
            assert!((first_integral(u) - first).abs() < 1e-11, "{u}");
            assert!((second_integral(u) - second).abs() < 1e-13 * (1.0 + u * u), "{u}");
        }
    }
}
