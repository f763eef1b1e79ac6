//! Search for the bead as straight lines along which the grey level steps, in the mean over the
//! whole gauge (a Radon transform of the step response). It finds edges that texture and tears
//! hide from a search step by step: texture averages out, an edge does not.

use super::gauge::WidthRangePx;
use super::pair::{MAX_SEAM_RATIO, MIN_RIVAL_RATIO, is_narrower};
use super::strip::{GaugeRows, GreyPixel};
use crate::numeric::number::{round_to_count, to_f32};
use crate::numeric::rank;
use crate::vision::buffer::{refill, reset};

/// Rows of a band at least: fewer are noisy, more smear a slanted edge.
const BAND_ROWS: usize = 8;
/// Bands at most: the time of the search grows with them.
const MAX_BANDS: usize = 24;
/// Pixels on either side that are compared for a step, as a fraction of the
/// bead's width, and their limits: about the depth of tears, and no more than a
/// groove and its flank.
const REACH_FRACTION: f32 = 0.04;
const REACH_PX: (f32, f32) = (2.0, 6.0);
/// Largest slope of an edge against the gauge's axis. Derived: tan 20°, the largest slant of a bead
/// (contract, `bead_axis`).
const MAX_SLOPE: f32 = 0.364;
/// Distance of neighbouring slopes, as a shift between the ends of the gauge
/// \[px\].
const SLOPE_STEP_PX: f32 = 3.0;
/// Rank among the strongest steps of the bands at which all steps are capped: a spark is no edge.
const CAP_RANK: f32 = 0.7;
/// Widest groove beside a bead \[px\]; what lies beyond is something else. Measured:
/// reference/accuracy.md, Drawn frames: `grooves` are 2 to 40 px wide.
const MAX_GROOVE_PX: f32 = 40.0;
/// Width of a groove over which the weight of its far side falls to 1/e \[px\]: of two lines before
/// a groove the nearer one is the edge.
const GROOVE_DECAY_PX: f32 = 20.0;
/// Fraction of a groove's far side that counts for the edge.
const FAR_SIDE_WEIGHT: f32 = 0.5;
/// What a groove's far side adds to an edge that certainly lies beside one, as a fraction
/// of the edge's step: a pattern of the ground adds up to 0.37.
const MIN_CERTAIN_GROOVE: f32 = 0.4;
/// Distance of a seam from an edge \[px\]: nearer lines belong to the edge's flank. Measured:
/// reference/accuracy.md, Drawn frames: the lines of `ribs-weak` lie at least 6 px from the edges.
const MIN_SEAM_DISTANCE_PX: f32 = 6.0;
/// [`MAX_SEAM_RATIO`] and [`MIN_RIVAL_RATIO`] where the stronger pair lies within the other one:
/// rough edges are some tenths fainter in the mean along a line than ribs are.
const INNER_PAIR_RATIOS: (f32, f32) = (0.5, 0.8);
/// Lines of each sign that are kept.
const MAX_LINES: usize = 8;
/// Difference of slope at which the score of a pair falls to 1/e.
const SLOPE_DIFFERENCE_SCALE: f32 = 0.3;

/// A line along which the grey steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLine {
    /// Position across the bead in the middle of the gauge \[px\].
    pub at: f32,
    /// Change of the position for each row.
    pub slope: f32,
    /// Mean step across it \[grey levels\], positive.
    pub step: f32,
}

/// Two lines that may be the edges of a bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinePair {
    /// Left (upper) and right (lower) edge.
    pub sides: [StepLine; 2],
    /// Whether the bead is brighter than what lies outside.
    pub bright: bool,
    /// Geometric mean of the strengths, lower for lines that are not parallel \[grey levels\].
    pub score: f32,
    /// Score without the far sides of grooves \[grey levels\].
    pub score_without_grooves: f32,
    /// Step of each edge, with the weighted far side of a groove beside it \[grey levels\].
    pub strengths: [f32; 2],
}

impl LinePair {
    /// Distance of the two lines in the middle of the gauge \[px\].
    pub fn width_px(&self) -> f32 {
        self.sides[1].at - self.sides[0].at
    }

    /// Whether a groove certainly lies beside one of the two lines.
    pub fn has_groove(&self) -> bool {
        let mut sides = self.sides.iter().zip(self.strengths);
        sides.any(|(line, strength)| strength > (1.0 + MIN_CERTAIN_GROOVE) * line.step)
    }
}

