//! One frame after the other: bands, candidates, contours, sub-pixel edges,
//! width.

use crate::calib::SurfaceMap;
use crate::frame::Frame;
use crate::geometry::ImagePoint;

use super::axis;
use super::contour::Contours;
use super::covered;
use super::edge::{Candidates, REACH, respond};
use super::edge_lines;
use super::gauge::{Gauge, Method, Polarity};
use super::noise;
use super::outlier;
use super::pair::{self, Pair, Search};
use super::parallel::Parallel;
use super::pool::{self, Bands};
use super::reject::Reject;
use super::saturated;
use super::step::StepTable;
use super::strip::{Grey, Strip, Strips, Turner, View};
use super::trace::{Scene, Tracer};
use super::width::{Caliper, EdgePlace, Edges, Hints, WidthMeasurement};

/// Share of the caliper lines that must show each of the two edges.
const NEED_SHARE: f64 = 0.6;
/// Share from which a contour is looked at.
const LEAST_SHARE: f64 = 0.4;
/// Share of the rows from which each edge must come.
const NEED_ROWS: f64 = 0.4;
/// The same where each row is known to be clear.
const NEED_CLEAR_ROWS: f64 = 0.16;
/// Share of saturated pixels from which missing contrast is laid to light.
const MUCH_LIGHT: f64 = 0.3;
/// Room that a search allows beyond the range of widths, for the difference
/// between one caliper and the mean of all.
const RANGE_SLACK: f64 = 1.5;
/// Misfit of a blurred step from which on, if both have it, edges are located
/// line by line: one alone is more likely covered than of another kind.
const STRANGE: f64 = 2.0;
/// The same for one edge alone.
const VERY_STRANGE: f64 = 8.0;
/// Least deviation from its neighbours that makes a caliper an outlier \[px\]:
/// of one that many rows agree on, and of one that was fitted for itself.
const OFF_PX: f64 = 0.3;
const LINE_OFF_PX: f64 = 0.75;
/// Largest standard deviation of a width whose edges are covered in part
/// \[px\]: beyond it, what is left of an edge does not tell its course.
const COVERED_SIGMA_PX: f64 = 0.19;
/// Share of clear rows from which on an edge's course is sure enough.
const PLENTY_CLEAR: f64 = 0.6;
/// Ground on either side of the bead that its noise is taken from \[px\].
const BESIDE_PX: f32 = 12.0;
/// Share by which the blur of one edge differs from the other's.
const DIFFERENT: f64 = 0.04;
/// Largest scatter of neighbouring edges about each other \[px\] that still is
/// an edge, not noise.
const MAX_SCATTER_PX: f64 = 1.5;
/// The same where one edge was hidden and had to be located line by line.
const LOST_SCATTER_PX: f64 = 0.5;

/// Steps that noise alone makes are passed over up to so many of its standard
/// deviations.
const FLOOR_SIGMA: f32 = 3.5;

/// Measures frames of one cell; keeps its memory from frame to frame.
#[derive(Debug, Clone)]
pub struct Measurer {
    gauge: Gauge,
    white: Option<u16>,
    turner: Turner,
    work: Work,
}

/// What a measurement works on.
#[derive(Debug, Clone)]
struct Work {
    gauge: Gauge,
    table: StepTable,
    bands: Bands,
    lines: Vec<(usize, usize)>,
    noise: f32,
    width_px: f32,
    memory: Vec<f32>,
    response: Vec<i16>,
    candidates: Vec<Candidates>,
    ups: Contours,
    downs: Contours,
    parallel: Parallel,
    left: Tracer,
    right: Tracer,
    least_off_px: f64,
    is_lost: bool,
    contrasts: [f64; 2],
    scatter: Vec<f64>,
    middles: Vec<f64>,
    axis: axis::Memory,
    left_px: Vec<ImagePoint>,
    right_px: Vec<ImagePoint>,
}

