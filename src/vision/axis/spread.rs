//! Uncertainty of a width, and the bias that the uncertain direction of its axis gives it.

use super::sections::Sections;
use super::width_input::{LocatedEdge, WidthInput, WidthScratch};
use crate::numeric::number::to_f64;
use crate::vision::curve::EdgeCurve;
use crate::vision::located::CaliperEdge;
use crate::vision::scatter::{self, EdgeResidual};
use crate::vision::waviness::{CURVE_ORDERS, Evidence, Midline, ORDERS, WaveKind, legendre, norm};

/// Fraction of rows with a position from which on an edge is not occluded.
const MIN_COMPLETE_FRACTION: f64 = 0.98;
/// Limit of the variance inflation for a misfit that noise explains: a lower one would ignore
/// correlation that such a misfit may hide.
const MIN_INFLATION_LIMIT: f64 = 1.2;
/// Growth of that limit for each unit by which the squared misfit exceeds 1: a texture shifts an
/// edge alike over about as many rows.
const INFLATION_PER_MISFIT: f64 = 15.0;
/// Squared slope of the axis, in variances of the slope that waves make, up to which it is taken
/// for waves: a larger value takes a slope for waves, a smaller one waves for a slope.
const MIN_OBLIQUE_RATIO: f64 = 3.0;

/// A bead that was cut along the curves of its two edges.
#[derive(Clone, Copy)]
pub struct CutBead<'a> {
    /// Edge positions, and the map to the surface.
    pub scene: &'a WidthInput<'a>,
    /// Left and right edge.
    pub curves: &'a [EdgeCurve; 2],
    /// Its widths.
    pub sections: &'a Sections,
}

/// Uncertainty of the width.
pub struct WidthUncertainty {
    /// Standard deviation of the width \[mm\], without the calibration's fraction.
    pub sigma: f64,
    /// Mean loss of width by the uncertain direction of the axis \[mm\]: an axis that is off by an
    /// angle shows 1 − angle²/2 of the width.
    pub shortened: f64,
}

impl WidthUncertainty {
    /// Uncertainty of the width of a bead that was cut.
    pub fn of(cut: &CutBead<'_>, scratch: &mut WidthScratch) -> Self {
        let &CutBead { scene, curves, sections } = cut;
        let (mut variance, mut noise) = (0.0, 0.0);
        for (side, curve) in curves.iter().enumerate() {
            let scale = sections.scales[side] * sections.scales[side];
            let per_place = mean_variance(scene.sides[side].positions);
            if let Some(of_mean) = scene.sides[side].mean_variance {
                variance += scale * of_mean;
                noise += scale * per_place;
                continue;
            }
            let off = &scratch.off[side];
            let inflation = scatter::variance_inflation(off, per_place, &mut scratch.values)
                .unwrap_or_else(|| scene.sides[side].inflation_with_gaps(off, curve, per_place))
                .min(scene.sides[side].max_inflation());
            let of_mean = per_place * inflation * curve.mean_variance;
            variance += scale * (of_mean + scene.sides[side].common_variance);
            noise += scale * per_place * inflation;
        }
        let roughness = Self::roughness(cut, scratch, noise);
        variance += Self::variance_of_gaps(cut, roughness, scratch);
        let (shortened, of_tilt) = Self::tilt_bias_and_variance(cut, scratch);
        Self { sigma: (variance + of_tilt).sqrt(), shortened }
    }