/// The search; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct LineSearch {
    /// Steps of each band, position by position; `middles` has its middle row about the gauge's.
    steps: Vec<f32>,
    middles: Vec<f32>,
    across: usize,
    totals: Vec<f32>,
    strongest: Vec<f32>,
    /// Sum of the steps of two bands.
    pair: Vec<f32>,
    /// Mean step of every line: positions by slopes.
    means: Vec<f32>,
    slopes: Vec<f32>,
    /// Highest and lowest of these means at each position.
    highest: Vec<f32>,
    lowest: Vec<f32>,
    ups: Vec<StepLine>,
    downs: Vec<StepLine>,
}

impl LineSearch {
    /// Looks for lines. `width_px` is a usual width of the bead.
    #[inline(always)]
    pub fn look<T: GreyPixel>(&mut self, strip: &GaugeRows<'_, T>, width_px: f32) {
        let reach = round_to_count((REACH_FRACTION * width_px).clamp(REACH_PX.0, REACH_PX.1));
        self.respond(strip, reach);
        self.clip_steps();
        self.project_lines(strip.along);
        self.find_strongest(reach);
    }

    /// Lines into a bright or a dark bead, and out of it.
    fn sides(&self, bright: bool) -> (&Vec<StepLine>, &Vec<StepLine>) {
        if bright { (&self.ups, &self.downs) } else { (&self.downs, &self.ups) }
    }

    /// Pairs of lines at a distance within a range, the strongest first.
    /// `polarities` are whether bright and dark beads are looked for; where a groove may lie
    /// beside a bright one, its far side adds to the edge.
    pub fn pairs(
        &self,
        range: WidthRangePx,
        polarities: [bool; 2],
        may_be_groove: bool,
        out: &mut Vec<LinePair>,
    ) {
        out.clear();
        for (bright, wanted) in [(true, polarities[0]), (false, polarities[1])] {
            if !wanted {
                continue;
            }
            let (lefts, rights) = self.sides(bright);
            let has_far_sides = bright && may_be_groove;
            let far_sides = (has_far_sides.then_some(rights), has_far_sides.then_some(lefts));
            for &left in lefts {
                for &right in rights {
                    let width = right.at - left.at;
                    if width < range.min || width > range.max {
                        continue;
                    }
                    let apart = (left.slope - right.slope) / SLOPE_DIFFERENCE_SCALE;
                    let strengths = [
                        left.step + groove(&left, far_sides.0, -1.0),
                        right.step + groove(&right, far_sides.1, 1.0),
                    ];
                    let parallel = (-apart * apart).exp();
                    let score = (strengths[0] * strengths[1]).sqrt() * parallel;
                    let (sides, bare) = ([left, right], (left.step * right.step).sqrt() * parallel);
                    let score_without_grooves = bare;
                    out.push(LinePair { sides, bright, score, score_without_grooves, strengths });
                }
            }
        }
        out.sort_by(|a, b| b.score.total_cmp(&a.score));
    }

    /// Whether either of two pairs may be the bead: one lies within the other, and each of its
    /// edges that the two do not share is that of a seam or a rib of the wider one.
    pub fn are_rivals(&self, pair: &LinePair, other: &LinePair) -> bool {
        let (inner, outer) =
            if pair.width_px() < other.width_px() { (pair, other) } else { (other, pair) };
        let [left, right] = outer.sides;
        let is_within = inner.sides[0].at >= left.at && inner.sides[1].at <= right.at;
        let narrower = is_narrower(inner.width_px(), outer.width_px());
        if pair.bright != other.bright || !is_within || !narrower {
            return false;
        }
        let gap = self.gap(outer) / left.step.min(right.step);
        let (ins, outs) = self.sides(outer.bright);
        // The narrower pair, where it is the stronger one, owes that to its rib.
        let (seam, rival) =
            if inner == pair { INNER_PAIR_RATIOS } else { (MAX_SEAM_RATIO, MIN_RIVAL_RATIO) };
        let least = seam * left.step.max(right.step);
        let is_of_rib = |end: &StepLine, partners: &[StepLine]| {
            let mut partners = partners.iter().filter(|line| line.step >= least);
            let has_partner = partners.any(|line| {
                let apart = (line.at - left.at).min(right.at - line.at);
                apart > MIN_SEAM_DISTANCE_PX && (line.at - end.at).abs() < MAX_GROOVE_PX
            });
            end.step >= least && has_partner
        };
        let ends = [(&inner.sides[0], left, outs), (&inner.sides[1], right, ins)];
        let mut ribs = ends.into_iter().filter(|(end, edge, _)| **end != *edge);
        let fits = other.score_without_grooves >= rival * pair.score_without_grooves
            || outer == pair && gap > MAX_SEAM_RATIO;
        fits && ribs.all(|(end, _, partners)| is_of_rib(end, partners))
    }

