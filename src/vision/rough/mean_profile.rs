//! The mean profile across an edge: what of it is bead, ground or a groove.

use crate::numeric::number::{round_to_count, to_f32};

/// Pixels outside that are searched for the bead's surroundings: a groove's darkest position or the
/// ground.
pub const OUTSIDE_PX: usize = 20;
/// First and last pixel inside whose mean is the bead's level: beyond the flank,
/// and near enough to have the light of the edge.
const INSIDE_PX: (f32, f32) = (6.0, 30.0);
/// Fraction of the width within which these lie.
const INSIDE_FRACTION: (f32, f32) = (0.14, 0.42);
/// Pixels of a course's profile.
pub const PROFILE_PX: usize = OUTSIDE_PX + 30;
/// Fraction of the step within which a position outside is as dark as the darkest.
const SAME_LEVEL_FRACTION: f32 = 0.1;
/// Fewest such positions in a row that are ground; fewer are a groove.
pub const MIN_GROUND_PX: usize = 8;
/// Blocks whose mean is one sample of how much darker a groove is than what lies beyond it, and by
/// how many standard errors it must be darker where it is shallow and where it is deep: a pattern
/// of the ground has some ten positions, one of which is three darker by chance.
const SAMPLE_BLOCKS: usize = 4;
const DARKER_SIGMAS: (f32, f32) = (4.0, 2.5);
/// Difference that makes it deep, as a fraction of the step to the bead.
const MIN_DEEP_FRACTION: f32 = 0.4;
/// Distance from the darkest position from which on what lies beyond is read \[px\].
const BEYOND_GROOVE_PX: usize = 6;
/// Ground beside the edge whose mean is its level, where it has a pattern \[px\].
const NEAR_GROUND_PX: usize = 16;
/// Positions of the ground that the flank may reach into.
const FLANK_FOOT_PX: usize = 3;
/// Smallest height of a groove's far side, as a fraction of the near one.
const MIN_FAR_SIDE: f32 = 0.3;
/// Length of a groove's floor, in distances from its darkest position to the bead, at
/// which it certainly is filled by blur, and from which on it certainly is not: a
/// box of four and five times the blur's standard deviation (0.87 and 1.01).
const FILLED_FLOOR_RATIO: (f32, f32) = (0.87, 1.0);
/// Height of a groove's far side, as a fraction of the near one, from which on its depth may be
/// hidden, and at which it certainly may: a darker line beside plain ground is a shadow, or comes
/// from the lens or a compression.
const ENCLOSED_FAR_SIDE: (f32, f32) = (0.4, 0.6);

/// The mean profile across an edge, from [`OUTSIDE_PX`] pixels before it on.
pub type BlockProfile = [f32; PROFILE_PX];

/// The profile of the whole edge and what is read from it.
#[derive(Debug, Clone, Copy)]
pub struct MeanProfile {
    /// Grey levels.
    pub grey: [f32; PROFILE_PX],
    /// Positions whose mean is the level inside.
    pub inside: (usize, usize),
    /// Positions whose mean is the level outside.
    pub outside: (usize, usize),
    /// Whether what lies outside is as wide as ground.
    pub on_ground: bool,
    /// How far it looks like a groove that is too narrow to show its depth: 0 to 1.
    pub filled: f32,
}

impl MeanProfile {
    /// Whether what lies outside becomes clearly brighter again farther out.
    pub fn is_groove(&self) -> bool {
        let bead = mean_of(&self.grey, self.inside);
        let darkest = self.grey[darkest_of(&self.grey, 0)];
        let beyond = self.grey[..self.outside.0].iter().fold(darkest, |most: f32, &v| most.max(v));
        beyond - darkest > MIN_FAR_SIDE * (bead - darkest)
    }

    /// The darkest position outside.
    pub fn darkest(&self) -> usize {
        darkest_of(&self.grey, self.outside.0)
    }

    /// Level of the bead beside the edge \[grey levels\].
    pub fn bead(&self) -> f64 {
        f64::from(mean_of(&self.grey, self.inside))
    }

    /// Standard deviation of the ground's level from position to position \[grey levels\].
    pub fn ground_spread(&self) -> f64 {
        let (from, to) = self.ground();
        let positions = &self.grey[from..to.max(from + 1)];
        let mean = mean_of(&self.grey, (from, to.max(from + 1)));
        let squares: f32 = positions.iter().map(|grey| (grey - mean).powi(2)).sum();
        f64::from(squares / to_f32(positions.len())).sqrt()
    }

    /// Level of the ground in a profile of its rows \[grey levels\].
    pub fn ground_level(&self, profile: &[f32]) -> f32 {
        mean_of(profile, self.ground())
    }

    /// Positions whose mean is the level of the ground: without those where the flank
    /// begins.
    pub fn ground(&self) -> (usize, usize) {
        (self.outside.0, self.outside.1 - FLANK_FOOT_PX)
    }
}

