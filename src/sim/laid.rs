//! The bead as it was laid: positions of its edges along the path.

use super::flow_drift::FlowDrift;
use super::waviness::Waviness;
use crate::numeric::number::{to_count, to_f64};
use crate::scenario::bead::{BeadModel, EdgeRoughness};
use crate::scenario::disturbance::Flow;

/// Coarsest grid along the path \[mm\]: a finer one costs time, a coarser one blurs steps of
/// the flow.
const MAX_STEP_MM: f64 = 0.5;
/// Grid points within one correlation length of the roughness. Derived: half-way between two
/// points the variance is (1 + e^(−1/100))/2 = 0.995 of that at a point.
const POINTS_PER_LENGTH: f64 = 10.0;
/// Largest gap within one bead \[mm\]: above rounding errors of a path, below any real gap.
const JOINT_TOLERANCE_MM: f64 = 1e-6;

/// A bead along its path. Its width is the model's width at the speed at which a position was
/// laid, times the flow ratio there, plus roughness. The edges are straight between the nodes of a
/// grid, so that means along the path are exact. The same pieces give the same bead, whatever is
/// read in between.
#[derive(Debug, Clone)]
pub struct LaidBead {
    model: BeadModel,
    flow: Flow,
    waviness: Waviness,
    drift: FlowDrift,
    /// Current ratio of the pump's flow to its mean flow.
    pulse: f64,
    step_mm: f64,
    strips: Vec<Strip>,
}

/// Position and speed of the nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathSpeed {
    /// Distance along the path \[mm\].
    pub path_mm: f64,
    /// Speed there \[mm/s\].
    pub speed_mm_per_s: f64,
}

/// A piece of bead without a gap.
#[derive(Debug, Clone)]
struct Strip {
    start_mm: f64,
    end_mm: f64,
    /// Number of the first node; a node's position is its number times the step.
    first: i64,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    left_mm: f64,
    right_mm: f64,
    /// Width without roughness.
    smooth_mm: f64,
    /// Integral of the width from the strip's first node \[mm²\].
    area_mm2: f64,
}

impl Node {
    fn width_mm(&self) -> f64 {
        self.right_mm - self.left_mm
    }
}

impl LaidBead {
    /// A bead of which nothing has been laid yet.
    pub fn new(model: BeadModel, roughness: EdgeRoughness, flow: Flow, seed: u64) -> Self {
        let step_mm = if roughness.sigma_mm > 0.0 {
            MAX_STEP_MM.min(roughness.length_mm.max(0.01) / POINTS_PER_LENGTH)
        } else {
            MAX_STEP_MM
        };
        let waviness = Waviness::new(roughness, seed);
        let drift = FlowDrift::new(flow.drift_per_root_m, seed);
        Self { model, flow, waviness, drift, pulse: 1.0, step_mm, strips: Vec::new() }
    }

    /// Lays a piece at one speed. Pieces come in the order of the path and do not change earlier
    /// ones. A piece that does not continue the last one leaves a gap; a path that stands still
    /// adds nothing.
    pub fn lay(&mut self, from_mm: f64, to_mm: f64, speed_mm_per_s: f64) {
        let sound = from_mm.is_finite() && to_mm.is_finite() && speed_mm_per_s.is_finite();
        let from_mm = self.end_mm().map_or(from_mm, |end| from_mm.max(end));
        if !sound || to_mm <= from_mm {
            return;
        }
        if self.end_mm().is_none_or(|end| from_mm > end + JOINT_TOLERANCE_MM) {
            let first = number((from_mm / self.step_mm).floor());
            let strip = Strip { start_mm: from_mm, end_mm: from_mm, first, nodes: Vec::new() };
            self.strips.push(strip);
        }
        let last = number((to_mm / self.step_mm).ceil());
        let width = self.model.width_at(speed_mm_per_s) * self.pulse;
        let Self { flow, waviness, drift, step_mm, strips, .. } = self;
        let Some(strip) = strips.last_mut() else { return };
        strip.take_back(*step_mm);
        strip.end_mm = to_mm;
        while strip.next_number() <= last {
            #[expect(clippy::cast_precision_loss, reason = "node numbers stay below 2^53")]
            let path_mm = strip.next_number() as f64 * *step_mm;
            let smooth_mm = width * flow.ratio_at(path_mm) * drift.at(path_mm);
            strip.push(smooth_mm, waviness.at(path_mm), *step_mm);
        }
    }

