//! An edge one side of which is saturated. Position, blur and the hidden level are fitted together
//! to the part of the flank below the end of the scale. Rows are then compared with that step,
//! clipped likewise.

use nalgebra::{Matrix2, Vector2};

use super::blur_estimate::BlurEstimate;
use super::censor::{self, CensoredPixel};
use super::edge_windows::{EdgeWindow, EdgeWindows};
use super::overlay::{MeanProfilePart, Overlay};
use super::pixel_noise;
use crate::numeric::blurred_step::StepTable;
use crate::numeric::normal_equations::NormalEquations;
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Parts along the bead, each with levels of its own, because the light may change along it.
const PARTS_ALONG: usize = 3;
/// Gauss–Newton steps at most; a fit that needs more does not converge.
const MAX_STEPS: usize = 30;
/// Steps after which the window is fixed: a pixel that enters and leaves at its ends keeps a fit
/// from converging.
const WINDOW_STEPS: usize = 4;
/// Smallest blur that is fitted \[px\]: a pixel alone has 1/√12 = 0.29.
const MIN_BLUR_PX: f64 = 0.3;
/// How far the hidden side is read, in blurs. Derived: beyond 3.5 blurs 2·10⁻⁴ of a step is left, 1
/// − Φ(3.5).
const CLIPPED_SIDE_BLURS: f64 = 3.5;
/// How far the visible side is read, in blurs. Derived: beyond 3 blurs 1.3·10⁻³ of a step is left,
/// 1 − Φ(3).
const VISIBLE_SIDE_BLURS: f64 = 3.0;
/// Pixels that are read beyond that on the visible side: enough to show the level, few enough for
/// its slope not to matter.
const BESIDE_PX: f64 = 12.0;
/// Standard deviation of the prior of the hidden level, about the end of the scale, in heights of
/// the visible part of the step.
const HIDDEN_LEVEL_SIGMA: f64 = 2.0;
/// Relative change of the blur from frame to frame, as a standard deviation.
const BLUR_DRIFT: f64 = 0.002;
/// Difference from the blur of earlier frames, in standard deviations, from which on the blur has
/// changed. Derived: noise alone exceeds 4 in 6 of 100,000 frames.
const BLUR_CHANGE_SIGMAS: f64 = 4.0;
/// Level of the visible side below which it does not show how the light varies \[grey levels\].
const MIN_LIGHT_GREY: f64 = 25.0;
/// Misfit of a row, relative to the median, above which the row does not count.
const MAX_MISFIT_RATIO: f64 = 2.5;
/// Residual of a pixel, in standard deviations of the noise, above which it is an outlier.
const NOISE_SIGMAS: f64 = pixel_noise::NOISE_SIGMAS as f64;
/// Distance of a row's edge from the path that makes no pixel an outlier \[px\].
const SLACK_PX: f64 = 0.5;
/// Outlying pixels that a row may have.
const MAX_WILD_PIXELS: usize = 2;

/// A step of which one level is hidden \[px, grey levels\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClippedStep {
    /// How far it lies from the path.
    pub at: f64,
    /// Blur, integration over pixels included.
    pub blur: f64,
    /// Level on the side that can be seen.
    pub visible: f64,
    /// Level on the other side.
    pub clipped: f64,
}

/// What is known of the image.
#[derive(Debug, Clone, Copy)]
pub struct ClippedScene<'a> {
    /// The blurred step.
    pub table: &'a StepTable,
    /// Whether the hidden level lies after the edge.
    pub clipped_after: bool,
    /// Noise of a pixel \[grey levels\].
    pub noise: f64,
    /// End of the scale \[grey levels\].
    pub white: f64,
    /// Distance without another edge on the visible and on the hidden side \[px\].
    pub room: [f64; 2],
    /// Change of the visible level for each pixel away from the edge
    /// \[grey levels/px\].
    pub shading: f64,
}

/// A step that was fitted to a flank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClippedStepFit {
    /// The step.
    pub step: ClippedStep,
    /// Variance of its position from the uncertainty of blur and hidden level \[px²\].
    pub variance: f64,
    /// Standard deviation of the blur \[px\].
    pub blur_sd: f64,
    /// Fraction of the step that is not hidden.
    pub visible_fraction: f64,
    /// Mean visible level of the path \[grey levels\].
    mean_visible: f64,
}

/// Edge on a caliper line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClippedLine {
    /// Distance from the path \[px\].
    pub moved: f64,
    /// Its variance \[px²\].
    pub variance: f64,
    /// Fraction of its rows that count.
    pub row_fraction: f64,
}

