//! `truebead lab accuracy --roughness`: long torn beads that pass through the gauge.

use std::process::ExitCode;

use anyhow::Result;
use rayon::prelude::*;

use super::arguments::AccuracyArgs;
use super::publish::{Texts, make_folder};
use crate::calibration::SurfaceMap;
use crate::cli::print::Verbosity;
use crate::core::Mm;
use crate::io::progress::SharedProgress;
use crate::studies::accuracy::drawn::LongBead;
use crate::studies::accuracy::roughness_table::{
    BeadOutcome, OwnMeanError, Ratio, RoughnessEstimate, figures,
};
use crate::studies::accuracy::table::{markdown, table};
use crate::vision::{Measurer, Roughness, RoughnessEstimator};

/// Length of each bead in correlation lengths.
const CORRELATION_LENGTHS: f64 = 50.0;
/// Motion of a bead from frame to frame \[px\]: the length of a gauge, and a tenth of it, so that
/// each part is seen in ten frames.
const ADVANCES_PX: [usize; 2] = [100, 10];

/// Renders and measures the beads.
pub fn judge(args: &AccuracyArgs, voice: Verbosity) -> Result<ExitCode> {
    make_folder(args)?;
    let progress = SharedProgress::new("measuring", "beads", args.beads, voice.quiet);
    let outcomes: Result<Vec<[BeadOutcome; 2]>> = (0..args.beads)
        .into_par_iter()
        .map(|number| {
            let bead = LongBead::draw(number, CORRELATION_LENGTHS);
            let [apart, overlapping] = ADVANCES_PX.map(|advance| pass(&bead, advance));
            progress.advance();
            Ok([apart?, overlapping?])
        })
        .collect();
    progress.finish();
    let outcomes = outcomes?;
    let mut all = Vec::new();
    for (index, advance) in ADVANCES_PX.into_iter().enumerate() {
        let of_advance: Vec<BeadOutcome> =
            outcomes.iter().map(|both| both[index].clone()).collect();
        all.extend(figures(advance, &of_advance, LongBead::lengths_px()));
    }
    let missed = all.iter().any(|figures| !figures.missed.is_empty());
    Texts { table: table(&all), markdown: markdown(&all) }.publish(args, "roughness", &all, missed)
}

/// Measures a bead while it passes through its gauge.
fn pass(bead: &LongBead, advance: usize) -> Result<BeadOutcome> {
    let surface = SurfaceMap::from_scale(1.0);
    let mut measurer = Measurer::new(bead.gauge(), None);
    let mut estimator = RoughnessEstimator::default();
    let mut widths = Vec::new();
    let beyond = bead.rows() - bead.gauge_rows();
    for (frame, first_row) in (0..).zip((0..beyond + advance).step_by(advance)) {
        let passage = bead.take(frame, first_row)?;
        let Ok(measured) = measurer.measure(&passage.frame, &surface) else { continue };
        widths.push(OwnMeanError {
            error_px: measured.width.get() - bead.own_width_px(),
            sigma_px: measured.sigma.get(),
        });
        if let Some(local) = measurer.local_widths(&measured, &surface) {
            estimator.add(&local, None);
        }
    }
    let found = estimator.estimate().map(|found| found_of(&found, bead)).transpose()?;
    Ok(BeadOutcome { length_px: bead.length_px(), estimate: found, widths })
}

fn found_of(found: &Roughness, bead: &LongBead) -> Result<RoughnessEstimate> {
    let ratio = |found: Mm, sigma: Mm, truth: f64| Ratio {
        value: found.get() / truth,
        sigma: sigma.get() / found.get(),
    };
    #[expect(clippy::cast_precision_loss, reason = "rows of an image")]
    let gauge = Mm::new(bead.gauge_rows() as f64)?;
    Ok(RoughnessEstimate {
        roughness: ratio(found.roughness, found.roughness_sigma, bead.roughness_px()),
        length: ratio(found.length, found.length_sigma, bead.length_px()),
        gauge_mean_sigma_px: found.of_gauge_mean(gauge).get(),
    })
}
