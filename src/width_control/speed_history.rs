//! The speeds at which the bead behind the nozzle was laid, along the path.

use std::collections::VecDeque;

use crate::core::{MAX_SILENCE, MmPerS};

/// Largest number of nodes, whatever the length: more than ten minutes at 50 reports a second
/// with two nodes each.
const MAX_NODES: usize = 1 << 16;
/// Speed below which the width model does not hold \[mm/s\]; it keeps ln v finite.
const SLOWEST_MM_PER_S: f64 = 0.5;
/// Relative difference within which two reports count as the same speed.
const SAME_SPEED_RATIO: f64 = 1e-3;
/// Largest jitter of the reports' arrival \[s\]. Within it the reported speeds are used: a
/// report that is a millisecond late changes a speed from the path by several percent.
const MAX_REPORT_DELAY_S: f64 = 0.03;
/// Time constant in which an arrival's delay decays \[s\].
const DELAY_TIME_CONSTANT_S: f64 = 1.0;
/// Shortest duration of a piece, as a fraction of the time between its reports.
const MIN_TIME_RATIO: f64 = 0.1;
/// Flow ratio below which there is no bead to speak of; it keeps ln finite.
const MIN_FLOW_RATIO: f64 = 0.01;
/// Pieces that are shorter are left out \[mm\], against division by zero.
const MIN_PIECE_MM: f64 = 1e-9;
/// Pieces of a smaller fraction of the time between reports are left out.
const MIN_PIECE_RATIO: f64 = 1e-6;
/// Time constant in which a flow other than at the start speed becomes the usual one \[s\].
const FLOW_TIME_CONSTANT_S: f64 = 3.0;

/// Speed over path. Between two reports the speed is taken to change once, at the position
/// that the path between them implies. Where speeds and path contradict each other by more than
/// jitter of the reports explains, the path is used.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedHistory {
    reference_mm_per_s: f64,
    /// Length behind the newest report that is kept \[mm\].
    kept_mm: f64,
    nodes: VecDeque<Node>,
    /// Speed of the newest report \[mm/s\].
    speed: f64,
    /// How early reports have arrived, judged by path and speeds \[s\].
    early_s: f64,
    flow_ratio: f64,
    /// Slow average of the logarithm of the flow ratio.
    usual_ln_flow: Option<f64>,
    /// Decaying maximum of the distance from that average.
    flow_excursion: f64,
}

/// The end of a piece laid at one speed, with integrals from the history's start: means over
/// any segment are differences of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    path_mm: f64,
    at_s: f64,
    /// Integrals over the path of ln(v/v₀), of its square, and of the change of the flow
    /// \[mm\].
    sums: [f64; 3],
}

/// ln(v/v₀) over a segment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LnSpeed {
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
}

impl SpeedHistory {
    /// An empty history, for a reference speed v₀ \[mm/s\], of a length \[mm\].
    pub fn new(reference_mm_per_s: f64, length_mm: f64) -> Self {
        let reference_mm_per_s = reference_mm_per_s.max(SLOWEST_MM_PER_S);
        Self {
            reference_mm_per_s,
            kept_mm: length_mm,
            nodes: VecDeque::new(),
            speed: 0.0,
            early_s: 0.0,
            flow_ratio: 1.0,
            usual_ln_flow: None,
            flow_excursion: 0.0,
        }
    }

