//! Relative standard deviation of a width over the image, with the gauge: as text and as a page.

use std::path::Path;

use nalgebra::Vector2;

use crate::assembly::LoadedCell;
use crate::calibration::Calibration;
use crate::calibration::relative_sigma_map::{MapBead, RelativeSigmaMap, relative_sigma_at};
use crate::calibration::width_map::{Cells, MAP_CELLS};
use crate::core::{ImagePoint, Roi};
use crate::io::atomic_file::write_atomic;
use crate::report::calibration::cell::CellCalibrationPage;
use crate::vision::gauge::BeadAxis;

/// Cells of the map as text, in columns and rows.
const TEXT_CELLS: Cells = Cells { columns: 8, rows: 6 };

/// Prints the map, and writes the page if a path is given. A calibration with a single number for
/// the whole image, or with none, has no map.
pub fn tell(loaded: &LoadedCell, page: Option<&Path>) -> anyhow::Result<()> {
    let Calibration::Full { quality, .. } = &loaded.calibration else {
        anyhow::ensure!(page.is_none(), "--report: mm_per_px has no map of its uncertainty");
        return Ok(());
    };
    let surface = loaded.surface(None);
    let bead = bead(loaded);
    let Some(text) = RelativeSigmaMap::of(&surface, &bead, TEXT_CELLS) else {
        if let Some(fraction) = surface.width_relative_sigma() {
            let percent = 100.0 * fraction;
            say!(
                "  sigma        uncertainty of every width by the calibration {percent:.3} %: one"
            );
            say!("               number for the whole image; `calibrate` anew makes a map");
        } else {
            say!("  sigma        the uncertainty of a width by the calibration is unknown");
        }
        anyhow::ensure!(page.is_none(), "--report: the calibration file has no [uncertainty]");
        return Ok(());
    };
    let roi = loaded.cell.gauge.roi;
    let in_gauge = relative_sigma_at(&surface, &bead, middle(roi));
    say!(
        "  sigma        uncertainty of a width of {:.1} mm by the calibration [% of it], where its",
        { bead.width_mm }
    );
    say!("               middle is seen; [ ] in the gauge, - not seen whole");
    for line in lines(&text, roi) {
        say!("               {line}");
    }
    if let Some(fraction) = in_gauge {
        say!(
            "               {:.3} % or {:.4} mm in the middle of the gauge",
            100.0 * fraction,
            fraction * bead.width_mm
        );
    }
    let Some(path) = page else { return Ok(()) };
    let Some(map) = RelativeSigmaMap::of(&surface, &bead, MAP_CELLS) else { return Ok(()) };
    let page = CellCalibrationPage {
        cell: &loaded.path.display().to_string(),
        calibration: &loaded.calibration_words(),
        map: &map,
        gauge: roi,
        in_gauge,
        covered_px: quality.and_then(|quality| quality.seen_px),
    };
    write_atomic(path, page.page().as_bytes())?;
    say!("  wrote        {}", path.display());
    Ok(())
}

/// A bead of plausible width in the direction of the gauge: its width is the geometric mean of the
/// narrowest and the widest.
fn bead(loaded: &LoadedCell) -> MapBead {
    let gauge = &loaded.cell.gauge;
    let range = gauge.width_range;
    let across = match gauge.axis {
        BeadAxis::Vertical => Vector2::x(),
        BeadAxis::Horizontal => Vector2::y(),
    };
    MapBead { width_mm: (range.min.get() * range.max.get()).sqrt(), across }
}

#[expect(clippy::cast_precision_loss, reason = "pixels of an image")]
fn middle(roi: Roi) -> ImagePoint {
    let half = |from: usize, length: usize| from as f64 + (length as f64 - 1.0) / 2.0;
    ImagePoint::new(half(roi.x, roi.width), half(roi.y, roi.height))
}

/// The map as text, with the columns and rows of the cells' middles \[px\].
fn lines(map: &RelativeSigmaMap, gauge: Roi) -> Vec<String> {
    let Cells { columns, rows } = map.counts;
    let middle = |cell: u32| {
        let [left, top, right, bottom] = map.cell_px(cell);
        (f64::midpoint(left, right), f64::midpoint(top, bottom))
    };
    let heads: Vec<String> =
        (0..columns).map(|column| format!("{:>8.0}", middle(column).0)).collect();
    let mut lines = vec![format!("{:>6}{}", "px", heads.concat())];
    for row in 0..rows {
        let cells: String = (0..columns)
            .map(|column| {
                let cell = row * columns + column;
                let fraction = map.cells.get(cell as usize).copied().flatten();
                let words = fraction.map_or_else(|| "-".to_owned(), percent);
                if map.is_in(gauge, cell) {
                    format!(" [{words:>5}]")
                } else {
                    format!("{words:>7} ")
                }
            })
            .collect();
        lines.push(format!("{:>6.0}{}", middle(row * columns).1, cells.trim_end()));
    }
    lines
}

/// A fraction in percent, with three significant digits.
fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    let places = if percent < 1.0 {
        3
    } else if percent < 10.0 {
        2
    } else {
        1
    };
    format!("{percent:.places$}")
}
