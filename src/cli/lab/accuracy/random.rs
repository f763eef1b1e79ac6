//! `truebead lab accuracy --random`: frames with random parameters.

use std::io::Cursor;
use std::ops::Range;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use image::{GrayImage, ImageFormat};
use rayon::prelude::*;

use super::arguments::AccuracyArgs;
use super::publish::Texts;
use crate::calibration::SurfaceMap;
use crate::cli::print::Verbosity;
use crate::core::{Pixels, Size};
use crate::io::progress::SharedProgress;
use crate::rows::output;
use crate::studies::accuracy::drawn::{self, DrawnFrame, DrawnSet};
use crate::studies::accuracy::drawn_table::{
    Deviation, DrawnOutcome, FrameRejection, figures, markdown,
};
use crate::studies::accuracy::table::table;
use crate::vision::Measurer;

/// Default number of frames of a set. Derived: a limit of 0.01 % of silently wrong widths is then
/// three frames (reference/accuracy.md).
const FRAMES: u64 = 30_000;
/// Name that stands for all sets.
const ALL: &str = "all";

/// Renders frames with random parameters, measures each independently, and compares the figures of
/// each set with its limits: status 1 if one is missed. Writes tables, and the first frames if
/// requested.
pub fn judge(args: &AccuracyArgs, voice: Verbosity) -> Result<ExitCode> {
    let sets = named(&args.random)?;
    let frames = args.frames.unwrap_or(FRAMES);
    let first = args.first_frame;
    if let Some(out) = &args.out {
        output::make_folder(out)?;
        if args.keep_frames > 0 {
            let folder = out.join("frames");
            output::make_folder(&folder)?;
            sets.iter().try_for_each(|set| keep(set, first..first + args.keep_frames, &folder))?;
        }
    }
    let total = frames * u64::try_from(sets.len()).unwrap_or(u64::MAX);
    let progress = SharedProgress::new("measuring", "frames", total, voice.quiet);
    let mut all = Vec::new();
    for set in &sets {
        let outcomes: Result<Vec<DrawnOutcome>> = (first..first + frames)
            .into_par_iter()
            .map(|number| {
                let outcome = measure(&set.take(number)?, number);
                progress.advance();
                Ok(outcome)
            })
            .collect();
        all.extend(figures(set, &outcomes?));
    }
    progress.finish();
    let missed = all.iter().any(|figures| !figures.missed.is_empty());
    let texts = Texts { table: table(&all), markdown: markdown(&sets, &all) };
    texts.publish(args, "random", &all, missed)
}

/// The sets with these names, each once.
fn named(names: &[String]) -> Result<Vec<DrawnSet>> {
    let mut chosen = Vec::new();
    for name in names {
        let sets = if name == ALL { drawn::all() } else { drawn::named(name) };
        if sets.is_empty() {
            let known: Vec<&str> = drawn::all().iter().map(|set| set.name).collect();
            refuse!(
                "--random {name}: there is no such set; {ALL}, or some of {}",
                known.join(", ")
            );
        }
        chosen.extend(sets.iter().map(|set| set.name));
    }
    Ok(drawn::all().into_iter().filter(|set| chosen.contains(&set.name)).collect())
}

/// Measures a frame with a new measurer: its width does not depend on other frames.
fn measure(drawn: &DrawnFrame, number: u64) -> DrawnOutcome {
    let surface = SurfaceMap::from_scale(1.0);
    let width = match Measurer::new(drawn.gauge, None).measure(&drawn.frame, &surface) {
        Ok(found) => Ok(Deviation {
            error_px: found.width.get() - drawn.truth_px,
            sigma_px: found.sigma.get(),
        }),
        Err(reject) => {
            let names_gamma = reject.to_string().contains("gamma");
            Err(FrameRejection { status: reject.status(), names_gamma })
        }
    };
    DrawnOutcome { frame: number, parameters: drawn.parameters.clone(), width }
}

/// Saves the first frames of a set, and a table of their parameters and results.
fn keep(set: &DrawnSet, numbers: Range<u64>, folder: &Path) -> Result<()> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let first = numbers.start;
    for number in numbers {
        let drawn = set.take(number)?;
        let outcome = measure(&drawn, number);
        if number == first {
            let names = drawn.parameters.iter().map(|parameter| parameter.name);
            let heads = ["file", "status", "width_px", "sigma_px", "truth_px"];
            table.write_record(heads.into_iter().chain(names))?;
        }
        let file = format!("{}-{number:06}.png", set.name);
        let measured = match &outcome.width {
            Ok(found) => [
                "ok".to_owned(),
                format!("{:.4}", drawn.truth_px + found.error_px),
                format!("{:.4}", found.sigma_px),
            ],
            Err(refusal) => [refusal.status.to_owned(), String::new(), String::new()],
        };
        let truth = format!("{:.4}", drawn.truth_px);
        let values = drawn.parameters.iter().map(|parameter| format!("{:.4}", parameter.value));
        let row = [file.clone()].into_iter().chain(measured).chain([truth]).chain(values);
        table.write_record(row)?;
        output::write_whole(folder, &file, &png(&drawn)?)?;
    }
    let table = table.into_inner().context("the table of kept frames")?;
    Ok(output::write_whole(folder, &format!("{}.csv", set.name), &table).map(drop)?)
}

fn png(drawn: &DrawnFrame) -> Result<Vec<u8>> {
    let Size { width, height } = drawn.frame.size();
    let Pixels::Grey8(pixels) = drawn.frame.pixels() else { return Ok(Vec::new()) };
    let image = GrayImage::from_raw(u32::try_from(width)?, u32::try_from(height)?, pixels.clone())
        .context("a drawn frame")?;
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}
