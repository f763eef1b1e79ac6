//! `truebead lab render`: frames of a simulated bead, with their true widths.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use image::{ExtendedColorType, ImageEncoder, codecs::png};
use rayon::prelude::*;

use crate::assembly::LoadedCell;
use crate::cell::Cell;
use crate::cell::file::{CalibrationSource, Purpose};
use crate::cli::print::Verbosity;
use crate::core::Frame;
use crate::io::progress::SharedProgress;
use crate::sim::frame_series::FrameSeries;
use crate::sim::truth::Truth;

/// Renders frames of a simulated bead, with the truth of each.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead lab render test_images/straight/scenario.toml --out frames/

The scenario is a cell file; [bead], [render] and [simulation] say what is
rendered. The bead is laid at the robot's start speed, or at the bead's
reference speed where the file has no [robot]. Measure the frames with
  truebead process frames/ --cell frames/scenario.toml --out measured/")]
pub struct RenderArgs {
    /// Cell file that describes bead, light and camera
    scenario: PathBuf,
    /// Folder for frames, truth.csv, times.csv and the scenario; must not hold files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Render only the first N frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
}

/// Renders a scenario into a folder, which appears when it is complete.
pub fn run(args: &RenderArgs, voice: Verbosity) -> Result<()> {
    let LoadedCell { cell, calibration, text, .. } =
        LoadedCell::read(&args.scenario, Purpose::Measure)?;
    let series = FrameSeries::new(&cell, calibration)
        .map_err(|error| wrong!("{}: {error}", args.scenario.display()))?;
    refuse_files_in(&args.out)?;
    let frames = args.frames.map_or(series.frames(), |most| most.min(series.frames()));
    let parent = match args.out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(parent).with_context(|| format!("cannot make {}", parent.display()))?;
    let folder = tempfile::Builder::new()
        .prefix(".truebead-render-")
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777))
        .tempdir_in(parent)
        .with_context(|| format!("cannot write in {}", parent.display()))?;
    let truths = write_frames(&series, frames, folder.path(), voice)?;
    write_tables(&series, &truths, folder.path()).context("cannot write the tables")?;
    copy_scenario(&cell, &args.scenario, &text, folder.path())
        .context("cannot copy the scenario")?;
    // An empty folder of this name is replaced by the complete one.
    fs::rename(folder.path(), &args.out)
        .with_context(|| format!("cannot make {}", args.out.display()))?;
    let _renamed = folder.keep();
    say!(
        "{frames} frames, {:.3} mm of bead apart, laid at {:.1} mm/s: {}",
        series.spacing_mm(),
        series.speed_mm_per_s(),
        args.out.display()
    );
    Ok(())
}

fn refuse_files_in(out: &Path) -> Result<()> {
    let used = match fs::read_dir(out) {
        Ok(mut entries) => entries.next().is_some(),
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        Err(error) => {
            refuse!("--out {}: {error}; name a new folder", out.display());
        }
    };
    if used {
        refuse!("--out {} holds files already; name a new folder", out.display());
    }
    Ok(())
}

/// Renders and writes all frames, and returns their true values.
fn write_frames(
    series: &FrameSeries,
    frames: u64,
    folder: &Path,
    voice: Verbosity,
) -> Result<Vec<Option<Truth>>> {
    let progress = SharedProgress::new("rendering", "frames", frames, voice.quiet);
    let truths = (0..frames)
        .into_par_iter()
        .map(|number| {
            let rendered = series.render(number)?;
            let path = folder.join(format!("frame_{number:05}.png"));
            write_png(&rendered.frame, &path)
                .with_context(|| format!("cannot write frame {number}"))?;
            progress.advance();
            Ok(rendered.truth)
        })
        .collect();
    progress.finish();
    truths
}

fn write_png(frame: &Frame, path: &Path) -> Result<()> {
    let (width, height) = (u32::try_from(frame.width())?, u32::try_from(frame.height())?);
    let file = std::io::BufWriter::new(File::create(path)?);
    let (compression, filter) = (png::CompressionType::Default, png::FilterType::Adaptive);
    png::PngEncoder::new_with_quality(file, compression, filter).write_image(
        &frame.to_grey8(),
        width,
        height,
        ExtendedColorType::L8,
    )?;
    Ok(())
}

fn write_tables(series: &FrameSeries, truths: &[Option<Truth>], folder: &Path) -> Result<()> {
    let mut times = csv::Writer::from_path(folder.join("times.csv"))?;
    let mut table = csv::Writer::from_path(folder.join("truth.csv"))?;
    times.write_record(["frame", "time_s"])?;
    let head = "frame,time_s,width_mm,left_x_px,left_y_px,right_x_px,right_y_px,roughness_mm";
    table.write_record(head.split(','))?;
    for (number, truth) in (0..).zip(truths) {
        let time = format!("{:.6}", series.time_s(number));
        times.write_record([number.to_string(), time.clone()])?;
        let values = truth.map_or_else(
            || vec![String::new(); 6],
            |t| {
                [t.width_mm, t.left.x, t.left.y, t.right.x, t.right.y, t.roughness_mm]
                    .map(|value| format!("{value:.6}"))
                    .to_vec()
            },
        );
        table.write_record([vec![number.to_string(), time], values].concat())?;
    }
    times.flush()?;
    table.flush()?;
    Ok(())
}

/// Copies the scenario, and its calibration file if it is in the same folder, so that the frames
/// can be measured and rendered again.
fn copy_scenario(cell: &Cell, scenario: &Path, text: &str, folder: &Path) -> Result<()> {
    fs::write(folder.join("scenario.toml"), text)?;
    let CalibrationSource::File(path) = &cell.calibration else { return Ok(()) };
    let beside = path.strip_prefix(scenario.parent().unwrap_or(Path::new(""))).ok();
    if let Some(beside) =
        beside.filter(|p| p.components().all(|c| matches!(c, Component::Normal(_))))
    {
        let copy = folder.join(beside);
        fs::create_dir_all(copy.parent().unwrap_or(folder))?;
        fs::copy(path, copy)?;
    }
    Ok(())
}
