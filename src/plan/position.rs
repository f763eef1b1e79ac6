//! Positions of the nozzle.

/// Position of the nozzle: x, y, z \[mm\].
pub type Position = [f64; 3];

/// Distance of two positions \[mm\].
pub fn distance(from: Position, to: Position) -> f64 {
    from.iter().zip(to).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt()
}
