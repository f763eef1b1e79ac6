//! The shape of an edge, from its overlay: place, blur and levels, how far its
//! surroundings on either side are plain, and how they are shaded.

use super::flank::Flank;
pub(super) use super::flank::Flanks;
use super::slopes::Slopes;
use super::{Overlay, REACH, ROUNDING};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::float;
use crate::vision::line::Line;

pub const LEAST_BLUR_PX: f64 = 0.3;
const MOST_BLUR_PX: f64 = 15.0;
pub const MAX_STEPS: usize = 16;
/// A step \[px, or blurs\] after which another would change next to nothing: each
/// squares what is left.
const CONVERGED: f64 = 8e-3;
/// How far from the edge samples are fitted, in blurs and pixels beside.
const FIT_BLURS: f64 = 4.5;
const FIT_BESIDE_PX: f64 = 2.0;
/// Slope that shows another step beside the edge, times the blur: a twelfth of what the
/// edge itself has. The fraction of it that is enough where the edge alone leaves more than
/// noise does and such a step explains it, as beside a rib of a tenth of the contrast; and
/// the misfit from which on it is more than noise.
const NOTABLE: f64 = 0.032;
const WEAK_SHARE: f64 = 0.5;
const STRANGE: f64 = 1.3;
/// Shading that is usual close to an edge, as a standard deviation \[1/px\].
pub const SHADING_SD: f64 = 0.02;

/// Samples that are free of anything but this edge, on either side \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Towards smaller places.
    pub before: f64,
    /// Towards larger ones.
    pub after: f64,
}

/// A blurred step, its levels in shares of the step that was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// How far it lies from the path \[px\].
    pub at: f64,
    /// Blur as the standard deviation of a Gaussian \[px\], integration over
    /// pixels included.
    pub blur: f64,
    /// Level before it.
    pub before: f64,
    /// Level after it.
    pub after: f64,
}

/// A first look at an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The step.
    pub step: Step,
    /// Standard deviation of its blur \[px\].
    pub blur_sd: f64,
    /// Change of the level before and after it \[1/px away from it\].
    pub(super) shading: [f64; 2],
    /// Standard deviation of a pixel, in shares of the step.
    pub(super) pixel_noise: f64,
    /// Standard deviation of a row's samples about the step before the fit's last move, in
    /// shares of it.
    pub(super) noise: f64,
    /// The same after it, where each phase has a place and levels of its own.
    pub(super) residual: f64,
    /// Number of the phases that have rows.
    phases: f64,
    /// How far there is nothing but this edge.
    pub room: Extent,
    /// Steps beside it that reach into its pixels.
    pub(super) flanks: Flanks,
    /// What they and the blur add to the variance of its place \[px²\]; 0 where
    /// there are none.
    pub(super) doubt: f64,
}

impl Look {
    /// Samples beside the edge on either side: distances of the nearest and the
    /// farthest \[px\].
    pub fn beside(&self) -> [(usize, usize); 2] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the window"
        )]
        let whole = |distance: f64| distance.max(0.0) as usize;
        let near = 3.0 * self.step.blur + 1.0;
        let to = |room: f64| whole(room).min(REACH);
        [
            (whole((near - self.step.at).ceil()), to(self.room.before)),
            (whole((near + self.step.at).ceil()), to(self.room.after)),
        ]
    }

    /// Standard deviation of a sample, in shares of the step.
    pub fn pixel_noise(&self) -> f64 {
        self.pixel_noise
    }

    /// Blur and its standard deviation \[px\].
    pub fn blur(&self) -> (f64, f64) {
        (self.step.blur, self.blur_sd)
    }

    /// Mean square of the residuals about the edge, in variances of their noise: at
    /// least 1. Each phase has a place and levels of its own, so that they are those of the
    /// step's shape.
    pub fn misfit(&self) -> f64 {
        (self.residual / self.pixel_noise).powi(2)
    }

    /// Whether the step leaves more than noise does.
    pub fn is_strange(&self) -> bool {
        self.misfit() >= STRANGE
    }

    /// The misfit of one place and levels for all phases.
    pub fn misfit_of_all(&self) -> f64 {
        (self.noise / self.pixel_noise).powi(2)
    }

    /// Number of samples about the edge that the misfit is the mean of.
    pub fn samples(&self) -> f64 {
        let reach = FIT_BLURS * self.step.blur + FIT_BESIDE_PX;
        let Extent { before, after } = self.room;
        self.phases * (reach.min(before) + reach.min(after))
    }

    /// Ends of the samples about the edge that are fitted \[px from the path\].
    #[inline(always)]
    pub(super) fn fitted(&self) -> (f64, f64) {
        let reach = FIT_BLURS * self.step.blur + FIT_BESIDE_PX;
        let from = (self.step.at - reach.min(self.room.before)).max(-place_limit());
        let to = (self.step.at + reach.min(self.room.after)).min(place_limit());
        (from, to)
    }

    /// Derivatives of the level at a distance from the path for the step's place
    /// and blur, its two levels and the two shadings, and the level itself,
    /// without flanks.
    #[inline(always)]
    pub(super) fn linear_at(&self, table: &StepTable, at: f64) -> ([f64; 6], f64) {
        let Self { step: edge, shading, .. } = self;
        let per_blur = 1.0 / edge.blur;
        let z = (at - edge.at) * per_blur;
        let (step, density, slopes) = table.with_slopes(z);
        let depth = slopes.map(|level| level * edge.blur);
        let slope = (edge.after - edge.before) * density * per_blur;
        let level = edge.before * (1.0 - step)
            + edge.after * step
            + shading[0] * depth[0]
            + shading[1] * depth[1];
        ([-slope, -slope * z, 1.0 - step, step, depth[0], depth[1]], level)
    }

    /// The same look up to half-way to the steps beside the edge.
    fn without_flanks(&self) -> Self {
        let half = |flank: &Option<Flank>, room: f64| {
            flank.as_ref().map_or(room, |flank| 0.5 * (flank.at - self.step.at).abs())
        };
        let Flanks([before, after]) = &self.flanks;
        let room =
            Extent { before: half(before, self.room.before), after: half(after, self.room.after) };
        Self { room, flanks: Flanks::default(), doubt: 0.0, ..*self }
    }

    /// The same look where texture makes samples less sure than noise does:
    /// `noise` is what independent ones as unsure would have.
    pub fn in_texture(self, noise: f64) -> Self {
        let blur_sd = self.blur_sd * (noise / self.noise).max(1.0);
        Self {
            blur_sd,
            pixel_noise: noise,
            noise: noise.max(self.noise),
            residual: noise.max(self.residual),
            ..self
        }
    }
}

