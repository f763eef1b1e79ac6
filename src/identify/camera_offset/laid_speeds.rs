//! The speed at which bead was laid, along the path.

use super::estimate::SpeedRange;
use super::observation::BeadObservation;
use crate::core::{Mm, MmPerS, RobotState, Span, Stamp};
use crate::numeric::number::{to_count, to_f64};
use crate::numeric::rank;

/// Longest time between two reports over which the speed is interpolated; a longer one is a
/// lost link.
pub const MAX_GAP: Span = Span::from_millis(500);
/// A path that decreases by less is the same bead \[mm\]: rounding of the reports.
const MAX_BACKSTEP_MM: f64 = 0.01;
/// Grid along the path on which speeds are integrated \[mm\]. A choice: well below any gauge.
const GRID_MM: f64 = 0.5;
/// Longest bead \[mm\]; a longer one is a path that jumped.
const MAX_LENGTH_MM: f64 = 1e7;
/// Speed over the median below which a bead starts or ends, where its width is no power of the
/// speed.
const MIN_SPEED_FRACTION: f64 = 0.2;
/// Relative growth of the speed per millimetre from which a bead is still starting, or already
/// ending, where its width is no power of the speed either.
const RUN_UP_PER_MM: f64 = 0.01;

/// All beads of a recording.
#[derive(Debug, Clone)]
pub struct LaidSpeeds {
    beads: Vec<Bead>,
    min_speed: f64,
}

/// Reports of one bead without a gap.
#[derive(Debug, Clone, Default)]
struct Bead {
    times: Vec<Stamp>,
    /// The robot's own clock \[s\].
    clocks: Vec<f64>,
    paths: Vec<f64>,
    speeds: Vec<f64>,
    /// Number of grid nodes up to each one where the bead was slow, starting or ending.
    slow: Vec<u32>,
}

/// Integrals along one bead, for means over segments.
#[derive(Debug, Clone)]
pub struct PowerIntegral {
    start_mm: f64,
    exponent: f64,
    /// Integral of v^−b from the start to each node \[mm·(mm/s)^−b\].
    to_nodes: Vec<f64>,
    /// v^−b at both ends.
    ends: (f64, f64),
}

impl LaidSpeeds {
    /// From the robot's reports, in order; `None` without a bead.
    pub fn of(states: &[(Stamp, RobotState)]) -> Option<Self> {
        let mut beads: Vec<Bead> = Vec::new();
        let mut open = false;
        for (at, state) in states {
            if !state.mode.lays_bead() {
                open = false;
                continue;
            }
            let follows = open && beads.last().is_some_and(|bead| bead.is_followed_by(*at, state));
            if !follows {
                beads.push(Bead::default());
                open = true;
            }
            if let Some(bead) = beads.last_mut() {
                bead.push(*at, state);
            }
        }
        beads.retain(|bead| bead.length_mm() > 0.0 && bead.length_mm() < MAX_LENGTH_MM);
        let median = rank::median_of(beads.iter().flat_map(Bead::on_grid))?;
        let slowest = (MIN_SPEED_FRACTION * median).max(f64::MIN_POSITIVE);
        for bead in &mut beads {
            bead.mark_slow(slowest);
        }
        Some(Self { beads, min_speed: slowest })
    }

    /// Bead and path position of the nozzle at a moment \[mm\], interpolated between two
    /// reports.
    pub fn path_at(&self, at: Stamp) -> Option<(usize, f64)> {
        let number = self.beads.partition_point(|bead| bead.times.last() < Some(&at));
        Some((number, self.beads.get(number)?.path_at(at)?))
    }