    /// Sets the ratio of the pump's flow to its mean flow, for all bead that is laid from now on.
    pub fn set_pulse(&mut self, ratio: f64) {
        self.pulse = ratio;
    }

    /// Lays a piece over which the speed changes linearly.
    pub fn lay_ramp(&mut self, from: PathSpeed, to: PathSpeed) {
        let (from_mm, to_mm) = (from.path_mm, to.path_mm);
        let (first, last) = (from.speed_mm_per_s, to.speed_mm_per_s);
        let pieces = ((to_mm - from_mm) / 1.0).ceil().clamp(1.0, 1e4);
        let mut done = 0.0;
        while done < pieces {
            let at = |fraction: f64| from_mm + (to_mm - from_mm) * fraction / pieces;
            let speed = first + (last - first) * (done + 0.5) / pieces;
            self.lay(at(done), at(done + 1.0), speed);
            done += 1.0;
        }
    }

    /// Path up to which it has been laid \[mm\]; `None` before the first piece.
    pub fn end_mm(&self) -> Option<f64> {
        self.strips.last().map(|strip| strip.end_mm)
    }

    /// Width at a path length \[mm\]; `None` where nothing has been laid.
    pub fn width_at(&self, path_mm: f64) -> Option<f64> {
        self.edges_at(path_mm).map(|(left, right)| right - left)
    }

    /// Width without roughness at a path length \[mm\]; `None` where nothing has been laid.
    pub fn smooth_width_at(&self, path_mm: f64) -> Option<f64> {
        let (node, next, fraction) = self.strip_at(path_mm)?.cell(path_mm, self.step_mm)?;
        Some(node.smooth_mm + (next.smooth_mm - node.smooth_mm) * fraction)
    }

    /// Offsets of the left and the right edge from the path \[mm\], positive
    /// to the right of the direction of travel; `None` where nothing has been
    /// laid.
    pub fn edges_at(&self, path_mm: f64) -> Option<(f64, f64)> {
        let (node, next, fraction) = self.strip_at(path_mm)?.cell(path_mm, self.step_mm)?;
        let between = |a: f64, b: f64| a + (b - a) * fraction;
        Some((between(node.left_mm, next.left_mm), between(node.right_mm, next.right_mm)))
    }

    /// Exact mean width over a segment \[mm\]; `None` unless all of it has been laid.
    pub fn mean_width(&self, from_mm: f64, to_mm: f64) -> Option<f64> {
        let strip = self.strip_at(from_mm)?;
        if to_mm - from_mm < 1e-6 {
            return self.width_at(from_mm);
        }
        if to_mm > strip.end_mm {
            return None;
        }
        let area = strip.area_to(to_mm, self.step_mm)? - strip.area_to(from_mm, self.step_mm)?;
        Some(area / (to_mm - from_mm))
    }

    fn strip_at(&self, path_mm: f64) -> Option<&Strip> {
        self.strips.iter().rev().find(|s| (s.start_mm..=s.end_mm).contains(&path_mm))
    }
}

#[expect(clippy::cast_possible_truncation, reason = "saturates far beyond any path")]
fn number(position: f64) -> i64 {
    position as i64
}

impl Strip {
    fn next_number(&self) -> i64 {
        self.first + i64::try_from(self.nodes.len()).unwrap_or(i64::MAX - self.first.max(0))
    }

    /// Removes a node beyond the end: the bead there is laid only now.
    fn take_back(&mut self, step_mm: f64) {
        #[expect(clippy::cast_precision_loss, reason = "node numbers stay below 2^53")]
        let last_mm = (self.next_number() - 1) as f64 * step_mm;
        if last_mm > self.end_mm {
            self.nodes.pop();
        }
    }

