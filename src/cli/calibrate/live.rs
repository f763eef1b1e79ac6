//! Images for a calibration, taken while the board is held before the camera.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};

use super::arguments::CalibrateArgs;
use super::conclusion::CalibrationResult;
use super::images::{CalibrationImages, taken_so_far};
use crate::calibration::board::Board;
use crate::calibration::collect::{Collector, Decision};
use crate::calibration::coverage::{Coverage, PARTS, SIDES};
use crate::calibration::solve::MIN_VIEWS;
use crate::calibration::{board_observation, warnings};
use crate::cell::file::ImageSource;
use crate::cli::arguments::WrongArguments;
use crate::core::{Channel, Frame, Span};
use crate::drivers::camera::open::{self, LiveOptions};
use crate::io::atomic_file::write_atomic;
use crate::io::clock::RunClock;
use crate::io::image_file;
use crate::io::stop::StopSignal;
use crate::run::ports::{FrameSource, Grab};

/// Longest wait for an image \[s\], which trades a slow camera against a lost one.
const FRAME_TIMEOUT_S: f64 = 5.0;
/// Largest number of images: more of them hardly reduce the uncertainty.
const MAX_VIEWS: usize = 60;
/// Period with which the report reloads itself \[s\].
const RELOAD_S: u32 = 3;

/// Takes images until the uncertainty of the bead's width meets its limit, an additional image has
/// no effect, there are [`MAX_VIEWS`] images, the camera ends, or the user ends it.
pub fn take(args: &CalibrateArgs, board: &Board) -> anyhow::Result<CalibrationImages> {
    let name = args.camera.as_deref().unwrap_or_default();
    let source = source(name)?;
    let folder = folder(args)?;
    let stop = StopSignal::install().context("cannot listen for signals")?;
    let options = LiveOptions {
        source: &source,
        name,
        rate_hz: args.rate_hz,
        deadline: Span::from_secs(FRAME_TIMEOUT_S),
        max_outage: Span::from_secs(FRAME_TIMEOUT_S),
        channel: Channel::Grey,
    };
    let mut camera = open::live(options, RunClock::start(), stop.signals().clone())?;
    let is_folder_new = !folder.exists();
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let (collector, files, screen) = (Collector::new(*board), Vec::new(), Screen::new());
    let mut taking = Taking { args, board, folder, is_folder_new, collector, files, screen };
    let done = taking.run(camera.as_mut(), &stop);
    if taking.files.is_empty() {
        taking.clear();
    }
    done?;
    taking.finish()
}

fn source(name: &str) -> Result<ImageSource, WrongArguments> {
    match ImageSource::parse(name, Path::new("")) {
        None => {
            Err(wrong!("--camera {name}: expected camera: and a whole number, such as camera:0"))
        }
        Some(ImageSource::Rendered) => Err(wrong!(
            "--camera rendered: the rendered camera shows a bead, not a board; name a real one"
        )),
        Some(source) => Ok(source),
    }
}

/// The folder for the images. Fails if it has other images, which could be mistaken for images of
/// this camera.
fn folder(args: &CalibrateArgs) -> Result<PathBuf, WrongArguments> {
    let beside = || {
        let stem = args.out.file_stem().unwrap_or(args.out.as_os_str()).to_string_lossy();
        args.out.with_file_name(format!("{stem}-images"))
    };
    let folder = args.images.clone().unwrap_or_else(beside);
    let is_empty = match std::fs::read_dir(&folder) {
        Ok(mut entries) => entries.next().is_none(),
        Err(_) => !folder.exists(),
    };
    if is_empty {
        return Ok(folder);
    }
    Err(wrong!(
        "{}: expected an empty folder, or none; name another with --images, or calibrate from \
         the images in it with `truebead calibrate {}`",
        folder.display(),
        folder.display()
    ))
}

/// The images taken so far, and the messages about them.
struct Taking<'a> {
    args: &'a CalibrateArgs,
    board: &'a Board,
    folder: PathBuf,
    is_folder_new: bool,
    collector: Collector,
    files: Vec<PathBuf>,
    screen: Screen,
}

