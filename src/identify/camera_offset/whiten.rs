//! Normalised innovations of numbers along the path.
//!
//! The noise of each frame is independent, on top of a stationary process whose correlation
//! decays exponentially along the path (Ornstein and Uhlenbeck 1930). The Kalman filter (1960)
//! gives the innovations, which are independent, for frames at any distances and for a nozzle
//! at rest. It is linear, and applies to any series of numbers at these positions.

/// Variances of the process that are tried, in units of a frame's noise variance. A choice: a
/// factor of three is below the uncertainty of the estimate.
const VARIANCES: [f64; 11] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, 10_000.0];
/// Correlation lengths that are tried \[mm\].
const LENGTHS_MM: [f64; 9] = [3.0, 10.0, 20.0, 40.0, 80.0, 200.0, 600.0, 2000.0, 10_000.0];

/// Noise model of the widths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthNoise {
    variance: f64,
    correlation_length_mm: f64,
}

impl WidthNoise {
    /// Initial value of the iteration.
    pub const INITIAL: Self = Self { variance: 3.0, correlation_length_mm: 80.0 };

    /// All noise models that are tried.
    pub fn all() -> impl Iterator<Item = Self> {
        let drifting = VARIANCES.into_iter().skip(1).flat_map(|variance| {
            LENGTHS_MM
                .into_iter()
                .map(move |length_mm| Self { variance, correlation_length_mm: length_mm })
        });
        std::iter::once(Self { variance: VARIANCES[0], correlation_length_mm: LENGTHS_MM[0] })
            .chain(drifting)
    }
}

/// Position of an observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPosition {
    /// Number of the bead; the process starts anew with each.
    pub bead: usize,
    /// Where along its path \[mm\].
    pub path_mm: f64,
    /// Variance of the frame noise, in units of the typical one.
    pub variance: f64,
}

/// The Kalman filter for some positions.
#[derive(Debug, Clone)]
pub struct PathWhitener {
    steps: Vec<Step>,
    /// Sum of the logarithms of the innovation variances.
    pub ln_variances: f64,
}

#[derive(Debug, Clone, Copy)]
struct Step {
    /// Correlation with the state before.
    correlation: f64,
    gain: f64,
    /// One over the standard deviation of the innovation.
    weight: f64,
}

impl PathWhitener {
    /// For these positions, in order.
    pub fn new(positions: &[PathPosition], noise: WidthNoise) -> Self {
        let mut variance = noise.variance;
        let mut before: Option<PathPosition> = None;
        let mut ln_variances = 0.0;
        let steps = positions
            .iter()
            .map(|position| {
                let same_bead = before.filter(|before| before.bead == position.bead);
                let way_mm = same_bead.map(|before| (position.path_mm - before.path_mm).abs());
                let correlation =
                    way_mm.map_or(0.0, |way_mm| (-way_mm / noise.correlation_length_mm).exp());
                let kept = correlation * correlation;
                variance = kept * variance + noise.variance * (1.0 - kept);
                let total = variance + position.variance;
                let gain = variance / total;
                variance *= 1.0 - gain;
                before = Some(*position);
                ln_variances += total.ln();
                Step { correlation, gain, weight: 1.0 / total.sqrt() }
            })
            .collect();
        Self { steps, ln_variances }
    }

    /// The innovations of a series of numbers, in units of their standard deviations.
    pub fn apply(&self, values: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
        let mut known = 0.0;
        self.steps.iter().zip(values).map(move |(step, value)| {
            let predicted = step.correlation * known;
            let innovation = value - predicted;
            known = predicted + step.gain * innovation;
            step.weight * innovation
        })
    }
}