    /// Discards all reports.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.early_s = 0.0;
    }

    /// Whether there is no segment yet.
    pub fn is_empty(&self) -> bool {
        self.nodes.len() < 2
    }

    /// Adds a report: time \[s\], path \[mm\], speed \[mm/s\] and the flow over the one at the
    /// start speed. A path that falls, a time that does not grow, or a silence in which the speed may
    /// have changed more than once, clears the history. Returns whether it goes on.
    pub fn report(&mut self, at_s: f64, path_mm: f64, speed: f64, flow_ratio: f64) -> bool {
        let last = self.nodes.back().copied();
        self.flow(flow_ratio, last.map_or(0.0, |last| at_s - last.at_s));
        let before = std::mem::replace(&mut self.speed, speed.max(SLOWEST_MM_PER_S));
        match last {
            Some(last) if path_mm >= last.path_mm && known_since(last.at_s, at_s) => {
                self.extend(&last, at_s, path_mm, before);
                true
            }
            _ => {
                self.clear();
                self.nodes.push_back(Node { path_mm, at_s, sums: [0.0; 3] });
                false
            }
        }
    }

    fn flow(&mut self, ratio: f64, passed_s: f64) {
        self.flow_ratio = ratio.max(MIN_FLOW_RATIO);
        let ln = libm::log(self.flow_ratio);
        let usual = self.usual_ln_flow.unwrap_or(ln);
        let kept = libm::exp(-passed_s.max(0.0) / FLOW_TIME_CONSTANT_S);
        self.flow_excursion = (self.flow_excursion * kept).max((ln - usual).abs());
        self.usual_ln_flow = Some(ln + kept * (usual - ln));
    }

    /// Distance of the flow from the one at the start speed, as a logarithm; 0 where it has
    /// been constant for long.
    fn flow_change(&self) -> f64 {
        libm::log(self.flow_ratio).abs().min(self.flow_excursion)
    }

    /// Adds the path from the last report to this one as a piece at each speed.
    fn extend(&mut self, last: &Node, at_s: f64, path_mm: f64, before: f64) {
        let (length, time) = (path_mm - last.path_mm, at_s - last.at_s);
        let changed = (self.speed - before).abs() > SAME_SPEED_RATIO * before;
        // Fraction of the time at the speed before.
        let fraction =
            if changed { (length / time - self.speed) / (before - self.speed) } else { 0.0 };
        let fraction = fraction.clamp(0.0, 1.0);
        let driven = before * fraction + self.speed * (1.0 - fraction);
        let first = length * before * fraction / driven.max(MIN_PIECE_MM);
        let took = self.duration(time, length / driven.max(MIN_PIECE_MM));
        if first > MIN_PIECE_MM && fraction > MIN_PIECE_RATIO {
            self.push(last.path_mm + first, last.at_s + fraction * time, first / (fraction * took));
        }
        if length - first > MIN_PIECE_MM && fraction < 1.0 - MIN_PIECE_RATIO {
            self.push(path_mm, at_s, (length - first) / ((1.0 - fraction) * took));
        } else if let Some(node) = self.nodes.back_mut() {
            node.at_s = at_s;
        }
    }

    /// Duration of a piece of path \[s\]: `by_speed`, as far as jitter of the reports explains its
    /// difference to `time` between them.
    fn duration(&mut self, time: f64, by_speed: f64) -> f64 {
        let early = self.early_s * libm::exp(-time / DELAY_TIME_CONSTANT_S);
        self.early_s = (early + by_speed - time).clamp(-MAX_REPORT_DELAY_S, MAX_REPORT_DELAY_S);
        (time + self.early_s - early).max(MIN_TIME_RATIO * time)
    }

    fn push(&mut self, path_mm: f64, at_s: f64, speed: f64) {
        let Some(last) = self.nodes.back().copied() else { return };
        let speed = speed.max(SLOWEST_MM_PER_S) / self.flow_ratio;
        let ln = libm::log(speed / self.reference_mm_per_s);
        let length = path_mm - last.path_mm;
        let needless = |node: &Node| node.path_mm < path_mm - self.kept_mm;
        while self.nodes.len() >= MAX_NODES || self.nodes.get(1).is_some_and(needless) {
            self.nodes.pop_front();
        }
        let [sum, square, change] = last.sums;
        let change = change + self.flow_change() * length;
        let sums = [sum + ln * length, square + ln * ln * length, change];
        self.nodes.push_back(Node { path_mm, at_s, sums });
    }

    /// The speed that a mean of ln(v/v₀) belongs to, with the flow of the newest report.
    pub fn speed_of(&self, ln: f64) -> MmPerS {
        let speed = self.reference_mm_per_s * self.flow_ratio * libm::exp(ln);
        MmPerS::new(speed).unwrap_or_default()
    }

    /// When the nozzle was at a position \[s\]; `None` outside the history.
    pub fn time_at(&self, path_mm: f64) -> Option<f64> {
        let (before, after, fraction) = self.bracket(path_mm)?;
        Some(before.at_s + (after.at_s - before.at_s) * fraction)
    }

    /// Speed over a segment of path \[mm\]; `None` unless all of it is known.
    pub fn mean_over(&self, from_mm: f64, to_mm: f64) -> Option<LnSpeed> {
        let (from, to) = (self.sums(from_mm)?, self.sums(to_mm)?);
        let length = to_mm - from_mm;
        if length <= MIN_PIECE_MM {
            let (before, after, _) = self.bracket(from_mm)?;
            let mean = (after.sums[0] - before.sums[0]) / (after.path_mm - before.path_mm);
            return Some(LnSpeed { mean, variance: 0.0 });
        }
        let mean = (to[0] - from[0]) / length;
        let variance = ((to[1] - from[1]) / length - mean * mean).max(0.0);
        Some(LnSpeed { mean, variance })
    }

    /// Mean change of the flow over a segment of path \[mm\], as a logarithm; `None` unless all
    /// of it is known.
    pub fn flow_change_over(&self, from_mm: f64, to_mm: f64) -> Option<f64> {
        let change = self.sums(to_mm)?[2] - self.sums(from_mm)?[2];
        Some(change / (to_mm - from_mm).max(MIN_PIECE_MM))
    }

    /// Speed over a segment, which is shifted into the history where it is partly outside.
    pub fn mean_near(&self, from_mm: f64, to_mm: f64) -> Option<LnSpeed> {
        let (first, last) = (self.nodes.front()?, self.nodes.back()?);
        let shift = (first.path_mm - from_mm).max(0.0) - (to_mm - last.path_mm).max(0.0);
        self.mean_over(from_mm + shift, to_mm + shift)
    }

    fn sums(&self, path_mm: f64) -> Option<[f64; 3]> {
        let (before, after, fraction) = self.bracket(path_mm)?;
        let (a, b) = (before.sums, after.sums);
        Some([0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * fraction))
    }

    /// The nodes on either side of a position, and the fraction of the path between.
    fn bracket(&self, path_mm: f64) -> Option<(&Node, &Node, f64)> {
        let after = self.nodes.partition_point(|node| node.path_mm <= path_mm);
        let after = after.min(self.nodes.len().saturating_sub(1));
        let (before, after) = (self.nodes.get(after.checked_sub(1)?)?, self.nodes.get(after)?);
        let fraction = (path_mm - before.path_mm) / (after.path_mm - before.path_mm);
        (0.0..=1.0).contains(&fraction).then_some((before, after, fraction))
    }
}

