//! The speeds at which the bead behind the nozzle was laid, along the path.

use std::collections::VecDeque;

/// Most nodes that are kept, whatever the reach: at the fastest reports and a speed that
/// never stands still more than ten minutes.
const MAX_NODES: usize = 1 << 16;
/// Speed below which a bead has no width that the model could tell \[mm/s\].
const SLOWEST_MM_PER_S: f64 = 0.5;
/// Share of the speed within which two reports tell the same speed.
const SAME_SPEED_RATIO: f64 = 1e-3;
/// How far the arrival of reports may lie beside what path and speeds tell \[s\]: within
/// it the speeds are believed, for a report that is a millisecond late makes several
/// percent of a speed by the path.
const MAX_REPORT_DELAY_S: f64 = 0.03;
/// Time within which such a difference is forgotten \[s\].
const DELAY_TIME_CONSTANT_S: f64 = 1.0;
/// Shortest time that a piece can have taken, as a share of that between its reports.
const MIN_TIME_RATIO: f64 = 0.1;
/// Share of the flow below which there is no bead to speak of.
const MIN_FLOW_RATIO: f64 = 0.01;
/// A piece shorter than this is none \[mm\].
const MIN_PIECE_MM: f64 = 1e-9;
/// Share of the time between reports below which a piece is none.
const MIN_PIECE_RATIO: f64 = 1e-6;
/// Time within which a flow that stays other than the start speed's becomes the usual one
/// \[s\].
const FLOW_TIME_CONSTANT_S: f64 = 3.0;

/// Speeds over path. Between two reports the speed is taken to have gone from
/// one to the other at once, at the place that the way between them tells. Where speeds and
/// path do not belong together, beyond what late reports explain, the path tells.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedHistory {
    reference_mm_per_s: f64,
    /// Length behind the newest report that is kept \[mm\].
    kept_mm: f64,
    nodes: VecDeque<Node>,
    /// Speed of the newest report \[mm/s\].
    speed: f64,
    /// Time by which reports have come early, by path and speeds \[s\].
    early_s: f64,
    flow_ratio: f64,
    /// Logarithm of the flow's share as it has been of late.
    usual_ln_flow: Option<f64>,
    /// How far the flow has been from that of late.
    flow_excursion: f64,
}

/// The end of a piece laid at one speed, with sums from the trail's start:
/// means over any stretch are differences of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    path_mm: f64,
    at_s: f64,
    /// Integral of ln(v/v₀) over the path \[mm\].
    sum: f64,
    /// Integral of its square \[mm\].
    square: f64,
    /// Integral of how far the flow had been changed \[mm\].
    flow_change: f64,
}

/// ln(v/v₀) over a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LnSpeed {
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
}

impl SpeedHistory {
    /// An empty one, for a reference speed v₀ \[mm/s\], that knows the last piece of bead as
    /// long as its reach \[mm\].
    pub fn new(reference_mm_per_s: f64, reach_mm: f64) -> Self {
        let reference_mm_per_s = reference_mm_per_s.max(SLOWEST_MM_PER_S);
        Self {
            reference_mm_per_s,
            kept_mm: reach_mm,
            nodes: VecDeque::new(),
            speed: 0.0,
            early_s: 0.0,
            flow_ratio: 1.0,
            usual_ln_flow: None,
            flow_excursion: 0.0,
        }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.early_s = 0.0;
    }

    /// Whether there is no stretch yet.
    pub fn is_empty(&self) -> bool {
        self.nodes.len() < 2
    }

    /// Takes a report: time \[s\], path \[mm\], speed \[mm/s\] and the share of
    /// the flow that came meanwhile. A path that falls, or a time that does not
    /// grow, begins a new trail.
    pub fn report(&mut self, at_s: f64, path_mm: f64, speed: f64, flow_share: f64) {
        let last = self.nodes.back().copied();
        self.flow(flow_share, last.map_or(0.0, |last| at_s - last.at_s));
        let before = std::mem::replace(&mut self.speed, speed.max(SLOWEST_MM_PER_S));
        match last {
            Some(last) if path_mm >= last.path_mm && at_s > last.at_s => {
                self.extend(&last, at_s, path_mm, before);
            }
            _ => {
                self.clear();
                self.nodes.push_back(Node {
                    path_mm,
                    at_s,
                    sum: 0.0,
                    square: 0.0,
                    flow_change: 0.0,
                });
            }
        }
    }

