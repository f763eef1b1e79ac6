//! `truebead process`: measures recorded frames offline.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use clap::Args;
use crossbeam_channel::{Sender, bounded};

use super::arguments::WrongArguments;
use super::live_cell::log;
use super::outcome::status_of_rejections;
use super::print::Verbosity;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::drivers::camera::open::{self, OfflineOptions};
use crate::io::progress::Progress;
use crate::io::stop::StopSignal;
use crate::report::overlays::OverlayWriter;
use crate::rows::edges::EdgesWriter;
use crate::rows::frame_row::FrameRow;
use crate::rows::log::RunLog;
use crate::rows::summary::{RunNote, Summary};
use crate::run::ports::{FrameSource, Grab, SourceError};
use crate::run::robot_z::RobotZ;
use crate::vision::{Measurer, Reject, RepeatDetector, RoughnessEstimator};

/// Frames that may wait between reading and measuring: more need memory, fewer leave cores idle.
const QUEUE_LENGTH: usize = 8;
/// Number of unreadable frames that are listed one by one, so that the terminal stays readable.
const MAX_NAMED_UNREADABLE: u64 = 10;

/// Measures the bead in recorded frames.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead process frames/ --cell cell.toml --out measured/
  truebead process clip.mp4 --cell cell.toml --out measured/
  truebead process recording.mcap --cell cell.toml --out measured/
  truebead process clip.mp4 --cell cell.toml --out measured/ --edges

Leaves widths.csv, summary.json and report.html in the output folder, with
--edges also edges.csv, with --overlays a folder overlays/. The cell needs [calibration] and [gauge] only.")]
pub struct ProcessArgs {
    /// Folder of images, video file or MCAP
    input: PathBuf,
    /// Cell file
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames a second, where the input does not know its times
    #[arg(long, value_name = "F")]
    fps: Option<f64>,
    /// Topic of the frames in an MCAP [default: the first with images]
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
    /// Also write edges.csv: where each caliper line found the two edges
    #[arg(long)]
    edges: bool,
    /// Also write overlays/: every frame with its gauge and edges drawn in
    #[arg(long)]
    overlays: bool,
}

/// Runs the command; the summary goes to standard output.
pub fn run(args: &ProcessArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    let loaded = LoadedCell::read(&args.cell, Purpose::Measure)?;
    let options = OfflineOptions {
        fps: args.fps,
        topic: args.topic.as_deref(),
        channel: loaded.cell.channel,
    };
    let recorded = open::recorded(&args.input, options).map_err(wrong_input)?;
    let stop = StopSignal::install().context("cannot wait for signals")?;
    let (input, cell) = (args.input.display().to_string(), args.cell.display().to_string());
    let title = format!("Widths of {input}");
    let log = log(&loaded, &args.out, title, [("input", input), ("cell", cell)], None)?;
    let total = recorded.source.expected_frames();
    let progress = Progress::new("measuring", "frames", total, voice.quiet);
    let edges = args.edges.then(|| EdgesWriter::create(&args.out)).transpose()?;
    let overlays = args.overlays.then(|| OverlayWriter::create(&args.out, loaded.cell.gauge));
    let measuring = Measuring {
        loaded: &loaded,
        robot_z: recorded.robot_z.as_ref(),
        progress,
        log,
        roughness: RoughnessEstimator::default(),
        repeats: RepeatDetector::new(loaded.cell.gauge.roi),
        edges,
        overlays: overlays.transpose()?,
        first_rejections: BTreeMap::new(),
    };
    let (summary, first_rejections) = measuring.measure_all(recorded.source, &stop)?;
    Ok(conclude(args, &summary, &first_rejections, &loaded))
}

/// The first frame that was rejected with each status, and its reason.
type FirstRejections = BTreeMap<&'static str, (u64, Reject)>;

fn wrong_input(SourceError { source_name, what }: SourceError) -> WrongArguments {
    wrong!("{source_name}: {what}")
}

/// State of the measuring loop.
struct Measuring<'a> {
    loaded: &'a LoadedCell,
    robot_z: Option<&'a RobotZ>,
    progress: Progress,
    log: RunLog,
    roughness: RoughnessEstimator,
    repeats: RepeatDetector,
    edges: Option<EdgesWriter>,
    overlays: Option<OverlayWriter>,
    first_rejections: FirstRejections,
}