impl Measurer {
    /// For a gauge. `white` is the upper end of the camera's scale where it is
    /// not that of the pixels, as with 12 bits in 16.
    pub fn new(gauge: Gauge, white: Option<u16>) -> Self {
        let work = Work {
            gauge,
            table: StepTable::default(),
            bands: Bands::default(),
            lines: Vec::new(),
            noise: 0.0,
            width_px: 0.0,
            memory: Vec::new(),
            response: Vec::new(),
            candidates: Vec::new(),
            ups: Contours::default(),
            downs: Contours::default(),
            parallel: Parallel::default(),
            left: Tracer::default(),
            right: Tracer::default(),
            least_off_px: OFF_PX,
            is_lost: false,
            contrasts: [0.0; 2],
            scatter: Vec::new(),
            middles: Vec::new(),
            axis: axis::Memory::default(),
            left_px: Vec::new(),
            right_px: Vec::new(),
        };
        Self { gauge, white, turner: Turner::default(), work }
    }

    /// The edges behind the last width, for pictures of them.
    pub fn edges(&self) -> Edges<'_> {
        Edges { left: &self.work.left_px, right: &self.work.right_px }
    }

    /// The same line by line, with how sure each place is. A refused frame has
    /// the edges that were found before it was refused.
    pub fn calipers(&self) -> impl Iterator<Item = Caliper> {
        let Edges { left, right } = self.edges();
        let (mut left, mut right) = (left.iter().copied(), right.iter().copied());
        let lines = match self.gauge.method {
            Method::Caliper => self.work.lines.len(),
            Method::EdgeLines => left.len(),
        };
        (0..lines).filter_map(move |number| {
            let left = self.place(&self.work.left, number, &mut left);
            let right = self.place(&self.work.right, number, &mut right);
            let found = left.is_some() || right.is_some();
            found.then_some(Caliper { number, left, right })
        })
    }

    /// The next point of an edge, if it belongs to this line.
    fn place(
        &self,
        tracer: &Tracer,
        number: usize,
        points: &mut impl Iterator<Item = ImagePoint>,
    ) -> Option<EdgePlace> {
        if self.gauge.method == Method::EdgeLines {
            return Some(EdgePlace { at: points.next()?, sigma_px: None });
        }
        let located = tracer.edges().get(number).copied().flatten()?;
        Some(EdgePlace { at: points.next()?, sigma_px: Some(located.variance.sqrt()) })
    }

    /// Measures the bead in a frame on a surface.
    pub fn measure(
        &mut self,
        frame: &Frame,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        self.measure_picture(frame, surface)?.with_calibration(surface)
    }

    /// The same with no more in sigma than the picture itself leaves open.
    fn measure_picture(
        &mut self,
        frame: &Frame,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let work = &mut self.work;
        work.left_px.clear();
        work.right_px.clear();
        if !self.gauge.roi.fits(frame.size()) {
            return Err(Reject::WrongSize { image: frame.size() });
        }
        if self.gauge.method == Method::EdgeLines {
            let points = (&mut work.left_px, &mut work.right_px);
            return edge_lines::measure(&self.gauge, frame, surface, points);
        }
        let view = View::new(self.gauge.roi, self.gauge.axis);
        let strips = self.turner.strips(frame, &view, self.white);
        pulp::Arch::new().dispatch(Task { work, strips, view: &view, surface })
    }
}

/// A measurement as the processor's vectors do it: the same code is compiled
/// for each width of vectors, and the widest that there is runs.
struct Task<'a> {
    work: &'a mut Work,
    strips: Strips<'a>,
    view: &'a View,
    surface: &'a SurfaceMap,
}

impl pulp::WithSimd for Task<'_> {
    type Output = Result<WidthMeasurement, Reject>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        match self.strips {
            Strips::Bytes(strip) => self.work.measure(&strip, self.view, self.surface),
            Strips::Words(strip) => self.work.measure(&strip, self.view, self.surface),
        }
    }
}