    /// Slowest and fastest speed along the path, without a fraction at either end of the range
    /// and without slow parts.
    pub fn range(&self, tail: f64) -> SpeedRange {
        let speeds = self.beads.iter().flat_map(Bead::on_grid);
        let mut speeds: Vec<f64> = speeds.filter(|&speed| speed >= self.min_speed).collect();
        speeds.sort_by(f64::total_cmp);
        let last = speeds.len().saturating_sub(1);
        let skip = to_count(tail * to_f64(last));
        let at =
            |i: usize| MmPerS::new(speeds.get(i).copied().unwrap_or(0.0)).unwrap_or(MmPerS::ZERO);
        SpeedRange { min: at(skip), max: at(last - skip) }
    }

    /// Whether the speed is known and high enough over the whole gauge of a width at an offset
    /// \[mm\].
    pub fn covers(&self, look: &BeadObservation, offset_mm: f64, gauge: Mm) -> bool {
        let middle = look.middle_mm(offset_mm);
        let half = 0.5 * gauge.get();
        self.beads.get(look.bead).is_some_and(|bead| bead.knows(middle - half, middle + half))
    }

    /// Uncertainty of the position of speed changes along the path \[mm\]: between two reports
    /// the robot moves further than with linear change of its speed if it slows down later, or
    /// speeds up earlier. The mean is weighted by the squared changes, as in the offset.
    pub fn position_sigma_mm(&self) -> f64 {
        let (mut ways, mut changes) = (0.0, 0.0);
        for (way, change) in self.beads.iter().flat_map(Bead::changes) {
            ways += way * change;
            changes += change * change;
        }
        if changes > 0.0 { (ways / changes).abs() } else { 0.0 }
    }

    /// Integrals of every bead for an exponent.
    pub fn sums(&self, exponent: f64) -> Vec<PowerIntegral> {
        self.beads.iter().map(|bead| bead.sums(exponent, self.min_speed)).collect()
    }
}

impl Bead {
    fn is_followed_by(&self, at: Stamp, state: &RobotState) -> bool {
        let (Some(&last_at), Some(&last)) = (self.times.last(), self.paths.last()) else {
            return true;
        };
        at > last_at && at - last_at <= MAX_GAP && state.path_mm.get() >= last - MAX_BACKSTEP_MM
    }

    fn push(&mut self, at: Stamp, state: &RobotState) {
        let last = self.paths.last().copied().unwrap_or(f64::NEG_INFINITY);
        self.times.push(at);
        let on_robot = state.robot_time_ms.and_then(|ms| i64::try_from(ms).ok());
        self.clocks.push(on_robot.map_or(at.secs(), |ms| Span::from_millis(ms).secs()));
        self.paths.push(state.path_mm.get().max(last));
        self.speeds.push(state.speed_mm_per_s.get().abs());
    }

    fn start_mm(&self) -> f64 {
        self.paths.first().copied().unwrap_or(0.0)
    }

    fn length_mm(&self) -> f64 {
        self.paths.last().map_or(0.0, |last| last - self.start_mm())
    }

    fn path_at(&self, at: Stamp) -> Option<f64> {
        let after = self.times.partition_point(|time| *time < at);
        if self.times.get(after) == Some(&at) {
            return self.paths.get(after).copied();
        }
        let before = after.checked_sub(1)?;
        let (from, to) = (*self.times.get(before)?, *self.times.get(after)?);
        let fraction = (at - from).secs() / (to - from).secs();
        Some(self.paths[before] + (self.paths[after] - self.paths[before]) * fraction)
    }

