//! `[extruder.readings]`: filters of the readings for the strategy.

use crate::document::Table;
use crate::extruder::ReadingFilters;
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;

/// Reads the filters; without the table there are none.
pub(super) fn read(table: &Table<'_>) -> Option<ReadingFilters> {
    if !table.has("readings") {
        return Some(ReadingFilters::default());
    }
    let table = table.table("readings")?;
    let sigmas = table.number_or("spike_sigmas", 1.0..=100.0, 4.0);
    let degree = table.integer_or("smooth_degree", 0..=3, 1);
    let spikes = table.has("spike_half_width").then(|| read_spikes(&table, sigmas));
    let smoothing = table.has("smooth_window").then(|| read_smoothing(&table, degree));
    if spikes.is_none() && smoothing.is_none() {
        let expected = "an integer from 1 to 50, or smooth_window, an odd one from 3 to 101";
        table.report("spike_half_width", "nothing", expected);
        return None;
    }
    for (key, filter, needed) in [
        ("spike_sigmas", spikes.is_some(), "spike_half_width beside it"),
        ("smooth_degree", smoothing.is_some(), "smooth_window beside it"),
    ] {
        if table.has(key) && !filter {
            table.report(key, "a number without its filter", needed);
        }
    }
    // An invalid filter was reported.
    if spikes == Some(None) || smoothing == Some(None) {
        return None;
    }
    Some(ReadingFilters { spikes: spikes.flatten(), smoothing: smoothing.flatten() })
}

fn read_spikes(table: &Table<'_>, sigmas: Option<f64>) -> Option<Hampel> {
    let half_width = table.optional_integer("spike_half_width", 1..=50);
    Hampel::new(usize::try_from(half_width?).ok()?, sigmas?).ok()
}

fn read_smoothing(table: &Table<'_>, degree: Option<u64>) -> Option<SavGol> {
    let window = table.optional_integer("smooth_window", 3..=101);
    let (window, degree) = (usize::try_from(window?).ok()?, usize::try_from(degree?).ok()?);
    let filter = SavGol::new(window, degree);
    if filter.is_err() {
        let expected = format!("an odd number from 3 to 101, above smooth_degree = {degree}");
        table.report("smooth_window", window.to_string(), expected);
    }
    filter.ok()
}