impl Taking<'_> {
    fn run(&mut self, camera: &mut dyn FrameSource, stop: &StopSignal) -> anyhow::Result<()> {
        self.screen
            .say("lay the board flat on the bed, in the middle of the image, and let it lie");
        while !stop.requested() {
            let is_enough = match camera.next_frame() {
                Ok(Some(Grab::Frame { frame, .. })) => self.examine(&frame)?,
                Ok(Some(Grab::Unreadable { reason, .. })) => {
                    self.screen.state(&format!("unreadable: {reason}"));
                    false
                }
                Ok(Some(Grab::Waiting { reason })) => {
                    self.screen.state(&format!("waiting for the camera {reason}"));
                    false
                }
                Ok(None) => {
                    self.screen.say("the camera has ended");
                    break;
                }
                Err(error) if self.files.is_empty() => return Err(error.into()),
                Err(error) => {
                    self.screen.say(&format!("{error}; ending with the images so far"));
                    break;
                }
            };
            if is_enough {
                self.screen.say("that is enough");
                break;
            }
        }
        Ok(())
    }

    /// Examines a frame; returns whether there are enough images.
    fn examine(&mut self, frame: &Frame) -> anyhow::Result<bool> {
        match self.collector.add(board_observation::observe(self.board, "", frame)) {
            Decision::Kept(number) => self.keep(number, frame),
            news => {
                self.screen.state(&words(&news));
                Ok(false)
            }
        }
    }

    fn keep(&mut self, number: usize, frame: &Frame) -> anyhow::Result<bool> {
        let name = format!("view-{number:03}.png");
        let path = self.folder.join(&name);
        let png = image_file::encode_png(frame)?;
        write_atomic(&path, &png).with_context(|| {
            format!("the {} images before it are in {}", number - 1, self.folder.display())
        })?;
        self.collector.name_last(&name);
        self.files.push(path);
        let corners = self.collector.kept().last().map_or(0, |kept| kept.corners.len());
        let what = if number == 1 { "the bed plane, " } else { "" };
        self.screen.ring();
        self.screen.say(&format!("view {number}: {what}{corners} corners -> {name}"));
        if number == 1 {
            self.screen.say(
                "take the board up; hold it still for a moment in every part of the image, tilted \
                 by 20 to 45 degrees to all sides",
            );
        }
        if number < MIN_VIEWS {
            return Ok(false);
        }
        Ok(self.assess(number) || number >= MAX_VIEWS)
    }

    /// Prints the progress and writes the report; returns whether there are enough images. A few
    /// images may not determine a camera; then more are taken.
    fn assess(&mut self, number: usize) -> bool {
        let images = taken_so_far(&self.files, self.collector.kept());
        let result = match CalibrationResult::of(self.args, self.board, &images) {
            Ok(result) => result,
            Err(error) => {
                self.screen.say(&format!("  not yet a calibration: {error:#}"));
                return false;
            }
        };
        self.screen.say(&progress(self.args, &result));
        let page = result.calibration().map(|c| result.page(&result.text(&c), Some(RELOAD_S)));
        let report = self.args.report();
        match page.map(|page| write_atomic(&report, page.as_bytes())) {
            Ok(Ok(())) if number == MIN_VIEWS => {
                self.screen.say(&format!("  open {} to follow it", report.display()));
            }
            Ok(Ok(())) | Err(_) => {}
            // The report is written again at the end; an error there ends the command.
            Ok(Err(error)) => self.screen.state(&error.to_string()),
        }
        is_enough(self.args, &result)
    }

    /// Removes the folder if it is new and empty.
    fn clear(&self) {
        if self.is_folder_new {
            let _ = std::fs::remove_dir(&self.folder);
        }
    }

    fn finish(self) -> anyhow::Result<CalibrationImages> {
        self.screen.end();
        if self.files.is_empty() {
            bail!("the camera has not shown the board lying still on the bed; nothing was written");
        }
        let images = taken_so_far(&self.files, self.collector.kept());
        say!("{} images in {}\n", self.files.len(), self.folder.display());
        Ok(images)
    }
}