    /// Depth of the deepest gap between the edges of a pair \[grey levels\]: a line out
    /// of the bead, followed by one back in.
    fn gap(&self, pair: &LinePair) -> f32 {
        let [left, right] = pair.sides;
        let (backs, outs) = self.sides(pair.bright);
        let is_within = |line: &&StepLine| line.at > left.at && line.at < right.at;
        let mut deepest: f32 = 0.0;
        for out in outs.iter().filter(is_within) {
            for back in backs.iter().filter(is_within).filter(|back| back.at > out.at) {
                deepest = deepest.max(out.step.min(back.step));
            }
        }
        deepest
    }

    /// Typical step along a line between two positions where there is no edge: the
    /// root of the mean square over all slopes \[grey levels\].
    pub fn texture_between(&self, from: f32, to: f32) -> f32 {
        let range = round_to_count(from).min(self.across)..round_to_count(to).min(self.across);
        let (mut sum, mut count) = (0.0, 0.0);
        for means in self.means.chunks(self.across) {
            for mean in means.get(range.clone()).unwrap_or_default() {
                sum += mean * mean;
                count += 1.0;
            }
        }
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }

    /// Steps of the bands' mean profiles.
    #[inline(always)]
    fn respond<T: GreyPixel>(&mut self, strip: &GaugeRows<'_, T>, reach: usize) {
        let count = (strip.along / BAND_ROWS).clamp(1, MAX_BANDS);
        self.across = strip.across;
        reset(&mut self.steps, count * strip.across, 0.0);
        self.middles.clear();
        for band in 0..count {
            let (from, to) = (band * strip.along / count, (band + 1) * strip.along / count);
            self.middles.push(0.5 * (to_f32(from + to) - to_f32(strip.along)));
            let steps = &mut self.steps[band * strip.across..][..strip.across];
            for v in from..to {
                for (sum, &value) in steps.iter_mut().zip(strip.row(v)) {
                    *sum += T::sum_to_f32(value.add_to(T::Sum::default()));
                }
            }
            let scale = strip.scale / to_f32((to - from) * reach);
            self.totals.clear();
            self.totals.push(0.0);
            let mut total = 0.0;
            self.totals.extend(steps.iter().map(|sum| {
                total += scale * sum;
                total
            }));
            steps.fill(0.0);
            let totals = self.totals.windows(2 * reach + 1);
            for (step, totals) in steps.iter_mut().skip(reach).zip(totals) {
                *step = totals[2 * reach] - 2.0 * totals[reach] + totals[0];
            }
        }
    }

    /// Caps steps at what most bands have.
    fn clip_steps(&mut self) {
        let most = |steps: &[f32]| steps.iter().fold(0.0, |most: f32, step| most.max(step.abs()));
        refill(&mut self.strongest, self.steps.chunks(self.across).map(most));
        let rank = round_to_count(CAP_RANK * to_f32(self.strongest.len() - 1));
        let cap = rank::at(&mut self.strongest, rank).unwrap_or(f32::INFINITY);
        for step in &mut self.steps {
            *step = step.clamp(-cap, cap);
        }
    }

    /// The strongest lines of either sign, each at least `reach` from the others.
    #[inline(always)]
    fn find_strongest(&mut self, reach: usize) {
        // The highest and the lowest step of every position, of all slopes.
        let (highest, lowest) = (&mut self.highest, &mut self.lowest);
        for best in [&mut *highest, lowest] {
            reset(best, self.across, 0.0);
        }
        for means in self.means.chunks(self.across) {
            for ((high, low), &mean) in highest.iter_mut().zip(lowest.iter_mut()).zip(means) {
                *high = if mean > *high { mean } else { *high };
                *low = if mean < *low { mean } else { *low };
            }
        }
        for low in lowest.iter_mut() {
            *low = -*low;
        }
        let lines = ProjectedLines { means: &self.means, slopes: &self.slopes, reach };
        lines.take_strongest(highest, 1.0, &mut self.ups);
        lines.take_strongest(lowest, -1.0, &mut self.downs);
    }

