//! A straight line through samples, summed up block by block.

/// Slope of the surroundings, in its standard deviations, from which on it is accepted. Derived:
/// noise alone exceeds 2.5 in 1.2 % of the sides, and a slope that is shrunk to none costs little.
const MIN_SLOPE_SIGMAS: f64 = 2.5;
/// Mean square distance of positions from their middle from which on they show a
/// slope \[px²\].
const MIN_SPREAD_PX2: f64 = 3.0;

/// Running sums of a straight line.
#[derive(Debug, Clone, Copy, Default)]
pub struct LineSums {
    /// Sum of the weights.
    pub weight: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl LineSums {
    /// Adds a sample.
    #[inline(always)]
    pub fn add(&mut self, x: f64, y: f64, weight: f64) {
        self.weight += weight;
        self.x += weight * x;
        self.y += weight * y;
        self.xx += weight * x * x;
        self.xy += weight * x * y;
    }

    /// Adds the samples of another.
    pub fn join(&mut self, other: &Self) {
        self.weight += other.weight;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.xy += other.xy;
    }

    /// Mean position of the samples.
    pub fn middle(&self) -> f64 {
        self.x / self.weight
    }

    /// Mean value of the samples.
    pub fn mean(&self) -> f64 {
        self.y / self.weight
    }

    fn spread(&self) -> f64 {
        self.xx - self.x * self.x / self.weight
    }

    fn slope(&self) -> f64 {
        (self.xy - self.x * self.y / self.weight) / self.spread()
    }

    /// Whether the samples reach far enough to show a slope.
    pub fn shows_slope(&self) -> bool {
        self.weight > 0.0 && self.spread() >= MIN_SPREAD_PX2 * self.weight
    }

    /// Value of the line at a position, and its variance in units of a sample's. Samples over too
    /// few pixels give their mean, without a slope; no samples give (0, 0).
    pub fn at(&self, x: f64) -> (f64, f64) {
        if self.weight <= 0.0 {
            return (0.0, 0.0);
        }
        let away = x - self.middle();
        if !self.shows_slope() {
            return (self.mean(), 1.0 / self.weight);
        }
        (self.mean() + self.slope() * away, 1.0 / self.weight + away * away / self.spread())
    }

    /// The slope, shrunk towards 0 for noise: 0 below 2.5 standard deviations, nearly unchanged far
    /// above. And the variance that its uncertainty gives the line at position 0, the edge.
    pub fn shrunk_slope(&self, noise: f64) -> (f64, f64) {
        if !self.shows_slope() {
            return (0.0, 0.0);
        }
        let slope = self.slope();
        let variance = noise * noise / self.spread();
        let sure =
            (1.0 - MIN_SLOPE_SIGMAS * MIN_SLOPE_SIGMAS * variance / (slope * slope)).max(0.0);
        (slope * sure, sure * variance * self.middle() * self.middle())
    }
}