    /// Mean loss of width \[mm\] by the uncertain direction of the axis, and its variance \[mm²\].
    fn tilt_bias_and_variance(cut: &CutBead<'_>, scratch: &mut WidthScratch) -> (f64, f64) {
        let &CutBead { scene, curves, sections } = cut;
        let oblique = sections.oblique * sections.oblique;
        let Some(waves) = scene.waves(cut, scratch) else {
            let [tilt, bend] = Self::tilt_variances(cut, scratch);
            let shortened = 0.5 * sections.mean * tilt;
            let of_bend = sections.oblique_by_bend * sections.oblique_by_bend * bend;
            return (shortened, oblique * tilt + of_bend + 2.0 * shortened * shortened);
        };
        let midline = Midline::of(curves);
        let per_slope =
            scene.cosine_squared(curves, 0.0) / (scene.half_length() * scene.half_length());
        let first = per_slope * scene.cosine_squared(curves, 0.0) * waves[0];
        // A bend that waves explain is not one of the axis.
        let bends = midline.bends_of(&waves);
        let per_bend = 0.5 * sections.mean * per_slope;
        // Waves have a slope of their own. Only a slope beyond it is the axis', and only along that
        // an error of the direction counts.
        let beyond = (oblique - MIN_OBLIQUE_RATIO * sections.mean * sections.mean * first).max(0.0);
        let of_slope = 0.5 * scene.kind_of_waves().slope_fraction() * sections.mean * first;
        let of_bends = per_bend * bends.of_waves_sigma;
        // Along a bent bead the waves' bend is an error of the direction as well.
        let by_bend = sections.oblique_by_bend / scene.half_length();
        let of_axis = beyond * first + bends.bent_probability * by_bend * by_bend * waves[1];
        let variance = of_axis + of_slope * of_slope + of_bends * of_bends;
        (of_slope + per_bend * bends.of_waves, variance)
    }

    /// Standard deviation of the width along the gauge, without the noise of its positions \[mm\].
    fn roughness(cut: &CutBead<'_>, scratch: &WidthScratch, noise: f64) -> f64 {
        let &CutBead { scene, sections, .. } = cut;
        let (mut square, mut n) = (0.0, 0.0);
        for (band, (left, right)) in scratch.off[0].iter().zip(&scratch.off[1]).enumerate() {
            let (Some(left), Some(right)) = (left, right) else { continue };
            let off = sections.scales[1] * right - sections.scales[0] * left;
            let width = sections.at(scene.normalised_position(band)) + off - sections.mean;
            square += width * width;
            n += 1.0;
        }
        (square / f64::max(n - 1.0, 1.0) - noise).max(0.0).sqrt()
    }

    /// Variance of the width from missing bands \[mm²\]: waviness of the bead that they hide, which
    /// is correlated over neighbouring bands. Each edge has half of it.
    fn variance_of_gaps(cut: &CutBead<'_>, roughness: f64, scratch: &mut WidthScratch) -> f64 {
        let &CutBead { scene, sections, .. } = cut;
        let mut variance = 0.0;
        for (number, side) in scene.sides.iter().enumerate() {
            let seen: f64 =
                side.positions.iter().flatten().map(|located| located.row_fraction).sum();
            let missing = 1.0 - seen / to_f64(side.positions.len());
            if missing > 0.0 {
                scratch.values.clear();
                scratch.values.extend(scratch.off[number].iter().flatten());
                let waves = scatter::long_run_variance(&scratch.values);
                let waves = (waves - mean_variance(side.positions)).max(0.0);
                let waves = waves * sections.scales[number] * sections.scales[number];
                variance += waves.max(0.5 * roughness * roughness) * missing / seen.max(1.0);
            }
        }
        variance
    }

    /// Variances of the axis' direction in the middle \[rad²\] and of its bend, relative to half
    /// the gauge: where lines across the gauge run obliquely to the bead, an axis that is off makes
    /// them longer or shorter. From the residuals of the midline and their correlation from band to
    /// band.
    fn tilt_variances(cut: &CutBead<'_>, scratch: &mut WidthScratch) -> [f64; 2] {
        let &CutBead { scene, curves, .. } = cut;
        let WidthScratch { off: [left, right], values } = scratch;
        values.clear();
        let both = left.iter().zip(right.iter());
        values.extend(both.filter_map(|(left, right)| Some(f64::midpoint((*left)?, (*right)?))));
        let per_place = scatter::long_run_variance(values);
        let slope = f64::midpoint(curves[0].slope_variance, curves[1].slope_variance);
        let bend = f64::midpoint(curves[0].bend_variance, curves[1].bend_variance);
        let cosine = scene.cosine_squared(curves, 0.0);
        let per_term = per_place / (scene.half_length() * scene.half_length());
        [slope * per_term * cosine * cosine, bend * per_term]
    }
}