impl Work {
    #[inline(always)]
    fn measure<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let range = self.search_range(view, surface)?;
        self.noise = noise::of(strip, 0..strip.across);
        self.bands.pool(strip, self.gauge.calipers);
        pool::cut(strip.along, self.gauge.calipers, &mut self.lines);
        self.find_candidates();
        let pair = self.find_pair(range)?;
        self.trace(strip, pair)?;
        self.sort_out()?;
        self.check_contrast()?;
        self.width_on(view, surface)
    }

    #[inline(always)]
    fn find_candidates(&mut self) {
        // A step is the difference of two means of REACH pooled pixels.
        #[expect(clippy::cast_precision_loss, reason = "REACH is small")]
        let noise = self.noise * (2.0 / (4.0 * REACH as f32)).sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "a grey level")]
        let least = (0.4 * self.gauge.min_contrast_grey) as f32;
        let floor = least.max(FLOOR_SIGMA * noise);
        #[expect(clippy::cast_precision_loss, reason = "REACH is small")]
        let unit = self.bands.unit() / REACH as f32;
        self.candidates.clear();
        for band in 0..self.bands.count() {
            let profile = self.bands.profile(band);
            self.response.resize(profile.len(), 0);
            respond(profile, &mut self.response);
            self.candidates.push(Candidates::find(&self.response, floor, unit));
        }
        #[expect(clippy::cast_precision_loss, reason = "a band has few rows")]
        let band_px = strip_rows(&self.bands) as f32 / self.bands.count().max(1) as f32;
        self.ups.search(&self.candidates, true, band_px, LEAST_SHARE);
        self.downs.search(&self.candidates, false, band_px, LEAST_SHARE);
    }

    #[inline(always)]
    fn trace<T: Grey>(&mut self, strip: &Strip<'_, T>, pair: Found) -> Result<(), Reject> {
        let (lefts, rights) = pair.sides(&self.ups, &self.downs);
        let (lefts, rights) = (&lefts.all()[pair.pair.left].at, &rights.all()[pair.pair.right].at);
        let about = about(lefts, rights, strip.across);
        self.noise = noise::of(strip, about);
        self.width_px = narrowest(lefts, rights, &mut self.memory);
        let scene = Scene {
            strip,
            bands: &self.bands,
            lines: &self.lines,
            noise: self.noise,
            width_px: self.width_px,
            bead_after: true,
        };
        let right_scene = Scene { bead_after: false, ..scene };
        let scenes = [scene, right_scene];
        let mut seen = [None; 2];
        self.is_lost = false;
        // A loop, so that what is inlined into it is compiled once for both.
        let sides = [(&mut self.left, lefts), (&mut self.right, rights)];
        for ((tracer, rough), (scene, seen)) in sides.into_iter().zip(scenes.iter().zip(&mut seen))
        {
            *seen = tracer.look(&self.table, scene, rough.iter().copied());
        }
        let failed = Reject::NoPair { got: 0.0, need: NEED_SHARE };
        if let [Some(_), Some(_)] = seen {
            let cut_off = [self.left.is_cut_off(&scene), self.right.is_cut_off(&right_scene)];
            if cut_off != [[false; 2]; 2] {
                self.least_off_px = OFF_PX;
                let tracers = [&mut self.left, &mut self.right];
                let bead = saturated::Bead { scenes, lefts, rights };
                self.noise = bead.trace(tracers, &self.table, cut_off)?;
                return Ok(());
            }
        }
        if let Some(blur) = common_blur(seen) {
            for (tracer, scene) in [&mut self.left, &mut self.right].into_iter().zip(&scenes) {
                tracer.trace(&self.table, scene, blur);
            }
            if self.left.is_hidden() || self.right.is_hidden() {
                let candidates = &self.candidates;
                let bead = covered::Bead { scenes, candidates, bright: pair.bright };
                let tracers = [&mut self.left, &mut self.right];
                bead.uncover(tracers, &self.table, blur, &mut self.parallel);
            }
            self.is_lost = self.one_is_lost();
            let found = self.left.is_located() && self.right.is_located();
            if found && !self.is_lost && !is_strange([self.left.misfit, self.right.misfit]) {
                self.least_off_px = OFF_PX;
                return Ok(());
            }
        }
        self.least_off_px = LINE_OFF_PX;
        let left = self.left.refine(&self.table, &scene);
        let right = self.right.refine(&self.table, &right_scene);
        if left && right { Ok(()) } else { Err(failed) }
    }

    /// Whether one edge alone is hidden: then it is covered, not of another kind
    /// than the other one.
    fn one_is_lost(&self) -> bool {
        let lost = |side: &Tracer| side.is_hidden() && side.misfit > STRANGE;
        lost(&self.left) != lost(&self.right)
    }

    /// The believed widths in pixels across the gauge's middle.
    fn search_range(&self, view: &View, surface: &SurfaceMap) -> Result<(f32, f32), Reject> {
        #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
        let (u, v) = (view.across as f64 / 2.0, view.along as f64 / 2.0);
        let middle = surface.to_mm(view.to_image(u, v)).ok_or(Reject::OffSurface)?;
        let beside = surface.to_mm(view.to_image(u + 1.0, v)).ok_or(Reject::OffSurface)?;
        let mm_per_px = (beside - middle).norm();
        let (min, max) = self.gauge.width_range;
        #[expect(clippy::cast_possible_truncation, reason = "widths in pixels")]
        let range = (
            (min.get() / mm_per_px / RANGE_SLACK) as f32,
            (max.get() / mm_per_px * RANGE_SLACK) as f32,
        );
        Ok(range)
    }

    /// The bead's two edges among the contours.
    fn find_pair(&mut self, width_px: (f32, f32)) -> Result<Found, Reject> {
        let found = self.search(width_px);
        if let Some(found) = found.filter(|found| found.pair.share >= NEED_SHARE) {
            return Ok(found);
        }
        let got = found.map_or(0.0, |found| found.pair.share);
        let refused = Reject::NoPair { got, need: NEED_SHARE };
        // A bead of another width deserves to be called that.
        let least = self.gauge.min_contrast_grey;
        let strong =
            |found: &Found| found.pair.share >= NEED_SHARE && f64::from(found.pair.step) >= least;
        match self.search((4.0, f32::MAX)).filter(strong) {
            Some(found) => Ok(found),
            None => Err(self.too_much_light().unwrap_or(refused)),
        }
    }

    fn search(&mut self, width_px: (f32, f32)) -> Option<Found> {
        let search = Search { width_px };
        let mut best: Option<Found> = None;
        for bright in [true, false] {
            let unwanted = if bright { Polarity::Dark } else { Polarity::Bright };
            if self.gauge.polarity == unwanted {
                continue;
            }
            let (lefts, rights) =
                if bright { (&self.ups, &self.downs) } else { (&self.downs, &self.ups) };
            let pair = pair::find(lefts, rights, search, &mut self.memory);
            best = match (best, pair) {
                (Some(best), Some(pair)) if best.pair.score >= pair.score => Some(best),
                (best, None) => best,
                (_, Some(pair)) => Some(Found { pair, bright }),
            };
        }
        best
    }

    fn too_much_light(&self) -> Option<Reject> {
        let got = self.bands.saturated_share();
        (got > MUCH_LIGHT).then_some(Reject::Saturated { got, limit: MUCH_LIGHT })
    }

    /// Takes out calipers that disagree with their neighbours, on either edge.
    fn sort_out(&mut self) -> Result<(), Reject> {
        let mut worst: f64 = 0.0;
        for side in [&mut self.left, &mut self.right] {
            if side.is_covered() {
                side.drop_strays(self.least_off_px);
            }
            let edges = side.edges_mut();
            worst = worst.max(outlier::sort_out(edges, self.least_off_px, &mut self.scatter));
        }
        let got = self.left.used_share().min(self.right.used_share());
        let enough =
            [&self.left, &self.right].iter().all(|side| side.used_share() >= need_of(side));
        let limit = if self.is_lost { LOST_SCATTER_PX } else { MAX_SCATTER_PX };
        if !enough || worst > limit {
            let got = if worst > limit { 0.0 } else { got };
            return Err(Reject::NoPair { got, need: NEED_ROWS });
        }
        Ok(())
    }

    fn check_contrast(&mut self) -> Result<(), Reject> {
        let need = self.gauge.min_contrast_grey;
        self.contrasts = [self.contrast(true), self.contrast(false)];
        let got = self.contrasts[0].min(self.contrasts[1]);
        if got < need {
            return Err(self.too_much_light().unwrap_or(Reject::LowContrast { got, need }));
        }
        Ok(())
    }

    /// Median height of an edge's steps \[grey levels\].
    fn contrast(&mut self, left: bool) -> f64 {
        let side = if left { &self.left } else { &self.right };
        self.scatter.clear();
        self.scatter.extend(side.edges().iter().flatten().map(|edge| edge.height.abs()));
        let middle = self.scatter.len() / 2;
        if self.scatter.is_empty() {
            return 0.0;
        }
        *self.scatter.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    fn width_on(&mut self, view: &View, surface: &SurfaceMap) -> Result<WidthMeasurement, Reject> {
        let hints = Hints {
            contrast_grey: f64::midpoint(self.contrasts[0], self.contrasts[1]),
            blur_px: f64::midpoint(self.left.blur_px, self.right.blur_px),
            noise_grey: self.noise.into(),
            saturated_share: self.bands.saturated_share(),
            used_share: f64::midpoint(self.left.used_share(), self.right.used_share()),
        };
        self.middles.clear();
        self.middles.extend(self.lines.iter().map(|&line| pool::middle(line)));
        for (tracer, points) in [(&self.left, &mut self.left_px), (&self.right, &mut self.right_px)]
        {
            let places = tracer.edges().iter().zip(&self.middles);
            points
                .extend(places.filter_map(|(edge, &v)| Some(view.to_image(edge.as_ref()?.at, v))));
        }
        let sides = [&self.left, &self.right].map(|tracer| axis::Side {
            places: tracer.edges(),
            common_variance: tracer.common_variance,
            misfit: tracer.misfit,
        });
        let (gauge, middles) = (&self.gauge, self.middles.as_slice());
        let scene = axis::Scene { view, surface, gauge, middles, sides };
        let found = axis::width(&scene, hints, &mut self.axis)?;
        self.check_covered(&found)?;
        Ok(found)
    }

    /// Refuses a bead of whose edges too little is uncovered to tell where they
    /// run.
    fn check_covered(&self, found: &WidthMeasurement) -> Result<(), Reject> {
        let share = found.sigma.get() / found.width.get();
        let sparse = |side: &Tracer| side.is_covered() && side.used_share() < PLENTY_CLEAR;
        let unsure = sparse(&self.left) || sparse(&self.right);
        if unsure && share * f64::from(self.width_px) > COVERED_SIGMA_PX {
            let got = self.left.used_share().min(self.right.used_share());
            return Err(Reject::NoPair { got, need: NEED_ROWS });
        }
        Ok(())
    }
}

