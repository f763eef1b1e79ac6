//! `truebead lab accuracy --roughness`: long torn beads that pass through the gauge.

use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use rayon::prelude::*;

use super::arguments::AccuracyArgs;
use crate::calibration::SurfaceMap;
use crate::cli::print::Verbosity;
use crate::core::units::Mm;
use crate::io::progress::Progress;
use crate::rows::output;
use crate::studies::accuracy::drawn::LongBead;
use crate::studies::accuracy::roughness_table::{
    BeadOutcome, OwnMeanError, Ratio, RoughnessEstimate, figures,
};
use crate::studies::accuracy::table::{markdown, table};
use crate::vision::{Measurer, Roughness, RoughnessEstimator};

/// Length of each bead in its correlation lengths.
const CORRELATION_LENGTHS: f64 = 50.0;
/// How far a bead moves on from frame to frame \[px\]: by a gauge, and as little as that
/// each piece is seen in ten frames.
const ADVANCES_PX: [usize; 2] = [100, 10];

/// Renders and measures the beads.
pub fn judge(args: &AccuracyArgs, voice: Verbosity) -> Result<ExitCode> {
    if let Some(out) = &args.out {
        output::make_folder(out)?;
    }
    let progress = Mutex::new(Progress::new("measuring", "beads", Some(args.beads), voice.quiet));
    let outcomes: Result<Vec<[BeadOutcome; 2]>> = (0..args.beads)
        .into_par_iter()
        .map(|number| {
            let bead = LongBead::draw(number, CORRELATION_LENGTHS);
            let [apart, overlapping] = ADVANCES_PX.map(|advance| pass(&bead, advance));
            progress.lock().unwrap_or_else(PoisonError::into_inner).advance();
            Ok([apart?, overlapping?])
        })
        .collect();
    progress.into_inner().unwrap_or_else(PoisonError::into_inner).finish();
    let outcomes = outcomes?;
    let mut all = Vec::new();
    for (way, advance) in ADVANCES_PX.into_iter().enumerate() {
        let of_way: Vec<BeadOutcome> = outcomes.iter().map(|both| both[way].clone()).collect();
        all.extend(figures(advance, &of_way, LongBead::lengths_px()));
    }
    if let Some(out) = &args.out {
        let json = serde_json::to_vec_pretty(&all).context("roughness.json")?;
        output::write_whole(out, "roughness.json", &json)?;
        output::write_whole(out, "roughness.md", markdown(&all).as_bytes())?;
    }
    say!("{}", table(&all).trim_end());
    let missed = all.iter().any(|figures| !figures.missed.is_empty());
    Ok(if missed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Lets a bead pass through its gauge.
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
