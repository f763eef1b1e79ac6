//! The course of an edge through its windows: the strongest step from dark to
//! bright that runs along the bead, by dynamic programming over blocks of rows.

use std::ops::Range;

use super::window::{RowWindows, WindowRow};
use crate::numeric::number::{round_to_count, to_f32};
use crate::numeric::rank;
use crate::vision::edge_windows::WINDOW_PX;

/// Pixels on either side that are compared for a step, as a fraction of the
/// bead's width: wide against texture, narrow against the bead.
const REACH_FRACTION: f32 = 0.06;
/// Fewest and most such pixels.
const REACH_PX: (f32, f32) = (3.0, 6.0);
/// How far a course may run aside from one block to the next \[px\].
const MAX_ASIDE: usize = 8;
/// Cost of running aside by a pixel, in typical steps: into a tear as deep as a block is long, and
/// out again, costs the steps of one and a half blocks.
const ASIDE_COST: f32 = 0.2;
/// Rank of the typical step among the blocks' strongest.
const TYPICAL_RANK: f32 = 0.7;
/// Fraction of the width within which an edge lies about its rough course.
const CORRIDOR_FRACTION: f32 = 0.4;
/// Half of the corridor at most \[px\].
const MAX_CORRIDOR_PX: f32 = 40.0;

/// The course of an edge; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct EdgeRoute {
    steps: Vec<WindowRow>,
    scores: Vec<WindowRow>,
    strongest: Vec<f32>,
    blocks: Vec<f32>,
    rows: Vec<f32>,
}

impl EdgeRoute {
    /// Positions of the last course, row by row \[px\] in its window.
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// Finds the course; `None` where nothing steps up.
    #[inline(always)]
    pub fn find(&mut self, windows: &RowWindows, width_px: f32) -> Option<()> {
        let reach = (REACH_FRACTION * width_px).clamp(REACH_PX.0, REACH_PX.1);
        let reach = round_to_count(reach.min(width_px / 3.0)).max(2);
        let corridor = (CORRIDOR_FRACTION * width_px).min(MAX_CORRIDOR_PX);
        let middle = WINDOW_PX / 2;
        let half = round_to_count(corridor).clamp(2, middle - reach - 1);
        let inside = middle - half..middle + half + 1;
        self.respond(windows, reach);
        self.link(inside)?;
        self.draw(windows.block());
        Some(())
    }

    /// Takes over positions that were found, and fills the rows without one.
    pub fn follow(&mut self, crossings: &[f32]) -> Option<()> {
        let mut last: Option<usize> = None;
        for (number, &at) in crossings.iter().enumerate() {
            if !at.is_finite() {
                continue;
            }
            let (from, start) = last.map_or((0, at), |last| (last, self.rows[last]));
            if number == from + 1 {
                self.rows[number] = at;
                last = Some(number);
                continue;
            }
            let span = to_f32((number - from).max(1));
            for between in from..=number {
                self.rows[between] = start + (at - start) * to_f32(between - from) / span;
            }
            last = Some(number);
        }
        let last = last?;
        let end = self.rows[last];
        self.rows[last..].fill(end);
        Some(())
    }

    /// Steps of the blocks: the mean of some pixels after a position less that of
    /// those before it, over three blocks with weights 1, 2, 1.
    #[inline(always)]
    fn respond(&mut self, windows: &RowWindows, reach: usize) {
        let count = windows.rows.len().div_ceil(windows.block());
        self.scores.resize(count, [0.0; WINDOW_PX]);
        self.steps.resize(count, [0.0; WINDOW_PX]);
        for (rows, sums) in windows.rows.chunks(windows.block()).zip(&mut self.scores) {
            sums.fill(0.0);
            for row in rows {
                for k in 0..WINDOW_PX {
                    sums[k] += row[k];
                }
            }
            let scale = 1.0 / to_f32(rows.len());
            for sum in sums.iter_mut() {
                *sum *= scale;
            }
        }
        for block in 0..count {
            let (before, after) = (block.saturating_sub(1), (block + 1).min(count - 1));
            let mut totals = [0.0; WINDOW_PX + 1];
            for k in 0..WINDOW_PX {
                let mean = 0.25 * (self.scores[before][k] + self.scores[after][k])
                    + 0.5 * self.scores[block][k];
                totals[k + 1] = totals[k] + mean;
            }
            let out = &mut self.steps[block];
            out.fill(0.0);
            for k in reach..WINDOW_PX - reach {
                let step = totals[k + reach] - 2.0 * totals[k] + totals[k - reach];
                out[k] = step / to_f32(reach);
            }
        }
    }

