//! What a number along the path differs from what those before it foretell.
//!
//! The noise is that of each picture, independent, on a course that wanders along the
//! path and forgets itself over a length (Ornstein and Uhlenbeck 1930). Kalman's filter
//! (1960) gives the differences, which are independent of each other, for frames at any
//! distances and for a nozzle that stands still. It is linear, and the same filter takes
//! any series of numbers at these places.

/// Sizes of the wandering course that are tried, as variances in units of a picture's.
const VARIANCES: [f64; 11] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, 10_000.0];
/// Lengths over which it forgets itself \[mm\].
const LENGTHS_MM: [f64; 9] = [3.0, 10.0, 20.0, 40.0, 80.0, 200.0, 600.0, 2000.0, 10_000.0];

/// How widths scatter about the bead's model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthNoise {
    variance: f64,
    correlation_length_mm: f64,
}

impl WidthNoise {
    /// Taken as long as nothing is known.
    pub const INITIAL: Self = Self { variance: 3.0, correlation_length_mm: 80.0 };

    /// All that are tried.
    pub fn all() -> impl Iterator<Item = Self> {
        let wandering = VARIANCES.into_iter().skip(1).flat_map(|variance| {
            LENGTHS_MM
                .into_iter()
                .map(move |length_mm| Self { variance, correlation_length_mm: length_mm })
        });
        std::iter::once(Self { variance: VARIANCES[0], correlation_length_mm: LENGTHS_MM[0] })
            .chain(wandering)
    }
}

/// A place at which something was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPosition {
    /// Number of the bead; what wanders begins anew with each.
    pub bead: usize,
    /// Where along its path \[mm\].
    pub path_mm: f64,
    /// Variance of the picture's noise, in units of the usual one.
    pub variance: f64,
}

/// The filter of some places.
#[derive(Debug, Clone)]
pub struct PathWhitener {
    steps: Vec<Step>,
    /// Sum of the logarithms of the variances of the differences.
    pub ln_variances: f64,
}

#[derive(Debug, Clone, Copy)]
struct Step {
    /// How much of what was known holds here.
    correlation: f64,
    gain: f64,
    /// One over the standard deviation of the difference.
    weight: f64,
}

impl PathWhitener {
    /// For these places, in order.
    pub fn new(places: &[PathPosition], noise: WidthNoise) -> Self {
        let mut variance = noise.variance;
        let mut before: Option<PathPosition> = None;
        let mut ln_variances = 0.0;
        let steps = places
            .iter()
            .map(|place| {
                let kept =
                    before.filter(|before| before.bead == place.bead).map_or(0.0, |before| {
                        (-(place.path_mm - before.path_mm).abs() / noise.correlation_length_mm)
                            .exp()
                    });
                variance = kept * kept * variance + noise.variance * (1.0 - kept * kept);
                let total = variance + place.variance;
                let gain = variance / total;
                variance *= 1.0 - gain;
                before = Some(*place);
                ln_variances += total.ln();
                Step { correlation: kept, gain, weight: 1.0 / total.sqrt() }
            })
            .collect();
        Self { steps, ln_variances }
    }

    /// The differences of a series of numbers, in units of their standard deviations.
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
