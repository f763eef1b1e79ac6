use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::core::{Frame, Pixels, Roi, Size, Stamp};
use crate::vision::gauge::{BeadAxis, GaugeView};
use crate::vision::pool;
use crate::vision::strip::{GaugeRowsOfDepth, RowLayout};

const COLUMNS: usize = 160;
const CALIPERS: usize = 64;
const BLUR_PX: f64 = 1.5;
/// Standard deviation of a pixel, with a step of 80 [grey levels].
const NOISE: f32 = 4.0;

/// Where an edge was located: the tracer, and the middle and number of rows of each line.
struct Traced {
    tracer: EdgeTracer,
    lines: Vec<RowRange>,
}

impl Traced {
    /// Errors of the located lines against a truth by line [px].
    fn errors(&self, truth: impl Fn(RowRange) -> f64) -> Vec<f64> {
        let lines = self.tracer.edges.iter().zip(&self.lines);
        lines.filter_map(|(edge, &rows)| Some(edge.as_ref()?.at - truth(rows))).collect()
    }
}

/// Traces a step from 70 to 150 at `edge` of a row, with `cover` over it: the grey level of what
/// hides a pixel of a row, by its distance from the edge. `rough` is the contour's position in a
/// band, beside the edge.
fn trace(
    rows: usize,
    edge: impl Fn(f64) -> f64,
    cover: impl Fn(usize, f64) -> Option<f64>,
    rough: impl Fn(RowRange) -> f64,
) -> Traced {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let table = StepTable::default();
    let mut values = Vec::new();
    for row in 0..rows {
        for column in 0..COLUMNS {
            let away = to_f64(column) - edge(to_f64(row));
            let noise: f64 = StandardNormal.sample(&mut random);
            let level = cover(row, away).unwrap_or(70.0 + 80.0 * table.at(away / BLUR_PX).0);
            let level = 257.0 * (level + f64::from(NOISE) * noise).clamp(0.0, 255.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "16 bits")]
            values.push(level.round() as u16);
        }
    }
    let size = Size::new(COLUMNS, rows);
    let frame = Frame::new(0, Stamp::START, size, Pixels::Grey16(values)).unwrap();
    let view = GaugeView::new(Roi { x: 0, y: 0, width: COLUMNS, height: rows }, BeadAxis::Vertical);
    let mut layout = RowLayout::default();
    let GaugeRowsOfDepth::Words(strip) = layout.strips(&frame, &view, None) else { unreachable!() };
    let (mut bands, mut lines) = (Bands::default(), Vec::new());
    bands.pool(&strip, CALIPERS);
    pool::cut_into_ranges(strip.along, CALIPERS, &mut lines);
    let scene = TraceInput {
        strip: &strip,
        table: &table,
        bands: &bands,
        lines: &lines,
        noise: NOISE,
        width_px: 100.0,
        bead_after: true,
    };
    let contour = bands.bounds.iter().map(|&rows| edge(rows.middle()) + rough(rows));
    let contour: Vec<_> = contour.map(|at| Some(narrow_to_f32(at))).collect();
    let mut tracer = EdgeTracer::default();
    let blur = tracer.fit_first(&scene, contour.into_iter()).unwrap();
    tracer.take_shape(&table, blur);
    tracer.trace(&scene, blur);
    Traced { tracer, lines }
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / to_f64(errors.len())).sqrt()
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / to_f64(errors.len())
}

fn slanted(row: f64) -> f64 {
    70.3 + 0.05 * row
}

#[test]
fn an_open_edge_is_located_to_the_bound_of_its_noise() {
    let traced = trace(100, slanted, |_, _| None, |_| 0.0);
    let errors = traced.errors(|rows| slanted(rows.middle()));
    assert!(traced.tracer.is_clear() && !traced.tracer.is_occluded());
    assert!((traced.tracer.blur_px - BLUR_PX).abs() < 0.15, "{}", traced.tracer.blur_px);
    // Cramér–Rao: a row of variance 2√π·(σ/A)²·s, of which a line has four.
    let line = 2.0 * std::f64::consts::PI.sqrt() * (4.0f64 / 80.0).powi(2) * BLUR_PX / 4.0;
    assert!(rms(&errors) < 1.5 * line.sqrt(), "{} {}", rms(&errors), line.sqrt());
    assert!(mean(&errors).abs() < 0.04, "{}", mean(&errors));
}

/// Grains of 12 px over 3 rows in 10, to which the contour is drawn by 3 px.
#[test]
fn grains_on_a_third_of_the_rows_move_nothing() {
    for grey in [230.0, 20.0] {
        let is_covered = |row: usize| row % 40 < 12;
        let cover = |row: usize, away: f64| {
            (is_covered(row) && (-9.0..3.0).contains(&away)).then_some(grey)
        };
        let drawn = |rows: RowRange| {
            if is_covered(usize::midpoint(rows.first, rows.end)) { -3.0 } else { 0.0 }
        };
        let traced = trace(160, slanted, cover, drawn);
        let errors = traced.errors(|rows| slanted(rows.middle()));
        assert!(traced.tracer.is_occluded(), "{grey}: {}", traced.tracer.misfit);
        let used = traced.tracer.used_fraction();
        assert!((0.3..0.75).contains(&used), "{grey}: {used}");
        assert!(mean(&errors).abs() < 0.05 && rms(&errors) < 0.2, "{grey}: {errors:?}");
    }
}

/// The mean of a sine over n rows about m is sin(ωm)·sin(ωn/2)/(n·sin(ω/2)).
#[test]
fn a_winding_edge_is_followed_between_bands() {
    let (size, turn) = (1.5, std::f64::consts::TAU / 57.0);
    let edge = |row: f64| 80.0 + size * (turn * row).sin();
    let traced = trace(500, edge, |_, _| None, |_| 0.0);
    assert!(traced.tracer.seems_winding());
    assert!(traced.tracer.is_clear() && !traced.tracer.is_occluded());
    let truth = |rows: RowRange| {
        let count = to_f64(rows.end - rows.first);
        let part = (0.5 * turn * count).sin() / (count * (0.5 * turn).sin());
        80.0 + size * (turn * rows.middle()).sin() * part
    };
    let errors = traced.errors(truth);
    assert!(to_f64(errors.len()) > 0.95 * to_f64(CALIPERS), "{}", errors.len());
    assert!(
        rms(&errors) < 0.15 && mean(&errors).abs() < 0.03,
        "{} {}",
        rms(&errors),
        mean(&errors)
    );
}

#[test]
fn a_straight_edge_does_not_wind() {
    let traced = trace(500, slanted, |_, _| None, |_| 0.0);
    assert!(!traced.tracer.seems_winding());
}
