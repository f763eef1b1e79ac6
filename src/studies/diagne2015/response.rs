//! The response of a run, and its performance figures.

use crate::numeric::number::to_f64;
/// One sample of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlugSample {
    /// Time since the start \[s\].
    pub at_s: f64,
    /// Length of the plug \[mm\].
    pub plug_mm: f64,
    /// Fill of the feed, 0 to 1.
    pub fill: f64,
    /// Prediction: length of the plug when this feed arrives \[mm\], and that time \[s\]. `None`
    /// without a predictor.
    pub predicted: Option<(f64, f64)>,
    /// Delay of the feed that arrives now \[s\].
    pub delay_s: f64,
}

/// A run, sample by sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlugResponse {
    /// In the order of time, one per step.
    pub samples: Vec<PlugSample>,
}

/// A limit cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// From the lowest to the highest length of the plug \[mm\].
    pub peak_to_peak_mm: f64,
    /// Period \[s\].
    pub period_s: f64,
}

impl PlugResponse {
    /// Time from which the plug stays within `within_mm` of `plug_mm` \[s\]; `None` if it does
    /// not.
    pub fn settles(&self, plug_mm: f64, within_mm: f64) -> Option<f64> {
        let outside = |sample: &PlugSample| (sample.plug_mm - plug_mm).abs() > within_mm;
        let inside = self.samples.iter().rposition(outside).map_or(0, |last| last + 1);
        self.samples.get(inside).map(|sample| sample.at_s)
    }

    /// Overshoot of the plug beyond `plug_mm` \[mm\].
    pub fn overshoot_mm(&self, plug_mm: f64) -> f64 {
        self.samples.iter().map(|sample| sample.plug_mm - plug_mm).fold(0.0, f64::max)
    }

    /// Root mean square deviation from `plug_mm` after `after_s` \[mm\].
    pub fn rms_mm(&self, plug_mm: f64, after_s: f64) -> f64 {
        let samples = self.after(after_s);
        let sum: f64 = samples.iter().map(|sample| (sample.plug_mm - plug_mm).powi(2)).sum();
        (sum / to_f64(samples.len().max(1))).sqrt()
    }

    /// Root mean square change of the feed from step to step after `after_s`: the activity of the
    /// feeder.
    pub fn feed_change(&self, after_s: f64) -> f64 {
        let samples = self.after(after_s);
        let changes = samples.windows(2).map(|pair| (pair[1].fill - pair[0].fill).powi(2));
        (changes.sum::<f64>() / to_f64(samples.len().max(1))).sqrt()
    }

    /// The limit cycle about `plug_mm` after `after_s`; `None` if the plug moves by less than a
    /// tenth of a millimetre or crosses that length less than four times. The period is twice the
    /// median time between crossings: with a slowly pulsating conveying speed it is not constant.
    pub fn cycle(&self, plug_mm: f64, after_s: f64) -> Option<Cycle> {
        let samples = self.after(after_s);
        let (low, high) =
            samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| {
                (low.min(s.plug_mm), high.max(s.plug_mm))
            });
        let crossings: Vec<f64> =
            samples.windows(2).filter_map(|pair| crossing(pair, plug_mm)).collect();
        let mut halves: Vec<f64> = crossings.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if halves.len() < 3 || high - low < 0.1 {
            return None;
        }
        halves.sort_by(f64::total_cmp);
        let half = halves.get(halves.len() / 2)?;
        Some(Cycle { peak_to_peak_mm: high - low, period_s: 2.0 * half })
    }

    /// Largest deviation from `lengths_mm` at successive samples \[mm\]; the first length belongs
    /// to the sample `from`.
    pub fn max_deviation(&self, from: usize, lengths_mm: impl Iterator<Item = f64>) -> f64 {
        let pairs = self.samples.get(from..).unwrap_or_default().iter().zip(lengths_mm);
        pairs.map(|(s, length)| (s.plug_mm - length).abs()).fold(0.0, f64::max)
    }

    fn after(&self, after_s: f64) -> &[PlugSample] {
        let first = self.samples.partition_point(|sample| sample.at_s < after_s);
        self.samples.get(first..).unwrap_or_default()
    }
}

/// Time at which a pair of samples crosses a level in either direction \[s\]; `None` if it does
/// not.
fn crossing(pair: &[PlugSample], level: f64) -> Option<f64> {
    let [one, two] = pair else { return None };
    if (one.plug_mm < level) == (two.plug_mm < level) {
        return None;
    }
    let fraction = (level - one.plug_mm) / (two.plug_mm - one.plug_mm);
    Some(one.at_s + fraction * (two.at_s - one.at_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn response(plug: impl Fn(f64) -> f64) -> PlugResponse {
        let sample = |k: u32| {
            let at_s = 0.001 * f64::from(k);
            PlugSample { at_s, plug_mm: plug(at_s), fill: 0.0, predicted: None, delay_s: 0.0 }
        };
        PlugResponse { samples: (0..10_000).map(sample).collect() }
    }

    #[test]
    fn settling_is_final_and_a_limit_cycle_is_measured() {
        let falling = response(|at| 160.0 - 60.0 * (-at).exp());
        let settled = falling.settles(160.0, 3.2).unwrap();
        assert!((settled - (60.0_f64 / 3.2).ln()).abs() < 1.1e-3);
        assert_eq!(falling.overshoot_mm(160.0), 0.0);
        let cycling = response(|at| 160.0 + 4.4 * (std::f64::consts::TAU * at / 1.6).sin());
        assert_eq!(cycling.settles(160.0, 3.2), None);
        let cycle = cycling.cycle(160.0, 2.0).unwrap();
        assert!((cycle.peak_to_peak_mm - 8.8).abs() < 1e-3);
        assert!((cycle.period_s - 1.6).abs() < 1e-6);
        assert!((cycling.rms_mm(160.0, 2.0) - 4.4 / 2_f64.sqrt()).abs() < 1e-2);
        assert!(falling.cycle(160.0, 2.0).is_none());
    }
}
