//! The search for the bead at a coarse scale, where texture and torn edges are
//! small: rows and columns are averaged before steps are looked for.

use super::contour::{Contour, Contours};
use super::edge::{Candidates, REACH, respond};
use super::number::{float, narrow, single};
use super::pair::{self, Pair, Search};
use super::strip::{Grey, Strip};

/// Rows of a band at least, and bands at most.
const BAND_ROWS: usize = 12;
const MAX_BANDS: usize = 24;
/// Columns that are averaged, as a fraction of the bead's width: with [`REACH`]
/// of them on either side a step is seen over a sixteenth of the width.
const STEP_FRACTION: f32 = 0.015;
/// Most such columns.
const MAX_STEP: usize = 4;
/// Fraction of the bands from which a contour is looked at.
const MIN_CONTOUR: f64 = 0.4;
/// Units of a profile for a grey level.
const UNITS: f32 = 16.0;

/// Contours at a coarse scale; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Coarse {
    /// Columns that are averaged.
    step: usize,
    bounds: Vec<(usize, usize)>,
    sums: Vec<f32>,
    profile: Vec<u16>,
    response: Vec<i16>,
    candidates: Vec<Candidates>,
    ups: Contours,
    downs: Contours,
    memory: Vec<f32>,
}

/// A bead's two edges at the coarse scale.
#[derive(Debug, Clone, Copy)]
pub struct CoarsePair<'a> {
    coarse: &'a Coarse,
    pair: Pair,
    /// Whether the bead is brighter than what lies outside.
    pub bright: bool,
}

impl Coarse {
    /// Looks for contours. `width_px` is a usual width, `min_step` the lowest step
    /// that counts \[grey levels\].
    #[inline(always)]
    pub fn look<T: Grey>(&mut self, strip: &Strip<'_, T>, width_px: f32, min_step: f32) {
        self.step = super::rough::whole(STEP_FRACTION * width_px).clamp(1, MAX_STEP);
        let count = (strip.along / BAND_ROWS).clamp(1, MAX_BANDS);
        self.bounds.clear();
        self.bounds
            .extend((0..count).map(|k| (k * strip.along / count, (k + 1) * strip.along / count)));
        self.candidates.resize(count, Candidates::default());
        for band in 0..count {
            self.pool(strip, self.bounds[band]);
            self.response.resize(self.profile.len(), 0);
            respond(&self.profile, &mut self.response);
            self.candidates[band].find(&self.response, min_step, 1.0 / (UNITS * single(REACH)));
        }
        let band_px = single(strip.along) / single(count * self.step);
        self.ups.search(&self.candidates, true, band_px, MIN_CONTOUR);
        self.downs.search(&self.candidates, false, band_px, MIN_CONTOUR);
    }

    /// Mean of a band's rows, a few columns together.
    #[inline(always)]
    fn pool<T: Grey>(&mut self, strip: &Strip<'_, T>, (from, to): (usize, usize)) {
        self.sums.clear();
        self.sums.resize(strip.across, 0.0);
        for v in from..to {
            for (sum, &value) in self.sums.iter_mut().zip(strip.row(v)) {
                *sum += T::float(value.add_to(T::Sum::default()));
            }
        }
        let scale = UNITS * strip.scale / single((to - from) * self.step);
        self.profile.clear();
        let cells = self.sums.chunks_exact(self.step);
        self.profile.extend(cells.map(|cell| units(scale * cell.iter().sum::<f32>())));
    }

    /// The best pair of the polarities that are looked for.
    pub fn pair(&mut self, width_px: (f32, f32), polarities: [bool; 2]) -> Option<CoarsePair<'_>> {
        let step = single(self.step);
        let search = Search { width_px: (width_px.0 / step, width_px.1 / step) };
        let mut best: Option<(Pair, bool)> = None;
        for bright in [true, false] {
            if !polarities[usize::from(!bright)] {
                continue;
            }
            let sides = if bright { (&self.ups, &self.downs) } else { (&self.downs, &self.ups) };
            let Some(pair) = pair::find(sides.0, sides.1, search, &mut self.memory) else {
                continue;
            };
            if best.is_none_or(|(best, _)| pair.score > best.score) {
                best = Some((pair, bright));
            }
        }
        let (pair, bright) = best?;
        Some(CoarsePair { coarse: self, pair, bright })
    }
}

impl CoarsePair<'_> {
    /// Places along the bead and positions across it of the left edge \[px\].
    pub fn left(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let side = if self.bright { &self.coarse.ups } else { &self.coarse.downs };
        self.places(&side.all()[self.pair.left])
    }

    /// Those of the right edge.
    pub fn right(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        let side = if self.bright { &self.coarse.downs } else { &self.coarse.ups };
        self.places(&side.all()[self.pair.right])
    }

    fn places<'a>(
        &self,
        contour: &'a Contour,
    ) -> impl Iterator<Item = (f64, f64)> + Clone + use<'a, '_> {
        let step = float(self.coarse.step);
        let bounds = self.coarse.bounds.iter();
        bounds.zip(&contour.at).filter_map(move |(&(from, to), at)| {
            let at = f64::from((*at)?);
            Some((float(from + to - 1) / 2.0, (at + 0.5) * step - 0.5))
        })
    }

    /// Distance of the two edges in the mean \[px\].
    pub fn width_px(&self) -> f32 {
        let mean = |places: &mut dyn Iterator<Item = (f64, f64)>| {
            let (mut sum, mut n) = (0.0, 0.0);
            for (_, at) in places {
                sum += at;
                n += 1.0;
            }
            sum / f64::max(n, 1.0)
        };
        narrow(mean(&mut self.right()) - mean(&mut self.left()))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a grey level of at most 256 in sixteenths"
)]
fn units(value: f32) -> u16 {
    value as u16
}