impl Measuring<'_> {
    /// Reads in a separate thread, measures here. If the source fails in the middle, the work ends
    /// with a warning; the results so far are kept.
    fn measure_all(
        mut self,
        mut source: Box<dyn FrameSource>,
        stop: &StopSignal,
    ) -> anyhow::Result<(Summary, FirstRejections)> {
        let (send, frames) = bounded(QUEUE_LENGTH);
        let ending = AtomicBool::new(false);
        let failed = std::thread::scope(|scope| -> anyhow::Result<Option<SourceError>> {
            let ending = &ending;
            let reader = scope.spawn(move || read(source.as_mut(), &send, ending));
            let mut unreadable = 0;
            let mut measurer = Measurer::new(self.loaded.cell.gauge, self.loaded.cell.white);
            for grab in &frames {
                if stop.requested() {
                    break;
                }
                if matches!(grab, Grab::Unreadable { .. }) {
                    unreadable += 1;
                }
                self.measure(&mut measurer, grab, unreadable).inspect_err(|_| {
                    ending.store(true, Ordering::Relaxed);
                })?;
            }
            ending.store(true, Ordering::Relaxed);
            drop(frames);
            Ok(reader.join().unwrap_or_default())
        })?;
        if stop.requested() {
            self.log.note(&RunNote::Remark("ended before the last frame, as was asked".into()));
        }
        if let Some(error) = failed {
            tell!("warning: {error}; what was measured until then is kept");
            self.log.note(&RunNote::Remark(error.to_string()));
        }
        self.progress.finish();
        let summary = self.log.finish()?;
        if let Some(edges) = self.edges {
            edges.finish()?;
        }
        Ok((summary, self.first_rejections))
    }

    fn measure(
        &mut self,
        measurer: &mut Measurer,
        grab: Grab,
        unreadable: u64,
    ) -> anyhow::Result<()> {
        match grab {
            Grab::Frame { frame, time_s } => {
                let frame = Arc::new(frame);
                if self.repeats.first_of_equal(&frame).is_some() {
                    self.log.note(&RunNote::FrameRepeated);
                }
                let robot_z = self.robot_z.and_then(|z| z.z_at(frame.captured_at));
                let surface = self.loaded.surface(robot_z);
                let outcome = measurer
                    .measure(&frame, &surface)
                    .inspect_err(|why| {
                        tracing::info!("frame {}: {why}", frame.seq);
                        self.first_rejections.entry(why.status()).or_insert((frame.seq, *why));
                    })
                    .map(|found| measurer.with_skew(found))
                    .map_err(|reject| reject.status());
                self.roughness.frame(measurer, outcome.as_ref().ok(), &surface);
                let roughness = self.roughness.estimate();
                let row = FrameRow { frame: frame.seq, time_s, outcome, roughness, control: None };
                self.log.frame(&row, Some(&frame), Some(measurer.edges()))?;
                if let Some(overlays) = &self.overlays {
                    overlays.frame(&frame, measurer.edges(), outcome)?;
                }
                if let Some(edges) = &mut self.edges {
                    edges.frame(frame.seq, measurer.calipers())?;
                }
            }
            // Recorded frames are there or not.
            Grab::Waiting { .. } => return Ok(()),
            Grab::Unreadable { seq, time_s, reason } => {
                if unreadable <= MAX_NAMED_UNREADABLE {
                    self.progress.note(&format!("unreadable: {reason}"));
                    self.log.note(&RunNote::Remark(format!("frame {seq} is unreadable: {reason}")));
                }
                let outcome = Err(Reject::Unreadable.status());
                let row = FrameRow { frame: seq, time_s, outcome, roughness: None, control: None };
                self.log.frame(&row, None, None)?;
            }
        }
        self.progress.advance();
        Ok(())
    }
}

/// Passes on every frame, until there are no more or the receiver is gone.
fn read(
    source: &mut dyn FrameSource,
    send: &Sender<Grab>,
    ending: &AtomicBool,
) -> Option<SourceError> {
    while !ending.load(Ordering::Relaxed) {
        match source.next_frame() {
            Ok(Some(grab)) => send.send(grab).ok()?,
            Ok(None) => return None,
            Err(error) => return Some(error),
        }
    }
    None
}

fn conclude(
    args: &ProcessArgs,
    summary: &Summary,
    first_rejections: &FirstRejections,
    loaded: &LoadedCell,
) -> ExitCode {
    say!("{} frames, {} measured", summary.frames, summary.measured);
    for (status, count) in &summary.rejected {
        say!("  {count} {status}");
        if let Some((frame, why)) = first_rejections.get(status) {
            say!("    frame {frame}: {why}");
        }
    }
    if summary.repeated > 0 {
        say!("  {} equal to at least two before them", summary.repeated);
    }
    if let (Some(mean), Some(std)) = (summary.width_mean_mm, summary.width_std_mm) {
        say!("width {mean:.3} mm on average, standard deviation {std:.3} mm");
    }
    if let Some(words) = summary.roughness.words() {
        say!("{words}");
    }
    for sentence in &summary.advice {
        say!("hint: {sentence}");
    }
    say!("{}", args.out.join("report.html").display());
    status_of_rejections(summary, loaded.cell.recording.max_rejected_share)
        .unwrap_or(ExitCode::SUCCESS)
}
