//! The plots of the thesis' experiments.

use maud::{Markup, html};

use crate::numeric::number::to_f64;
use crate::report::chart::area::XAxis;
use crate::report::chart::palette::{DEMAND, FLOW, LIMIT, MODEL, OURS, PAPER, TARGET};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::CurvePoint;
use crate::studies::bcs_thesis::corner::{BEAD, BudgetRow, CornerRun, DriveMode, JUDGED_MM};
use crate::studies::bcs_thesis::fit_table::{FitRow, FitTable};
use crate::studies::bcs_thesis::on_off::{AREA_MM2, Compared, JUDGED_FROM_S, WheelRun};
use crate::studies::plot::{Line, axis, plot_with_legend};

/// The period of the enlarged plot \[s\].
const CLOSER_S: Range = Range::new(40.0, 60.0);

fn plot(y_title: &str, axis: &XAxis, lines: &[Line<'_>]) -> Markup {
    plot_with_legend(220.0, axis, y_title, lines)
}

/// A line without a name at a reference level, behind some curves.
fn with_reference<const N: usize>(level: f64, lines: [Line<'_>; N]) -> Vec<Line<'_>> {
    std::iter::once(Line::level("", TARGET, level, "")).chain(lines).collect()
}

/// A measured and a predicted run, and the table of fits.
pub fn fits(table: &FitTable) -> Markup {
    let of = |which: usize| table.example.iter().map(move |row| (row[0], row[which]));
    let time = XAxis::time(Range::new(0.0, table.example.last().map_or(1.0, |row| row[0])));
    let flows = [
        Line::curve("simulated, with unmodelled disturbance", FLOW, of(1)),
        Line::curve("fitted model", MODEL, of(2)),
    ];
    let orders = |of: fn(&FitRow) -> f64| (1..).map(f64::from).zip(table.rows.iter().map(of));
    let fits = [
        Line::curve("published", TARGET, orders(|row| row.published_percent)),
        Line::curve("simulated", PAPER, orders(|row| row.simulated_percent)),
    ];
    let names =
        (1..).zip(&table.rows).map(|(at, row)| format!("{at}: {},{}", row.poles, row.zeros));
    let title = format!("poles,zeros – {}", names.collect::<Vec<_>>().join("   "));
    let orders = axis(title, Range::new(1.0, to_f64(table.rows.len())));
    html! {
        (plot("flow about its mean [mm³/s]", &time, &flows))
        (plot("fit [%]", &orders, &fits))
    }
}

/// Bead, speed and flow of one run at constant speed, with the thesis' controller and with ours.
/// The deposition wheel moves under the nozzle in place of the robot.
pub fn runs(thesis: &Compared, ours: &Compared) -> Markup {
    let [off, on] = &thesis.example;
    let [_, ours_on] = &ours.example;
    let axis = XAxis::time(Range::new(0.0, end_s(off)));
    let lines = |of: fn(&WheelRun) -> &[CurvePoint], range: Range| {
        [("off", DEMAND, off), ("the thesis' controller", PAPER, on), ("ours", OURS, ours_on)].map(
            |(name, ink, run)| {
                let within = of(run).iter().filter(|(t, _)| (range.min..=range.max).contains(t));
                Line::curve(name, ink, within.copied())
            },
        )
    };
    let all = |of| lines(of, axis.range);
    let [_, theirs, ours_on] = lines(|run| &run.area, CLOSER_S);
    let (near, near_axis) = (with_reference(AREA_MM2, [theirs, ours_on]), XAxis::time(CLOSER_S));
    let flow = [Line::curve("flow at the nozzle", FLOW, off.flow.iter().copied())];
    html! {
        (plot("section [mm²]", &axis, &with_reference(AREA_MM2, all(|run| &run.area))))
        (plot("section, looked at more closely [mm²]", &near_axis, &near))
        (plot("width [mm]", &axis, &all(|run| &run.width)))
        (plot("wheel's surface [mm/s]", &axis, &all(|run| &run.speed)))
        (plot("flow [mm³/s]", &axis, &flow))
    }
}

/// The section's deviation that remains with each controller and an exact model.
pub fn exact([thesis, ours]: &[Compared; 2]) -> Markup {
    let of = |found: &Compared| -> Vec<CurvePoint> {
        let [_, on] = &found.example;
        let judged = on.area.iter().filter(|(t, _)| *t >= JUDGED_FROM_S);
        judged.map(|(t, area)| (*t, area - AREA_MM2)).collect()
    };
    let lines = [
        Line::curve("the thesis' controller", PAPER, of(thesis)),
        Line::curve("ours", OURS, of(ours)),
    ];
    let axis = XAxis::time(Range::new(JUDGED_FROM_S, end_s(&thesis.example[0])));
    plot("section − 45 [mm²]", &axis, &lines)
}

fn end_s(run: &WheelRun) -> f64 {
    run.area.last().map_or(1.0, |(t, _)| *t)
}

/// Ratio of the section's RMSE off over on by the camera's distance behind the nozzle \[mm\], and
/// its bound.
pub fn sensing(found: Vec<CurvePoint>, bound: Vec<CurvePoint>) -> Markup {
    let range = Range::new(0.0, bound.last().map_or(1.0, |(behind_mm, _)| *behind_mm));
    let axis = axis("camera behind the nozzle [mm]", range);
    let lines = [Line::curve("bound", LIMIT, bound), Line::curve("ours", OURS, found)];
    plot("area RMSE, off over on", &axis, &lines)
}

/// Error ratio over the added time, and runs around the corner with a constant, a proportional and
/// a planned extruder.
pub fn corner(rows: &[BudgetRow], runs: &[CornerRun; 3]) -> Markup {
    let line = |name, ink, value: &dyn Fn(&BudgetRow) -> f64| {
        Line::curve(name, ink, rows.iter().map(|row| (row.budget_s, value(row))))
    };
    let ratios = [
        line("bound for the constant one, without noise", LIMIT, &|row| {
            row.bound_ratio(DriveMode::Constant)
        }),
        line("a constant extruder over ours", PAPER, &|row| row.ratio(DriveMode::Constant)),
        line("a proportional extruder over ours", DEMAND, &|row| {
            row.ratio(DriveMode::Proportional)
        }),
    ];
    let range = Range::new(0.0, rows.last().map_or(1.0, |row| row.budget_s));
    let time = axis("time that may be added [s]", range);
    let path = XAxis::path(Range::new(-JUDGED_MM, JUDGED_MM));
    let [constant, proportional, planned] = runs.each_ref();
    let over = |points: &dyn Fn(&CornerRun) -> Vec<CurvePoint>| {
        [
            Line::curve("constant extruder", PAPER, points(constant)),
            Line::curve("proportional extruder", DEMAND, points(proportional)),
            Line::curve("planned", OURS, points(planned)),
        ]
    };
    let error = |run: &CornerRun| {
        run.quiet().along().map(|(at, error)| (at, 100.0 * error)).collect::<Vec<_>>()
    };
    let speed = |run: &CornerRun| run.trajectory().map(|(at, speed, _)| (at, speed)).collect();
    let flow = |run: &CornerRun| run.trajectory().map(|(at, _, flow)| (at, flow)).collect();
    html! {
        (plot("width error RMS, baseline over planned", &time, &with_reference(1.0, ratios)))
        (plot("width error [%]", &path, &with_reference(0.0, over(&error))))
        (plot("robot's speed [mm/s]", &path, &over(&speed)))
        (plot("flow at the nozzle [mm³/s]", &path, &over(&flow)))
        p.hint { "Per cent are of a bead of " (BEAD.area_mm2) " mm², averaged over the nozzle." }
    }
}
