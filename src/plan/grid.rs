//! Nodes of the speed and windows of the width: fine where the nominal speed changes quickly, coarse
//! elsewhere.

use super::horizon::WidthWindow;
use super::profile::{ProfileNode, SpeedProfile};
use super::segment::PathSegment;
use super::task::BeadGeometry;

/// Fraction of the largest acceleration from which a change of the speed counts as quick.
const QUICK_ACCEL_RATIO: f64 = 0.1;
/// Largest number of nodes of a horizon; a longer one has wider spacings. The time of an iteration
/// grows with its cube.
const MAX_NODES: usize = 220;
/// Spacing of the nodes by distance from a quick change, both in lengths of the nozzle.
const NODE_SPACING: [Spacing; 3] =
    [Spacing::new(0.5, 0.025), Spacing::new(2.4, 0.1), Spacing::new(f64::INFINITY, 0.4)];
/// Spacing of the windows of a nozzle's length, in the same way.
const WINDOW_SPACING: [Spacing; 2] = [Spacing::new(1.5, 0.05), Spacing::new(f64::INFINITY, 0.25)];
/// Spacing of shorter windows, in the same way.
const FINE_WINDOW_SPACING: [Spacing; 2] =
    [Spacing::new(1.5, 0.05), Spacing::new(f64::INFINITY, 0.125)];
/// Smallest distance of a shorter window from a quick change, in lengths of the nozzle. Nearer, the
/// variation of the width is not controllable within a nozzle's length.
const FINE_MIN_DISTANCE: f64 = 0.6;
/// Length of the shorter windows, in lengths of the nozzle.
const FINE_LENGTH: f64 = 0.25;
/// Weight of the shorter windows: enough to suppress oscillations of the speed that average out over
/// a nozzle's length.
const FINE_WEIGHT: f64 = 0.003;
/// Largest relative error of the nozzle's length that is considered.
const MAX_LENGTH_ERROR: f64 = 0.75;
/// Distance from a quick change within which noise is weighted, in lengths of the nozzle.
const NOISE_RANGE: f64 = 5.0;
/// Margins before and after the quick changes over which the variance of the flow is taken, in
/// lengths of the nozzle: narrow and wide.
const CHANGE_MARGINS: [(f64, f64); 2] = [(5.0, 5.0), (11.0, 14.0)];

/// A spacing near a quick change, in lengths of the nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spacing {
    /// Largest distance from the change.
    within: f64,
    /// Spacing.
    step: f64,
}

impl Spacing {
    const fn new(within: f64, step: f64) -> Self {
        Self { within, step }
    }
}

/// Segments of path in which the nominal speed changes quickly \[mm\].
#[derive(Debug, Clone, PartialEq)]
pub struct QuickChanges(Vec<PathSegment>);

impl QuickChanges {
    /// The quick changes of a profile, by the robot's acceleration \[mm/s²\].
    pub fn of(profile: &SpeedProfile, accel: f64) -> Self {
        let mut all: Vec<PathSegment> = Vec::new();
        for (from, to) in profile.pieces() {
            let (from_mm, to_mm) = (from.path_mm, to.path_mm);
            let rise = (to.square - from.square).abs();
            if rise < QUICK_ACCEL_RATIO * 2.0 * accel * (to_mm - from_mm) {
                continue;
            }
            match all.last_mut() {
                Some(last) if last.to_mm >= from_mm => last.to_mm = to_mm,
                _ => all.push(PathSegment { from_mm, to_mm }),
            }
        }
        Self(all)
    }

    /// Distance of a position from the nearest quick change \[mm\]; infinite without one.
    pub fn distance(&self, position_mm: f64) -> f64 {
        let after = self.0.partition_point(|quick| quick.to_mm < position_mm);
        let before = after.checked_sub(1).and_then(|i| self.0.get(i));
        let back = before.map_or(f64::INFINITY, |quick| position_mm - quick.to_mm);
        let ahead = self.0.get(after).map_or(f64::INFINITY, |quick| quick.from_mm - position_mm);
        back.min(ahead).max(0.0)
    }