/// Locates edges that are clipped; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct ClippedEdge {
    profiles: Vec<MeanProfilePart>,
    rows: Vec<ClippedRow>,
    sorted: Vec<f64>,
    /// Blur of earlier frames; `None` until one is kept.
    blur: Option<BlurEstimate>,
}

/// Normal equations of a row for position and visible level.
#[derive(Debug, Clone, Copy, Default)]
struct ClippedRow {
    line: usize,
    matrix: Matrix2<f64>,
    vector: Vector2<f64>,
    squares: f64,
    pixels: f64,
    wild: usize,
}

/// Levels in a row or in a mean of rows \[grey levels\].
#[derive(Debug, Clone, Copy)]
struct ClippedLevels {
    visible: f64,
    clipped: f64,
    /// Relative light, 1 on average.
    light: f64,
}

/// A pixel as it is expected, and its derivatives by position, blur, visible and
/// hidden level.
struct ExpectedPixel {
    seen: CensoredPixel,
    by: [f64; 4],
}

impl ClippedScene<'_> {
    fn sign(&self) -> f64 {
        if self.clipped_after { 1.0 } else { -1.0 }
    }

    /// Ends of the window, as distances from the path \[px\].
    fn window(&self, step: &ClippedStep) -> (f64, f64) {
        let visible = (VISIBLE_SIDE_BLURS * step.blur + BESIDE_PX).min(self.room[0]);
        let hidden = (CLIPPED_SIDE_BLURS * step.blur).min(self.room[1]);
        if self.clipped_after {
            (step.at - visible, step.at + hidden)
        } else {
            (step.at - hidden, step.at + visible)
        }
    }

    /// Levels at a row, or a mean of rows, from those of the path before and after the edge.
    fn levels(
        &self,
        step: &ClippedStep,
        mean_visible: f64,
        [before, after]: [f64; 2],
    ) -> ClippedLevels {
        let here = if self.clipped_after { before } else { after };
        let light =
            if mean_visible > MIN_LIGHT_GREY { (here / mean_visible).clamp(0.5, 2.0) } else { 1.0 };
        let visible = step.visible + here - mean_visible;
        ClippedLevels { visible, clipped: step.clipped * light, light }
    }

    /// Pixel at a distance from the path \[px\], expected of the mean of rows whose positions
    /// spread with a variance \[px²\].
    #[inline]
    fn expect(
        &self,
        step: &ClippedStep,
        levels: &ClippedLevels,
        (distance, spread): (f64, f64),
    ) -> ExpectedPixel {
        let blur = (step.blur * step.blur + spread).sqrt();
        let z = self.sign() * (distance - step.at) / blur;
        let (fraction, density) = self.table.at(z);
        let height = levels.clipped - levels.visible;
        let depth = blur * (density - z * (1.0 - fraction));
        let level = levels.visible + height * fraction + self.shading * depth;
        let slope = height * density / blur;
        let noise = (self.noise * self.noise + slope * slope * spread).sqrt();
        let seen = censor::censored_pixel(self.table, level, noise, self.white);
        let by = [-self.sign() * slope, -slope * z, 1.0 - fraction, levels.light * fraction];
        ExpectedPixel { seen, by: by.map(|by| by * seen.sensitivity) }
    }
}

impl ClippedEdge {
    /// Fits the step to the rows of an overlay along a path. `blur` is a prior of the blur. `None`
    /// where no step can be fitted.
    pub fn fit(
        &mut self,
        scene: &ClippedScene<'_>,
        overlay: &Overlay,
        start: ClippedStep,
        blur: Option<BlurEstimate>,
    ) -> Option<ClippedStepFit> {
        overlay.profiles(PARTS_ALONG, &mut self.profiles);
        let mean_visible = self.mean_visible(scene.clipped_after);
        let mut step = start;
        let mut window = scene.window(&step);
        for k in 0..MAX_STEPS {
            if k < WINDOW_STEPS {
                window = scene.window(&step);
            }
            let (mut normal, misfit) = self.linearise(scene, window, &step, mean_visible);
            let seen = (scene.white - step.visible).max(scene.noise);
            normal.add_prior(3, (HIDDEN_LEVEL_SIGMA * seen).powi(-2), scene.white - step.clipped);
            if let Some(BlurEstimate { px, sd_px }) = blur {
                normal.add_prior(1, sd_px.powi(-2), px - step.blur);
            }
            let solved = normal.solve()?;
            let moved = solved.unknowns;
            step = ClippedStep {
                at: step.at + moved[0].clamp(-step.blur, step.blur),
                blur: (step.blur + moved[1].clamp(-0.3 * step.blur, 0.3 * step.blur))
                    .max(MIN_BLUR_PX),
                visible: step.visible + moved[2],
                clipped: (step.clipped + moved[3].clamp(-seen, seen)).max(scene.white - seen / 2.0),
            };
            let settled = moved[0].abs() < 1e-3 && moved[1].abs() < 1e-3 * step.blur;
            if settled && k >= WINDOW_STEPS {
                let covariance = solved.covariance() * misfit.max(1.0);
                return ClippedStepFit::of(scene, step, &covariance, mean_visible);
            }
        }
        None
    }