/// How the level beside an edge changes away from it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shading {
    /// Change at the edge \[1/px\].
    pub slope: f64,
    /// Half the change of that \[1/px²\].
    pub bend: f64,
}

impl Shading {
    /// The same in shares of a step of which the given one is a share.
    pub fn of(self, share: f64) -> Self {
        Self { slope: self.slope / share, bend: self.bend / share }
    }
}

/// One side of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beside {
    /// How far there is nothing else \[px\].
    pub extent: f64,
    /// How its level changes, in shares of the step that was given.
    pub shading: Shading,
    /// Variance that the doubt about it leaves to the level at the edge.
    pub doubt: f64,
}

/// An edge as the overlay shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// The step.
    pub step: Step,
    /// How far the surroundings are plain, and what is used of them.
    pub extent: Extent,
    /// How the level changes away from the edge, before it and after it, in
    /// shares of the step.
    pub shading: [Shading; 2],
    /// Steps beside the edge that reach into its pixels, in shares of its own.
    pub flanks: Flanks,
    /// Variance of the edge's position that doubt about the shading and about
    /// flanks leaves \[px²\].
    pub variance: f64,
}

impl Shape {
    /// Whether there is more beside the edge than even slopes.
    pub fn is_bent(&self) -> bool {
        self.flanks.any() || self.shading.iter().any(|shading| shading.bend != 0.0)
    }
}

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
        let (room, flanks) = self.up_to_neighbours(&slopes, step, (noise, NOTABLE), room);
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
        let weaker = (noise, WEAK_SHARE * NOTABLE);
        let (_, flanks) = self.up_to_neighbours(&slopes, step, weaker, whole_room);
        let start = Look { flanks: flanks.near(&look.step), ..look };
        let found = start.flanks.any().then(|| self.fit_flanks(table, &start, None)).flatten();
        Some(found.filter(|found| !found.is_strange()).unwrap_or(look))
    }

    /// Fits the edge of a look with another shape of the blur.
    pub fn fit_again(&self, table: &StepTable, look: &Look) -> Option<Look> {
        if look.flanks.any() {
            return self.fit_flanks(table, look, None);
        }
        self.fit(table, *look, None)
    }

    /// How far the surroundings on one side of a known step are plain \[px\],
    /// after it or before it, their slope in shares of the step that was given
    /// \[1/px away from it\], and the variance that its doubt leaves to the
    /// level at the edge.
    pub fn beside(
        &self,
        table: &StepTable,
        look: &Look,
        step: &Step,
        after: bool,
    ) -> (f64, (f64, f64)) {
        let (sign, room) = if after { (1.0, look.room.after) } else { (-1.0, look.room.before) };
        let (extent, line) = self.plain(table, (step, &look.flanks), look.pixel_noise, sign, room);
        (extent, line.sure_slope(look.pixel_noise))
    }

    /// Reads the edge's shape from a look at it and what is known of its blur:
    /// mean and standard deviation \[px\].
    #[inline(always)]
    pub fn shape(&self, table: &StepTable, look: &Look, blur: (f64, f64)) -> Option<Shape> {
        let look = self.fit_known(table, look, blur)?;
        let Look { step, noise, room, flanks, doubt, .. } = look;
        let sharp = step.blur * step.blur - ROUNDING;
        let step = Step { blur: sharp.max(LEAST_BLUR_PX.powi(2)).sqrt(), ..step };
        let noise = (noise, look.pixel_noise);
        let before = self.one_side(table, (&step, &flanks), noise, (-1.0, room.before));
        let after = self.one_side(table, (&step, &flanks), noise, (1.0, room.after));
        // A level that is off by a share moves the edge by √π blurs times it.
        let per_level = std::f64::consts::PI * step.blur * step.blur;
        Some(Shape {
            step,
            extent: Extent { before: before.extent, after: after.extent },
            shading: [before.shading, after.shading],
            flanks,
            variance: per_level * (before.doubt + after.doubt) + doubt,
        })
    }

    /// Fits the edge again with what is known of its blur.
    #[inline(always)]
    fn fit_known(&self, table: &StepTable, look: &Look, blur: (f64, f64)) -> Option<Look> {
        if !look.flanks.any() {
            return self.fit(table, *look, Some(blur));
        }
        let fitted = self.fit_flanks(table, look, Some(blur));
        fitted.or_else(|| self.fit(table, look.without_flanks(), Some(blur)))
    }

    /// Cuts the room off half-way to a neighbouring step: where the slope has
    /// fallen off and rises again, in either direction. Tells the steps too,
    /// roughly.
    #[inline(always)]
    fn up_to_neighbours(
        &self,
        slopes: &Slopes,
        start: Step,
        (noise, notable): (f64, f64),
        room: Extent,
    ) -> (Extent, Flanks) {
        let limits = (noise / (2.0 * self.used().max(1.0)).sqrt(), notable);
        let (before, flank_before) = slopes.up_to_neighbour(start, limits, (-1, room.before));
        let (after, flank_after) = slopes.up_to_neighbour(start, limits, (1, room.after));
        (Extent { before, after }, Flanks([flank_before, flank_after]))
    }

    /// Fits place, blur, levels and a little shading about the edge.
    #[inline(always)]
    fn fit(&self, table: &StepTable, start: Look, known: Option<(f64, f64)>) -> Option<Look> {
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
            if let Some((mean, sd)) = known {
                normal.hold(1, hold(sd), mean - step.blur);
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

    /// One side of the edge: along a straight line, or along a parabola where
    /// that ends early. `noise` is that of a row's samples and that of a pixel.
    #[inline(always)]
    fn one_side(
        &self,
        table: &StepTable,
        step: (&Step, &Flanks),
        (noise, pixel_noise): (f64, f64),
        (sign, room): (f64, f64),
    ) -> Beside {
        let (extent, line) = self.plain(table, step, noise, sign, room);
        if extent + 2.0 <= room
            && let Some(curved) = self.curved(table, step, noise, (sign, room))
        {
            return curved;
        }
        let (slope, doubt) = line.sure_slope(pixel_noise);
        Beside { extent, shading: Shading { slope, bend: 0.0 }, doubt }
    }

    /// Samples of two pixels beside the edge, from a distance on: how far each
    /// lies away from it, what it is beyond the level there, and its weight.
    #[inline(always)]
    pub(super) fn beside_step(
        &self,
        table: &StepTable,
        (step, flanks): (&Step, &Flanks),
        (sign, from): (f64, f64),
        mut add: impl FnMut(f64, f64, f64),
    ) {
        let height = step.after - step.before;
        let (near, far) = (step.at + sign * from, step.at + sign * (from + 2.0));
        for mean in self.means() {
            for (at, value) in mean.samples(near.min(far), near.max(far) - 1e-9) {
                let (share, _) = table.at((at - step.at) / step.blur);
                let beside = if flanks.any() { flanks.at(table, at) } else { 0.0 };
                let off = value - beside - step.before - height * share;
                add(sign * (at - step.at), off, mean.weight);
            }
        }
    }

    /// How far from the edge a side is plain, that is a straight line within
    /// what noise explains, and that line.
    #[inline(always)]
    fn plain(
        &self,
        table: &StepTable,
        (shape, flanks): (&Step, &Flanks),
        noise: f64,
        sign: f64,
        room: f64,
    ) -> (f64, Line) {
        let height = shape.after - shape.before;
        let first = 3.0 * shape.blur;
        let mut line = Line::default();
        let mut end = first.min(room);
        while end + 2.0 <= room {
            let mut block = Line::default();
            self.beside_step(table, (shape, flanks), (sign, end), |away, off, weight| {
                block.add(away, off, weight);
            });
            if block.weight <= 0.0 {
                break;
            }
            let (expected, variance) = line.at(block.middle());
            let off = block.mean() - expected;
            let doubt = noise * noise * (variance + 1.0 / block.weight);
            // The first few pixels show the slope.
            if line.shows_slope() && off.abs() > 4.0 * doubt.sqrt() + 0.006 * height {
                break;
            }
            line.join(&block);
            end += 2.0;
        }
        (end, line)
    }
}

#[expect(clippy::cast_precision_loss, reason = "the window is short")]
pub fn place_limit() -> f64 {
    REACH as f64 - 1.0
}
