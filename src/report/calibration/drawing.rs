//! Drawings over the camera's image.

use maud::{Markup, html};

use crate::calibration::relative_sigma_map::RelativeSigmaMap;
use crate::calibration::solve::{BoardView, Solution};
use crate::calibration::width_map::{Cells, MAP_CELLS, WidthMap};
use crate::numeric::rank;
use crate::report::chart::palette::{GAUGE, Ink, LEFT_EDGE, LIMIT, REJECTED, WIDTH};

/// Width of a drawing \[px of the drawing\].
const WIDE: f64 = 960.0;
/// Margins at the left and at the bottom for the axes \[px of the drawing\].
const MARGIN: (f64, f64) = (52.0, 44.0);
/// Length at which the median residual is drawn, as a fraction of a square's side.
const DRAWN: f64 = 0.15;
/// Width and height of a bar \[px of the page\].
const BAR: (f64, f64) = (160.0, 12.0);

/// The camera's image on the page.
#[derive(Debug, Clone, Copy)]
pub struct Drawing {
    size_px: [f64; 2],
    scale: f64,
}

impl Drawing {
    fn of(image_size_px: [u32; 2]) -> Self {
        let size_px = image_size_px.map(f64::from);
        Self { size_px, scale: (WIDE - MARGIN.0 - 8.0) / size_px[0] }
    }

    fn x(self, px: f64) -> f64 {
        round(MARGIN.0 + (px + 0.5) * self.scale)
    }

    fn y(self, px: f64) -> f64 {
        round(8.0 + (px + 0.5) * self.scale)
    }

    /// The drawing with its frame and its axes in pixels.
    fn svg(self, label: &str, inner: &Markup) -> Markup {
        let [width, height] = self.size_px;
        let (right, bottom) = (self.x(width - 0.5), self.y(height - 0.5));
        let (left, top) = (self.x(-0.5), self.y(-0.5));
        let view = format!("0 0 {WIDE} {}", round(bottom + MARGIN.1));
        html! {
            svg role="img" aria-label=(label) viewBox=(view) {
                rect.lane x=(left) y=(top) width=(round(right - left)) height=(round(bottom - top)) {}
                (inner)
                @for tick in ticks(width) {
                    text.tick x=(self.x(tick)) y=(bottom + 18.0) text-anchor="middle" { (tick) }
                }
                @for tick in ticks(height) {
                    text.tick x=(left - 7.0) y=(self.y(tick) + 4.0) text-anchor="end" { (tick) }
                }
                text x=(round(f64::midpoint(left, right))) y=(bottom + 38.0) text-anchor="middle" { "x [px]" }
                text x=(0) y=(0) text-anchor="middle"
                    transform=(format!("translate(13 {}) rotate(-90)", round(f64::midpoint(top, bottom)))) { "y [px]" }
            }
        }
    }

    /// A bar that shows the typical and the largest error as fractions of its full length.
    pub fn bar(typical: f64, largest: f64) -> Markup {
        let (long, high) = BAR;
        let part = |part: f64| round(long * part.clamp(0.0, 1.0));
        html! {
            svg width=(long) height=(high) viewBox=(format!("0 0 {long} {high}")) aria-hidden="true" {
                rect x="0" y="3" width=(part(largest)) height="6" fill=(WIDTH.css()) opacity="0.3" {}
                rect x="0" y="1" width=(part(typical)) height="10" fill=(WIDTH.css()) {}
            }
        }
    }
}

/// Round pixel numbers along a side.
fn ticks(side: f64) -> Vec<f64> {
    let steps = [20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];
    let step = steps.into_iter().find(|step| side / step <= 9.0).unwrap_or(5000.0);
    std::iter::successors(Some(0.0), |at| Some(at + step)).take_while(|&at| at < side).collect()
}