impl LocatedEdge<'_> {
    /// Variance inflation of positions with gaps between them: their spread, relative to what noise
    /// explains.
    fn inflation_with_gaps(&self, off: &[Option<f64>], curve: &EdgeCurve, per_place: f64) -> f64 {
        let positions = off.iter().zip(self.positions);
        let positions = positions.filter_map(|(off, located)| {
            Some(EdgeResidual { px: (*off)?, row_fraction: located.as_ref()?.row_fraction })
        });
        scatter::inflation_with_gaps(positions, per_place, curve.count)
    }

    /// Upper limit of the variance inflation by correlation of neighbouring positions: what moves
    /// an edge, unless it is the bead itself, leaves a misfit. Infinite for an edge that is
    /// occluded here and there, which may hide anything.
    fn max_inflation(&self) -> f64 {
        let seen: f64 = self.positions.iter().flatten().map(|located| located.row_fraction).sum();
        if seen < MIN_COMPLETE_FRACTION * to_f64(self.positions.len()) {
            return f64::INFINITY;
        }
        MIN_INFLATION_LIMIT + INFLATION_PER_MISFIT * (self.misfit * self.misfit - 1.0).max(0.0)
    }
}

impl WidthInput<'_> {
    /// Torn where an edge has a variance of its mean: only rough edges come with one.
    fn kind_of_waves(&self) -> WaveKind {
        let is_torn = self.sides.iter().any(|side| side.mean_variance.is_some());
        if is_torn { WaveKind::Torn } else { WaveKind::Smooth }
    }

    /// Variance of the midline's Legendre coefficients of the orders 1 to 4 that waviness of the
    /// two edges explains \[px²\]; `None` where there is no significant waviness. From the
    /// coefficients of the width, and those of the midline that no straight or evenly bent axis
    /// has.
    fn waves(&self, cut: &CutBead<'_>, scratch: &WidthScratch) -> Option<[f64; CURVE_ORDERS]> {
        let &CutBead { curves, sections, .. } = cut;
        let mut off = [[0.0; ORDERS]; 2];
        let mut bands = [0.0f64; 2];
        for (band, positions) in scratch.off[0].iter().zip(&scratch.off[1]).enumerate() {
            let values = legendre(self.normalised_position(band));
            for (side, position) in [positions.0, positions.1].into_iter().enumerate() {
                let Some(position) = position else { continue };
                bands[side] += 1.0;
                for (sum, value) in off[side].iter_mut().zip(values) {
                    *sum += position * value;
                }
            }
        }
        let scale = f64::midpoint(sections.scales[0], sections.scales[1]);
        let per_place = self.sides.iter().map(|side| mean_variance(side.positions)).sum::<f64>();
        let mut evidence = Evidence::default();
        for order in 1..=ORDERS {
            let rest = |side: usize| norm(order) * off[side][order - 1] / bands[side].max(1.0);
            let all = |side: usize| curves[side].coefficient(order) + rest(side);
            let half_width = 0.5
                * match order {
                    1 | 2 => sections.terms[order] / scale + rest(1) - rest(0),
                    _ => all(1) - all(0),
                };
            let noise = norm(order) * per_place / (4.0 * bands[0].min(bands[1]).max(1.0));
            evidence.add(order, half_width, noise);
            if order == 3 || order > CURVE_ORDERS {
                evidence.add(order, f64::midpoint(all(0), all(1)), noise);
            }
        }
        evidence.waves(self.kind_of_waves())
    }
}

/// Mean variance of an edge's positions, scaled to bands with all of their rows \[px²\].
fn mean_variance(positions: &[Option<CaliperEdge>]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for located in positions.iter().flatten() {
        sum += located.variance * located.row_fraction;
        n += 1.0;
    }
    sum / f64::max(n, 1.0)
}
