//! `[gauge]`: where and how the bead is measured.

use crate::core::{Channel, Mm, Roi, WidthRange};
use crate::document::Table;
use crate::vision::gauge::{self, BeadAxis, EdgeKind, Gauge, MeasureMethod, Polarity};

/// Largest accepted image side \[px\].
const MAX_SIDE_PX: f64 = 65_536.0;
/// Largest accepted `max_sigma`, as a fraction of the width.
const LARGEST_MAX_SIGMA: f64 = 0.5;
/// Gammas of cameras: 0.45 for television, 2.2 for its inverse, with room beyond.
const GAMMA_RANGE: std::ops::RangeInclusive<f64> = 0.2..=5.0;

pub(super) fn read_gauge(table: &Table<'_>) -> Option<Gauge> {
    let roi = read_roi(table);
    let axis = table.required_choice(
        "bead_axis",
        &[("vertical", BeadAxis::Vertical), ("horizontal", BeadAxis::Horizontal)],
    );
    let polarity = table.required_choice(
        "polarity",
        &[("bright", Polarity::Bright), ("dark", Polarity::Dark), ("any", Polarity::Any)],
    );
    let range = table.numbers::<2>("width_range_mm", 1e-6..=1e5);
    let method = table.choice(
        "method",
        &[("caliper", MeasureMethod::Caliper), ("edge_lines", MeasureMethod::EdgeLines)],
    );
    let calipers = table.integer_or("calipers", 4..=4096, gauge::DEFAULT_CALIPERS as u64);
    let min_contrast_grey =
        table.number_or("min_contrast_grey", 0.1..=255.0, gauge::DEFAULT_MIN_CONTRAST_GREY);
    let edge = table.choice(
        "edge",
        &[("auto", EdgeKind::Auto), ("step", EdgeKind::Step), ("groove", EdgeKind::Groove)],
    );
    let max_sigma = read_max_sigma(table);
    let gamma = read_gamma(table, method);
    let [min, max] = range?;
    if min >= max {
        table.report("width_range_mm", format!("[{min}, {max}]"), "the narrower width first");
        return None;
    }
    Some(Gauge {
        roi: roi?,
        axis: axis?,
        polarity: polarity?,
        width_range: WidthRange { min: Mm::new(min).ok()?, max: Mm::new(max).ok()? },
        method: method?,
        calipers: usize::try_from(calipers?).ok()?,
        min_contrast_grey: min_contrast_grey?,
        edge: edge?,
        max_sigma: max_sigma?,
        gamma,
    })
}

fn read_max_sigma(table: &Table<'_>) -> Option<f64> {
    let found = table.number_or("max_sigma", 0.0..=LARGEST_MAX_SIGMA, gauge::DEFAULT_MAX_SIGMA)?;
    if found <= 0.0 {
        table.report("max_sigma", "0", "a fraction of the width above 0, such as 0.02");
        return None;
    }
    Some(found)
}

/// The camera's gamma, none where the cell names none.
fn read_gamma(table: &Table<'_>, method: Option<MeasureMethod>) -> Option<f64> {
    let gamma = table.optional_number("gamma", GAMMA_RANGE)?;
    if method == Some(MeasureMethod::EdgeLines) {
        table.report("gamma", gamma.to_string(), "no gamma beside method = \"edge_lines\"");
    }
    Some(gamma)
}

fn read_roi(table: &Table<'_>) -> Option<Roi> {
    let row = table.numbers::<4>("roi_px", 0.0..=MAX_SIDE_PX)?;
    if row.iter().any(|value| value.fract() != 0.0) || row[2] < 8.0 || row[3] < 8.0 {
        table.report(
            "roi_px",
            format!("{row:?}"),
            "x, y, width, height in whole pixels, width and height 8 or more",
        );
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole and within 0..=65536"
    )]
    let [x, y, width, height] = row.map(|value| value as usize);
    Some(Roi { x, y, width, height })
}

pub(super) fn read_channel(table: &Table<'_>) -> Option<Channel> {
    table.choice(
        "channel",
        &[
            ("grey", Channel::Grey),
            ("red", Channel::Red),
            ("green", Channel::Green),
            ("blue", Channel::Blue),
        ],
    )
}
