//! The experiments of the source papers beside what was published: a table,
//! `reproduce.json` and a page with plots.

use maud::{Markup, html};
use serde::Serialize;

use super::report::area::{Area, XAxis};
use super::report::plot::{Layer as Drawn, Plot, y_range};
use super::report::sections::legend;
use super::report::series::Series;
use super::report::{palette, whole_page};
use crate::control::limiter::Limits;
use crate::sim::barjuei2022::StandOff;
use crate::sim::score::{AlongBead, Score};

/// One quantity of one experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The source.
    pub seed: &'static str,
    /// The experiment.
    pub case: String,
    /// What was measured.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The published number; none where the paper gives none.
    pub published: Option<f64>,
    /// What the paper's own method gives in our simulation; none where it
    /// never gets there.
    pub simulated: Option<f64>,
    /// What this program's best method gives on the same plant; none where
    /// there is none yet.
    pub ours: Option<f64>,
}

/// The rows as a table for people.
pub fn table(rows: &[Row]) -> String {
    let width = rows.iter().map(|row| row.case.chars().count()).max().unwrap_or(4);
    let mut text = format!(
        "{:width$}  {:28} {:5} {:>9} {:>9} {:>9}\n",
        "case", "quantity", "unit", "published", "simulated", "ours"
    );
    for row in rows {
        let [published, simulated, ours] = [row.published, row.simulated, row.ours].map(number);
        let line = format!(
            "{:width$}  {:28} {:5} {published:>9} {simulated:>9} {ours:>9}\n",
            row.case, row.quantity, row.unit
        );
        text.push_str(&line);
    }
    text
}

fn number(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| {
        let digits = if value.abs() >= 20.0 { 1 } else { 2 };
        let text = format!("{value:.digits$}");
        if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    })
}

/// What the page of the 2022 paper shows.
#[derive(Debug)]
pub struct Barjuei2022<'a> {
    /// The table.
    pub rows: &'a [Row],
    /// Each layer's target \[mm\] and its first seed.
    pub layers: &'a [(f64, Score)],
    /// The cell's limits.
    pub limits: Limits,
    /// The stand-off curve.
    pub stand_off: &'a [StandOff],
    /// How often and with what.
    pub about: &'a str,
}

impl Barjuei2022<'_> {
    /// The page.
    pub fn page(&self) -> String {
        let title = "Shojaei Barjuei et al. 2022, reproduced";
        let body = html! {
            h1 { (title) }
            p.hint { (self.about) }
            section {
                h2 { "Beside the published numbers" }
                (self.markup_table())
            }
            @for (target, score) in self.layers {
                section {
                    h2 { "Layer of " (target) " mm" }
                    (self.layer(*target, score))
                }
            }
            section {
                h2 { "Stand-off" }
                p.hint { "A bead of 42 mm that lies nearer to the camera, or farther, than where \
                    the scale was taken." }
                (self.stand_off())
            }
            footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
                ". The numbers are in reproduce.json." }
        };
        whole_page(title, &body).into_string()
    }

    fn markup_table(&self) -> Markup {
        html! {
            table {
                thead { tr {
                    @for head in ["case", "quantity", "unit", "published", "simulated", "ours"] {
                        th { (head) }
                    }
                } }
                tbody { @for row in self.rows { tr {
                    td { (row.case) }
                    td { (row.quantity) }
                    td { (row.unit) }
                    @for value in [row.published, row.simulated, row.ours] { td { (number(value)) } }
                } } }
            }
        }
    }

    fn layer(&self, target: f64, score: &Score) -> Markup {
        let (width, speed) = (series(&score.widths), series(&score.speeds));
        let Some(range) = speed.extent() else { return html! {} };
        let axis = XAxis::path(range);
        let name = format!("{target} mm");
        let bounds = [self.limits.min_speed.get(), self.limits.max_speed.get()];
        let names = bounds.map(|bound| format!("{bound} mm/s"));
        let widths = Plot {
            area: Area::wide(220.0),
            x: &axis,
            y_title: "width [mm]",
            y_range: y_range(&[&width], &[target]),
            layers: vec![
                Drawn::Curve(&width, palette::WIDTH),
                Drawn::Level(target, palette::TARGET, &name),
            ],
        };
        let speeds = Plot {
            area: Area::wide(220.0),
            x: &axis,
            y_title: "speed [mm/s]",
            y_range: y_range(&[&speed], &bounds),
            layers: vec![
                Drawn::Curve(&speed, palette::SPEED),
                Drawn::Level(bounds[0], palette::LIMIT, &names[0]),
                Drawn::Level(bounds[1], palette::LIMIT, &names[1]),
            ],
        };
        html! {
            (legend(&[("measured width", palette::WIDTH, ""), ("target", palette::TARGET, "dash")]))
            (widths.draw())
            (legend(&[("robot", palette::SPEED, ""), ("limits of the cell", palette::LIMIT, "dash")]))
            (speeds.draw())
        }
    }

    fn stand_off(&self) -> Markup {
        let pick = |value: fn(&StandOff) -> f64| {
            let points: Vec<AlongBead> =
                self.stand_off.iter().map(|point| (point.nearer_mm, value(point))).collect();
            series(&points)
        };
        let (scale, full) = (pick(|p| p.scale_error_mm), pick(|p| p.full_error_mm));
        let Some(range) = scale.extent() else { return html! {} };
        let axis =
            XAxis { title: "height above the calibrated one [mm]".to_owned(), range, divisor: 1.0 };
        let plot = Plot {
            area: Area::wide(260.0),
            x: &axis,
            y_title: "error of the width [mm]",
            y_range: y_range(&[&scale, &full], &[]),
            layers: vec![
                Drawn::Curve(&scale, palette::REJECTED),
                Drawn::Curve(&full, palette::WIDTH),
            ],
        };
        html! {
            (legend(&[
                ("single scale, as published", palette::REJECTED, ""),
                ("full calibration, height given", palette::WIDTH, ""),
            ]))
            (plot.draw())
        }
    }
}

fn series(points: &[AlongBead]) -> Series {
    let mut series = Series::default();
    for (x, y) in points {
        series.push(*x, *y);
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_the_keys_that_others_rely_on() {
        let row = Row {
            seed: "barjuei2022",
            case: "44 mm".into(),
            quantity: "mean error",
            unit: "mm",
            published: Some(1.3),
            simulated: Some(1.46),
            ours: None,
        };
        assert_eq!(
            serde_json::to_string(&row).unwrap(),
            r#"{"seed":"barjuei2022","case":"44 mm","quantity":"mean error","unit":"mm","published":1.3,"simulated":1.46,"ours":null}"#
        );
        assert!(table(&[row]).contains("1.46"));
    }

    #[test]
    fn nothing_is_not_less_than_nothing() {
        assert_eq!(number(Some(-0.001)), "0.00");
        assert_eq!(number(Some(-0.01)), "-0.01");
    }
}