    /// Prior of the blur from earlier frames; `None` where there are none. Where the fit to this
    /// frame alone differs significantly, the difference is its standard deviation: the lens may
    /// have changed.
    pub fn expected_blur(&self, alone: &ClippedStepFit) -> Option<BlurEstimate> {
        let BlurEstimate { px, sd_px } = self.blur?;
        let (sd, off) = (sd_px.hypot(BLUR_DRIFT * px), (px - alone.step.blur).abs());
        let changed = off > BLUR_CHANGE_SIGMAS * sd.hypot(alone.blur_sd);
        Some(BlurEstimate { px, sd_px: if changed { off } else { sd } })
    }

    /// Keeps a blur for the frames to come.
    pub fn keep_blur(&mut self, found: &ClippedStepFit) {
        self.blur = Some(BlurEstimate { px: found.step.blur, sd_px: found.blur_sd });
    }

    fn mean_visible(&self, hidden_after: bool) -> f64 {
        let side = usize::from(!hidden_after);
        let (sum, rows) = self.profiles.iter().fold((0.0, 0.0), |(sum, rows), profile| {
            (sum + profile.rows * profile.levels[side], rows + profile.rows)
        });
        sum / rows
    }

    /// Normal equations about a step, and the mean squared residual in variances of the noise.
    fn linearise(
        &self,
        scene: &ClippedScene<'_>,
        (from, to): (f64, f64),
        step: &ClippedStep,
        mean_visible: f64,
    ) -> (NormalEquations<4>, f64) {
        let mut normal = NormalEquations::<4>::default();
        let (mut square, mut n) = (0.0, -4.0);
        for profile in &self.profiles {
            let levels = scene.levels(step, mean_visible, profile.levels);
            for (distance, value) in profile.samples(from, to) {
                let position = (distance, profile.spread);
                let ExpectedPixel { seen, by } = scene.expect(step, &levels, position);
                let (miss, weight) = (value - seen.level, profile.rows / seen.variance);
                normal.add(by, miss, weight);
                square += weight * miss * miss;
                n += 1.0;
            }
        }
        (normal, square / f64::max(n, 1.0))
    }

    /// Compares windows with the step where it is expected. `take` receives the number of each
    /// caliper line and its edge. Returns the median residual of a window in standard deviations of
    /// its noise.
    pub fn locate(
        &mut self,
        scene: &ClippedScene<'_>,
        sheet: &EdgeWindows,
        lines: usize,
        found: &ClippedStepFit,
        mut take: impl FnMut(usize, Option<ClippedLine>),
    ) -> f64 {
        self.rows.clear();
        for (number, window) in sheet.windows.iter().enumerate() {
            let [at, before, step] = window.expected;
            let levels = [f64::from(before), f64::from(before + step)];
            let levels = scene.levels(&found.step, found.mean_visible, levels);
            let step = ClippedStep { at: f64::from(at), ..found.step };
            let pixels = (sheet.pixels(number).as_slice(), window);
            self.rows.push(ClippedRow::read(scene, pixels, &step, &levels));
        }
        let (limit, misfit) = self.limit();
        let mut first = 0;
        for line in 0..lines {
            let rows = &self.rows[first..];
            let count = rows.iter().take_while(|row| row.line == line).count();
            take(line, solve(&rows[..count], limit));
            first += count;
        }
        misfit
    }

