//! A horizon: a segment of path that is planned at once. Its cost for speeds and commands, with
//! gradient and Gauss–Newton Hessian.

use nalgebra::{DMatrix, DVector};

use super::flow::{FlowModel, FlowTrajectory, KnotResponses, whole};
use super::profile::SpeedProfile;
use super::quadratic::Quadratic;
use super::segment::PathSegment;
use super::task::{BeadGeometry, FlowUncertainty};
use super::time_gradient::PassingTimes;
use crate::numeric::number::to_f64;

/// Time between two samples of the flow, for its variance \[s\].
const FLOW_SAMPLE_S: f64 = 0.02;
/// Weight of time against the squared relative error of the width along the path \[mm/s\]: small, only
/// so that no time is added without a benefit.
const TIME_WEIGHT: f64 = 1e-3;
/// Weight of the squared change from one knot to the next, relative to the drive's range \[mm\]: small,
/// only so that the command does not oscillate without a benefit.
const ROUGH_WEIGHT: f64 = 1e-3;

/// A window of bead whose mean width counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthWindow {
    /// Its middle \[mm\].
    pub at_mm: f64,
    /// Its length \[mm\].
    pub length_mm: f64,
    /// Weight of its squared error \[mm\].
    pub weight: f64,
    /// Whether noise by a change of the flow is weighted here: near a quick change. Elsewhere its
    /// weight would grow with the length of the horizon.
    pub near: bool,
}

impl WidthWindow {
    fn ends(&self) -> [f64; 2] {
        [self.at_mm - 0.5 * self.length_mm, self.at_mm + 0.5 * self.length_mm]
    }
}

/// Squares of the speed at the nodes, and the command at its knots.
#[derive(Debug, Clone, PartialEq)]
pub struct Iterate {
    /// Squares of the speed \[mm²/s²\].
    pub squares: Vec<f64>,
    /// Command at the knots, in the unit of the drive.
    pub knots: Vec<f64>,
}

/// A segment of path with its windows.
#[derive(Debug, Clone)]
pub struct Horizon<'a> {
    /// The target bead.
    pub bead: BeadGeometry,
    /// The unmodelled flow.
    pub unmodelled: FlowUncertainty,
    /// Width of the drive's range.
    pub drive_span: f64,
    /// Nodes of the speed \[mm\].
    pub path: Vec<f64>,
    /// When the first node is passed \[s\].
    pub from_s: f64,
    /// Segments over which the variance of the flow is taken, whose mean counts \[mm\].
    pub change_segments: [PathSegment; 2],
    /// Windows of the width.
    pub windows: Vec<WidthWindow>,
    /// The extruder.
    pub extruder: &'a FlowModel,
    /// Responses to each knot.
    pub knot_responses: &'a KnotResponses,
}

/// The evaluation of an iterate.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// The speed; times from the first node.
    pub profile: SpeedProfile,
    /// The flow.
    pub flow: FlowTrajectory,
    /// Relative error of the width of each window.
    errors: Vec<f64>,
    /// Its variance for a unit of the flow's variance \[(mm³/s)⁻²\].
    volume_variance: Vec<f64>,
    /// Variance of the flow's change \[(mm³/s)²\].
    change: f64,
    /// The cost.
    pub cost: f64,
}