fn round(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

/// Magnification with which the residuals are visible.
pub fn magnification(solution: &Solution) -> f64 {
    let mut lengths_px: Vec<f64> = solution
        .views
        .iter()
        .flat_map(|view| view.errors_px.iter().map(nalgebra::Matrix::norm))
        .collect();
    let median = rank::median(&mut lengths_px).unwrap_or(1.0).max(1e-6);
    let times = DRAWN * typical_side(solution) / median;
    // Rounded down to one digit.
    let power = 10_f64.powf(times.log10().floor());
    (times / power).floor().max(1.0) * power
}

/// Median distance of neighbouring corners in a row \[px\].
fn typical_side(solution: &Solution) -> f64 {
    let neighbours = |view: &BoardView| -> Vec<f64> {
        let pairs = view.corners.windows(2).filter(|pair| pair[0].index + 1 == pair[1].index);
        pairs.map(|pair| (pair[1].px - pair[0].px).norm()).collect()
    };
    let mut sides: Vec<f64> = solution.views.iter().flat_map(neighbours).collect();
    rank::median(&mut sides).unwrap_or(10.0)
}

/// The residual of every corner: from the expected to the observed position, magnified.
pub fn residuals(solution: &Solution, times: f64) -> Markup {
    let drawing = Drawing::of(solution.image_size_px);
    let corners =
        || solution.views.iter().flat_map(|view| view.corners.iter().zip(&view.errors_px));
    drawing.svg(
        "corners of all boards with their errors",
        &html! {
            @for (corner, error) in corners().filter(|(_, error)| error.norm().is_finite()) {
                circle cx=(drawing.x(corner.px.x)) cy=(drawing.y(corner.px.y)) r="1.7"
                    fill=(LEFT_EDGE.css()) {}
                line x1=(drawing.x(corner.px.x)) y1=(drawing.y(corner.px.y))
                    x2=(drawing.x(corner.px.x + times * error.x))
                    y2=(drawing.y(corner.px.y + times * error.y))
                    stroke=(REJECTED.css()) stroke-width="1" {}
            }
        },
    )
}

/// Standard deviation of a width, cell by cell, with the area where boards were seen.
pub fn width_map(solution: &Solution, map: &WidthMap) -> Markup {
    let drawing = Drawing::of(solution.image_size_px);
    let [width, height] = drawing.size_px;
    let Cells { columns, rows } = MAP_CELLS;
    let edge = |at: u32, count: u32, side: f64| f64::from(at) / f64::from(count) * side - 0.5;
    let area = |i: u32| {
        let (column, row) = (i % columns, i / columns);
        let [left, right] = [column, column + 1].map(|at| edge(at, columns, width));
        let [top, bottom] = [row, row + 1].map(|at| edge(at, rows, height));
        [left, top, right, bottom]
    };
    drawing.svg(
        "standard deviation of a width over the image",
        &html! {
            (drawing.cells(&map.cells, map.range_mm(), area, short))
            @if let Some([from, to]) = solution.seen_px() {
                (drawing.frame([from.x, from.y, to.x, to.y], GAUGE, true))
            }
        },
    )
}

/// Relative standard deviation of a width, cell by cell, with the gauge and the area where boards
/// were seen.
pub fn sigma_map(map: &RelativeSigmaMap, gauge_px: [f64; 4], seen_px: Option<[f64; 4]>) -> Markup {
    let drawing = Drawing::of(map.image_size_px);
    drawing.svg(
        "relative standard deviation of a width over the image, with the gauge",
        &html! {
            (drawing.cells(&map.cells, map.range(), |i| map.cell_px(i), |fraction| short(100.0 * fraction)))
            @if let Some(seen) = seen_px { (drawing.frame(seen, LIMIT, true)) }
            (drawing.frame(gauge_px, GAUGE, false))
        },
    )
}

impl Drawing {
    /// Cells, darker for larger values, each with its value as text.
    fn cells(
        self,
        cells: &[Option<f64>],
        range: Option<(f64, f64)>,
        area_px: impl Fn(u32) -> [f64; 4],
        words: impl Fn(f64) -> String,
    ) -> Markup {
        let (low, high) = range.unwrap_or((1.0, 1.0));
        let shade =
            |sigma: f64| 0.06 + 0.74 * ((sigma / low).ln() / (high / low).ln().max(1e-9)).min(1.0);
        let filled = || cells.iter().zip(0_u32..).filter_map(|(cell, i)| Some(((*cell)?, i)));
        html! {
            @for (sigma, i) in filled() {
                @let [left, top, right, bottom] = area_px(i);
                @let (x, y) = (self.x(left), self.y(top));
                @let (right, bottom) = (self.x(right), self.y(bottom));
                rect x=(x) y=(y) width=(round(right - x)) height=(round(bottom - y))
                    fill=(WIDTH.css()) opacity=(format!("{:.2}", shade(sigma))) {}
                text.label x=(round(f64::midpoint(x, right))) y=(round(f64::midpoint(y, bottom)) + 4.0)
                    text-anchor="middle" style="font-size:11.5px;font-weight:400" { (words(sigma)) }
            }
        }
    }

    /// A rectangle in the image: first column and row, last column and row \[px\].
    fn frame(self, [left, top, right, bottom]: [f64; 4], ink: Ink, is_dashed: bool) -> Markup {
        let (x, y) = (self.x(left), self.y(top));
        let (width, height) = (round(self.x(right) - x), round(self.y(bottom) - y));
        let dashes = if is_dashed { "7 4" } else { "none" };
        html! {
            rect x=(x) y=(y) width=(width) height=(height)
                fill="none" stroke=(ink.css()) stroke-width="1.6" stroke-dasharray=(dashes) {}
        }
    }
}

/// A number with two significant digits.
fn short(mm: f64) -> String {
    let places = if mm < 0.001 {
        5
    } else if mm < 0.01 {
        4
    } else if mm < 0.1 {
        3
    } else {
        2
    };
    format!("{mm:.places$}")
}