/// Share of the rows from which an edge must come.
fn need_of(side: &Tracer) -> f64 {
    if side.is_covered() { NEED_CLEAR_ROWS } else { NEED_ROWS }
}

/// Blur that both edges have, seen through one lens, and how far one may differ
/// from it \[px\], from that of each and its standard deviation; `None` where
/// neither has one.
fn common_blur(seen: [Option<(f64, f64)>; 2]) -> Option<(f64, f64)> {
    let weight = |(blur, sd): (f64, f64)| 1.0 / (sd * sd + (DIFFERENT * blur).powi(2));
    let (mut sum, mut weights) = (0.0, 0.0);
    for seen in seen.into_iter().flatten() {
        sum += weight(seen) * seen.0;
        weights += weight(seen);
    }
    let blur = sum / weights;
    (weights > 0.0).then_some((blur, DIFFERENT * blur))
}

/// Whether edges are no blurred steps, from their misfits.
fn is_strange(misfits: [f64; 2]) -> bool {
    misfits.iter().all(|&misfit| misfit > STRANGE)
        || misfits.iter().any(|&misfit| misfit > VERY_STRANGE)
}

/// A pair and its polarity.
#[derive(Debug, Clone, Copy)]
struct Found {
    pair: Pair,
    bright: bool,
}