/// Whether the speed between two reports follows from them.
fn known_since(last_s: f64, at_s: f64) -> bool {
    at_s > last_s && at_s - last_s <= MAX_SILENCE.secs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot whose speed steps after 1.03 s, with reports every 0.1 s.
    fn stepped(first: f64, second: f64) -> SpeedHistory {
        let mut history = SpeedHistory::new(100.0, 1e3);
        for k in 0..40 {
            let at = 0.1 * f64::from(k);
            let (before, after) = (at.min(1.03), (at - 1.03).max(0.0));
            let speed = if after > 0.0 { second } else { first };
            history.report(at, first * before + second * after, speed, 1.0);
        }
        history
    }

    #[test]
    fn a_change_between_two_reports_lies_where_the_path_implies() {
        let history = stepped(100.0, 50.0);
        let before = history.mean_over(80.0, 103.0).unwrap();
        let after = history.mean_over(103.0, 120.0).unwrap();
        assert!(before.mean.abs() < 1e-9 && before.variance < 1e-9, "{before:?}");
        assert!((after.mean - 0.5_f64.ln()).abs() < 1e-9, "{after:?}");
        let half = history.mean_over(98.0, 108.0).unwrap();
        assert!((half.mean - 0.5 * 0.5_f64.ln()).abs() < 1e-9);
        assert!((half.variance - 0.25 * 0.5_f64.ln().powi(2)).abs() < 1e-9);
        assert!((history.time_at(103.0).unwrap() - 1.03).abs() < 1e-9);
        assert!((history.time_at(108.0).unwrap() - 1.13).abs() < 1e-9);
    }

    #[test]
    fn jitter_of_the_reports_changes_no_speed() {
        let mut history = SpeedHistory::new(100.0, 1e3);
        for k in 0..400_u32 {
            // Up to 3 ms late, of 20.
            let late_s = 1e-3 * f64::from(k * k % 4);
            let at_s = 0.02 * f64::from(k);
            history.report(at_s + late_s, 100.0 * at_s, 100.0, 1.0);
        }
        for k in 0..100 {
            let from = 20.0 + 7.3 * f64::from(k);
            let seen = history.mean_over(from, from + 12.7).unwrap();
            assert!(seen.mean.abs() < 1e-6 && seen.variance < 1e-9, "{from}: {seen:?}");
        }
    }

    #[test]
    fn a_speed_that_contradicts_the_path_is_not_used() {
        // It reports its setpoint, and moves at three quarters of it.
        let mut history = SpeedHistory::new(100.0, 1e3);
        for k in 0..400_u32 {
            let at_s = 0.02 * f64::from(k);
            history.report(at_s, 75.0 * at_s, 100.0, 1.0);
        }
        let seen = history.mean_over(400.0, 420.0).unwrap();
        // To the 3 % that a growing delay of the reports would explain.
        assert!((seen.mean - 0.75_f64.ln()).abs() < 0.035, "{seen:?}");
    }

    #[test]
    fn outside_the_history_there_is_no_speed() {
        let history = stepped(100.0, 50.0);
        assert_eq!(history.mean_over(-1.0, 10.0), None);
        assert_eq!(history.mean_over(200.0, 900.0), None);
        assert_eq!(history.time_at(900.0), None);
        assert!(history.mean_near(-20.0, -10.0).unwrap().mean.abs() < 1e-9);
        assert!((history.mean_near(500.0, 510.0).unwrap().mean - 0.5_f64.ln()).abs() < 1e-9);
    }

    #[test]
    fn the_history_of_a_slow_robot_reaches_its_length() {
        // 5 mm/s, never the same, reported every 20 ms: 300 mm are a minute.
        let mut history = SpeedHistory::new(100.0, 300.0);
        let (mut path, mut most) = (0.0, 0);
        for k in 0..20_000 {
            let speed = 5.0 + 0.1 * f64::from(k % 7);
            path += 0.02 * speed;
            history.report(0.02 * f64::from(k), path, speed, 1.0);
            most = most.max(history.nodes.len());
        }
        let back = history.mean_over(path - 299.0, path - 290.0).unwrap();
        assert!((back.mean - 0.053_f64.ln()).abs() < 1e-2, "{back:?}");
        assert!(history.mean_over(path - 310.0, path - 300.0).is_none());
        assert!((2_000..10_000).contains(&most), "{most}");
    }

    #[test]
    fn a_path_that_falls_clears_the_history() {
        let mut history = stepped(100.0, 50.0);
        history.report(10.0, 0.0, 80.0, 1.0);
        assert!(history.is_empty());
        history.report(10.1, 8.0, 80.0, 1.0);
        assert!((history.mean_over(0.0, 8.0).unwrap().mean - 0.8_f64.ln()).abs() < 1e-9);
    }

    #[test]
    fn what_was_laid_in_a_silence_has_no_speed() {
        let mut history = stepped(100.0, 50.0);
        let end = 103.0 + 50.0 * (3.9 - 1.03);
        history.report(3.9 + 0.4, end + 20.0, 50.0, 1.0);
        assert!(history.mean_over(end, end + 20.0).is_some());
        history.report(4.3 + 0.8, end + 70.0, 50.0, 1.0);
        assert!(history.is_empty());
    }

    #[test]
    fn a_robot_that_stands_adds_nothing() {
        let mut history = stepped(100.0, 50.0);
        let end = 103.0 + 50.0 * (3.9 - 1.03);
        for k in 1..20 {
            history.report(3.9 + 0.1 * f64::from(k), end, 0.0, 1.0);
        }
        let last = history.mean_over(end - 10.0, end).unwrap();
        assert!((last.mean - 0.5_f64.ln()).abs() < 1e-6, "{last:?}");
    }
}