    /// Largest misfit of a row that counts, as a mean square, and the median misfit, both in units
    /// of the noise.
    fn limit(&mut self) -> (f64, f64) {
        self.sorted.clear();
        self.sorted.extend(self.rows.iter().map(ClippedRow::misfit));
        let middle = self.sorted.len() / 2;
        let median = rank::median(&mut self.sorted).unwrap_or(f64::INFINITY);
        let pixels = self.rows.get(middle).map_or(1.0, |row| row.pixels.max(1.0));
        let noise = 1.0 + NOISE_SIGMAS * (2.0 / pixels).sqrt();
        (noise.max(MAX_MISFIT_RATIO * median), median.sqrt())
    }
}

impl ClippedStepFit {
    fn of(
        scene: &ClippedScene<'_>,
        step: ClippedStep,
        covariance: &nalgebra::Matrix4<f64>,
        mean_visible: f64,
    ) -> Option<Self> {
        // Part of the position's variance that comes from blur and hidden level.
        let of_place = Vector2::new(covariance[(0, 1)], covariance[(0, 3)]);
        let [blur, both, hidden] = [(1, 1), (1, 3), (3, 3)].map(|of| covariance[of]);
        let of_others = Matrix2::new(blur, both, both, hidden);
        let variance = (of_place.transpose() * of_others.try_inverse()? * of_place)[0];
        let visible_fraction = (scene.white - step.visible) / (step.clipped - step.visible);
        let blur_sd = blur.sqrt();
        let found = Self { step, variance, blur_sd, visible_fraction, mean_visible };
        (variance.is_finite() && blur_sd.is_finite() && step.blur > 0.0).then_some(found)
    }
}

impl ClippedRow {
    /// Normal equations of a window's residuals for position and visible level.
    fn read(
        scene: &ClippedScene<'_>,
        (pixels, window): (&[f32], &EdgeWindow),
        step: &ClippedStep,
        levels: &ClippedLevels,
    ) -> Self {
        let (from, to) = scene.window(step);
        let mut row = Self { line: window.line, ..Self::default() };
        let count = f64::from(window.rows);
        let noise = scene.noise / count.sqrt();
        for (&pixel, position) in pixels.iter().zip(window.first..) {
            #[expect(clippy::cast_precision_loss, reason = "a position near the gauge")]
            let position = position as f64;
            if position < from || position > to {
                continue;
            }
            let ExpectedPixel { seen, by } = scene.expect(step, levels, (position, 0.0));
            let miss = f64::from(pixel) - seen.level;
            if miss.abs() > NOISE_SIGMAS * noise + SLACK_PX * by[0].abs() {
                row.wild += 1;
                continue;
            }
            let by = Vector2::new(by[0], by[2]);
            let weight = count / seen.variance;
            row.matrix += by * by.transpose() * weight;
            row.vector += by * (miss * weight);
            row.squares += miss * miss * weight;
            row.pixels += 1.0;
        }
        row
    }

    /// Mean squared residual of the row after its best shift, in variances of the noise; infinite
    /// for a row with too many outliers.
    fn misfit(&self) -> f64 {
        if self.wild > MAX_WILD_PIXELS || self.matrix[(0, 0)] <= 0.0 {
            return f64::INFINITY;
        }
        (self.squares - self.vector[0] * self.vector[0] / self.matrix[(0, 0)]) / self.pixels
    }
}

