//! How long a width takes, beside a copy of the frame and beside OpenCV's
//! blur, edge detector and line finder, which the 2022 paper's method needs.
//!
//! After divan's own listing the three are compared in one run and one thread,
//! by turns, each call on the next frame of a ring that no L2 cache holds. So is a
//! loop that counts and touches no memory: how rarely it is slow tells what the
//! machine itself adds to the rarest times of the others.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use std::hint::black_box;
use std::time::Instant;

use divan::Bencher;
use truebead::bridge::{EdgeSettings, LineFinder};
use truebead::calibration::{Calibration, SurfaceMap, file};
use truebead::core::{Frame, Mm, Pixels, Roi, Stamp, WidthRange};
use truebead::scenario::image::ImageModel;
use truebead::sim::render::Renderer;
use truebead::vision::{BeadAxis, Gauge, MeasureMethod, Measurer, Polarity};

const MM_PER_PX: f64 = 0.126_582;
/// Frames of the ring, 25 MB.
const RING: u8 = 64;
/// Rounds of measurement and copy; with every so many one of OpenCV's.
const ROUNDS: usize = 20_000;
const ROUNDS_OF_LINES: usize = 20;
/// Rounds with the same frame; one in ten has OpenCV, too.
const HOT_ROUNDS: usize = 3000;
/// Turns of the loop that only counts, about as long as a measurement.
const TURNS: u32 = 60_000;
/// Those of the paper's method in a gauge of 500 rows.
const LINES: EdgeSettings = EdgeSettings {
    blur_sigma_px: 1.5,
    thresholds: [24.0, 60.0],
    votes: 30,
    shortest_px: 50.0,
    longest_gap_px: 50.0,
};
const FULL: &str = include_str!("../calib/example.toml");

fn gauge(axis: BeadAxis, method: MeasureMethod) -> Gauge {
    Gauge {
        method,
        ..Gauge::new(
            Roi { x: 40, y: 20, width: 640, height: 500 },
            axis,
            Polarity::Bright,
            WidthRange { min: Mm::constant(20.0), max: Mm::constant(60.0) },
        )
    }
}

fn scale() -> Calibration {
    Calibration::Scale { mm_per_px: MM_PER_PX, sigma: None }
}

/// Different frames, the bead of each a little wider and further to the right.
fn frames(axis: BeadAxis, count: u8) -> Vec<Frame> {
    let gauge = gauge(axis, MeasureMethod::Caliper);
    let renderer =
        Renderer::new(scale(), Mm::ZERO, gauge, ImageModel::DEFAULT, 1).expect("a sound cell");
    let frame = |number: u8| {
        let aside = 0.003 * f64::from(number);
        let bead = |_: f64| Some((-21.0 + aside, 21.0 + 2.0 * aside));
        renderer.render(number.into(), Stamp::START, None, &bead).expect("a picture").frame
    };
    (0..count).map(frame).collect()
}

fn frame(axis: BeadAxis) -> Frame {
    frames(axis, 1).swap_remove(0)
}

fn time(bencher: Bencher<'_, '_>, gauge: Gauge, frame: &Frame, surface: &SurfaceMap) {
    let mut measurer = Measurer::new(gauge, None);
    measurer.measure(frame, surface).expect("a width");
    bencher.bench_local(|| black_box(measurer.measure(black_box(frame), surface)));
}

#[divan::bench(args = [MeasureMethod::Caliper, MeasureMethod::EdgeLines])]
fn vertical(bencher: Bencher<'_, '_>, method: MeasureMethod) {
    let gauge = gauge(BeadAxis::Vertical, method);
    time(bencher, gauge, &frame(BeadAxis::Vertical), &scale().surface(Mm::ZERO, None));
}

#[divan::bench]
fn horizontal(bencher: Bencher<'_, '_>) {
    let gauge = gauge(BeadAxis::Horizontal, MeasureMethod::Caliper);
    time(bencher, gauge, &frame(BeadAxis::Horizontal), &scale().surface(Mm::ZERO, None));
}

#[divan::bench]
fn sixteen_bits(bencher: Bencher<'_, '_>) {
    let eight = frame(BeadAxis::Vertical);
    let values = eight.to_grey8().iter().map(|&grey| u16::from(grey) * 257).collect();
    let frame = Frame::new(0, Stamp::START, eight.size(), Pixels::Grey16(values)).expect("pixels");
    let gauge = gauge(BeadAxis::Vertical, MeasureMethod::Caliper);
    time(bencher, gauge, &frame, &scale().surface(Mm::ZERO, None));
}

#[divan::bench]
fn full_calibration(bencher: Bencher<'_, '_>) {
    let calibration = file::parse("example.toml", FULL).expect("a sound calibration");
    let gauge = gauge(BeadAxis::Vertical, MeasureMethod::Caliper);
    let surface = calibration.surface(Mm::constant(20.0), None);
    time(bencher, gauge, &frame(BeadAxis::Vertical), &surface);
}

#[divan::bench]
fn copy_of_the_frame(bencher: Bencher<'_, '_>) {
    let frame = frame(BeadAxis::Vertical);
    let mut copy = frame.to_grey8().into_owned();
    bencher.bench_local(|| copy.copy_from_slice(&black_box(&frame).to_grey8()));
}

