//! Where the speed has its nodes and where the width is judged: finely where the nominal
//! speed changes quickly, coarsely elsewhere.

use super::horizon::WidthWindow;
use super::profile::SpeedProfile;
use super::segment::PathSegment;
use super::task::BeadGeometry;

/// A change of the speed of this share of the acceleration is quick.
const QUICK_ACCEL_RATIO: f64 = 0.1;
/// Nodes of a horizon at most; more are put further apart.
const MAX_NODES: usize = 220;
/// Distances of the nodes, in lengths of the nozzle: within how far from a quick change,
/// and how far apart.
const NODE_SPACING: [Spacing; 3] =
    [Spacing::new(0.5, 0.025), Spacing::new(2.4, 0.1), Spacing::new(f64::INFINITY, 0.4)];
/// The same of the places where the width is judged over a nozzle's length.
const WINDOW_SPACING: [Spacing; 2] = [Spacing::new(1.5, 0.05), Spacing::new(f64::INFINITY, 0.25)];
/// The same of those where it is judged more finely; none lies about the quick change
/// itself, whose unevenness only the nozzle's length can take up.
const FINE_WINDOW_SPACING: [Spacing; 2] =
    [Spacing::new(1.5, 0.05), Spacing::new(f64::INFINITY, 0.125)];
const FINE_MIN_DISTANCE: f64 = 0.6;
/// The finer length, in lengths of the nozzle, and what it counts: enough that a wave of
/// the speed which a nozzle's length just hides is not taken for free.
const FINE_LENGTH: f64 = 0.25;
const FINE_WEIGHT: f64 = 0.003;
/// Largest share by which the nozzle's length is thought to be off.
const MAX_LENGTH_ERROR: f64 = 0.75;
/// Within how far of a quick change noise is weighed, in lengths of the nozzle.
const NOISE_RANGE: f64 = 5.0;
/// How far before and after the quick changes the flow's change is taken, in lengths of
/// the nozzle: narrowly and widely.
const CHANGE_MARGINS: [(f64, f64); 2] = [(5.0, 5.0), (11.0, 14.0)];

/// How far places lie from each other near to a quick change, in lengths of the nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spacing {
    /// Within how far from the change.
    within: f64,
    /// How far apart.
    step: f64,
}

impl Spacing {
    const fn new(within: f64, step: f64) -> Self {
        Self { within, step }
    }
}

/// Stretches of path in which the nominal speed changes quickly \[mm\].
#[derive(Debug, Clone, PartialEq)]
pub struct QuickChanges(Vec<PathSegment>);

impl QuickChanges {
    /// Of a profile and the robot's acceleration \[mm/s²\].
    pub fn of(profile: &SpeedProfile, accel: f64) -> Self {
        let nodes = || profile.path().iter().zip(profile.squares());
        let mut all: Vec<PathSegment> = Vec::new();
        for ((s0, b0), (s1, b1)) in nodes().zip(nodes().skip(1)) {
            if (b1 - b0).abs() < QUICK_ACCEL_RATIO * 2.0 * accel * (s1 - s0) {
                continue;
            }
            match all.last_mut() {
                Some(last) if last.to_mm >= *s0 => last.to_mm = *s1,
                _ => all.push(PathSegment { from_mm: *s0, to_mm: *s1 }),
            }
        }
        Self(all)
    }

    /// Distance of a place from the nearest \[mm\]; infinite where there is none.
    pub fn distance(&self, position_mm: f64) -> f64 {
        let after = self.0.partition_point(|quick| quick.to_mm < position_mm);
        let before = after.checked_sub(1).and_then(|i| self.0.get(i));
        let back = before.map_or(f64::INFINITY, |quick| position_mm - quick.to_mm);
        let ahead = self.0.get(after).map_or(f64::INFINITY, |quick| quick.from_mm - position_mm);
        back.min(ahead).max(0.0)
    }