    /// The course with the largest sum of steps less the cost of running aside.
    #[inline(always)]
    fn link(&mut self, inside: Range<usize>) -> Option<()> {
        let most =
            |steps: &WindowRow| steps[inside.clone()].iter().fold(0.0, |a: f32, &b| a.max(b));
        self.strongest.clear();
        self.strongest.extend(self.steps.iter().map(most));
        let rank = round_to_count(TYPICAL_RANK * to_f32(self.strongest.len().saturating_sub(1)));
        let typical = rank::at(&mut self.strongest, rank).filter(|&step| step > 0.0)?;
        for block in 0..self.steps.len() {
            let (before, here) = self.scores.split_at_mut(block);
            let scores = &mut here[0];
            match before.last() {
                Some(before) => best_before(before, &inside, scores),
                None => scores.fill(0.0),
            }
            for (score, step) in scores.iter_mut().zip(&self.steps[block]) {
                *score += step / typical;
            }
        }
        let last = self.scores.last()?;
        let mut at = inside.clone().max_by(|&a, &b| last[a].total_cmp(&last[b]))?;
        self.blocks.clear();
        for scores in self.scores.iter().rev() {
            if !self.blocks.is_empty() {
                at = came_from(scores, &inside, at);
            }
            // A step at k lies between the pixels k − 1 and k.
            self.blocks.push(to_f32(at) - 0.5);
        }
        self.blocks.reverse();
        Some(())
    }

    /// Straight lines between the middles of blocks of `block` rows.
    fn draw(&mut self, block: usize) {
        let blocks = &self.blocks;
        self.rows.clear();
        for number in 0..blocks.len() * block {
            let position = (to_f32(number) + 0.5) / to_f32(block) - 0.5;
            let position = position.clamp(0.0, to_f32(blocks.len() - 1));
            let before = round_to_count(position.floor()).min(blocks.len() - 1);
            let after = (before + 1).min(blocks.len() - 1);
            let fraction = position - to_f32(before);
            self.rows.push(blocks[before] + fraction * (blocks[after] - blocks[before]));
        }
    }
}

/// Best score of the block before from which each position can be reached.
#[inline(always)]
fn best_before(scores: &WindowRow, inside: &Range<usize>, best: &mut WindowRow) {
    let mut padded = [f32::NEG_INFINITY; WINDOW_PX + 2 * MAX_ASIDE];
    padded[MAX_ASIDE..][inside.clone()].copy_from_slice(&scores[inside.clone()]);
    best.fill(f32::NEG_INFINITY);
    for from in 0..=2 * MAX_ASIDE {
        let cost = aside_cost(from, MAX_ASIDE);
        for (best, score) in best.iter_mut().zip(&padded[from..]) {
            let score = score - cost;
            *best = if score > *best { score } else { *best };
        }
    }
}

/// Position in the block before from which the course comes to a position.
fn came_from(scores: &WindowRow, inside: &Range<usize>, at: usize) -> usize {
    let near = at.saturating_sub(MAX_ASIDE).max(inside.start)..(at + MAX_ASIDE + 1).min(inside.end);
    let score = |from: usize| scores[from] - aside_cost(from, at);
    // Of equal scores the first.
    near.rev().max_by(|&a, &b| score(a).total_cmp(&score(b))).unwrap_or(at)
}

fn aside_cost(from: usize, to: usize) -> f32 {
    ASIDE_COST * to_f32(from.abs_diff(to))
}
