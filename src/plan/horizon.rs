//! One stretch of path that is planned at once: what a choice of speeds and commands comes
//! to, and how that changes with each of them.

use nalgebra::{DMatrix, DVector};

use super::flow::{FlowModel, FlowTrajectory, KnotResponses, float, whole};
use super::profile::{ProfileNode, SpeedProfile};
use super::quadratic::Quadratic;
use super::segment::PathSegment;
use super::task::{BeadGeometry, FlowUncertainty};
use super::time_gradient::PassingTimes;

/// Time between two looks at the flow, for its standard deviation \[s\].
const FLOW_SAMPLE_S: f64 = 0.02;
/// What a second more costs, against the squared error of the width along the path
/// \[mm/s\]: next to nothing, so that no time is spent for nothing.
const TIME_WEIGHT: f64 = 1e-3;
/// What the squared change from one knot to the next costs, in squares of the drive's
/// range \[mm\]: as little, so that the command does not swing for nothing.
const ROUGH_WEIGHT: f64 = 1e-3;

/// A piece of bead whose mean width counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthWindow {
    /// Its middle \[mm\].
    pub at_mm: f64,
    /// Its length \[mm\].
    pub length_mm: f64,
    /// What its squared error counts \[mm\].
    pub weight: f64,
    /// Whether the noise that a change of the flow brings is weighed here: near to what
    /// the change is made for. Further away it would be weighed the more the longer the
    /// horizon is.
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
    /// \[mm²/s²\].
    pub squares: Vec<f64>,
    /// In the unit of the drive.
    pub knots: Vec<f64>,
}

/// A stretch of path and where it is judged.
#[derive(Debug, Clone)]
pub struct Horizon<'a> {
    /// The bead that is wanted.
    pub bead: BeadGeometry,
    /// The flow that no model tells.
    pub unmodelled: FlowUncertainty,
    /// Width of the drive's range.
    pub drive_span: f64,
    /// Nodes of the speed \[mm\].
    pub path: Vec<f64>,
    /// When the first node is passed \[s\].
    pub from_s: f64,
    /// Stretches over which the variance of the flow's change is taken, whose mean counts
    /// \[mm\].
    pub change_segments: [PathSegment; 2],
    /// Where the width is judged.
    pub windows: Vec<WidthWindow>,
    /// What the command acts on.
    pub extruder: &'a FlowModel,
    /// What each knot does.
    pub knot_responses: &'a KnotResponses,
}

/// What a choice comes to.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// The speed; times from the first node.
    pub profile: SpeedProfile,
    /// The flow.
    pub flow: FlowTrajectory,
    /// Share by which the width of each window is off.
    errors: Vec<f64>,
    /// Its variance for a unit of the flow's variance \[(mm³/s)⁻²\].
    volume_variance: Vec<f64>,
    /// Variance of the flow's change \[(mm³/s)²\].
    change: f64,
    /// What is to be least.
    pub cost: f64,
}

