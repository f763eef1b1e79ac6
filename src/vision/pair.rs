//! Which steps belong together: the chain of edge pairs that runs along the
//! bead, found by dynamic programming. Neighbours agree, polarity and width
//! are those of the cell; a caliper line without a fitting pair is skipped.

use super::edge::{Candidate, Candidates};

/// Pairs that are looked at a band.
const PAIRS: usize = 12;
/// Bands that a chain may jump over at once.
const MAX_SKIP: usize = 4;
/// Cost of a band without a pair, in typical pairs.
const SKIP_COST: f32 = 0.35;
/// Cost beyond which two pairs are not neighbours.
const BREAK_COST: f32 = 2.0;
/// Depth of a valley between two edges, as a share of their step, that shows
/// them to belong to two beads.
const VALLEY_SHARE: f32 = 0.5;
/// Slope against the gauge's axis up to which edges run freely; a bead that
/// slants 20 degrees and bulges by another 15 stays below.
const FREE_SLOPE: f32 = 0.7;

/// Two edges of a band.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pair {
    /// Position of the left edge \[px\].
    pub left: f32,
    /// Position of the right edge \[px\].
    pub right: f32,
    /// Geometric mean of the two steps \[grey levels\].
    pub step: f32,
}

/// What pairs are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Whether the bead is the brighter.
    pub bright: bool,
    /// Narrowest and widest pair \[px\].
    pub width_px: (f32, f32),
    /// Height of a band \[px\].
    pub band_px: f32,
}

#[derive(Debug, Clone, Copy, Default)]
struct Node {
    pair: Pair,
    score: f32,
    from: Option<(usize, usize)>,
}

/// Finds chains; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Chain {
    nodes: Vec<[Node; PAIRS]>,
    counts: Vec<usize>,
    steps: Vec<f32>,
    found: Vec<Option<Pair>>,
    score: f32,
}

impl Chain {
    /// The pair of each band, or none where the chain skips it.
    pub fn pairs(&self) -> &[Option<Pair>] {
        &self.found
    }

    /// Share of the bands that have a pair.
    #[expect(clippy::cast_precision_loss, reason = "a share needs no more")]
    pub fn share(&self) -> f64 {
        let with = self.found.iter().filter(|pair| pair.is_some()).count();
        if self.found.is_empty() { 0.0 } else { with as f64 / self.found.len() as f64 }
    }

    /// How good the chain is, in grey levels gathered; comparable between
    /// searches on the same frame.
    pub fn score(&self) -> f32 {
        self.score
    }

    /// Looks for the best chain along the bands.
    pub fn search(&mut self, bands: &[Candidates], search: &Search) {
        self.collect(bands, search);
        let typical = self.typical_step();
        self.found.clear();
        self.found.resize(bands.len(), None);
        self.score = 0.0;
        if typical <= 0.0 {
            return;
        }
        let best = self.link(search, typical);
        self.score = best.map_or(0.0, |(band, index)| self.nodes[band][index].score) * typical;
        let mut at = best;
        while let Some((band, index)) = at {
            let node = self.nodes[band][index];
            self.found[band] = Some(node.pair);
            at = node.from;
        }
    }

    fn collect(&mut self, bands: &[Candidates], search: &Search) {
        self.nodes.clear();
        self.counts.clear();
        for candidates in bands {
            let mut nodes = [Node::default(); PAIRS];
            let count = pairs_of(candidates, search, &mut nodes);
            self.nodes.push(nodes);
            self.counts.push(count);
        }
    }

    /// A strong but not extreme step: the 70th percentile of each band's best.
    fn typical_step(&mut self) -> f32 {
        self.steps.clear();
        for (nodes, &count) in self.nodes.iter().zip(&self.counts) {
            let best = nodes[..count].iter().map(|node| node.pair.step).fold(0.0, f32::max);
            if best > 0.0 {
                self.steps.push(best);
            }
        }
        if self.steps.is_empty() {
            return 0.0;
        }
        let rank = self.steps.len() * 7 / 10;
        *self.steps.select_nth_unstable_by(rank, f32::total_cmp).1
    }

    /// Fills in scores and returns the last node of the best chain.
    fn link(&mut self, search: &Search, typical: f32) -> Option<(usize, usize)> {
        let count = self.nodes.len();
        let mut best: Option<(usize, usize)> = None;
        let mut best_total = 0.0;
        for band in 0..count {
            for index in 0..self.counts[band] {
                let pair = self.nodes[band][index].pair;
                let reward = (pair.step / typical).sqrt().min(1.2);
                let (score, from) = self.best_before(band, pair, search);
                let node = &mut self.nodes[band][index];
                node.score = score + reward;
                node.from = from;
                let total = node.score - SKIP_COST * bands_between(band, count);
                if total > best_total {
                    best_total = total;
                    best = Some((band, index));
                }
            }
        }
        best
    }

    fn best_before(
        &self,
        band: usize,
        pair: Pair,
        search: &Search,
    ) -> (f32, Option<(usize, usize)>) {
        #[expect(clippy::cast_precision_loss, reason = "there are few bands")]
        let mut best = (-SKIP_COST * band as f32, None);
        for gap in 1..=(MAX_SKIP + 1).min(band) {
            let before = band - gap;
            for (index, node) in self.nodes[before][..self.counts[before]].iter().enumerate() {
                let cost = step_cost(node.pair, pair, gap, search.band_px);
                let score = node.score - cost - SKIP_COST * bands_between(before, band);
                if cost < BREAK_COST && score > best.0 {
                    best = (score, Some((before, index)));
                }
            }
        }
        best
    }
}