/// Whether the calibration has no warnings, and the standard deviation of a width meets its limit
/// or, without a limit, one more image would not reduce it.
fn is_enough(args: &CalibrateArgs, result: &CalibrationResult<'_>) -> bool {
    let known = match args.max_width_sigma_mm {
        Some(_) => !result.fails(),
        None => result.worst_mm().is_some() && result.next.is_none(),
    };
    known && warnings::warnings(&result.solution).is_empty()
}

/// Uncertainty and coverage of the images so far.
fn progress(args: &CalibrateArgs, result: &CalibrationResult<'_>) -> String {
    let coverage = Coverage::of(&result.solution);
    let mut text = String::new();
    let width = result.worst_mm().map_or_else(
        || "the uncertainty of a width cannot be determined yet".to_owned(),
        |worst| format!("uncertainty of a width {worst:.4} mm (1 sigma) where boards were seen"),
    );
    let asked = args.max_width_sigma_mm;
    let asked = asked.map_or_else(String::new, |limit| format!(" (limit {} mm)", limit.get()));
    let _ = writeln!(text, "  {width}{asked}");
    let tilts = SIDES.iter().zip(coverage.tilts).map(|(side, count)| format!("{side} {count}"));
    let mut missing = coverage.missing_tilts().join(", ");
    if !missing.is_empty() {
        missing.insert_str(0, "; missing: ");
    }
    let beside = [
        format!("boards in {} of {PARTS} parts of the image", coverage.count()),
        format!("side that was nearer: {}{missing}", tilts.collect::<Vec<_>>().join(", ")),
        result.next.as_ref().map_or_else(String::new, |next| format!("would help most: {next}")),
        warnings::warnings(&result.solution).first().map_or_else(String::new, ToString::to_string),
    ];
    for (row, beside) in coverage.cells.iter().zip(beside) {
        let row: String = row.iter().map(|&seen| if seen { '#' } else { '.' }).collect();
        let _ = writeln!(text, "{}", format!("  {row}  {beside}").trim_end());
    }
    text.trim_end().to_owned()
}

fn words(news: &Decision) -> String {
    match news {
        Decision::Kept(number) => format!("view {number}"),
        Decision::Moving => "the board moves: hold it still".to_owned(),
        Decision::Waiting => "still: a moment".to_owned(),
        Decision::Known(number) => format!("the board is where it was in view {number}: move it"),
        Decision::OtherSize => "the size of the camera's images has changed".to_owned(),
        Decision::Refused(refusal) => refusal.to_string(),
    }
}

/// Output: results on standard output, the current activity on standard error, in one line on a
/// terminal, otherwise a line for each change.
struct Screen {
    bar: ProgressBar,
    is_plain: bool,
    last: String,
}

impl Screen {
    fn new() -> Self {
        // The spinner hides itself if standard error is not a terminal.
        let bar = ProgressBar::new_spinner();
        let style = ProgressStyle::with_template("{spinner} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.enable_steady_tick(Duration::from_millis(120));
        Self { bar, is_plain: !std::io::stderr().is_terminal(), last: String::new() }
    }

    fn say(&self, text: &str) {
        self.bar.suspend(|| say!("{text}"));
    }

    fn state(&mut self, text: &str) {
        self.bar.set_message(text.to_owned());
        let kind: String = text.chars().filter(|letter| !letter.is_ascii_digit()).collect();
        if self.is_plain && kind != self.last {
            // A closed standard error does not stop the work.
            let _ = writeln!(std::io::stderr(), "{text}");
        }
        self.last = kind;
    }

    /// Rings the bell: a user who holds the board cannot read the screen.
    fn ring(&self) {
        if !self.is_plain {
            let _ = write!(std::io::stderr(), "\x07");
        }
    }

    fn end(&self) {
        self.bar.finish_and_clear();
    }
}
