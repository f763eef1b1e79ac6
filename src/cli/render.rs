//! `truebead render`: frames of a simulated bead, with their truth.

use std::fs::{self, File};
use std::io::{ErrorKind, IsTerminal};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use image::{ExtendedColorType, ImageEncoder, codecs::png};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::WrongArguments;
use crate::calib::Calibration;
use crate::config::Cell;
use crate::config::cell::{CalibrationSource, Purpose};
use crate::frame::Frame;
use crate::io::calibration_file;
use crate::sim::scenario::Series;
use crate::sim::truth::Truth;

/// Frames from one plain line of progress to the next.
const PLAIN_EVERY: u64 = 100;

/// Renders frames of a simulated bead, with the truth of each.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead render test_images/straight/scenario.toml --out frames/

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

/// Renders a scenario into a folder, which appears when it is whole.
pub fn run(args: &RenderArgs) -> Result<()> {
    let text = fs::read_to_string(&args.scenario)
        .map_err(|e| WrongArguments::new(format!("{}: {e}", args.scenario.display())))?;
    let cell = Cell::parse(&args.scenario, &text, Purpose::Measure).map_err(WrongArguments::new)?;
    let calibration = read_calibration(&cell)?;
    let series = Series::new(&cell, calibration)
        .map_err(|error| WrongArguments::new(format!("{}: {error}", args.scenario.display())))?;
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
    let truths = write_frames(&series, frames, folder.path())?;
    write_tables(&series, &truths, folder.path()).context("cannot write the tables")?;
    copy_scenario(&cell, &args.scenario, &text, folder.path())
        .context("cannot copy the scenario")?;
    // An empty folder of this name gives way to the whole one.
    fs::rename(folder.path(), &args.out)
        .with_context(|| format!("cannot make {}", args.out.display()))?;
    let _renamed = folder.keep();
    eprintln!(
        "{frames} frames, {:.3} mm of bead apart, laid at {:.1} mm/s: {}",
        series.spacing_mm(),
        series.speed_mm_per_s(),
        args.out.display()
    );
    Ok(())
}

fn read_calibration(cell: &Cell) -> Result<Calibration> {
    match &cell.calibration {
        CalibrationSource::Scale(mm_per_px) => Ok(Calibration::Scale { mm_per_px: *mm_per_px }),
        CalibrationSource::File(path) => {
            Ok(calibration_file::read(path).map_err(WrongArguments::new)?)
        }
    }
}

fn refuse_files_in(out: &Path) -> Result<()> {
    let used = match fs::read_dir(out) {
        Ok(mut entries) => entries.next().is_some(),
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        Err(error) => {
            let what = format!("--out {}: {error}; name a new folder", out.display());
            return Err(WrongArguments::new(what).into());
        }
    };
    if used {
        let what = format!("--out {} holds files already; name a new folder", out.display());
        return Err(WrongArguments::new(what).into());
    }
    Ok(())
}

/// Renders and writes all frames, and returns what is true of each.
fn write_frames(series: &Series, frames: u64, folder: &Path) -> Result<Vec<Option<Truth>>> {
    let progress = Progress::new(frames);
    (0..frames)
        .into_par_iter()
        .map(|number| {
            let rendered = series.render(number)?;
            let path = folder.join(format!("frame_{number:05}.png"));
            write_png(&rendered.frame, &path)
                .with_context(|| format!("cannot write frame {number}"))?;
            progress.step();
            Ok(rendered.truth)
        })
        .collect()
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

fn write_tables(series: &Series, truths: &[Option<Truth>], folder: &Path) -> Result<()> {
    let mut times = csv::Writer::from_path(folder.join("times.csv"))?;
    let mut table = csv::Writer::from_path(folder.join("truth.csv"))?;
    times.write_record(["frame", "time_s"])?;
    table.write_record([
        "frame",
        "time_s",
        "width_mm",
        "left_x_px",
        "left_y_px",
        "right_x_px",
        "right_y_px",
        "roughness_mm",
    ])?;
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

/// The scenario, and its calibration file where that lies beside it, so that
/// the folder can be measured and rendered again.
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

/// A bar on a terminal, a line now and then elsewhere.
struct Progress {
    bar: Option<ProgressBar>,
    frames: u64,
    done: std::sync::atomic::AtomicU64,
}

impl Progress {
    fn new(frames: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(frames).with_style(style).with_message("rendering")
        });
        Self { bar, frames, done: std::sync::atomic::AtomicU64::new(0) }
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        match &self.bar {
            Some(bar) => bar.inc(1),
            None if done.is_multiple_of(PLAIN_EVERY) => {
                eprintln!("rendered {done} of {} frames", self.frames);
            }
            None => {}
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