    fn flow(&mut self, fraction: f64, passed_s: f64) {
        self.flow_ratio = fraction.max(MIN_FLOW_RATIO);
        let ln = libm::log(self.flow_ratio);
        let usual = self.usual_ln_flow.unwrap_or(ln);
        let kept = libm::exp(-passed_s.max(0.0) / FLOW_TIME_CONSTANT_S);
        self.flow_excursion = (self.flow_excursion * kept).max((ln - usual).abs());
        self.usual_ln_flow = Some(ln + kept * (usual - ln));
    }

    /// How far the flow is from the start speed's, unless it has long been so, as a
    /// logarithm.
    fn flow_change(&self) -> f64 {
        libm::log(self.flow_ratio).abs().min(self.flow_excursion)
    }

    /// Adds the way from the last report to this one as a piece at each speed.
    fn extend(&mut self, last: &Node, at_s: f64, path_mm: f64, before: f64) {
        let (way, time) = (path_mm - last.path_mm, at_s - last.at_s);
        let changed = (self.speed - before).abs() > SAME_SPEED_RATIO * before;
        // Share of the time that was driven at the speed before.
        let fraction =
            if changed { (way / time - self.speed) / (before - self.speed) } else { 0.0 };
        let fraction = fraction.clamp(0.0, 1.0);
        let driven = before * fraction + self.speed * (1.0 - fraction);
        let first = way * before * fraction / driven.max(MIN_PIECE_MM);
        let took = self.duration(time, way / driven.max(MIN_PIECE_MM));
        if first > MIN_PIECE_MM && fraction > MIN_PIECE_RATIO {
            self.push(last.path_mm + first, last.at_s + fraction * time, first / (fraction * took));
        }
        if way - first > MIN_PIECE_MM && fraction < 1.0 - MIN_PIECE_RATIO {
            self.push(path_mm, at_s, (way - first) / ((1.0 - fraction) * took));
        } else if let Some(node) = self.nodes.back_mut() {
            node.at_s = at_s;
        }
    }

    /// Time that a way took \[s\], from that between its reports and that by the speeds: the
    /// latter, as far as reports that came early or late explain the difference.
    fn duration(&mut self, time: f64, by_speed: f64) -> f64 {
        let early = self.early_s * libm::exp(-time / DELAY_TIME_CONSTANT_S);
        self.early_s = (early + by_speed - time).clamp(-MAX_REPORT_DELAY_S, MAX_REPORT_DELAY_S);
        (time + self.early_s - early).max(MIN_TIME_RATIO * time)
    }

    fn push(&mut self, path_mm: f64, at_s: f64, speed: f64) {
        let Some(last) = self.nodes.back().copied() else { return };
        let speed = speed.max(SLOWEST_MM_PER_S) / self.flow_ratio;
        let ln = libm::log(speed / self.reference_mm_per_s);
        let way = path_mm - last.path_mm;
        let needless = |node: &Node| node.path_mm < path_mm - self.kept_mm;
        while self.nodes.len() >= MAX_NODES || self.nodes.get(1).is_some_and(needless) {
            self.nodes.pop_front();
        }
        let (sum, square) = (last.sum + ln * way, last.square + ln * ln * way);
        let changed = last.flow_change + self.flow_change() * way;
        self.nodes.push_back(Node { path_mm, at_s, sum, square, flow_change: changed });
    }

    /// When the nozzle was at a place \[s\]; `None` beyond what is known.
    pub fn time_at(&self, path_mm: f64) -> Option<f64> {
        let (before, after, fraction) = self.bracket(path_mm)?;
        Some(before.at_s + (after.at_s - before.at_s) * fraction)
    }

    /// Speed over a stretch of path \[mm\]; `None` unless all of it is known.
    pub fn mean_over(&self, from_mm: f64, to_mm: f64) -> Option<LnSpeed> {
        let (from, to) = (self.sums(from_mm)?, self.sums(to_mm)?);
        let length = to_mm - from_mm;
        if length <= MIN_PIECE_MM {
            let (before, after, _) = self.bracket(from_mm)?;
            let mean = (after.sum - before.sum) / (after.path_mm - before.path_mm);
            return Some(LnSpeed { mean, variance: 0.0 });
        }
        let mean = (to.0 - from.0) / length;
        let variance = ((to.1 - from.1) / length - mean * mean).max(0.0);
        Some(LnSpeed { mean, variance })
    }

