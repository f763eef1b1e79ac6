//! `[gauge]`: where and how the bead is measured.

use crate::document::Table;
use crate::frame::Channel;
use crate::geometry::Roi;
use crate::units::Mm;
use crate::vision::{Axis, Gauge, Method, Polarity};

/// Largest image side that is taken \[px\].
const MAX_SIDE_PX: f64 = 65_536.0;
pub(super) fn read_gauge(table: &Table<'_>) -> Option<Gauge> {
    let roi = read_roi(table);
    let axis = table.required_choice(
        "bead_axis",
        &[("vertical", Axis::Vertical), ("horizontal", Axis::Horizontal)],
    );
    let polarity = table.required_choice(
        "polarity",
        &[("bright", Polarity::Bright), ("dark", Polarity::Dark), ("any", Polarity::Any)],
    );
    let range = table.numbers::<2>("width_range_mm", 1e-6..=1e5);
    let method =
        table.choice("method", &[("caliper", Method::Caliper), ("edge_lines", Method::EdgeLines)]);
    let calipers = table.integer_or("calipers", 4..=4096, 64);
    let min_contrast_grey = table.number_or("min_contrast_grey", 0.1..=255.0, 6.0);
    let [min, max] = range?;
    if min >= max {
        table.report("width_range_mm", format!("[{min}, {max}]"), "the narrower width first");
        return None;
    }
    Some(Gauge {
        roi: roi?,
        axis: axis?,
        polarity: polarity?,
        width_range: (Mm::new(min).ok()?, Mm::new(max).ok()?),
        method: method?,
        calipers: usize::try_from(calipers?).ok()?,
        min_contrast_grey: min_contrast_grey?,
    })
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
