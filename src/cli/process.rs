//! `truebead process`: measures recorded frames offline.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use clap::Args;
use crossbeam_channel::{Sender, bounded};

use super::arguments::WrongArguments;
use super::print::Verbosity;
use super::status::WITH_LOSS;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::drivers::camera::mcap::RobotZ;
use crate::drivers::camera::open;
use crate::drivers::camera::open::OfflineOptions;
use crate::io::progress::Progress;
use crate::io::stop::StopSignal;
use crate::report::overlays::OverlayWriter;
use crate::report::run::RunPage;
use crate::rows::edges::EdgesWriter;
use crate::rows::frame_row::FrameRow;
use crate::rows::log::{LogOptions, RunLog};
use crate::rows::summary::{RunNote, Summary};
use crate::run::ports::{FrameSource, Grab, SourceError};
use crate::vision::{Measurer, Reject, RoughnessEstimator};
use crate::width_control::target::WidthTarget;

/// Frames that may wait between reading and measuring.
const QUEUE_LENGTH: usize = 8;
/// Unreadable frames that are named one by one.
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
    let log = RunPage::log(LogOptions {
        folder: args.out.clone(),
        title: format!("Widths of {}", args.input.display()),
        header: vec![
            ("input".into(), args.input.display().to_string()),
            ("cell".into(), args.cell.display().to_string()),
            ("calibration".into(), loaded.calibration_words()),
        ],
        gauge: loaded.cell.gauge,
        target: loaded.cell.target.as_ref().map(WidthTarget::nominal),
        max_rejected_fraction: loaded.cell.recording.max_rejected_share,
        control: None,
    })?;
    let total = recorded.source.expected_frames();
    let progress = Progress::new("measuring", "frames", total, voice.quiet);
    let edges = args.edges.then(|| EdgesWriter::create(&args.out)).transpose()?;
    let overlays = args.overlays.then(|| OverlayWriter::create(&args.out, loaded.cell.gauge));
    let overlays = overlays.transpose()?;
    let robot_z = recorded.robot_z.as_ref();
    let roughness = RoughnessEstimator::default();
    let refusals = BTreeMap::new();
    let bench = Measuring {
        loaded: &loaded,
        robot_z,
        progress,
        log,
        roughness,
        edges,
        overlays,
        first_rejections: refusals,
    };
    let measured = bench.measure_all(recorded.source, &stop)?;
    Ok(conclude(args, &measured, &loaded))
}

/// The first frame that was refused with a status, and why.
struct FirstRejection {
    frame: u64,
    why: Reject,
}

/// What was measured, and the first refusal of each status.
struct MeasuredFrames {
    summary: Summary,
    first_rejections: BTreeMap<&'static str, FirstRejection>,
}

fn wrong_input(SourceError { source_name, what }: SourceError) -> WrongArguments {
    WrongArguments::new(format!("{source_name}: {what}"))
}

/// Where frames are measured one after the other.
struct Measuring<'a> {
    loaded: &'a LoadedCell,
    robot_z: Option<&'a RobotZ>,
    progress: Progress,
    log: RunLog,
    roughness: RoughnessEstimator,
    edges: Option<EdgesWriter>,
    overlays: Option<OverlayWriter>,
    first_rejections: BTreeMap<&'static str, FirstRejection>,
}

impl Measuring<'_> {
    /// Reads in a thread of its own, measures here. A source that fails in
    /// the middle ends the work with what there is, and says so.
    fn measure_all(
        mut self,
        mut source: Box<dyn FrameSource>,
        stop: &StopSignal,
    ) -> anyhow::Result<MeasuredFrames> {
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
        Ok(MeasuredFrames { summary, first_rejections: self.first_rejections })
    }

    fn measure(
        &mut self,
        measurer: &mut Measurer,
        grab: Grab,
        unreadable: u64,
    ) -> anyhow::Result<()> {
        match grab {
            Grab::Frame { frame, time_s } => {
                let robot_z = self.robot_z.and_then(|z| z.z_at(frame.captured_at));
                let surface = self.loaded.surface(robot_z);
                let outcome = measurer
                    .measure(&frame, &surface)
                    .inspect_err(|why| {
                        tracing::info!("frame {}: {why}", frame.seq);
                        let first = FirstRejection { frame: frame.seq, why: *why };
                        self.first_rejections.entry(why.status()).or_insert(first);
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

/// Gives every frame on until there are no more or nobody wants them.
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
    MeasuredFrames { summary, first_rejections: refusals }: &MeasuredFrames,
    loaded: &LoadedCell,
) -> ExitCode {
    say!("{} frames, {} measured", summary.frames, summary.measured);
    for (status, count) in &summary.rejected {
        say!("  {count} {status}");
        if let Some(FirstRejection { frame, why }) = refusals.get(status) {
            say!("    frame {frame}: {why}");
        }
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
    let share = summary.rejected_fraction();
    let most = loaded.cell.recording.max_rejected_share;
    if share > most {
        tell!(
            "warning: {:.1} % of the frames were refused, the cell's limit is {:.1} %",
            share * 100.0,
            most * 100.0
        );
        return ExitCode::from(WITH_LOSS);
    }
    ExitCode::SUCCESS
}