    /// Means of the steps along lines. Of two neighbouring bands the steps are added for
    /// each shift of one against the other before they are added along all lines.
    #[inline(always)]
    fn project_lines(&mut self, along: usize) {
        let across = self.across;
        let most = (MAX_SLOPE * to_f32(along) / SLOPE_STEP_PX).ceil();
        let count = 2 * round_to_count(most) + 1;
        self.slopes.clear();
        self.slopes.extend((0..count).map(|k| (to_f32(k) - most) * SLOPE_STEP_PX / to_f32(along)));
        reset(&mut self.means, count * across, 0.0);
        self.pair.resize(across, 0.0);
        let scale = 1.0 / to_f32(self.middles.len());
        for (bands, middles) in self.steps.chunks(2 * across).zip(self.middles.chunks(2)) {
            let (first, second) = bands.split_at(across);
            let mut added = None;
            for (slope, means) in self.slopes.iter().zip(self.means.chunks_mut(across)) {
                let aside = shift(slope * middles[0]);
                let apart = middles.get(1).map_or(0, |middle| shift(slope * middle) - aside);
                if added != Some(apart) {
                    self.pair.copy_from_slice(first);
                    add_shifted(&mut self.pair, second, apart, 1.0);
                    added = Some(apart);
                }
                add_shifted(means, &self.pair, aside, scale);
            }
        }
    }
}

/// Adds values times a scale, shifted to lower positions by `aside`.
#[inline(always)]
fn add_shifted(sums: &mut [f32], values: &[f32], aside: isize, scale: f32) {
    let most = sums.len().min(values.len()).saturating_sub(aside.unsigned_abs());
    let (sums, values) = if aside >= 0 {
        (&mut sums[..most], &values[values.len() - most..])
    } else {
        let beyond = sums.len() - most;
        (&mut sums[beyond..], &values[..most])
    };
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += scale * value;
    }
}

/// Mean steps of all lines, their slopes, and the smallest distance of two lines that are kept
/// \[px\].
struct ProjectedLines<'a> {
    means: &'a [f32],
    slopes: &'a [f32],
    reach: usize,
}

impl ProjectedLines<'_> {
    /// Takes the strongest lines of a sign from `best`, the strongest step of each position.
    fn take_strongest(&self, best: &mut [f32], sign: f32, out: &mut Vec<StepLine>) {
        out.clear();
        let across = best.len();
        while out.len() < MAX_LINES {
            let strongest = best.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            let Some((at, &step)) = strongest.filter(|(_, best)| **best > 0.0) else { return };
            let mut by_slope = self.means.chunks(across).zip(self.slopes);
            let strongest = by_slope.find(|(means, _)| sign * means[at] >= step);
            let Some((_, &slope)) = strongest else { return };
            out.push(StepLine { at: to_f32(at) - 0.5, slope, step });
            let near = at.saturating_sub(self.reach)..(at + self.reach + 1).min(across);
            best[near].fill(0.0);
        }
    }
}

/// What the far side of a groove adds to an edge \[grey levels\]: the strongest line
/// of the other sign beyond it, outwards in the direction given.
fn groove(edge: &StepLine, far_sides: Option<&Vec<StepLine>>, outwards: f32) -> f32 {
    let added = far_sides.into_iter().flatten().map(|far| {
        let gap = outwards * (far.at - edge.at);
        let within = gap > 0.0 && gap <= MAX_GROOVE_PX;
        if within { FAR_SIDE_WEIGHT * far.step * (-gap / GROOVE_DECAY_PX).exp() } else { 0.0 }
    });
    added.fold(0.0, f32::max)
}

/// A shift rounded to whole pixels.
fn shift(aside: f32) -> isize {
    let size = round_to_count(aside.abs()).cast_signed();
    if aside < 0.0 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_slope_is_that_of_20_degrees() {
        assert!((MAX_SLOPE - 20f32.to_radians().tan()).abs() < 5e-4);
    }
}