    /// The quick changes that begin within a segment \[mm\].
    pub fn within(&self, segment: PathSegment) -> impl Iterator<Item = PathSegment> + '_ {
        let PathSegment { from_mm, to_mm } = segment;
        self.0
            .iter()
            .copied()
            .filter(move |quick| quick.from_mm >= from_mm && quick.from_mm < to_mm)
    }

    /// The parts of a segment over which the variance of the flow is taken: from before the first to
    /// after the last quick change, narrow and wide \[mm\]. A change outside the narrow one shows in
    /// the wide one.
    pub fn change_segments(&self, segment: PathSegment, nozzle_mm: f64) -> [PathSegment; 2] {
        let mut inside = self.within(segment);
        let Some(first) = inside.next() else { return [segment; 2] };
        let last = inside.last().unwrap_or(first);
        CHANGE_MARGINS.map(|(before, after)| PathSegment {
            from_mm: segment.from_mm.max(first.from_mm - before * nozzle_mm),
            to_mm: segment.to_mm.min(last.to_mm + after * nozzle_mm),
        })
    }

    /// Positions over a segment, both ends included, with spacings by the distance from a quick
    /// change.
    fn positions(&self, segment: PathSegment, unit: f64, spacings: &[Spacing]) -> Vec<f64> {
        let mut all = Vec::new();
        let PathSegment { from_mm: mut at, to_mm: to } = segment;
        while at < to {
            all.push(at);
            // The widest step that does not enter a finer spacing.
            let fitting = spacings.iter().rev().map(|s| s.step * unit).find(|step| {
                let near = self.distance(at + step).min(self.distance(at));
                spacings
                    .iter()
                    .find(|s| near <= s.within * unit)
                    .is_none_or(|s| s.step * unit >= *step)
            });
            at += fitting.or_else(|| spacings.first().map(|s| s.step * unit)).unwrap_or(unit);
        }
        all.push(to);
        all
    }

    /// Nodes of the speed over a segment \[mm\]. They include those of the nominal speed, so that a
    /// line between two nodes is nowhere above it and the nominal speed itself is a valid plan.
    pub fn nodes(&self, nominal: &SpeedProfile, span: PathSegment, nozzle_mm: f64) -> Vec<f64> {
        let corners = acceleration_changes(nominal, span);
        let mut unit = nozzle_mm;
        loop {
            let even = self.positions(span, unit, &NODE_SPACING);
            let apart = 0.5 * unit * NODE_SPACING.first().map_or(0.0, |s| s.step);
            let merged = merge(&even, &corners, apart);
            if merged.len() <= MAX_NODES.max(corners.len() + 2) || unit > 8.0 * nozzle_mm {
                return merged;
            }
            unit *= 1.2;
        }
    }

    /// The windows of the width within a segment \[mm\].
    pub fn windows(&self, segment: PathSegment, bead: &BeadGeometry) -> Vec<WidthWindow> {
        let mut all = Vec::new();
        let nozzle_mm = bead.nozzle_mm;
        let fine = FINE_LENGTH * nozzle_mm;
        let fine = (fine, FINE_WEIGHT, &FINE_WINDOW_SPACING, FINE_MIN_DISTANCE * nozzle_mm);
        let lengths = lengths(bead).into_iter();
        let whole = lengths
            .map(|(length_mm, weight)| (length_mm, weight, &WINDOW_SPACING, f64::NEG_INFINITY));
        for (length_mm, weight, steps, beyond) in whole.chain([fine]) {
            let inside = PathSegment {
                from_mm: segment.from_mm + 0.5 * length_mm,
                to_mm: segment.to_mm - 0.5 * length_mm,
            };
            if inside.to_mm <= inside.from_mm {
                continue;
            }
            let positions = self.positions(inside, nozzle_mm, steps);
            let next = positions.iter().skip(1).chain(positions.last());
            let before = positions.first().into_iter().chain(&positions);
            for ((at_mm, next), before) in positions.iter().zip(next).zip(before) {
                let distance = self.distance(*at_mm);
                if distance > beyond {
                    let weight = weight * 0.5 * (next - before);
                    let near = distance <= NOISE_RANGE * nozzle_mm;
                    all.push(WidthWindow { at_mm: *at_mm, length_mm, weight, near });
                }
            }
        }
        all
    }
}