#[expect(clippy::cast_precision_loss, reason = "there are few bands")]
fn bands_between(first: usize, second: usize) -> f32 {
    (second - first - 1) as f32
}

/// Cost of two pairs being neighbours, `gap` bands apart.
fn step_cost(before: Pair, after: Pair, gap: usize, band_px: f32) -> f32 {
    #[expect(clippy::cast_precision_loss, reason = "a gap is a few bands")]
    let free = FREE_SLOPE * band_px * gap as f32 + 1.0;
    let of = |moved: f32| {
        let moved = moved.abs();
        let beyond = (moved - free).max(0.0) / 2.0;
        0.05 * moved.min(free) / free + beyond * beyond
    };
    of(after.left - before.left) + of(after.right - before.right)
}

/// The strongest pairs of a band that have the right polarity and width and
/// no gap as deep as themselves between their edges.
fn pairs_of(candidates: &Candidates, search: &Search, nodes: &mut [Node; PAIRS]) -> usize {
    let (lefts, rights) = if search.bright {
        (candidates.up(), candidates.down())
    } else {
        (candidates.down(), candidates.up())
    };
    let mut count = 0;
    for left in lefts {
        for right in rights {
            let width = right.at - left.at;
            if width < search.width_px.0 || width > search.width_px.1 {
                continue;
            }
            let pair =
                Pair { left: left.at, right: right.at, step: (left.step * right.step).sqrt() };
            if valley(lefts, rights, pair) > VALLEY_SHARE * pair.step {
                continue;
            }
            keep(nodes, &mut count, pair);
        }
    }
    count
}

/// Depth of the deepest valley between a pair's edges: a step out of the bead
/// followed by one back in.
fn valley(lefts: &[Candidate], rights: &[Candidate], pair: Pair) -> f32 {
    let mut deepest: f32 = 0.0;
    for out in rights.iter().filter(|out| out.at > pair.left && out.at < pair.right - 1.0) {
        for back in lefts.iter().filter(|back| back.at > out.at && back.at < pair.right) {
            deepest = deepest.max(out.step.min(back.step));
        }
    }
    deepest
}

fn keep(nodes: &mut [Node; PAIRS], count: &mut usize, pair: Pair) {
    let node = Node { pair, ..Node::default() };
    if *count < PAIRS {
        nodes[*count] = node;
        *count += 1;
        return;
    }
    let mut weakest = 0;
    for (index, kept) in nodes.iter().enumerate() {
        if kept.pair.step < nodes[weakest].pair.step {
            weakest = index;
        }
    }
    if nodes[weakest].pair.step < pair.step {
        nodes[weakest] = node;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::edge::respond;

    /// A profile of bright bars on dark ground.
    fn bars(bars: &[(usize, usize, u16)]) -> Candidates {
        let mut profile = vec![160; 200];
        for &(from, to, height) in bars {
            for value in &mut profile[from..to] {
                *value += 4 * height;
            }
        }
        let mut response = vec![0; 200];
        respond(&profile, &mut response);
        Candidates::find(&response, 5.0, 0.0625)
    }

    const BRIGHT: Search = Search { bright: true, width_px: (10.0, 80.0), band_px: 4.0 };

    #[test]
    fn the_chain_follows_the_bead_and_skips_what_is_hidden() {
        let bands: Vec<Candidates> = (0..20)
            .map(|k| if k == 7 || k == 8 { bars(&[]) } else { bars(&[(60 + k, 100 + k, 80)]) })
            .collect();
        let mut chain = Chain::default();
        chain.search(&bands, &BRIGHT);
        assert_eq!(chain.pairs().iter().filter(|pair| pair.is_none()).count(), 2);
        assert!(chain.pairs()[7].is_none() && chain.pairs()[8].is_none());
        let last = chain.pairs()[19].unwrap();
        assert!((last.right - last.left - 40.0).abs() < 0.5);
    }

    #[test]
    fn a_bright_spark_on_a_few_bands_does_not_lead_astray() {
        let bands: Vec<Candidates> = (0..20)
            .map(|k| {
                if k % 5 == 0 {
                    bars(&[(60, 100, 60), (130, 150, 160)])
                } else {
                    bars(&[(60, 100, 60)])
                }
            })
            .collect();
        let mut chain = Chain::default();
        chain.search(&bands, &BRIGHT);
        assert!(chain.pairs().iter().flatten().all(|pair| (pair.left - 59.5).abs() < 1.0));
    }

    #[test]
    fn the_gap_between_two_beads_is_not_bridged() {
        let bands = vec![bars(&[(50, 75, 80), (85, 110, 80)]); 20];
        let mut chain = Chain::default();
        chain.search(&bands, &BRIGHT);
        let pair = chain.pairs()[3].unwrap();
        assert!((pair.right - pair.left - 25.0).abs() < 0.5);
    }

    #[test]
    fn polarity_and_width_are_heeded() {
        let bands = vec![bars(&[(60, 100, 80)]); 20];
        let mut chain = Chain::default();
        chain.search(&bands, &Search { bright: false, ..BRIGHT });
        assert_eq!(chain.share(), 0.0);
        chain.search(&bands, &Search { width_px: (50.0, 90.0), ..BRIGHT });
        assert_eq!(chain.share(), 0.0);
    }
}
