//! Limits of the pattern of the ground beside which edges are measured, and the variance that
//! texture adds.

use crate::vision::coarse::LinePair;
use crate::vision::reject::{Checked, Reject};
use crate::vision::rough::RoughFit;

/// Strongest pattern beside the bead, as a fraction of the contrast. Measured:
/// reference/accuracy.md, Drawn frames: patterns of up to a third (`ground-texture-weak`) are
/// measured, of stronger ones (`ground-texture-strong`) parts are taken for the bead.
pub(super) const MAX_PATTERN: f64 = 0.37;
/// Strongest pattern where edges were located line by line. Measured: reference/accuracy.md, Drawn
/// frames (`ground-texture-weak`): widths beside a pattern of 0.25 and 0.31 were 53 and 22 px off.
/// A real strand has up to 0.2, real printed lines up to 0.24.
pub(super) const MAX_PATTERN_LINE_BY_LINE: f64 = 0.25;
/// Strongest pattern where no mean profile shows the edges of a textured bead. Beside beads of real
/// concrete other beads and grooves have up to 0.464.
const MAX_PATTERN_BESIDE_TEXTURED: f64 = 0.48;
/// Strongest such pattern beside a plain bead, where it is neither another bead nor a groove.
const MAX_PATTERN_BESIDE_PLAIN: f64 = 0.2;
/// Strongest pattern where the blurred steps of a plain bead show all along it: beside stronger
/// drawn patterns, one in fifty was off by five standard deviations. A real strand has up to 0.2.
pub(super) const MAX_PATTERN_BESIDE_COMPLETE: f64 = 0.25;
/// Blur of a mean profile up to which texture and pattern explain its variance \[px\]. Drawn beads
/// with a blur of 1.5 px and texture on them fitted more in one of three frames, and were off by
/// more, the larger it was: a z of 1.15, 1.3 and 1.4 where 2, 2.5 and 3 px fitted best, for
/// positions where the bead is dark pass for a flank.
const REFERENCE_BLUR_PX: f64 = 1.5;

/// Refuses a bead whose ground has a pattern, a fraction of the contrast, and whose mean
/// profile shows no edges: parts of the pattern look like bead, and like grooves.
pub fn check_pattern(got: f64, is_textured: bool) -> Checked {
    let limit = if is_textured { MAX_PATTERN_BESIDE_TEXTURED } else { MAX_PATTERN_BESIDE_PLAIN };
    if got > limit { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
}

/// Factor of the variance of a textured bead's edge by its blur \[px\].
pub fn blur_inflation(blur_px: f64) -> f64 {
    (blur_px / REFERENCE_BLUR_PX).max(1.0)
}

/// Inflates the variance of a textured bead's rough edges: without a groove beside it, dark
/// positions of the bead pass for a part of a flank that is too wide.
pub fn with_texture_variance(pair: &LinePair, fits: [RoughFit; 2]) -> [RoughFit; 2] {
    if pair.has_groove() {
        return fits;
    }
    fits.map(|fit| RoughFit { variance: fit.variance * blur_inflation(fit.blur_px), ..fit })
}