/// Position of a line from its rows; `None` where less than half of them count.
fn solve(rows: &[ClippedRow], limit: f64) -> Option<ClippedLine> {
    let counts = |row: &&ClippedRow| row.misfit() <= limit;
    let (mut matrix, mut vector, mut n) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for row in rows.iter().filter(counts) {
        matrix += row.matrix;
        vector += row.vector;
        n += 1.0;
    }
    let row_fraction = n / to_f64(rows.len());
    if row_fraction < 0.5 {
        return None;
    }
    let inverse = matrix.try_inverse()?;
    Some(ClippedLine { moved: (inverse * vector)[0], variance: inverse[(0, 0)], row_fraction })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Frame, Pixels, Roi, Size, Stamp};
    use crate::vision::edge_windows::Grouping;
    use crate::vision::gauge::{BeadAxis, GaugeView};
    use crate::vision::path::EdgeCorrection;
    use crate::vision::row_range::RowRange;
    use crate::vision::strip::{GaugeRowsOfDepth, RowLayout};

    const SIZE: (usize, usize) = (120, 40);
    const LINES: [RowRange; 4] =
        [RowRange::new(0, 10), RowRange::new(10, 20), RowRange::new(20, 30), RowRange::new(30, 40)];

    /// A path that lies off the edge, with the levels that a glance gives.
    struct Straight {
        at: f32,
        levels: [f32; 2],
    }

    impl Straight {
        fn expected(&self) -> [f32; 3] {
            [self.at, self.levels[0], self.levels[1] - self.levels[0]]
        }
    }

    fn scene(table: &StepTable, hidden_after: bool) -> ClippedScene<'_> {
        ClippedScene {
            table,
            clipped_after: hidden_after,
            noise: 4.0,
            white: 255.0,
            room: [30.0; 2],
            shading: 0.0,
        }
    }

    /// The mean of what a camera with noise shows of a step, in fine levels.
    fn sheet(scene: &ClippedScene<'_>, step: &ClippedStep, path: &Straight) -> EdgeWindows {
        let levels = ClippedLevels { visible: step.visible, clipped: step.clipped, light: 1.0 };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within 16 bits"
        )]
        let shown = |x: u16| {
            let level = scene.expect(step, &levels, (f64::from(x), 0.0)).seen.level;
            (level * 257.0).round() as u16
        };
        let values = (0..40).flat_map(|_| (0..120u16).map(shown)).collect();
        let frame =
            Frame::new(0, Stamp::START, Size::new(SIZE.0, SIZE.1), Pixels::Grey16(values)).unwrap();
        let view = GaugeView::new(Roi { x: 0, y: 0, width: 120, height: 40 }, BeadAxis::Vertical);
        let mut layout = RowLayout::default();
        let GaugeRowsOfDepth::Words(strip) = layout.strips(&frame, &view, None) else {
            unreachable!()
        };
        let mut sheet = EdgeWindows::default();
        let grouping = Grouping { steepest: 0.0, max_rows: 1 };
        sheet.read(&strip, &LINES, grouping, |_| path.expected());
        sheet
    }

    #[test]
    fn the_flank_tells_place_blur_and_the_hidden_level() {
        let table = StepTable::default();
        for hidden_after in [true, false] {
            let scene = scene(&table, hidden_after);
            let truth = ClippedStep { at: 60.3, blur: 1.6, visible: 175.0, clipped: 300.0 };
            let levels = if hidden_after { [175.0, 255.0] } else { [255.0, 175.0] };
            let path = Straight { at: 59.8, levels };
            let mut sheet = sheet(&scene, &truth, &path);
            let mut overlay = Overlay::default();
            overlay.lay(&sheet);
            let start = ClippedStep { at: 0.0, blur: 1.2, visible: 175.0, clipped: 280.0 };
            let mut cut_off = ClippedEdge::default();
            let found = cut_off.fit(&scene, &overlay, start, None).unwrap();
            assert!((found.step.at - 0.5).abs() < 0.005, "{found:?}");
            assert!((found.step.blur - 1.6).abs() < 0.005, "{found:?}");
            assert!((found.step.clipped - 300.0).abs() < 0.5, "{found:?}");
            assert!((found.visible_fraction - 80.0 / 125.0).abs() < 0.005);
            // The scatter that 40 rows allow where nothing is known before.
            assert!((0.10..0.25).contains(&found.variance.sqrt()), "{found:?}");
            let mut lines = Vec::new();
            sheet.correct(EdgeCorrection { aside: 60.25 - path.at, before: 0.0, after: 1.0 });
            let take = |_, line: Option<ClippedLine>| lines.push(line.unwrap());
            cut_off.locate(&scene, &sheet, LINES.len(), &found, take);
            assert_eq!(lines.len(), 4);
            assert!(lines.iter().all(|line| (line.moved - 0.05).abs() < 0.006), "{lines:?}");
        }
    }

    #[test]
    fn the_blur_of_frames_before_counts_until_it_is_another() {
        let found = |blur, blur_sd| ClippedStepFit {
            step: ClippedStep { at: 0.0, blur, visible: 175.0, clipped: 300.0 },
            variance: 0.01,
            blur_sd,
            visible_fraction: 0.64,
            mean_visible: 175.0,
        };
        let mut cut_off = ClippedEdge::default();
        assert_eq!(cut_off.expected_blur(&found(1.5, 0.05)), None);
        cut_off.keep_blur(&found(1.5, 0.01));
        let expected = cut_off.expected_blur(&found(1.55, 0.05)).unwrap();
        assert_eq!(expected.px, 1.5);
        assert!((expected.sd_px - 0.01_f64.hypot(0.003)).abs() < 1e-12);
        let expected = cut_off.expected_blur(&found(2.5, 0.05)).unwrap();
        assert!((expected.sd_px - 1.0).abs() < 1e-12);
    }
}