impl Found {
    /// Contours of left and right edges.
    fn sides<'a>(&self, ups: &'a Contours, downs: &'a Contours) -> (&'a Contours, &'a Contours) {
        if self.bright { (ups, downs) } else { (downs, ups) }
    }
}

fn strip_rows(bands: &Bands) -> usize {
    bands.count().checked_sub(1).map_or(0, |last| bands.rows(last).1)
}

/// Columns of the bead and a little beside it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates at 0 and is cut to the gauge"
)]
fn about(left: &[Option<f32>], right: &[Option<f32>], across: usize) -> std::ops::Range<usize> {
    let low = left.iter().flatten().fold(f32::INFINITY, |low, &at| low.min(at));
    let high = right.iter().flatten().fold(0.0, |high: f32, &at| high.max(at));
    let (from, to) = ((low - BESIDE_PX) as usize, (high + BESIDE_PX) as usize);
    from.min(across - 1)..to.clamp(from + 1, across)
}

/// A narrow distance between two contours \[px\], for the size of windows.
fn narrowest(left: &[Option<f32>], right: &[Option<f32>], memory: &mut Vec<f32>) -> f32 {
    memory.clear();
    memory.extend(left.iter().zip(right).filter_map(|(left, right)| Some((*right)? - (*left)?)));
    let rank = memory.len() / 10;
    if memory.is_empty() {
        return 0.0;
    }
    *memory.select_nth_unstable_by(rank, f32::total_cmp).1
}
