//! A curve of any length in bounded memory: neighbouring samples share a bucket, which keeps the
//! smallest and the largest, so that no spike is lost.

use super::range::ValueRange;

/// A point of a curve, in the units of its axes.
pub type CurvePoint = (f64, f64);

/// Largest number of buckets; each gives up to two points, together more than a page has pixels
/// across.
const MAX_BUCKETS: usize = 1000;

/// The extremes of neighbouring samples.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bucket {
    low: CurvePoint,
    high: CurvePoint,
    first_x: f64,
    last_x: f64,
    count: u64,
}

impl Bucket {
    fn of(point: CurvePoint) -> Self {
        Self { low: point, high: point, first_x: point.0, last_x: point.0, count: 1 }
    }

    fn join(self, later: Self) -> Self {
        Self {
            low: if later.low.1 < self.low.1 { later.low } else { self.low },
            high: if later.high.1 > self.high.1 { later.high } else { self.high },
            first_x: self.first_x,
            last_x: later.last_x,
            count: self.count + later.count,
        }
    }
}

/// Samples in order, thinned by doubling the size of the buckets.
#[derive(Debug, Clone)]
pub struct PlotCurve {
    buckets: Vec<Bucket>,
    per_bucket: u64,
}

impl Default for PlotCurve {
    fn default() -> Self {
        Self { buckets: Vec::new(), per_bucket: 1 }
    }
}

impl PlotCurve {
    /// Adds a sample; values that are not finite are ignored. If x decreases, as a path does with
    /// a new bead, a new bucket begins.
    pub fn push(&mut self, x: f64, y: f64) {
        if !(x.is_finite() && y.is_finite()) {
            return;
        }
        let sample = Bucket::of((x, y));
        match self.buckets.last_mut() {
            Some(last) if last.count < self.per_bucket && x >= last.last_x => {
                *last = last.join(sample);
            }
            _ => self.buckets.push(sample),
        }
        if self.buckets.len() > MAX_BUCKETS {
            self.per_bucket *= 2;
            self.buckets = self
                .buckets
                .chunks(2)
                .map(|pair| pair.iter().copied().reduce(Bucket::join).unwrap_or(pair[0]))
                .collect();
        }
    }

    /// Whether it has no point.
    pub fn is_empty(&self) -> bool {
        self.buckets.is_empty()
    }

    /// The curve, with both extremes of every bucket; at most 2000 points.
    pub fn points(&self) -> Vec<CurvePoint> {
        let mut points = Vec::with_capacity(self.buckets.len() * 2);
        for bucket in &self.buckets {
            if bucket.count == 1 {
                points.push(bucket.low);
            } else if bucket.low.0 <= bucket.high.0 {
                points.extend([bucket.low, bucket.high]);
            } else {
                points.extend([bucket.high, bucket.low]);
            }
        }
        points
    }

    /// The smallest value of every bucket, at its middle.
    pub fn lower_envelope(&self) -> Vec<CurvePoint> {
        self.buckets.iter().map(|b| (f64::midpoint(b.first_x, b.last_x), b.low.1)).collect()
    }

    /// The largest value of every bucket, at its middle.
    pub fn upper_envelope(&self) -> Vec<CurvePoint> {
        self.buckets.iter().map(|b| (f64::midpoint(b.first_x, b.last_x), b.high.1)).collect()
    }

    /// Smallest and largest value; `None` without points.
    pub fn range(&self) -> Option<ValueRange> {
        self.buckets
            .iter()
            .map(|bucket| ValueRange::new(bucket.low.1, bucket.high.1))
            .reduce(ValueRange::joined)
    }

    /// Smallest and largest x; `None` without points.
    pub fn extent(&self) -> Option<ValueRange> {
        self.buckets
            .iter()
            .map(|bucket| ValueRange::new(bucket.first_x, bucket.last_x))
            .reduce(ValueRange::joined)
    }
}

/// Splits points where the curve breaks: x decreases, or increases by more than five times its
/// usual step.
pub fn unbroken(points: &[CurvePoint]) -> Vec<&[CurvePoint]> {
    let mut steps: Vec<f64> =
        points.windows(2).map(|pair| pair[1].0 - pair[0].0).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    // The two extremes of a bucket may be close together, so the usual step is the upper quartile.
    let leap = steps.get(steps.len() * 3 / 4).map_or(f64::INFINITY, |step| step * 5.0);
    points
        .chunk_by(|a, b| (0.0..=leap).contains(&(b.0 - a.0)))
        .filter(|part| !part.is_empty())
        .collect()
}

/// Collects points into a curve.
impl FromIterator<CurvePoint> for PlotCurve {
    fn from_iter<I: IntoIterator<Item = CurvePoint>>(points: I) -> Self {
        let mut series = Self::default();
        for (x, y) in points {
            series.push(x, y);
        }
        series
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_short_curve_is_kept_as_it_is() {
        let mut series = PlotCurve::default();
        for point in [(0.0, 1.0), (1.0, 5.0), (2.0, f64::NAN), (3.0, 2.0)] {
            series.push(point.0, point.1);
        }
        assert_eq!(series.points(), [(0.0, 1.0), (1.0, 5.0), (3.0, 2.0)]);
        assert_eq!(series.range(), Some(ValueRange::new(1.0, 5.0)));
        assert_eq!(series.extent(), Some(ValueRange::new(0.0, 3.0)));
    }

    #[test]
    fn a_lone_spike_survives_a_million_samples() {
        let mut series = PlotCurve::default();
        for i in 0..1_000_000_u32 {
            let y = if i == 654_321 { 99.0 } else { f64::from(i % 7) };
            series.push(f64::from(i), y);
        }
        let points = series.points();
        assert!(points.len() <= 2000, "{}", points.len());
        assert!(points.contains(&(654_321.0, 99.0)));
        assert!(points.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn curves_break_at_gaps_and_at_a_new_bead() {
        let points: Vec<CurvePoint> =
            [0.0, 1.0, 2.0, 20.0, 21.0, 3.0, 4.0].iter().map(|x| (*x, 0.0)).collect();
        let lengths: Vec<usize> = unbroken(&points).iter().map(|part| part.len()).collect();
        assert_eq!(lengths, [3, 2, 2]);
    }

    proptest! {
        #[test]
        fn extremes_are_kept(values in prop::collection::vec(-1e6..1e6, 1..5000)) {
            let mut series = PlotCurve::default();
            for (i, y) in (0_u32..).zip(&values) {
                series.push(f64::from(i), *y);
            }
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert_eq!(series.range(), Some(ValueRange::new(least, largest)));
            prop_assert!(series.points().len() <= 2000);
        }
    }
}
