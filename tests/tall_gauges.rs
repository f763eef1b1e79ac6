//! Gauges of all heights: how rows are taken together depends on their number, and
//! what the sets of images show at 100 rows has to hold at others.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use truebead::scenario::bead::EdgeRoughness;
use truebead::studies::accuracy::sets::{self, Set};
use truebead::studies::accuracy::studio::SetStudio;
use truebead::vision::Measurer;

const FRAMES: u64 = 20;

fn set(name: &str, rows: u32) -> Set {
    let set = sets::all().into_iter().find(|set| set.name == name).unwrap();
    Set { rows, ..set }
}

/// Errors of the measured frames and their standard deviations \[px\].
fn measure(set: &Set) -> Vec<(f64, f64)> {
    let studio = SetStudio::new(set).unwrap();
    let mut measurer = Measurer::new(studio.gauge(), None);
    let px = 1.0 / studio.mm_per_px();
    (0..FRAMES)
        .filter_map(|number| {
            let taken = studio.take(number).unwrap();
            let found = measurer.measure(&taken.frame, studio.surface()).ok()?;
            let error = found.width.get() - taken.truth.unwrap().width_mm;
            Some((error * px, found.sigma.get() * px))
        })
        .collect()
}

#[test]
fn rough_beads_are_measured_in_every_row() {
    for rows in [120, 150, 160, 161, 170, 250, 400, 500] {
        let rough = EdgeRoughness { sigma_mm: 0.3, length_mm: 2.0 };
        let found = measure(&Set { roughness: rough, ..set("blur-1.5", rows) });
        assert!(found.len() >= 18, "{rows} rows: {} measured", found.len());
        let (mut square, mut of_sigma) = (0.0, 0.0);
        for (error, sigma) in &found {
            square += error * error;
            of_sigma += (error / sigma).powi(2);
        }
        let mean = |sum: f64| (sum / f64::from(u8::try_from(found.len()).unwrap())).sqrt();
        // The shorter the gauge, the more its waves look like a slant.
        assert!(mean(square) < 40.0 / f64::from(rows), "{rows} rows: {found:?}");
        assert!(mean(of_sigma) < 2.0, "{rows} rows: {found:?}");
    }
}

#[test]
fn grains_on_smooth_beads_pass_for_no_waves() {
    for rows in [104, 120, 160, 170, 200, 300] {
        for name in ["grains-6-dark", "grains-12-bright"] {
            let found = measure(&set(name, rows));
            assert!(found.len() >= 18, "{name}, {rows} rows: {} measured", found.len());
            let worst = found.iter().fold(0.0, |worst: f64, (error, _)| worst.max(error.abs()));
            assert!(worst < 0.3, "{name}, {rows} rows: {worst}");
        }
    }
}