/// The profile of the whole edge; `None` where it does not step up.
pub fn mean_profile(blocks: &[BlockProfile], width_px: f32) -> Option<MeanProfile> {
    let mut grey = [0.0; PROFILE_PX];
    for profile in blocks {
        for k in 0..PROFILE_PX {
            grey[k] += profile[k];
        }
    }
    for value in &mut grey {
        *value /= to_f32(blocks.len());
    }
    let from = round_to_count((INSIDE_FRACTION.0 * width_px).clamp(2.0, INSIDE_PX.0));
    let to = round_to_count((INSIDE_FRACTION.1 * width_px).min(INSIDE_PX.1)).max(from + 1);
    let inside = (OUTSIDE_PX + from, (OUTSIDE_PX + to).min(PROFILE_PX));
    let bead = mean_of(&grey, inside);
    let darkest = darkest_of(&grey, 0);
    let limit = grey[darkest] + SAME_LEVEL_FRACTION * (bead - grey[darkest]);
    let mut outside = (darkest, darkest + 1);
    while outside.0 > 0 && grey[outside.0 - 1] < limit {
        outside.0 -= 1;
    }
    while outside.1 < OUTSIDE_PX && grey[outside.1] < limit {
        outside.1 += 1;
    }
    if !is_darker(blocks, darkest, bead - grey[darkest]) {
        outside = plain(&grey, bead);
    }
    let on_ground = outside.1 - outside.0 >= MIN_GROUND_PX;
    let beyond = grey[..outside.0].iter().fold(grey[darkest], |most: f32, &v| most.max(v));
    let far_side = (beyond - grey[darkest]) / (bead - grey[darkest]);
    let enclosed = ((far_side - ENCLOSED_FAR_SIDE.0) / (ENCLOSED_FAR_SIDE.1 - ENCLOSED_FAR_SIDE.0))
        .clamp(0.0, 1.0);
    let filled = if on_ground { 0.0 } else { enclosed * filled(&grey, outside, bead) };
    (bead > grey[darkest]).then_some(MeanProfile { grey, inside, outside, on_ground, filled })
}

/// Whether a position is darker than what lies beyond it along the whole edge, and not only
/// by the ground's pattern.
fn is_darker(blocks: &[BlockProfile], darkest: usize, step: f32) -> bool {
    if darkest < BEYOND_GROOVE_PX + 3 {
        return false;
    }
    let before = (0, darkest.saturating_sub(BEYOND_GROOVE_PX));
    let after = (darkest + BEYOND_GROOVE_PX, OUTSIDE_PX - FLANK_FOOT_PX);
    let segments = [before, after].into_iter().filter(|(from, to)| from + 2 < *to);
    let positions: Vec<usize> = segments.flat_map(|(from, to)| from..to).collect();
    let looks = blocks.chunks(SAMPLE_BLOCKS).map(|blocks| {
        let darker = |profile: &BlockProfile| {
            let beyond: f32 = positions.iter().map(|&k| profile[k]).sum();
            beyond / to_f32(positions.len()) - profile[darkest]
        };
        blocks.iter().map(darker).sum::<f32>() / to_f32(blocks.len())
    });
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for darker in looks {
        count += 1.0;
        sum += darker;
        squares += darker * darker;
    }
    let mean = sum / count;
    let variance = (squares / count - mean * mean).max(0.0) / (count - 1.0_f32).max(1.0);
    let need = if mean > MIN_DEEP_FRACTION * step { DARKER_SIGMAS.1 } else { DARKER_SIGMAS.0 };
    mean > need * variance.sqrt()
}

/// Positions of the ground, where it has a pattern.
fn plain(grey: &BlockProfile, bead: f32) -> (usize, usize) {
    let ground = mean_of(grey, (0, OUTSIDE_PX / 2));
    let limit = ground + SAME_LEVEL_FRACTION * (bead - ground);
    let foot = (1..=OUTSIDE_PX).rev().find(|&k| grey[k - 1] < limit).unwrap_or(OUTSIDE_PX);
    (foot.saturating_sub(NEAR_GROUND_PX), foot.max(1))
}

/// How far a groove looks too narrow to show its depth, from the length of its floor
/// against its width.
fn filled(grey: &BlockProfile, floor: (usize, usize), bead: f32) -> f32 {
    let darkest = darkest_of(grey, floor.0);
    let depth = bead - grey[darkest];
    let limit = grey[darkest] + SAME_LEVEL_FRACTION * depth;
    // Where the limit lies between a position of the floor and the next one.
    let part = |within: usize, beyond: usize| {
        ((limit - grey[within]) / (grey[beyond] - grey[within])).clamp(0.0, 1.0)
    };
    let before = if floor.0 > 0 { part(floor.0, floor.0 - 1) } else { 0.0 };
    let length = to_f32(floor.1 - 1 - floor.0) + before + part(floor.1 - 1, floor.1);
    let missing = grey[darkest + 1..].iter().take(OUTSIDE_PX).map(|value| (bead - value) / depth);
    let half = 0.5 + missing.map(|missing| missing.max(0.0)).sum::<f32>();
    ((FILLED_FLOOR_RATIO.1 - length / half) / (FILLED_FLOOR_RATIO.1 - FILLED_FLOOR_RATIO.0))
        .clamp(0.0, 1.0)
}

/// Darkest position outside, from a position on.
pub fn darkest_of(profile: &[f32], from: usize) -> usize {
    let mut darkest = from.min(OUTSIDE_PX);
    for position in darkest + 1..=OUTSIDE_PX {
        if profile[position] < profile[darkest] {
            darkest = position;
        }
    }
    darkest
}

fn mean_of(profile: &[f32], (from, to): (usize, usize)) -> f32 {
    profile[from..to].iter().sum::<f32>() / to_f32(to - from)
}
