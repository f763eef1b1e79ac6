//! The part of the page that a plot fills, its grid and its axes.

use maud::{Markup, html};

use super::axis::{AxisScale, PageExtent};
use super::range::ValueRange;

/// An x axis that several plots share.
#[derive(Debug, Clone, PartialEq)]
pub struct XAxis {
    /// Its quantity, with its unit.
    pub title: String,
    /// Smallest and largest value, before division by `divisor`.
    pub range: ValueRange,
    /// Divisor of the values at the ticks.
    pub divisor: f64,
}

impl XAxis {
    /// Time \[s\]; in minutes or hours for a long range.
    pub fn time(range: ValueRange) -> Self {
        let (unit, divisor) = match range.length() {
            long if long > 7200.0 => ("h", 3600.0),
            long if long > 600.0 => ("min", 60.0),
            _ => ("s", 1.0),
        };
        Self { title: format!("time [{unit}]"), range, divisor }
    }

    /// Numbers of frames.
    pub fn frames(range: ValueRange) -> Self {
        Self { title: "frame".to_string(), range, divisor: 1.0 }
    }

    /// Path length \[mm\]; in metres for a long range.
    pub fn path(range: ValueRange) -> Self {
        let (unit, divisor) = if range.length() > 10_000.0 { ("m", 1000.0) } else { ("mm", 1.0) };
        Self { title: format!("distance along the path [{unit}]"), range, divisor }
    }

    fn scale(&self, page: PageExtent) -> AxisScale {
        let ValueRange { min, max } = self.range;
        AxisScale::linear(ValueRange::new(min / self.divisor, max / self.divisor), page)
    }
}

/// Size of a plot and the margins around its grid \[px of the drawing\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Width with margins.
    pub width: f64,
    /// Height with margins.
    pub height: f64,
    /// Top margin.
    pub top: f64,
    /// Bottom margin.
    pub bottom: f64,
}

/// Left margin \[px of the drawing\], the same for all plots so that they align.
pub const LEFT: f64 = 62.0;
/// Right margin \[px of the drawing\].
const RIGHT: f64 = 14.0;

impl Area {
    /// A plot with the width of the page.
    pub const fn wide(height: f64) -> Self {
        Self { width: 1080.0, height, top: 26.0, bottom: 42.0 }
    }

    /// A plot with half the width of the page.
    pub const fn half(height: f64) -> Self {
        Self { width: 530.0, height, top: 26.0, bottom: 42.0 }
    }

    /// Left and right end of the grid.
    pub fn across(&self) -> PageExtent {
        PageExtent { from: LEFT, to: self.width - RIGHT }
    }

    /// Lower and upper end of the grid, in the order of a y axis.
    pub fn upwards(&self) -> PageExtent {
        PageExtent { from: self.height - self.bottom, to: self.top }
    }

    /// Map from values to x positions on this area.
    pub fn x(&self, axis: &XAxis) -> impl Fn(f64) -> f64 + use<> {
        let scale = axis.scale(self.across());
        let divisor = axis.divisor;
        move |value| scale.position(value / divisor)
    }

    /// Vertical grid lines and their labels.
    pub fn x_grid(&self, axis: &XAxis) -> Markup {
        let scale = axis.scale(self.across());
        self.vertical_grid(
            &scale.ticks(if self.width > 700.0 { 12 } else { 6 }),
            &scale,
            &axis.title,
        )
    }

    /// Vertical grid lines and labels for other ticks and another scale.
    pub fn vertical_grid(&self, ticks: &[(f64, String)], scale: &AxisScale, title: &str) -> Markup {
        let PageExtent { from: bottom, to: top } = self.upwards();
        let PageExtent { from: left, to: right } = self.across();
        html! {
            @for (value, label) in ticks {
                @let x = round(scale.position(*value));
                line.grid x1=(x) x2=(x) y1=(top) y2=(bottom) {}
                text.tick x=(x) y=(bottom + 17.0) text-anchor="middle" { (label) }
            }
            text.title x=(right) y=(bottom + 36.0) text-anchor="end" { (title) }
            line.axis x1=(left) x2=(right) y1=(bottom) y2=(bottom) {}
        }
    }

    /// Horizontal grid lines, their labels and the axis title above them.
    pub fn y_grid(&self, scale: &AxisScale, title: &str) -> Markup {
        let PageExtent { from: left, to: right } = self.across();
        let PageExtent { from: bottom, to: top } = self.upwards();
        let wanted = if bottom - top > 150.0 { 6 } else { 4 };
        html! {
            @for (value, label) in scale.ticks(wanted) {
                @let y = round(scale.position(value));
                line.grid x1=(left) x2=(right) y1=(y) y2=(y) {}
                text.tick x=(left - 8.0) y=(y + 4.5) text-anchor="end" { (label) }
            }
            text.title x="4" y=(top - 11.0) { (title) }
        }
    }

    /// The complete drawing with this content.
    pub fn svg(&self, label: &str, inner: &Markup) -> Markup {
        html! {
            svg viewBox=(format!("0 0 {} {}", self.width, self.height)) role="img" aria-label=(label) {
                (inner)
            }
        }
    }

    /// Clips the content to the grid.
    pub fn clipped(&self, inner: &Markup) -> Markup {
        let PageExtent { from: left, to: right } = self.across();
        let PageExtent { from: bottom, to: top } = self.upwards();
        let (width, height) = (right - left, bottom - top);
        html! {
            svg x=(left) y=(top) width=(width) height=(height)
                viewBox=(format!("{left} {top} {width} {height}")) { (inner) }
        }
    }
}

/// A position rounded to one decimal; smaller differences are not visible.
pub fn round(position: f64) -> f64 {
    (position * 10.0).round() / 10.0 + 0.0
}
