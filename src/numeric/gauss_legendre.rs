//! Numerical integration.

/// Nodes and weights of the five-point Gauss-Legendre rule on −1 to 1 (Abramowitz and Stegun
/// 1964, table 25.4); the weights add up to 2.
pub const GAUSS_LEGENDRE_5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189),
    (-0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.0, 0.568_888_888_888_889),
    (0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.906_179_845_938_664, 0.236_926_885_056_189),
];
