//! The plots of the thesis' experiments.

use maud::{Markup, html};

use super::around::Around;
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette;
use crate::report::chart::palette::Ink;
use crate::report::chart::plot::{Plot, PlotLayer as Drawn, y_range};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::PlotCurve as Curve;
use crate::studies::bcs_thesis as plant;
use crate::studies::bcs_thesis::corner::{BEAD, BudgetRow, DriveMode, JUDGED_MM};
use crate::studies::bcs_thesis::fit_table::{FitRow, FitTable};
use crate::studies::bcs_thesis::on_off::{Compared, WheelRun};

/// What is drawn once more, more closely \[s\].
const CLOSER_S: Range = Range::new(40.0, 60.0);

/// What a camera some way behind the nozzle brings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraGain {
    /// Distance behind the nozzle \[mm\].
    pub behind_mm: f64,
    /// Area RMSE, off over on.
    pub ratio: f64,
}

/// A curve, its name and its colour.
type NamedPoints<'a> = (&'a [(f64, f64)], &'static str, Ink);

fn plot(y_title: &str, axis: &XAxis, curves: &[NamedPoints<'_>], level: Option<f64>) -> Markup {
    let drawn: Vec<Curve> =
        curves.iter().map(|(points, ..)| points.iter().copied().collect()).collect();
    let shown: Vec<_> = drawn.iter().collect();
    let levels: Vec<f64> = level.into_iter().collect();
    let mut layers: Vec<Drawn<'_>> =
        levels.iter().map(|level| Drawn::Level(*level, palette::TARGET, "")).collect();
    layers.extend(drawn.iter().zip(curves).map(|(line, (_, _, ink))| Drawn::Curve(line, *ink)));
    let names: Vec<(&str, Ink, &str)> =
        curves.iter().map(|(_, name, ink)| (*name, *ink, "")).collect();
    let y_range = y_range(&shown, &levels);
    html! {
        (legend(&names))
        (Plot { area: Area::wide(220.0), x: axis, y_title, y_range, layers }.draw())
    }
}

/// A run beside its model, and the table of fits.
pub fn fits(table: &FitTable) -> Markup {
    let of = |which: usize| -> Vec<(f64, f64)> {
        table.example.iter().map(|row| (row[0], row[which])).collect()
    };
    let (measured, predicted) = (of(1), of(2));
    let axis = XAxis::time(Range::new(0.0, measured.last().map_or(1.0, |(t, _)| *t)));
    let flows = [
        (measured.as_slice(), "simulated with what no model tells", palette::FLOW),
        (predicted.as_slice(), "fitted model", palette::MODEL),
    ];
    let orders = |of: fn(&FitRow) -> f64| -> Vec<(f64, f64)> {
        (1_u32..).map(f64::from).zip(table.rows.iter().map(of)).collect()
    };
    let (published, simulated) =
        (orders(|row| row.published_percent), orders(|row| row.simulated_percent));
    let fits = [
        (published.as_slice(), "published", palette::TARGET),
        (simulated.as_slice(), "simulated", palette::PAPER),
    ];
    let names: Vec<String> = (1..)
        .zip(&table.rows)
        .map(|(place, row)| format!("{place}: {},{}", row.poles, row.zeros))
        .collect();
    let title = format!("poles,zeros – {}", names.join("   "));
    #[expect(clippy::cast_precision_loss, reason = "eight models")]
    let range = Range::new(1.0, table.rows.len() as f64);
    html! {
        (plot("flow about its mean [mm³/s]", &axis, &flows, None))
        (plot("fit [%]", &XAxis { title, range, divisor: 1.0 }, &fits, None))
    }
}

/// The control off, and with either controller on.
pub fn runs(thesis: &Compared, ours: &Compared) -> Markup {
    let [off, on] = &thesis.example;
    let [_, best] = &ours.example;
    let axis = time(off);
    let runs = |of: fn(&WheelRun) -> &[(f64, f64)]| {
        [
            (of(off), "off", palette::DEMAND),
            (of(on), "the thesis' controller", palette::PAPER),
            (of(best), "ours", palette::OURS),
        ]
    };
    let near = |run: &WheelRun| -> Vec<(f64, f64)> {
        run.area
            .iter()
            .copied()
            .filter(|(t, _)| (CLOSER_S.min..=CLOSER_S.max).contains(t))
            .collect()
    };
    let (theirs, best_near) = (near(on), near(best));
    let closer = [
        (theirs.as_slice(), "the thesis' controller", palette::PAPER),
        (best_near.as_slice(), "ours", palette::OURS),
    ];
    let closer_axis = XAxis::time(CLOSER_S);
    let wanted = Some(plant::on_off::AREA_MM2);
    let flow = [(off.flow.as_slice(), "flow at the nozzle", palette::FLOW)];
    html! {
        (plot("section [mm²]", &axis, &runs(|run| &run.area), wanted))
        (plot("section, looked at more closely [mm²]", &closer_axis, &closer, wanted))
        (plot("width [mm]", &axis, &runs(|run| &run.width), None))
        (plot("wheel's surface [mm/s]", &axis, &runs(|run| &run.speed), None))
        (plot("flow [mm³/s]", &axis, &flow, None))
    }
}

/// What either controller leaves of the section with an exact model.
pub fn exact([thesis, ours]: &[Compared; 2]) -> Markup {
    let of = |found: &Compared| -> Vec<(f64, f64)> {
        let [_, on] = &found.example;
        let judged = on.area.iter().filter(|(t, _)| *t >= plant::on_off::JUDGED_FROM_S);
        judged.map(|(t, area)| (*t, area - plant::on_off::AREA_MM2)).collect()
    };
    let (theirs, best) = (of(thesis), of(ours));
    let curves = [
        (theirs.as_slice(), "the thesis' controller", palette::PAPER),
        (best.as_slice(), "ours", palette::OURS),
    ];
    let axis =
        XAxis::time(Range::new(plant::on_off::JUDGED_FROM_S, time(&thesis.example[0]).range.max));
    plot("section − 45 [mm²]", &axis, &curves, None)
}

fn time(run: &WheelRun) -> XAxis {
    XAxis::time(Range::new(0.0, run.area.last().map_or(1.0, |(t, _)| *t)))
}

/// What a camera can do, beside its bound.
pub fn sensing(found: &[CameraGain], bound: &[CameraGain]) -> Markup {
    let range = Range::new(0.0, bound.last().map_or(1.0, |gain| gain.behind_mm));
    let points = |gains: &[CameraGain]| -> Vec<(f64, f64)> {
        gains.iter().map(|gain| (gain.behind_mm, gain.ratio)).collect()
    };
    let (found, bound) = (points(found), points(bound));
    let axis = XAxis { title: "camera behind the nozzle [mm]".to_owned(), range, divisor: 1.0 };
    let curves =
        [(bound.as_slice(), "bound", palette::LIMIT), (found.as_slice(), "ours", palette::OURS)];
    plot("area RMSE, off over on", &axis, &curves, None)
}

/// What is gained for the time that is added, and runs around the corner.
pub fn corner(rows: &[BudgetRow], runs: &[Around; 3]) -> Markup {
    let of = |value: &dyn Fn(&BudgetRow) -> f64| -> Vec<(f64, f64)> {
        rows.iter().map(|row| (row.budget_s, value(row))).collect()
    };
    let bound = of(&|row| row.bound_ratio(DriveMode::Constant));
    let constant = of(&|row| row.ratio(DriveMode::Constant));
    let proportional = of(&|row| row.ratio(DriveMode::Proportional));
    let ratios = [
        (bound.as_slice(), "bound for the constant one, without noise", palette::LIMIT),
        (constant.as_slice(), "a constant extruder over ours", palette::PAPER),
        (proportional.as_slice(), "a proportional extruder over ours", palette::DEMAND),
    ];
    let range = Range::new(0.0, rows.last().map_or(1.0, |row| row.budget_s));
    let time = XAxis { title: "time that may be added [s]".to_owned(), range, divisor: 1.0 };
    let path = XAxis::path(Range::new(-JUDGED_MM, JUDGED_MM));
    let inks = [palette::PAPER, palette::DEMAND, palette::OURS];
    let over = |pick: fn(&Around) -> &[(f64, f64)]| -> Vec<NamedPoints<'_>> {
        runs.iter().zip(inks).map(|(run, ink)| (pick(run), run.name, ink)).collect()
    };
    html! {
        (plot("width error RMS, baseline over planned", &time, &ratios, Some(1.0)))
        (plot("width error [%]", &path, &over(|run| &run.error), Some(0.0)))
        (plot("robot's speed [mm/s]", &path, &over(|run| &run.speed), None))
        (plot("flow at the nozzle [mm³/s]", &path, &over(|run| &run.flow), None))
        p.hint { "Per cent are of a bead of " (BEAD.area_mm2) " mm², averaged over the nozzle." }
    }
}