/// The three that are compared, and the frames that they take by turns.
struct Contest<'a> {
    frames: &'a [Frame],
    next: usize,
    surface: SurfaceMap,
    measurer: Measurer,
    copy: Vec<u8>,
    finder: LineFinder,
}

impl<'a> Contest<'a> {
    fn new(frames: &'a [Frame]) -> Self {
        Self {
            frames,
            next: 0,
            surface: scale().surface(Mm::ZERO, None),
            measurer: Measurer::new(gauge(BeadAxis::Vertical, MeasureMethod::Caliper), None),
            copy: frames[0].to_grey8().into_owned(),
            finder: LineFinder::new(LINES),
        }
    }

    fn next(&mut self) -> &'a Frame {
        self.next = (self.next + 1) % self.frames.len();
        black_box(&self.frames[self.next])
    }

    /// Each of these takes the next frame and says how long it took \[µs\].
    fn measure(&mut self) -> f64 {
        let frame = self.next();
        clocked(|| {
            black_box(self.measurer.measure(frame, &self.surface)).expect("a width");
        })
    }

    fn copy(&mut self) -> f64 {
        let frame = self.next();
        clocked(|| {
            self.copy.copy_from_slice(&frame.to_grey8());
            black_box(self.copy.as_slice());
        })
    }

    fn lines(&mut self) -> f64 {
        let frame = self.next();
        clocked(|| {
            black_box(self.finder.count(frame)).expect("lines");
        })
    }

    /// Counts: the same work in each round, for registers alone.
    fn count(&self) -> f64 {
        let start = self.next;
        clocked(|| {
            let step = |value: u64, turn: u32| black_box(value.wrapping_mul(3) + u64::from(turn));
            black_box((0..TURNS).fold(start as u64, step));
        })
    }

    /// Measurement, copy and count by turns, and now and then OpenCV, after which the
    /// other two are called once without the clock: neither pays for the
    /// caches that it has filled.
    fn run(&mut self, rounds: usize, rounds_of_lines: usize) -> Times {
        let mut times = Times::default();
        for round in 0..rounds {
            if round % rounds_of_lines == 0 {
                times.lines.push(self.lines());
                self.measure();
                self.copy();
            }
            times.measure.push(self.measure());
            times.copy.push(self.copy());
            times.count.push(self.count());
        }
        let Times { measure, copy, lines, count } = &mut times;
        for list in [measure, copy, lines, count] {
            list.sort_by(f64::total_cmp);
        }
        times
    }
}

#[expect(clippy::disallowed_methods, reason = "a benchmark")]
fn clocked(work: impl FnOnce()) -> f64 {
    let began = Instant::now();
    work();
    began.elapsed().as_secs_f64() * 1e6
}

/// Sorted \[µs\].
#[derive(Default)]
struct Times {
    measure: Vec<f64>,
    copy: Vec<f64>,
    lines: Vec<f64>,
    count: Vec<f64>,
}

impl Times {
    /// Of OpenCV to measurement, and of measurement to copy.
    fn ratios(&self) -> (f64, f64) {
        let measure = median(&self.measure);
        (median(&self.lines) / measure, measure / median(&self.copy))
    }
}

fn median(sorted: &[f64]) -> f64 {
    sorted[sorted.len() / 2]
}

/// The value that one in a thousand is above.
fn rare(sorted: &[f64]) -> f64 {
    sorted[sorted.len() - 1 - sorted.len() / 1000]
}

fn report(times: &Times) {
    println!("              calls    median us   p99.9 us");
    let rows = [
        ("measure", &times.measure),
        ("memcpy", &times.copy),
        ("canny_hough", &times.lines),
        ("counting", &times.count),
    ];
    for (name, list) in rows {
        println!("{name:12} {:6} {:12.2} {:10.2}", list.len(), median(list), rare(list));
    }
    let spread = |list: &[f64]| rare(list) / median(list);
    let (measure, count) = (spread(&times.measure), spread(&times.count));
    println!("measure p99.9/median = {measure:.2}; of counting alone {count:.2}");
}

fn main() {
    divan::main();
    let ring = frames(BeadAxis::Vertical, RING);
    let times = Contest::new(&ring).run(ROUNDS, ROUNDS_OF_LINES);
    let hot = Contest::new(&ring[..1]).run(HOT_ROUNDS, 10);
    println!("\n{RING} frames of 720x540 px in turn, one thread, rounds interleaved");
    report(&times);
    let (lines, copy) = hot.ratios();
    println!(
        "hot: measure {:.2} us, memcpy {:.2} us, canny_hough {:.2} us; \
         canny_hough/measure = {lines:.2}, measure/memcpy = {copy:.2}",
        median(&hot.measure),
        median(&hot.copy),
        median(&hot.lines)
    );
    let (lines, copy) = times.ratios();
    println!("ratio canny_hough/measure = {lines:.2}");
    println!("ratio measure/memcpy = {copy:.2}");
    println!("measure us = {:.2}", median(&times.measure));
}