    /// Those that begin within a stretch \[mm\].
    pub fn within(&self, stretch: PathSegment) -> impl Iterator<Item = PathSegment> + '_ {
        let PathSegment { from_mm, to_mm } = stretch;
        self.0
            .iter()
            .copied()
            .filter(move |quick| quick.from_mm >= from_mm && quick.from_mm < to_mm)
    }

    /// The parts of a stretch over which the flow's change is taken: from before the first
    /// to after the last, narrowly and widely \[mm\]. What is changed only outside the
    /// one shows in the other.
    pub fn change_segments(&self, stretch: PathSegment, nozzle_mm: f64) -> [PathSegment; 2] {
        let mut inside = self.within(stretch);
        let Some(first) = inside.next() else { return [stretch; 2] };
        let last = inside.last().unwrap_or(first);
        CHANGE_MARGINS.map(|(before, after)| PathSegment {
            from_mm: stretch.from_mm.max(first.from_mm - before * nozzle_mm),
            to_mm: stretch.to_mm.min(last.to_mm + after * nozzle_mm),
        })
    }

    /// Places from one to another, both included, as far apart as the distance from here
    /// says.
    fn positions(&self, stretch: PathSegment, unit: f64, spacings: &[Spacing]) -> Vec<f64> {
        let mut all = Vec::new();
        let PathSegment { from_mm: mut at, to_mm: to } = stretch;
        while at < to {
            all.push(at);
            // The finest step that is not left before it ends.
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

    /// Nodes of the speed from one place to another \[mm\]. Those of the nominal speed are
    /// among them, so that a straight line between two nodes lies nowhere above it and the
    /// nominal speed itself can be planned.
    pub fn nodes(&self, nominal: &SpeedProfile, span: PathSegment, nozzle_mm: f64) -> Vec<f64> {
        let turns = acceleration_changes(nominal, span);
        let mut unit = nozzle_mm;
        loop {
            let even = self.positions(span, unit, &NODE_SPACING);
            let apart = 0.5 * unit * NODE_SPACING.first().map_or(0.0, |s| s.step);
            let merged = merge(&even, &turns, apart);
            if merged.len() <= MAX_NODES.max(turns.len() + 2) || unit > 8.0 * nozzle_mm {
                return merged;
            }
            unit *= 1.2;
        }
    }

    /// Where the width is judged, over pieces that lie within a stretch \[mm\].
    pub fn windows(&self, stretch: PathSegment, bead: &BeadGeometry) -> Vec<WidthWindow> {
        let mut all = Vec::new();
        let nozzle_mm = bead.nozzle_mm;
        let fine = FINE_LENGTH * nozzle_mm;
        let fine = (fine, FINE_WEIGHT, &FINE_WINDOW_SPACING, FINE_MIN_DISTANCE * nozzle_mm);
        let lengths = lengths(bead).into_iter();
        let whole = lengths
            .map(|(length_mm, weight)| (length_mm, weight, &WINDOW_SPACING, f64::NEG_INFINITY));
        for (length_mm, weight, steps, beyond) in whole.chain([fine]) {
            let inside = PathSegment {
                from_mm: stretch.from_mm + 0.5 * length_mm,
                to_mm: stretch.to_mm - 0.5 * length_mm,
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

/// Lengths over which the nozzle may average \[mm\] and how likely each is: three that have
/// the mean and the standard deviation of what is known.
fn lengths(bead: &BeadGeometry) -> Vec<(f64, f64)> {
    let BeadGeometry { nozzle_mm, nozzle_sigma, .. } = *bead;
    if nozzle_sigma <= 0.0 {
        return vec![(nozzle_mm, 1.0)];
    }
    let away = nozzle_mm * (nozzle_sigma * std::f64::consts::SQRT_2).min(MAX_LENGTH_ERROR);
    vec![(nozzle_mm - away, 0.25), (nozzle_mm, 0.5), (nozzle_mm + away, 0.25)]
}

/// Places within a stretch at which a profile's acceleration changes \[mm\].
fn acceleration_changes(profile: &SpeedProfile, stretch: PathSegment) -> Vec<f64> {
    let nodes = || profile.path().iter().zip(profile.squares());
    let slope = |a: (&f64, &f64), b: (&f64, &f64)| (b.1 - a.1) / (b.0 - a.0);
    nodes()
        .zip(nodes().skip(1))
        .zip(nodes().skip(2))
        .filter(|((a, b), c)| slope(*a, *b) != slope(*b, *c))
        .map(|((_, b), _)| *b.0)
        .filter(|s| *s > stretch.from_mm && *s < stretch.to_mm)
        .collect()
}

/// Both rows in order, without those of the first that lie too near to one of the second;
/// the ends stay.
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

    const STRETCH: PathSegment = PathSegment { from_mm: -200.0, to_mm: 250.0 };

    fn corner() -> SpeedProfile {
        let top = 100.0;
        profile_of(&[(-300.0, top), (-2.499, top), (0.0, 2.0), (2.499, top), (300.0, top)]).unwrap()
    }

    #[test]
    fn a_corner_is_one_quick_stretch_with_its_apex_among_the_nodes() {
        let profile = corner();
        let quick = QuickChanges::of(&profile, 2000.0);
        assert_eq!(quick, QuickChanges(vec![PathSegment { from_mm: -2.499, to_mm: 2.499 }]));
        assert_eq!(quick.distance(-12.499), 10.0);
        let nodes = quick.nodes(&profile, STRETCH, 20.0);
        assert!(nodes.contains(&0.0) && nodes.len() <= MAX_NODES, "{}", nodes.len());
        assert_eq!((nodes[0], nodes[nodes.len() - 1]), (-200.0, 250.0));
        for pair in nodes.windows(2) {
            let near = quick.distance(pair[0]).min(quick.distance(pair[1]));
            let most = if near <= 10.0 { 0.5 } else { 8.0 };
            // One that lay too near to a node of the profile is left out.
            let most = most + 0.25;
            assert!(pair[1] > pair[0] && pair[1] - pair[0] <= most + 1e-9, "{pair:?}");
        }
    }

    #[test]
    fn the_windows_weigh_what_the_path_is_long() {
        let quick = QuickChanges::of(&corner(), 2000.0);
        let bead = BeadGeometry { area_mm2: 45.0, nozzle_mm: 20.0, nozzle_sigma: 0.0 };
        let windows = quick.windows(STRETCH, &bead);
        let coarse = windows.iter().filter(|w| w.length_mm == 20.0);
        let sum: f64 = coarse.map(|w| w.weight).sum();
        assert!((sum - 430.0).abs() < 1e-9, "{sum}");
        assert!(windows.iter().all(|w| w.at_mm - 0.5 * w.length_mm >= -200.0));
    }
}
