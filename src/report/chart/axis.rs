//! Axes: round ticks, and the map from values to positions on the page.

use super::range::ValueRange;

/// Start and end of an axis on the page \[px of the drawing\]; on a y axis the start is the larger
/// number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PageExtent {
    /// Position of the smallest value.
    pub from: f64,
    /// Position of the largest value.
    pub to: f64,
}

/// A linear or logarithmic map from values to positions on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisScale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    log: bool,
}

impl AxisScale {
    /// A linear map from values to a part of the page. A range of length 0 is widened.
    pub fn linear(values: ValueRange, page: PageExtent) -> Self {
        let (low, high) = widened(values.min, values.max);
        let PageExtent { from, to } = page;
        Self { low, high, from, to, log: false }
    }

    /// A logarithmic map from positive values to a part of the page.
    pub fn log(values: ValueRange, page: PageExtent) -> Self {
        let low = values.min.max(1e-9);
        let high = if values.max > low { values.max } else { low * 2.0 };
        let PageExtent { from, to } = page;
        Self { low, high, from, to, log: true }
    }

    /// Position of a value on the page \[px of the drawing\].
    pub fn position(&self, value: f64) -> f64 {
        let fraction = if self.log {
            (value.max(1e-9) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + fraction * (self.to - self.from)
    }

    /// About `wanted` round values within the range, with their labels.
    pub fn ticks(&self, wanted: u32) -> Vec<(f64, String)> {
        if self.log { self.log_ticks() } else { self.linear_ticks(wanted) }
    }

    fn linear_ticks(&self, wanted: u32) -> Vec<(f64, String)> {
        let step = round_step((self.high - self.low) / f64::from(wanted.max(1)));
        let places = decimals(step);
        let mut ticks = Vec::new();
        let mut index = (self.low / step - 1e-9).ceil();
        while index * step <= self.high + step * 1e-9 && ticks.len() < 100 {
            // Adding zero turns a negative zero into a positive one.
            let value = index * step + 0.0;
            ticks.push((value, format!("{value:.places$}")));
            index += 1.0;
        }
        ticks
    }

    fn log_ticks(&self) -> Vec<(f64, String)> {
        let factors: &[f64] = match self.high / self.low {
            narrow if narrow < 10.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
            wide if wide < 1e3 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let mut ticks = Vec::new();
        let mut decade = 10_f64.powf(self.low.log10().floor());
        while decade <= self.high && ticks.len() < 100 {
            for factor in factors {
                let value = decade * factor;
                if (self.low..=self.high).contains(&value) {
                    let halves = usize::from(factor.fract() > 0.0);
                    ticks.push((value, format!("{value:.*}", decimals(value) + halves)));
                }
            }
            decade *= 10.0;
        }
        ticks
    }
}

fn widened(low: f64, high: f64) -> (f64, f64) {
    let min_length = (low.abs().max(high.abs()) * 1e-6).max(1e-6);
    if high - low > min_length {
        (low, high)
    } else {
        let middle = f64::midpoint(low, high);
        let half = (middle.abs() * 0.01).max(0.5);
        (middle - half, middle + half)
    }
}

/// The smallest of 1, 2 or 5 times a power of ten that is not below `rough`.
fn round_step(rough: f64) -> f64 {
    let power = 10_f64.powf(rough.max(1e-12).log10().floor());
    let factor = rough / power;
    let round = [1.0, 2.0, 5.0].into_iter().find(|round| factor <= round + 1e-9);
    power * round.unwrap_or(10.0)
}

/// Number of decimals for values in steps of this size.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=9")]
fn decimals(step: f64) -> usize {
    (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: AxisScale, wanted: u32) -> Vec<String> {
        scale.ticks(wanted).into_iter().map(|tick| tick.1).collect()
    }

    #[test]
    fn ticks_are_round() {
        let page = PageExtent { from: 0.0, to: 100.0 };
        assert_eq!(
            labels(AxisScale::linear(ValueRange::new(0.0, 20.0), page), 5),
            ["0", "5", "10", "15", "20"]
        );
        assert_eq!(
            labels(AxisScale::linear(ValueRange::new(41.83, 42.21), page), 4),
            ["41.9", "42.0", "42.1", "42.2"]
        );
        assert_eq!(
            labels(AxisScale::linear(ValueRange::new(-0.5, 0.5), page), 2),
            ["-0.5", "0.0", "0.5"]
        );
        assert_eq!(
            labels(AxisScale::log(ValueRange::new(0.3, 6.0), page), 5),
            ["0.5", "1", "2", "5"]
        );
        assert_eq!(
            labels(AxisScale::log(ValueRange::new(0.9, 3.1), page), 5),
            ["1", "1.5", "2", "3"]
        );
    }

    #[test]
    fn a_range_without_extent_still_has_an_axis() {
        let scale =
            AxisScale::linear(ValueRange::new(42.0, 42.0), PageExtent { from: 0.0, to: 100.0 });
        assert!((scale.position(42.0) - 50.0).abs() < 1e-9);
        assert!(!scale.ticks(5).is_empty());
        assert!(
            !AxisScale::log(ValueRange::new(0.0, 0.0), PageExtent { from: 0.0, to: 1.0 })
                .position(0.0)
                .is_nan()
        );
    }

    #[test]
    fn values_have_their_position() {
        let scale =
            AxisScale::linear(ValueRange::new(0.0, 10.0), PageExtent { from: 200.0, to: 100.0 });
        assert!((scale.position(2.5) - 175.0).abs() < 1e-9);
        let log = AxisScale::log(ValueRange::new(1.0, 100.0), PageExtent { from: 0.0, to: 100.0 });
        assert!((log.position(10.0) - 50.0).abs() < 1e-9);
    }
}
