//! Strips under a plot: states, limits or rejected frames over time.

use maud::{Markup, html};

use super::area::{Area, LEFT, XAxis, round};
use super::axis::PageExtent;
use super::palette::Ink;
use super::strip::{Strip, StripSegment};
use crate::rows::names::in_words;

/// Height of a strip \[px of the drawing\].
const ROW_HEIGHT: f64 = 20.0;
/// Gap between strips \[px of the drawing\].
const GAP: f64 = 8.0;
/// Smallest width of a segment \[px of the drawing\], so that one frame among thousands is
/// visible.
const MIN_WIDTH: f64 = 1.6;
/// Approximate width of a letter of the labels \[px of the drawing\].
const LETTER_WIDTH: f64 = 6.6;

/// A strip with its name and the colours of its marks; marks without a colour are not drawn.
pub struct StripRow<'a> {
    /// Name at its left.
    pub name: &'a str,
    /// The segments.
    pub strip: &'a Strip,
    /// Colour of a mark, by its name.
    pub ink: fn(&str) -> Option<Ink>,
}

/// Draws strips below each other on one x axis.
pub fn draw(axis: &XAxis, rows: &[StripRow<'_>]) -> Markup {
    let height = rows.iter().fold(GAP, |sum, _| sum + ROW_HEIGHT + GAP);
    let area = Area { top: 0.0, bottom: 0.0, ..Area::wide(height) };
    let mut y = GAP / 2.0;
    let inner = html! {
        @for row in rows {
            (draw_row(&area, axis, row, y))
            ({ y += ROW_HEIGHT + GAP; "" })
        }
    };
    let names: Vec<&str> = rows.iter().map(|row| row.name).collect();
    area.svg(&names.join(", "), &inner)
}

fn draw_row(area: &Area, axis: &XAxis, row: &StripRow<'_>, y: f64) -> Markup {
    let PageExtent { from: left, to: right } = area.across();
    html! {
        text.title x=(LEFT - 8.0) y=(y + 14.5) text-anchor="end" { (row.name) }
        rect.lane x=(left) y=(y) width=(right - left) height=(ROW_HEIGHT) rx="2" {}
        @for segment in row.strip.segments() {
            @if let Some(ink) = (row.ink)(segment.mark.name) { (draw_segment(area, axis, segment, ink, y)) }
        }
    }
}

fn draw_segment(area: &Area, axis: &XAxis, segment: &StripSegment, ink: Ink, y: f64) -> Markup {
    let x = area.x(axis);
    let (from, to) = (round(x(segment.from)), round(x(segment.to)));
    let width = round((to - from).max(MIN_WIDTH));
    let name = in_words(segment.mark.name);
    let letters = name.chars().fold(2.0, |sum, _| sum + 1.0);
    let decimals = usize::from(axis.divisor > 1.0 || axis.range.length() < 600.0);
    html! {
        rect x=(from) y=(y) width=(width) height=(ROW_HEIGHT) fill=(ink.css()) {
            title {
                (name) ", " (format!("{:.*}", decimals, segment.from / axis.divisor))
                " to " (format!("{:.*}", decimals, segment.to / axis.divisor))
            }
        }
        @if letters * LETTER_WIDTH < width {
            text.inside x=(from + 7.0) y=(y + 14.5) { (name) }
        }
    }
}
