//! A groove beside the bead: where the bead begins, from the shape of the whole dark line.
//! A groove that is not much wider than the blur does not show how dark it is; what is
//! known of other grooves then says how wide it is.

use super::levels::{LENGTH, MeanProfile, OUTSIDE};
use crate::vision::normal::Normal;
use crate::vision::number::float;

/// Grey of a groove as a fraction of the bead's, and its standard deviation: grooves of
/// real concrete that are wide enough to show it have 1 to 74 beside beads of 131.
const GREY: f64 = 0.13;
const GREY_SIGMA: f64 = 0.12;
/// Places beyond the groove's darkest one, and within the bead, that are fitted \[px\].
const BEYOND_PX: usize = 9;
const WITHIN_PX: usize = 7;
/// Standard deviation of a mean profile about the model, as a fraction of the bead's
/// level: light and texture that the mean over the gauge leaves.
const MISFIT: f64 = 0.01;
/// Rounds of the fit, and the change of position at which it ends \[px\].
const ROUNDS: usize = 20;
const CONVERGED_PX: f64 = 1e-3;
/// Largest change of position, width and blur in a round \[px\].
const STEP_PX: f64 = 1.0;
/// Largest mean square of the misfit, largest blur \[px\] and largest width \[px\] of a
/// groove that is a blurred box: torn edges leave a wider flank, and a wider groove shows
/// how dark it is.
const MAX_MISFIT: f64 = 0.5;
const MAX_BLUR_PX: f64 = 2.6;
const MAX_WIDTH_PX: f64 = 9.0;
/// Ranges of width and blur \[px\].
const WIDTH_PX: (f64, f64) = (0.5, 30.0);
const BLUR_PX: (f64, f64) = (0.6, 6.0);

/// Where a bead beside a groove begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Groove {
    /// Position in the mean profile \[px\].
    pub at: f64,
    /// Its variance \[px²\].
    pub variance: f64,
    /// Width of the groove \[px\].
    pub width_px: f64,
}

/// A dark line between two levels, blurred.
#[derive(Debug, Clone, Copy)]
struct Model {
    /// Where the bead begins \[px\].
    at: f64,
    width: f64,
    blur: f64,
    /// Grey levels beyond the groove, in it, and of the bead.
    beyond: f64,
    grey: f64,
    bead: f64,
}

impl Model {
    /// Value at a place, and its derivatives by position, width, blur, level beyond and
    /// level in the groove.
    fn value(&self, place: f64) -> (f64, [f64; 5]) {
        let near = Edge::of(place - self.at, self.blur);
        let far = Edge::of(place - self.at + self.width, self.blur);
        let (up, down) = (self.bead - self.grey, self.beyond - self.grey);
        let value = self.beyond - down * far.share + up * near.share;
        let row = [
            down * far.slope - up * near.slope,
            -down * far.slope,
            -down * far.by_blur + up * near.by_blur,
            1.0 - far.share,
            far.share - near.share,
        ];
        (value, row)
    }
}

/// A blurred step from 0 to 1.
struct Edge {
    share: f64,
    slope: f64,
    by_blur: f64,
}

impl Edge {
    fn of(off: f64, blur: f64) -> Self {
        let u = off / blur;
        let share = 0.5 * libm::erfc(-u * std::f64::consts::FRAC_1_SQRT_2);
        let slope = libm::exp(-0.5 * u * u) / (blur * (2.0 * std::f64::consts::PI).sqrt());
        Self { share, slope, by_blur: -u * slope }
    }
}

/// Fits a groove to the mean profile across an edge. `None` where the bead is not
/// brighter than black, or no groove fits.
pub fn fit(mean: &MeanProfile) -> Option<Groove> {
    let bead = mean.bead();
    if bead <= 0.0 {
        return None;
    }
    let darkest = usize::midpoint(mean.outside.0, mean.outside.1);
    let (from, to) = (darkest.saturating_sub(BEYOND_PX), (OUTSIDE + WITHIN_PX).min(LENGTH));
    let prior = GREY * bead;
    let missing: f64 = (darkest..to).map(|k| bead - f64::from(mean.grey[k])).sum();
    let beyond = mean.grey[from..=darkest].iter().fold(0.0, |most: f32, &v| most.max(v));
    let mut model = Model {
        at: float(OUTSIDE),
        width: (2.0 * missing / (bead - prior)).clamp(1.0, 0.5 * WIDTH_PX.1),
        blur: 1.7,
        beyond: f64::from(beyond),
        grey: prior,
        bead,
    };
    let weight = (MISFIT * bead).powi(-2);
    let round = |model: &Model| {
        let mut normal = Normal::<5>::default();
        let mut squares = 0.0;
        for k in from..to {
            let (value, row) = model.value(float(k));
            let miss = f64::from(mean.grey[k]) - value;
            squares += weight * miss * miss;
            normal.add(row, miss, weight);
        }
        normal.hold(4, (GREY_SIGMA * bead).powi(-2), prior - model.grey);
        normal.hold(2, 1.0, 1.8 - model.blur);
        Some((normal.solve()?, squares))
    };
    let mut found = None;
    for _ in 0..ROUNDS {
        let (solved, squares) = round(&model)?;
        let step = solved.unknowns;
        model.at += step[0].clamp(-STEP_PX, STEP_PX);
        model.width =
            (model.width + step[1].clamp(-STEP_PX, STEP_PX)).clamp(WIDTH_PX.0, WIDTH_PX.1);
        model.blur = (model.blur + step[2].clamp(-STEP_PX, STEP_PX)).clamp(BLUR_PX.0, BLUR_PX.1);
        model.beyond += step[3];
        model.grey = (model.grey + step[4]).clamp(0.0, bead);
        let freedom = float(to - from - 5);
        let variance = solved.variance(0) * (squares / freedom).max(1.0);
        let is_box = squares < MAX_MISFIT * freedom
            && model.blur < MAX_BLUR_PX
            && model.width < MAX_WIDTH_PX;
        if step[0].abs() < CONVERGED_PX && is_box {
            found = Some(Groove { at: model.at, variance, width_px: model.width });
            break;
        }
    }
    found
}