/// Lengths over which the nozzle may average \[mm\], with weights: three that have the mean and the
/// standard deviation of the nozzle's length.
fn lengths(bead: &BeadGeometry) -> Vec<(f64, f64)> {
    let BeadGeometry { nozzle_mm, nozzle_sigma, .. } = *bead;
    if nozzle_sigma <= 0.0 {
        return vec![(nozzle_mm, 1.0)];
    }
    let away = nozzle_mm * (nozzle_sigma * std::f64::consts::SQRT_2).min(MAX_LENGTH_ERROR);
    vec![(nozzle_mm - away, 0.25), (nozzle_mm, 0.5), (nozzle_mm + away, 0.25)]
}

/// Positions within a segment at which a profile's acceleration changes \[mm\].
fn acceleration_changes(profile: &SpeedProfile, segment: PathSegment) -> Vec<f64> {
    let slope =
        |(a, b): (ProfileNode, ProfileNode)| (b.square - a.square) / (b.path_mm - a.path_mm);
    let pairs = profile.pieces().zip(profile.pieces().skip(1));
    let changes = pairs.filter(|(before, after)| slope(*before) != slope(*after));
    let positions = changes.map(|(_, (node, _))| node.path_mm);
    positions.filter(|s| *s > segment.from_mm && *s < segment.to_mm).collect()
}

/// Both lists in order, without those of the first that are too near to one of the second; the ends
/// stay.
fn merge(even: &[f64], given: &[f64], apart: f64) -> Vec<f64> {
    let ends = [even.first(), even.last()];
    let far = |s: &f64| given.iter().all(|g| (g - s).abs() > apart);
    let mut all: Vec<f64> =
        even.iter().filter(|s| ends.contains(&Some(s)) || far(s)).chain(given).copied().collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::plan::profile::profile_of;

    const SEGMENT: PathSegment = PathSegment { from_mm: -200.0, to_mm: 250.0 };

    fn corner() -> SpeedProfile {
        let top = 100.0;
        profile_of(&[(-300.0, top), (-2.499, top), (0.0, 2.0), (2.499, top), (300.0, top)]).unwrap()
    }

    #[test]
    fn a_corner_is_one_quick_change_with_its_apex_among_the_nodes() {
        let profile = corner();
        let quick = QuickChanges::of(&profile, 2000.0);
        assert_eq!(quick, QuickChanges(vec![PathSegment { from_mm: -2.499, to_mm: 2.499 }]));
        assert_eq!(quick.distance(-12.499), 10.0);
        let nodes = quick.nodes(&profile, SEGMENT, 20.0);
        assert!(nodes.contains(&0.0) && nodes.len() <= MAX_NODES, "{}", nodes.len());
        assert_eq!((nodes[0], nodes[nodes.len() - 1]), (-200.0, 250.0));
        for pair in nodes.windows(2) {
            let near = quick.distance(pair[0]).min(quick.distance(pair[1]));
            let widest = if near <= 10.0 { 0.5 } else { 8.0 };
            // Nodes too near to one of the profile are omitted.
            let widest = widest + 0.25;
            assert!(pair[1] > pair[0] && pair[1] - pair[0] <= widest + 1e-9, "{pair:?}");
        }
    }

    #[test]
    fn the_weights_of_the_windows_sum_to_the_length_of_the_path() {
        let quick = QuickChanges::of(&corner(), 2000.0);
        let bead = BeadGeometry { area_mm2: 45.0, nozzle_mm: 20.0, nozzle_sigma: 0.0 };
        let windows = quick.windows(SEGMENT, &bead);
        let coarse = windows.iter().filter(|w| w.length_mm == 20.0);
        let sum: f64 = coarse.map(|w| w.weight).sum();
        assert!((sum - 430.0).abs() < 1e-9, "{sum}");
        assert!(windows.iter().all(|w| w.at_mm - 0.5 * w.length_mm >= -200.0));
    }
}