    /// Adds a node with a width and the deviations of its left and right edge; the width is
    /// never negative.
    fn push(&mut self, smooth_mm: f64, [left, right]: [f64; 2], step_mm: f64) {
        let left_mm = left - 0.5 * smooth_mm;
        let right_mm = (right + 0.5 * smooth_mm).max(left_mm);
        let area_mm2 = self.nodes.last().map_or(0.0, |before| {
            before.area_mm2 + step_mm * 0.5 * (before.width_mm() + right_mm - left_mm)
        });
        self.nodes.push(Node { left_mm, right_mm, smooth_mm, area_mm2 });
    }

    /// The nodes before and after a position, and the fraction of the way between them.
    fn cell(&self, path_mm: f64, step_mm: f64) -> Option<(&Node, &Node, f64)> {
        #[expect(clippy::cast_precision_loss, reason = "node numbers stay below 2^53")]
        let position = path_mm / step_mm - self.first as f64;
        let number = to_count(position).min(self.nodes.len().checked_sub(2)?);
        let fraction = position - to_f64(number);
        Some((self.nodes.get(number)?, self.nodes.get(number + 1)?, fraction))
    }

    fn area_to(&self, path_mm: f64, step_mm: f64) -> Option<f64> {
        let (node, next, fraction) = self.cell(path_mm, step_mm)?;
        let mean = node.width_mm() + 0.5 * fraction * (next.width_mm() - node.width_mm());
        Some(node.area_mm2 + step_mm * fraction * mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bead_changes_where_the_speed_does_however_short_the_pieces() {
        for piece_mm in [0.05, 0.4, 2.0] {
            let mut bead = LaidBead::new(BeadModel::fitted_2022(), SMOOTH, STEADY, 1);
            let model = BeadModel::fitted_2022();
            let speed = |at: f64| 80.0 + 0.4 * at;
            let mut at = 0.0;
            while at < 100.0 {
                let here = |path_mm| PathSpeed { path_mm, speed_mm_per_s: speed(path_mm) };
                bead.lay_ramp(here(at), here(at + piece_mm));
                at += piece_mm;
            }
            for position in [10.3, 47.77, 80.0] {
                // The speed changes by 0.4 mm/s per millimetre: the position at which that width
                // belongs.
                let width = bead.width_at(position).unwrap();
                let slope = model.width_at(speed(position + 1.0)) - model.width_at(speed(position));
                let off_mm = (width - model.width_at(speed(position))) / slope;
                assert!(off_mm.abs() < 0.55, "{piece_mm}: {off_mm} at {position}");
                assert!(
                    piece_mm > 1.0 || off_mm.abs() < 0.26,
                    "{piece_mm}: {off_mm} at {position}"
                );
            }
        }
    }

    const STEADY: Flow = Flow::STEADY;
    const SMOOTH: EdgeRoughness = EdgeRoughness { sigma_mm: 0.0, length_mm: 5.0 };
    const ROUGH: EdgeRoughness = EdgeRoughness { sigma_mm: 0.1, length_mm: 5.0 };

    fn laid(roughness: EdgeRoughness, seed: u64, length_mm: f64) -> LaidBead {
        let mut bead = LaidBead::new(BeadModel::fitted_2022(), roughness, STEADY, seed);
        bead.lay(0.0, length_mm, 112.5);
        bead
    }

    #[test]
    fn a_smooth_bead_is_the_model_times_the_flow() {
        let model = BeadModel::fitted_2022();
        let flow = Flow { step_at_mm: 150.0, step_ratio: 0.92, ..STEADY };
        let mut bead = LaidBead::new(model, SMOOTH, flow, 1);
        bead.lay(0.0, 100.0, 112.5);
        bead.lay(100.0, 200.0, 70.0);
        assert!((bead.width_at(50.0).unwrap() - 38.61).abs() < 1e-12);
        assert!((bead.width_at(120.0).unwrap() - model.width_at(70.0)).abs() < 1e-12);
        assert!((bead.width_at(180.0).unwrap() - 0.92 * model.width_at(70.0)).abs() < 1e-12);
        let (left, right) = bead.edges_at(50.0).unwrap();
        assert!((left + right).abs() < 1e-12);
        assert!((bead.mean_width(10.0, 90.3).unwrap() - 38.61).abs() < 1e-10);
    }

    #[test]
    fn there_is_nothing_where_nothing_was_laid() {
        let mut bead = LaidBead::new(BeadModel::fitted_2022(), ROUGH, STEADY, 1);
        assert_eq!(bead.width_at(0.0), None);
        bead.lay(10.2, 20.0, 100.0);
        bead.lay(20.0, 20.0, 100.0);
        bead.lay(15.0, 18.0, 60.0);
        bead.lay(30.0, 40.0, 100.0);
        bead.lay(f64::NAN, 50.0, 100.0);
        assert_eq!(bead.end_mm(), Some(40.0));
        assert_eq!(bead.width_at(10.19), None);
        assert!(bead.width_at(10.2).is_some());
        assert_eq!(bead.width_at(25.0), None);
        assert_eq!(bead.width_at(40.1), None);
        assert!(bead.mean_width(11.0, 19.0).is_some());
        assert_eq!(bead.mean_width(19.0, 31.0), None);
    }

    #[test]
    fn roughness_has_the_size_and_the_length_that_were_asked_for() {
        let bead = laid(ROUGH, 3, 100_000.0);
        let at = |i: u32, lag: f64| {
            let (left, right) = bead.edges_at(f64::from(i) * 2.3 + lag).unwrap();
            (right - left - 38.61, 0.5 * (left + right))
        };
        let n = 40_000;
        let mean_of = |f: &dyn Fn(u32) -> f64| (0..n).map(f).sum::<f64>() / f64::from(n);
        let size = mean_of(&|i| at(i, 0.0).0.powi(2)).sqrt();
        assert!((size / 0.1 - 1.0).abs() < 0.03, "{size}");
        let middle = mean_of(&|i| at(i, 0.0).1.powi(2)).sqrt();
        assert!((middle / 0.05 - 1.0).abs() < 0.03, "{middle}");
        for (lag, expected) in [(2.5, (-0.25_f64).exp()), (5.0, (-1.0_f64).exp()), (15.0, 0.0)] {
            let correlation = mean_of(&|i| at(i, 0.0).0 * at(i, lag).0) / size.powi(2);
            assert!((correlation - expected).abs() < 0.03, "lag {lag}: {correlation}");
        }
    }

    #[test]
    fn a_bead_is_a_function_of_seed_and_place() {
        let whole = laid(ROUGH, 9, 300.0);
        let mut pieces = LaidBead::new(BeadModel::fitted_2022(), ROUGH, STEADY, 9);
        let mut path = 0.0;
        while path < 300.0 {
            pieces.lay(path, path + 1.7, 112.5);
            let _ = pieces.width_at(path * 0.3);
            path += 1.7;
        }
        let mut late = LaidBead::new(BeadModel::fitted_2022(), ROUGH, STEADY, 9);
        late.lay(150.3, 300.0, 112.5);
        for position in [299.9, 151.0, 200.03, 160.0] {
            assert_eq!(whole.edges_at(position), pieces.edges_at(position));
            assert_eq!(whole.edges_at(position), late.edges_at(position));
        }
        assert_ne!(whole.width_at(100.0), laid(ROUGH, 10, 300.0).width_at(100.0));
    }

    #[test]
    fn the_mean_is_the_integral_of_the_width() {
        let bead = laid(ROUGH, 4, 200.0);
        let (from, to) = (20.13, 83.71);
        let n = 400_000;
        let mid = |i: i32| from + (to - from) * (f64::from(i) + 0.5) / f64::from(n);
        let summed: f64 = (0..n).map(|i| bead.width_at(mid(i)).unwrap()).sum();
        let mean = bead.mean_width(from, to).unwrap();
        assert!((mean - summed / f64::from(n)).abs() < 1e-8);
    }

    #[test]
    fn a_ramp_of_speed_makes_a_taper() {
        let mut bead = LaidBead::new(BeadModel::fitted_2022(), SMOOTH, STEADY, 1);
        bead.lay_ramp(
            PathSpeed { path_mm: 0.0, speed_mm_per_s: 80.0 },
            PathSpeed { path_mm: 100.0, speed_mm_per_s: 120.0 },
        );
        let expected = BeadModel::fitted_2022().width_at(100.0);
        assert!((bead.width_at(50.0).unwrap() - expected).abs() < 0.1);
        assert!(bead.width_at(1.0) > bead.width_at(99.0));
    }
}
