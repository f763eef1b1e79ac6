//! Strips under a plot: what held from when to when.

use maud::{Markup, html};

use super::area::{Area, LEFT, XAxis, round};
use super::axis::Extent;
use super::palette::Ink;
use super::strip::{Spell, Strip};
use crate::rows::names::spoken;

const ROW: f64 = 20.0;
const GAP: f64 = 8.0;
/// Narrowest spell that is drawn, so that one frame among thousands is seen.
const LEAST: f64 = 1.6;
/// Rough width of a letter of the labels.
const LETTER: f64 = 6.6;

/// One strip with its name and the colour of each spell; none draws nothing.
pub struct Row<'a> {
    /// Name at the left.
    pub name: &'a str,
    /// What is drawn.
    pub strip: &'a Strip,
    /// Colour of a mark's name.
    pub ink: fn(&str) -> Option<Ink>,
}

/// Draws strips below each other on one x axis.
pub fn draw(axis: &XAxis, rows: &[Row<'_>]) -> Markup {
    let height = rows.iter().fold(GAP, |sum, _| sum + ROW + GAP);
    let area = Area { top: 0.0, bottom: 0.0, ..Area::wide(height) };
    let mut y = GAP / 2.0;
    let inner = html! {
        @for row in rows {
            (draw_row(&area, axis, row, y))
            ({ y += ROW + GAP; "" })
        }
    };
    let names: Vec<&str> = rows.iter().map(|row| row.name).collect();
    area.svg(&names.join(", "), &inner)
}

fn draw_row(area: &Area, axis: &XAxis, row: &Row<'_>, y: f64) -> Markup {
    let Extent { from: left, to: right } = area.across();
    html! {
        text.title x=(LEFT - 8.0) y=(y + 14.5) text-anchor="end" { (row.name) }
        rect.lane x=(left) y=(y) width=(right - left) height=(ROW) rx="2" {}
        @for spell in row.strip.spells() {
            @if let Some(ink) = (row.ink)(spell.mark.name) { (draw_spell(area, axis, spell, ink, y)) }
        }
    }
}

fn draw_spell(area: &Area, axis: &XAxis, spell: &Spell, ink: Ink, y: f64) -> Markup {
    let place = area.x(axis);
    let (from, to) = (round(place(spell.from)), round(place(spell.to)));
    let width = round((to - from).max(LEAST));
    let name = spoken(spell.mark.name);
    let letters = name.chars().fold(2.0, |sum, _| sum + 1.0);
    let decimals = usize::from(axis.divisor > 1.0 || axis.range.length() < 600.0);
    html! {
        rect x=(from) y=(y) width=(width) height=(ROW) fill=(ink.css()) {
            title {
                (name) ", " (format!("{:.*}", decimals, spell.from / axis.divisor))
                " to " (format!("{:.*}", decimals, spell.to / axis.divisor))
            }
        }
        @if letters * LETTER < width {
            text.inside x=(from + 7.0) y=(y + 14.5) { (name) }
        }
    }
}