    /// Speeds at the grid nodes, interpolated along the path.
    fn on_grid(&self) -> impl Iterator<Item = f64> {
        let start = self.start_mm();
        let mut next = 1;
        (0..=to_count(self.length_mm() / GRID_MM)).map(move |node| {
            let path = start + to_f64(node) * GRID_MM;
            while next + 1 < self.paths.len() && self.paths[next] < path {
                next += 1;
            }
            let (from, to) = (self.paths[next - 1], self.paths[next]);
            let fraction =
                if to > from { ((path - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
            self.speeds[next - 1] + (self.speeds[next] - self.speeds[next - 1]) * fraction
        })
    }

    /// For each pair of reports: the path beyond that of a linear speed change \[mm\] times the
    /// mean speed, and the speed change.
    fn changes(&self) -> impl Iterator<Item = (f64, f64)> {
        (1..self.paths.len()).map(|i| {
            let pair = |values: &[f64]| (values[i - 1], values[i]);
            let (before, after) = pair(&self.speeds);
            let [way, time] = [pair(&self.paths), pair(&self.clocks)].map(|(from, to)| to - from);
            let mean = 0.5 * (before + after);
            (mean * (way - mean * time), after - before)
        })
    }

    fn mark_slow(&mut self, slowest: f64) {
        let speeds: Vec<f64> = self.on_grid().collect();
        let from = run_up(speeds.iter(), slowest);
        let to = speeds.len() - run_up(speeds.iter().rev(), slowest);
        let slow = speeds.iter().enumerate().scan(0, |count, (node, speed)| {
            *count += u32::from(*speed < slowest || node < from || node >= to);
            Some(*count)
        });
        self.slow = slow.collect();
    }

    fn knows(&self, from_mm: f64, to_mm: f64) -> bool {
        let (from, to) = (from_mm - self.start_mm(), to_mm - self.start_mm());
        if from < 0.0 || to > self.length_mm() {
            return false;
        }
        // Both nodes about either end count: a gauge may have zero length.
        let before = to_count(from / GRID_MM).checked_sub(1).and_then(|node| self.slow.get(node));
        let after = self.slow.get(to_count(to / GRID_MM) + 1).or(self.slow.last());
        before.copied().unwrap_or(0) == after.copied().unwrap_or(0)
    }

    fn sums(&self, exponent: f64, slowest: f64) -> PowerIntegral {
        let powers: Vec<f64> =
            self.on_grid().map(|speed| speed.max(slowest).powf(-exponent)).collect();
        let mut sum = 0.0;
        let mut to_nodes = vec![0.0];
        to_nodes.extend(powers.windows(2).map(|pair| {
            sum += GRID_MM * 0.5 * (pair[0] + pair[1]);
            sum
        }));
        let end = |power: Option<&f64>| power.copied().unwrap_or(1.0);
        let ends = (end(powers.first()), end(powers.last()));
        PowerIntegral { start_mm: self.start_mm(), exponent, to_nodes, ends }
    }
}

/// Number of nodes from an end of a bead inwards over which the speed grows fast.
fn run_up<'a>(speeds: impl Iterator<Item = &'a f64> + Clone, slowest: f64) -> usize {
    let grows = |here: f64, next: f64| next > here * (1.0 + RUN_UP_PER_MM * GRID_MM);
    let pairs = speeds.clone().zip(speeds.skip(1));
    pairs.take_while(|(here, next)| **here < slowest || grows(**here, **next)).count()
}

impl PowerIntegral {
    /// Logarithm of the speed that lays a bead of the mean width over a segment about a point.
    /// Beyond the ends of the bead the speed is taken as constant.
    pub fn ln_speed(&self, middle_mm: f64, length: Mm) -> f64 {
        let length = length.get().max(GRID_MM);
        let from = middle_mm - 0.5 * length;
        let mean = (self.integral_to(from + length) - self.integral_to(from)) / length;
        -mean.ln() / self.exponent
    }

    fn integral_to(&self, path_mm: f64) -> f64 {
        let index = (path_mm - self.start_mm) / GRID_MM;
        let last = self.to_nodes.len() - 1;
        if index <= 0.0 {
            return index * GRID_MM * self.ends.0;
        }
        let node = to_count(index);
        if node >= last {
            return self.to_nodes[last] + (index - to_f64(last)) * GRID_MM * self.ends.1;
        }
        self.to_nodes[node]
            + (self.to_nodes[node + 1] - self.to_nodes[node]) * (index - to_f64(node))
    }
}
