//! Whether a narrow groove may lie beside an edge.

use super::{HALF_SPAN, Overlay};

/// Positions beside the edge within which a narrow groove lies \[px\].
const MAX_GROOVE_PX: usize = 9;
/// Smallest rise of the level beyond a groove towards the bead's, as a fraction of the step.
const MIN_RISE: f64 = 0.015;
/// Addition to it, in standard deviations of noise. Derived: noise alone exceeds 5 in 6 of ten
/// million positions.
const MIN_RISE_SIGMAS: f64 = 5.0;

impl Overlay {
    /// Whether the level beside the edge, after it or before it, rises again farther out towards
    /// that on its other side, as beyond a narrow groove. `noise` is the standard deviation of a
    /// pixel, as a fraction of the step.
    pub fn rises_beside(&self, after: bool, noise: f64) -> bool {
        let rows = self.used();
        if rows <= 0.0 {
            return false;
        }
        let (mut lowest, mut rise) = (f64::INFINITY, 0.0_f64);
        for away in 1..=MAX_GROOVE_PX {
            let at = if after { HALF_SPAN + away } else { HALF_SPAN - away };
            let phases = self.phases.iter();
            let sum: f64 = phases.map(|of| f64::from(of.rows) * f64::from(of.samples[at])).sum();
            let level = if after { 1.0 - sum / rows } else { sum / rows };
            lowest = lowest.min(level);
            rise = rise.max(level - lowest);
        }
        rise > MIN_RISE + MIN_RISE_SIGMAS * noise / rows.sqrt()
    }
}