impl Horizon<'_> {
    /// Evaluates an iterate; `None` where its speeds are not valid.
    pub fn evaluate(&self, iterate: &Iterate) -> Option<Evaluation> {
        let profile = self.profile(&iterate.squares)?;
        let flow = self.extruder.predict(&iterate.knots);
        let mut errors = Vec::with_capacity(self.windows.len());
        let mut spread = Vec::with_capacity(self.windows.len());
        for window in &self.windows {
            let [from, to] = self.times(&profile, window);
            let full = self.volume(window);
            errors.push((flow.volume_at(to) - flow.volume_at(from)) / full - 1.0);
            let noise = if window.near { self.unmodelled.volume_variance(to - from) } else { 0.0 };
            spread.push(noise / full.powi(2));
        }
        let change = self.change_segments.iter().map(|segment| {
            let samples = self.flow_samples(&profile, *segment).map(|at| flow.flow_at(at));
            DVector::from_vec(samples.collect()).variance() / to_f64(self.change_segments.len())
        });
        let change = change.sum();
        let noise = self.unmodelled.ratio.powi(2) * change;
        let windows = self.windows.iter().zip(&errors).zip(&spread);
        let squares: f64 = windows.map(|((w, e), c)| w.weight * (e * e + noise * c)).sum();
        let rough: f64 = self.increments(iterate).map(|rise| rise * rise).sum();
        let cost = squares + TIME_WEIGHT * profile.duration_s() + self.rough_weight() * rough;
        Some(Evaluation { profile, flow, errors, volume_variance: spread, change, cost })
    }

    /// The profile with squares of the speed at the nodes.
    pub fn profile(&self, squares: &[f64]) -> Option<SpeedProfile> {
        SpeedProfile::of_squares(self.path.clone(), squares.to_vec()).ok()
    }

    /// Change of the command to each knot, the first from the decided command.
    fn increments(&self, iterate: &Iterate) -> impl Iterator<Item = f64> {
        let before = std::iter::once(self.extruder.command()).chain(iterate.knots.iter().copied());
        iterate.knots.iter().zip(before).map(|(knot, before)| knot - before)
    }

    fn rough_weight(&self) -> f64 {
        ROUGH_WEIGHT / self.drive_span.powi(2)
    }

    /// Times at which a window's ends are passed \[s\].
    fn times(&self, profile: &SpeedProfile, window: &WidthWindow) -> [f64; 2] {
        window.ends().map(|at| self.from_s + profile.time_at(at))
    }

    /// Target volume of a window \[mm³\].
    fn volume(&self, window: &WidthWindow) -> f64 {
        self.bead.area_mm2 * window.length_mm
    }

    /// Sample times of the flow \[s\].
    fn flow_samples(
        &self,
        profile: &SpeedProfile,
        segment: PathSegment,
    ) -> impl Iterator<Item = f64> + use<> {
        let (from, to) = (profile.time_at(segment.from_mm), profile.time_at(segment.to_mm));
        let start = self.from_s + from;
        (0..=whole((to - from) / FLOW_SAMPLE_S))
            .map(move |sample| start + FLOW_SAMPLE_S * to_f64(sample))
    }

    /// The quadratic model of the cost about an iterate, with the Gauss–Newton Hessian, for the squares
    /// of the speed and then the knots.
    pub fn model(&self, iterate: &Iterate, at: &Evaluation) -> Quadratic {
        let nodes = self.path.len();
        let size = nodes + iterate.knots.len();
        let (jacobian, gradient) = self.linear(iterate, at);
        let mut model = Quadratic { hessian: &jacobian * jacobian.transpose() * 2.0, gradient };
        for segment in self.change_segments {
            self.add_noise(at, segment, &mut model);
        }
        let Quadratic { hessian, gradient } = &mut model;
        let weight = 2.0 * self.rough_weight();
        for (knot, rise) in (nodes..size).zip(self.increments(iterate)) {
            hessian[(knot, knot)] += weight;
            gradient[knot] += weight * rise;
            if knot > nodes {
                hessian[(knot - 1, knot - 1)] += weight;
                hessian[(knot - 1, knot)] -= weight;
                hessian[(knot, knot - 1)] -= weight;
                gradient[knot - 1] -= weight * rise;
            }
        }
        model
    }

    /// Jacobian of the weighted errors, a column per window, and the gradient of their squares, of the
    /// time, and of the noise through the duration of a window.
    fn linear(&self, iterate: &Iterate, at: &Evaluation) -> (DMatrix<f64>, DVector<f64>) {
        let nodes = self.path.len();
        let size = nodes + iterate.knots.len();
        let clock = PassingTimes::new(&at.profile);
        let noise = self.unmodelled.ratio.powi(2) * at.change;
        let mut jacobian = DMatrix::zeros(size, self.windows.len());
        let mut gradient = DVector::zeros(size);
        for (j, (window, error)) in self.windows.iter().zip(&at.errors).enumerate() {
            let times = self.times(&at.profile, window);
            let full = self.volume(window);
            let over_s = times[1] - times[0];
            let longer =
                if window.near { self.unmodelled.volume_variance_slope(over_s) } else { 0.0 };
            let slope = window.weight * noise * longer / full.powi(2);
            let root = window.weight.sqrt();
            let mut column = jacobian.column_mut(j);
            for ((end, time), sign) in window.ends().into_iter().zip(times).zip([-1.0, 1.0]) {
                let flow = at.flow.flow_at(time);
                clock.for_each(end, |node, change| {
                    column[node] += root * sign * flow / full * change;
                    gradient[node] += sign * slope * change;
                });
                let effects =
                    self.knot_responses.at(time - self.extruder.now_s(), iterate.knots.len());
                for (k, (_, volume)) in effects.enumerate() {
                    column[nodes + k] += root * sign * volume / full;
                }
            }
            gradient.axpy(2.0 * root * error, &column, 1.0);
        }
        clock.for_each(at.profile.end_mm(), |node, change| gradient[node] += TIME_WEIGHT * change);
        (jacobian, gradient)
    }

    /// Adds the cost of noise through the variance of the flow, which is quadratic in the knots.
    fn add_noise(&self, at: &Evaluation, segment: PathSegment, model: &mut Quadratic) {
        let Quadratic { hessian, gradient } = model;
        let nodes = self.path.len();
        let knots = gradient.len() - nodes;
        let samples: Vec<f64> = self.flow_samples(&at.profile, segment).collect();
        let flows = samples.iter().map(|sample| at.flow.flow_at(*sample));
        let mut flows = DVector::from_iterator(samples.len(), flows);
        let mut slopes = DMatrix::zeros(knots, samples.len());
        for (mut column, sample) in slopes.column_iter_mut().zip(&samples) {
            let effects = self.knot_responses.at(sample - self.extruder.now_s(), knots);
            for (slope, (flow, _)) in column.iter_mut().zip(effects) {
                *slope = flow;
            }
        }
        flows.add_scalar_mut(-flows.mean());
        for mut row in slopes.row_iter_mut() {
            row.add_scalar_mut(-row.mean());
        }
        let windows = self.windows.iter().zip(&at.volume_variance);
        let spread: f64 = windows.map(|(window, spread)| window.weight * spread).sum();
        let factor = 2.0 * self.unmodelled.ratio.powi(2) * spread
            / to_f64(samples.len() * self.change_segments.len());
        let mut corner = hessian.view_mut((nodes, nodes), (knots, knots));
        corner += &slopes * slopes.transpose() * factor;
        let mut tail = gradient.rows_mut(nodes, knots);
        tail += slopes * flows * factor;
    }
}