    /// How far the flow had been changed over a stretch of path \[mm\], as a logarithm;
    /// `None` unless all of it is known.
    pub fn flow_change_over(&self, from_mm: f64, to_mm: f64) -> Option<f64> {
        let at = |path_mm: f64| {
            let (before, after, fraction) = self.bracket(path_mm)?;
            Some(before.flow_change + (after.flow_change - before.flow_change) * fraction)
        };
        Some((at(to_mm)? - at(from_mm)?) / (to_mm - from_mm).max(MIN_PIECE_MM))
    }

    /// Speed over a stretch that is moved until it lies within what is known.
    pub fn mean_near(&self, from_mm: f64, to_mm: f64) -> Option<LnSpeed> {
        let (first, last) = (self.nodes.front()?, self.nodes.back()?);
        let shift = (first.path_mm - from_mm).max(0.0) - (to_mm - last.path_mm).max(0.0);
        self.mean_over(from_mm + shift, to_mm + shift)
    }

    fn sums(&self, path_mm: f64) -> Option<(f64, f64)> {
        let (before, after, fraction) = self.bracket(path_mm)?;
        let between = |a: f64, b: f64| a + (b - a) * fraction;
        Some((between(before.sum, after.sum), between(before.square, after.square)))
    }

    /// The nodes on either side of a place, and the share of the way between.
    fn bracket(&self, path_mm: f64) -> Option<(&Node, &Node, f64)> {
        let after = self.nodes.partition_point(|node| node.path_mm <= path_mm);
        let after = after.min(self.nodes.len().saturating_sub(1));
        let (before, after) = (self.nodes.get(after.checked_sub(1)?)?, self.nodes.get(after)?);
        let fraction = (path_mm - before.path_mm) / (after.path_mm - before.path_mm);
        (0.0..=1.0).contains(&fraction).then_some((before, after, fraction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that drives at one speed and changes to another at once, after
    /// 1.03 s, with reports every 0.1 s.
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
    fn a_change_between_two_reports_lies_where_the_way_tells() {
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
    fn reports_that_come_early_or_late_change_no_speed() {
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
    fn a_speed_that_the_path_belies_is_not_believed() {
        // It reports what it was told, and moves at three quarters of it.
        let mut history = SpeedHistory::new(100.0, 1e3);
        for k in 0..400_u32 {
            let at_s = 0.02 * f64::from(k);
            history.report(at_s, 75.0 * at_s, 100.0, 1.0);
        }
        let seen = history.mean_over(400.0, 420.0).unwrap();
        // To the 3 % that reports which came later and later would explain.
        assert!((seen.mean - 0.75_f64.ln()).abs() < 0.035, "{seen:?}");
    }

    #[test]
    fn beyond_what_is_known_there_is_nothing() {
        let history = stepped(100.0, 50.0);
        assert_eq!(history.mean_over(-1.0, 10.0), None);
        assert_eq!(history.mean_over(200.0, 900.0), None);
        assert_eq!(history.time_at(900.0), None);
        assert!(history.mean_near(-20.0, -10.0).unwrap().mean.abs() < 1e-9);
        assert!((history.mean_near(500.0, 510.0).unwrap().mean - 0.5_f64.ln()).abs() < 1e-9);
    }

    #[test]
    fn a_slow_robot_is_known_as_far_back_as_the_camera_looks() {
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
    fn a_path_that_falls_begins_a_new_trail() {
        let mut history = stepped(100.0, 50.0);
        history.report(10.0, 0.0, 80.0, 1.0);
        assert!(history.is_empty());
        history.report(10.1, 8.0, 80.0, 1.0);
        assert!((history.mean_over(0.0, 8.0).unwrap().mean - 0.8_f64.ln()).abs() < 1e-9);
    }

    #[test]
    fn a_robot_that_stands_leaves_no_trace() {
        let mut history = stepped(100.0, 50.0);
        let end = 103.0 + 50.0 * (3.9 - 1.03);
        for k in 1..20 {
            history.report(3.9 + 0.1 * f64::from(k), end, 0.0, 1.0);
        }
        let last = history.mean_over(end - 10.0, end).unwrap();
        assert!((last.mean - 0.5_f64.ln()).abs() < 1e-6, "{last:?}");
    }
}
