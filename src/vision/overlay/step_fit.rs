//! The fit of a blurred step to an overlay: a first look, and others from it on.

use super::Overlay;
use super::look::{Look, MAX_STEPS, SHADING_SD};
use super::slopes::{SlopeLimits, Slopes};
use super::step::{Extent, Flanks, LEAST_BLUR_PX, Step};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::float;
use crate::vision::blur_estimate::BlurEstimate;

/// Largest blur of a step \[px\].
const MOST_BLUR_PX: f64 = 15.0;
/// A step \[px, or blurs\] after which another would change next to nothing: each
/// squares what is left.
const CONVERGED: f64 = 8e-3;
/// Slope that shows another step beside the edge, times the blur: a twelfth of what the
/// edge itself has. The fraction of it that is enough where the edge alone leaves more than
/// noise does and such a step explains it, as beside a rib of a tenth of the contrast.
const NOTABLE: f64 = 0.032;
const WEAK_SHARE: f64 = 0.5;

impl Overlay {
    /// Looks at the edge. `noise` is the standard deviation of a pixel as a
    /// share of the step, `room` how far to look. `None` where no step can be
    /// fitted.
    #[inline(always)]
    pub fn look(&self, table: &StepTable, noise: f64, room: Extent) -> Option<Look> {
        let slopes = Slopes::of(self);
        let (slope, at) = slopes.steepest(room)?;
        let blur = (0.2 / slope).clamp(0.5, MOST_BLUR_PX);
        let step = Step { at, blur, before: 0.0, after: 1.0 };
        let whole_room = room;
        let (room, flanks) = self.up_to_neighbours(&slopes, step, noise, NOTABLE, room);
        let look = Look {
            step,
            blur_sd: f64::INFINITY,
            shading: [0.0; 2],
            pixel_noise: noise,
            noise,
            residual: noise,
            phases: float(self.means().count()),
            room,
            flanks: Flanks::default(),
            doubt: 0.0,
        };
        let look = self.fit(table, look, None)?;
        let flanks = flanks.near(&look.step);
        if flanks.any() {
            let start = Look { flanks, ..look };
            return Some(self.fit_flanks(table, &start, None).unwrap_or(look));
        }
        if !look.is_strange() {
            return Some(look);
        }
        // A weaker step beside it, if that explains what is left.
        let weaker = WEAK_SHARE * NOTABLE;
        let (_, flanks) = self.up_to_neighbours(&slopes, step, noise, weaker, whole_room);
        let start = Look { flanks: flanks.near(&look.step), ..look };
        let found = start.flanks.any().then(|| self.fit_flanks(table, &start, None)).flatten();
        Some(found.filter(|found| !found.is_strange()).unwrap_or(look))
    }

    /// Fits the edge of a look with another shape of the blur.
    pub fn fit_again(&self, table: &StepTable, look: &Look) -> Option<Look> {
        self.fit_from(table, look, None)
    }

    /// Fits the edge again with what is known of its blur.
    #[inline(always)]
    pub(super) fn fit_known(
        &self,
        table: &StepTable,
        look: &Look,
        blur: BlurEstimate,
    ) -> Option<Look> {
        let fitted = self.fit_from(table, look, Some(blur));
        if fitted.is_some() || !look.flanks.any() {
            return fitted;
        }
        self.fit(table, look.without_flanks(), Some(blur))
    }

    /// Fits the edge of a look and the steps beside it.
    #[inline(always)]
    fn fit_from(
        &self,
        table: &StepTable,
        look: &Look,
        known: Option<BlurEstimate>,
    ) -> Option<Look> {
        if look.flanks.any() {
            return self.fit_flanks(table, look, known);
        }
        self.fit(table, *look, known)
    }

    /// Cuts the room off half-way to a neighbouring step: where the slope has
    /// fallen off and rises again, in either direction. Tells the steps too,
    /// roughly.
    #[inline(always)]
    fn up_to_neighbours(
        &self,
        slopes: &Slopes,
        start: Step,
        noise: f64,
        notable: f64,
        room: Extent,
    ) -> (Extent, Flanks) {
        let limits = SlopeLimits { noise: noise / (2.0 * self.used().max(1.0)).sqrt(), notable };
        let (before, flank_before) = slopes.up_to_neighbour(start, limits, -1, room.before);
        let (after, flank_after) = slopes.up_to_neighbour(start, limits, 1, room.after);
        (Extent { before, after }, Flanks([flank_before, flank_after]))
    }

    /// Fits place, blur, levels and a little shading about the edge.
    #[inline(always)]
    fn fit(&self, table: &StepTable, start: Look, known: Option<BlurEstimate>) -> Option<Look> {
        let mut look = start;
        let mut last = None;
        let hold = |sd: f64| (start.noise / sd).powi(2);
        // Shading is held near none, because over a short way it could pass
        // for a shift of the edge.
        let of_shading = (start.pixel_noise / SHADING_SD).powi(2);
        for _ in 0..MAX_STEPS {
            let step = look.step;
            let linear = self.linearise(table, &look);
            let mut normal = linear.normal();
            normal.hold(4, of_shading, -look.shading[0]);
            normal.hold(5, of_shading, -look.shading[1]);
            if let Some(BlurEstimate { px, sd_px }) = known {
                normal.hold(1, hold(sd_px), px - step.blur);
            }
            let solved = normal.solve()?;
            let moved = solved.unknowns;
            look.step = Step {
                at: step.at + moved[0].clamp(-step.blur, step.blur),
                blur: (step.blur + moved[1].clamp(-0.5 * step.blur, 0.5 * step.blur))
                    .clamp(LEAST_BLUR_PX, MOST_BLUR_PX),
                before: step.before + moved[2],
                after: step.after + moved[3],
            };
            look.shading[0] += moved[4];
            look.shading[1] += moved[5];
            last = Some((linear, solved));
            if moved[0].abs() < CONVERGED && moved[1].abs() < CONVERGED * step.blur {
                break;
            }
        }
        let (linear, solved) = last?;
        // What the model leaves is noise, if not of the pixels.
        look.noise = start.pixel_noise.max(linear.mean_square().sqrt());
        look.residual = start.pixel_noise;
        if look.noise > start.pixel_noise {
            let within_phases = linear.within_phases_after(&solved.unknowns);
            look.residual = start.pixel_noise.max(within_phases.sqrt());
        }
        look.blur_sd = look.noise * solved.variance(1).max(0.0).sqrt();
        let inside = look.step.at > -look.room.before && look.step.at < look.room.after;
        (inside && look.step.after - look.step.before > 0.1).then_some(look)
    }
}