impl Horizon<'_> {
    /// What a choice comes to; `None` where the speeds are none.
    pub fn evaluate(&self, iterate: &Iterate) -> Option<Evaluation> {
        let profile = self.profile(&iterate.squares)?;
        let course = self.extruder.predict(&iterate.knots);
        let mut errors = Vec::with_capacity(self.windows.len());
        let mut spread = Vec::with_capacity(self.windows.len());
        for window in &self.windows {
            let [from, to] = self.times(&profile, window);
            let full = self.volume(window);
            errors.push((course.volume_at(to) - course.volume_at(from)) / full - 1.0);
            let noise = if window.near { self.unmodelled.volume_variance(to - from) } else { 0.0 };
            spread.push(noise / full.powi(2));
        }
        let change = self.change_segments.iter().map(|stretch| {
            let looks = self.flow_samples(&profile, *stretch).map(|at| course.flow_at(at));
            DVector::from_vec(looks.collect()).variance() / float(self.change_segments.len())
        });
        let change = change.sum();
        let noise = self.unmodelled.ratio.powi(2) * change;
        let windows = self.windows.iter().zip(&errors).zip(&spread);
        let squares: f64 = windows.map(|((w, e), c)| w.weight * (e * e + noise * c)).sum();
        let rough: f64 = self.increments(iterate).map(|rise| rise * rise).sum();
        let cost = squares + TIME_WEIGHT * profile.duration_s() + self.rough_weight() * rough;
        Some(Evaluation { profile, flow: course, errors, volume_variance: spread, change, cost })
    }

    /// The speed with some squares at the nodes.
    pub fn profile(&self, squares: &[f64]) -> Option<SpeedProfile> {
        let node =
            |(path_mm, square): (&f64, &f64)| ProfileNode { path_mm: *path_mm, square: *square };
        let nodes: Vec<_> = self.path.iter().zip(squares).map(node).collect();
        SpeedProfile::of_squares(&nodes).ok()
    }

    /// From each knot of a command to the next, the first from the command before.
    fn increments(&self, iterate: &Iterate) -> impl Iterator<Item = f64> {
        let before = std::iter::once(self.extruder.command()).chain(iterate.knots.iter().copied());
        iterate.knots.iter().zip(before).map(|(knot, before)| knot - before)
    }

    fn rough_weight(&self) -> f64 {
        ROUGH_WEIGHT / self.drive_span.powi(2)
    }

    /// When a window's ends are passed \[s\].
    fn times(&self, profile: &SpeedProfile, window: &WidthWindow) -> [f64; 2] {
        window.ends().map(|at| self.from_s + profile.time_at(at))
    }

    /// Volume that a window should hold \[mm³\].
    fn volume(&self, window: &WidthWindow) -> f64 {
        self.bead.area_mm2 * window.length_mm
    }

    /// Moments at which the flow's change is taken \[s\].
    fn flow_samples(
        &self,
        profile: &SpeedProfile,
        stretch: PathSegment,
    ) -> impl Iterator<Item = f64> + use<> {
        let (from, to) = (profile.time_at(stretch.from_mm), profile.time_at(stretch.to_mm));
        let start = self.from_s + from;
        (0..=whole((to - from) / FLOW_SAMPLE_S))
            .map(move |sample| start + FLOW_SAMPLE_S * float(sample))
    }

    /// The quadratic model of the cost about an outcome, with Gauss's and Newton's Hessian,
    /// for the squares of the speed and then the knots.
    pub fn model(&self, iterate: &Iterate, at: &Evaluation) -> Quadratic {
        let nodes = self.path.len();
        let size = nodes + iterate.knots.len();
        let (jacobian, gradient) = self.linear(iterate, at);
        let mut model = Quadratic { hessian: &jacobian * jacobian.transpose() * 2.0, gradient };
        for stretch in self.change_segments {
            self.add_noise(at, stretch, &mut model);
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

    /// Slopes of the weighted errors, a column a window, and the gradient of their squares,
    /// of the time, and of the noise through the time that a window takes.
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

    /// Adds the noise's cost through the variance of the flow, which is quadratic in the
    /// knots.
    fn add_noise(&self, at: &Evaluation, stretch: PathSegment, model: &mut Quadratic) {
        let Quadratic { hessian, gradient } = model;
        let nodes = self.path.len();
        let knots = gradient.len() - nodes;
        let looks: Vec<f64> = self.flow_samples(&at.profile, stretch).collect();
        let mut flows = DVector::from_iterator(
            looks.len(),
            looks.iter().map(|sample| at.flow.flow_at(*sample)),
        );
        let mut slopes = DMatrix::zeros(knots, looks.len());
        for (mut column, sample) in slopes.column_iter_mut().zip(&looks) {
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
            / float(looks.len() * self.change_segments.len());
        let mut corner = hessian.view_mut((nodes, nodes), (knots, knots));
        corner += &slopes * slopes.transpose() * factor;
        let mut tail = gradient.rows_mut(nodes, knots);
        tail += slopes * flows * factor;
    }
}
