//! Control by distance on a simulated bead.

use std::f64::consts::TAU;
use std::ops::Range;

use super::*;
use crate::sim::hash;

/// A robot without lag, and a bead whose width is a power of its speed times a flow.
struct Line {
    controller: DistanceController,
    /// Glare: the width that frames between two paths show in place of the bead.
    glare: Option<(f64, f64, f64)>,
    now_s: f64,
    path: f64,
    speed: f64,
    /// Path and width, every 2 mm or so.
    laid: Vec<(f64, f64)>,
    frame: u64,
    seed: u64,
}

const TARGET: f64 = 42.0;
const OFFSET: f64 = 88.4;
const GAUGE: f64 = 12.7;
const STEP_S: f64 = 0.02;

fn settings() -> DistanceSettings {
    DistanceSettings {
        offset: Mm::constant(OFFSET),
        offset_sigma: Mm::constant(0.1 * OFFSET),
        gauge: Mm::constant(GAUGE),
        reference_speed: MmPerS::constant(112.5),
        exponent: 0.25,
        learns_exponent: true,
        drift_per_root_m: 0.002,
        roughness: BeadRoughness { ratio: 0.0025, length_mm: 5.0 },
        cancels_pulsation: true,
        screw_pulses: None,
    }
}

impl Line {
    fn new(settings: DistanceSettings) -> Self {
        let controller = DistanceController::new(settings);
        let (now_s, path, speed, frame, seed) = (0.0, 0.0, 112.5, 0, 3);
        Self { controller, glare: None, now_s, path, speed, laid: Vec::new(), frame, seed }
    }

    /// One frame: lay, report, measure, and command from 200 mm on.
    fn step(
        &mut self,
        exponent: f64,
        flow: impl Fn(f64) -> f64,
        noise: f64,
    ) -> Option<DistanceTrace> {
        let width = |at: f64| 38.61 * (self.speed / 112.5).powf(-exponent) * flow(at);
        self.laid.push((self.path, width(self.path)));
        self.path += self.speed * STEP_S;
        self.now_s += STEP_S;
        let (path, speed) = (Mm::new(self.path).unwrap(), MmPerS::new(self.speed).unwrap());
        self.controller.reported(Stamp::from_secs(self.now_s), path, speed, 1.0);
        let seen = self.seen();
        let trace = seen.map(|seen| {
            self.frame += 1;
            let [random, _] = hash::normal_pair(hash::mix(&[self.seed, self.frame]));
            let glares = self.glare.filter(|(from, to, _)| (*from..*to).contains(&self.path));
            let seen = glares.map_or(seen, |(_, _, width)| width);
            let (width, sigma) = (Mm::new(seen + noise * random), Mm::new(noise));
            let measured = WidthReading { width: width.unwrap(), sigma: sigma.unwrap() };
            self.controller.measured(path, measured)
        });
        let (now, target) = (Stamp::from_secs(self.now_s), Mm::constant(TARGET));
        if self.path >= 200.0
            && let Some(speed) = self.controller.speed(target, now, Span::from_secs(STEP_S))
        {
            self.speed = speed.get().clamp(60.0, 150.0);
        }
        trace
    }

    /// Mean width under the gauge.
    fn seen(&self) -> Option<f64> {
        let middle = self.path - OFFSET;
        let within = |at: f64| (at - middle).abs() <= 0.5 * GAUGE;
        if middle < GAUGE {
            return None;
        }
        let widths: Vec<f64> =
            self.laid.iter().filter(|(at, _)| within(*at)).map(|(_, w)| *w).collect();
        let mut sum = 0.0;
        for width in &widths {
            sum += width;
        }
        (!widths.is_empty()).then(|| sum / f64::from(u32::try_from(widths.len()).unwrap()))
    }

    fn error(&self) -> f64 {
        self.laid.last().unwrap().1 - TARGET
    }
}

#[test]
fn the_first_speed_is_right_to_the_exponent_and_the_rest_is_corrected_when_measured() {
    let mut line = Line::new(settings());
    while line.path < 230.0 {
        let _ = line.step(0.22, |_| 1.0, 0.0);
    }
    assert!(line.error().abs() < 0.6, "{}", line.error());
    while line.path < 380.0 {
        let _ = line.step(0.22, |_| 1.0, 0.0);
    }
    assert!(line.error().abs() < 0.05, "{}", line.error());
}

#[test]
fn a_step_of_the_flow_is_distinguished_from_an_outlier_and_corrected() {
    let mut line = Line::new(settings());
    let flow = |at: f64| if at > 900.0 { 1.08 } else { 1.0 };
    let mut seen = Vec::new();
    while line.path < 900.0 + OFFSET + 25.0 {
        seen.extend(line.step(0.25, flow, 0.36).map(|trace| trace.use_of_width));
    }
    assert!(seen.contains(&WidthUse::Change), "{seen:?}");
    assert!(line.error().abs() < 0.6, "{}", line.error());
}

#[test]
fn the_next_bead_begins_with_the_estimates_of_the_last() {
    let mut line = Line::new(settings());
    while line.path < 900.0 {
        let _ = line.step(0.22, |_| 1.0, 0.36);
    }
    let mut next = Line::new(settings());
    next.controller = line.controller.clone();
    next.controller.begin_bead();
    let now = Stamp::from_secs(20.0);
    let speed = next.controller.speed(Mm::constant(TARGET), now, Span::from_secs(0.2)).unwrap();
    let width = 38.61 * (speed.get() / 112.5).powf(-0.22);
    assert!((width - TARGET).abs() < 0.3, "{width}");
}

#[test]
fn without_a_width_there_is_no_speed_and_without_a_path_no_match() {
    let mut controller = DistanceController::new(settings());
    let (now, span) = (Stamp::START, Span::from_secs(0.2));
    assert_eq!(controller.speed(Mm::constant(TARGET), now, span), None);
    let trace = controller.measured(
        Mm::constant(100.0),
        WidthReading { width: Mm::constant(40.0), sigma: Mm::constant(0.3) },
    );
    assert_eq!(trace.use_of_width, WidthUse::NotMatched);
    assert!(!controller.is_ready());
}

#[test]
fn a_change_by_glare_is_reverted_by_the_first_widths_after_it() {
    let mut line = Line::new(settings());
    line.glare = Some((900.0, 912.0, 47.0));
    let mut seen = Vec::new();
    while line.path < 990.0 {
        let found = line.step(0.25, |_| 1.0, 0.36);
        seen.extend(found.filter(|_| line.path > 900.0).map(|trace| trace.use_of_width));
    }
    assert!(seen.contains(&WidthUse::Change), "{seen:?}");
    assert!(line.error().abs() < 0.4, "{}", line.error());
    // Little bead was laid meanwhile.
    let off = |(at, width): &&(f64, f64)| *at > 600.0 && (width - TARGET).abs() > 0.6;
    let off = line.laid.iter().filter(off).count();
    assert!(off < 20, "{off} frames");
}

#[test]
fn a_width_of_a_large_flow_transient_is_not_matched() {
    let mut controller = DistanceController::new(settings());
    let mut uses = Vec::new();
    for k in 0..200_u32 {
        let at = f64::from(k) * STEP_S;
        // A flow that rises within two seconds.
        let fraction = (at / 2.0).clamp(0.1, 1.0);
        let path = Mm::new(100.0 * at).unwrap();
        controller.reported(Stamp::from_secs(at), path, MmPerS::constant(100.0), fraction);
        let width = WidthReading { width: Mm::constant(30.0), sigma: Mm::constant(0.3) };
        uses.push(controller.measured(path, width).use_of_width);
    }
    let bead_at = |path: f64| (path + OFFSET) / (100.0 * STEP_S);
    let (rising, steady) = (bead_at(100.0), bead_at(260.0));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "frames")]
    let at = |frame: f64| uses[frame as usize];
    assert_eq!(at(rising), WidthUse::NotMatched);
    assert_ne!(at(steady), WidthUse::NotMatched);
}

#[test]
fn control_does_not_depend_on_the_width_of_the_bead() {
    let driven = |at: f64| if at.rem_euclid(400.0) < 200.0 { 100.0 } else { 110.0 };
    for times in [0.05, 1.0, 6.0] {
        let mut controller = DistanceController::new(DistanceSettings {
            offset_sigma: Mm::constant(0.5),
            ..settings()
        });
        let mut seen = Vec::new();
        let mut path = 0.0;
        for k in 0..600_u32 {
            // The speed changes by 10 % every 200 mm.
            let speed = driven(path);
            path += speed * STEP_S;
            let now = Stamp::from_secs(STEP_S * f64::from(k + 1));
            controller.reported(now, Mm::constant(path), MmPerS::constant(speed), 1.0);
            let position = path - OFFSET;
            let laid = driven(position);
            // Gauges with both speeds are left out.
            let near = (position - GAUGE).div_euclid(200.0) != (position + GAUGE).div_euclid(200.0);
            if position < GAUGE || near {
                continue;
            }
            let [random, _] = hash::normal_pair(hash::mix(&[5, u64::from(k)]));
            let width = times * 40.0 * (f64::powf(laid / 112.5, -0.25) + 0.009 * random);
            let (width, sigma) = (Mm::constant(width), Mm::constant(times * 40.0 * 0.009));
            let trace = controller.measured(Mm::constant(path), WidthReading { width, sigma });
            assert!(controller.is_ready());
            seen.push((trace.use_of_width, trace.level_mm.get() / times));
        }
        assert!(seen.iter().all(|(taken, _)| *taken != WidthUse::Change), "{times}: {seen:?}");
        let last = seen.last().unwrap().1;
        assert!((last - 40.0).abs() < 0.3, "{times}: {last}");
    }
}

#[test]
fn a_bead_that_is_never_matched_to_a_speed_falls_back() {
    // The gauge reaches beyond the nozzle.
    let near = DistanceSettings { offset: Mm::constant(5.0), ..settings() };
    let mut line = Line::new(near);
    while line.path < OFFSET + 60.0 {
        let _ = line.step(0.25, |_| 1.0, 0.36);
    }
    assert_eq!(line.controller.fallback_reason(), None);
    while line.path < OFFSET + 120.0 {
        let _ = line.step(0.25, |_| 1.0, 0.36);
    }
    assert_eq!(line.controller.fallback_reason(), Some(FallbackReason::Unmatched));
    line.controller.begin_bead();
    assert_eq!(line.controller.fallback_reason(), None);
}

#[test]
fn noise_of_the_reported_speed_does_not_change_the_exponent() {
    let mut controller = DistanceController::new(settings());
    let mut path = 0.0;
    for k in 0..800_u32 {
        // 0.5 % of noise on the reported speeds, milliseconds on their arrival, exact widths.
        let [speed, delay] = hash::normal_pair(hash::mix(&[7, u64::from(k)]));
        path += 112.5 * STEP_S;
        let at = Stamp::from_secs(STEP_S * f64::from(k + 1) + 1e-3 * delay.abs().min(5.0));
        let reported = MmPerS::constant(112.5 * (1.0 + 0.005 * speed));
        controller.reported(at, Mm::constant(path), reported, 1.0);
        if path > OFFSET + GAUGE {
            let exact = WidthReading { width: Mm::constant(38.61), sigma: Mm::constant(0.002) };
            let trace = controller.measured(Mm::constant(path), exact);
            assert!((trace.exponent - 0.25).abs() < 0.01, "{k}: {trace:?}");
        }
    }
}

/// RMS error, within a time \[s\], of beads whose flow pulsates with every turn of a screw that
/// becomes faster by 20 % from 25 to 30 s. Its speed is reported 60 ms late, in whole turns a minute.
fn rms_with_screw(per_turn: Option<f64>, cancels_pulsation: bool, within_s: Range<f64>) -> f64 {
    let valid = Span::from_millis(300);
    let screw_pulses = per_turn.map(|per_turn| ScrewPulses { per_turn, valid });
    let settings = DistanceSettings { cancels_pulsation, screw_pulses, ..settings() };
    let speed_ratio = |at: f64| 1.0 + 0.2 * ((at - 25.0) / 5.0).clamp(0.0, 1.0);
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..6 {
        let mut line = Line { seed, ..Line::new(settings) };
        let mut turns = 0.0;
        while line.now_s < within_s.end {
            let reported = (40.3 * speed_ratio(line.now_s - 0.06)).round();
            line.controller.screw_reported(Stamp::from_secs(line.now_s), Rpm::constant(reported));
            turns += 40.3 / 60.0 * speed_ratio(line.now_s) * STEP_S;
            let flow = speed_ratio(line.now_s).powf(0.25) * (1.0 + 0.02 * (TAU * turns).sin());
            let _ = line.step(0.25, |_| flow, 0.1);
            if within_s.contains(&line.now_s) {
                (squares, count) = (squares + line.error().powi(2), count + 1.0);
            }
        }
    }
    f64::sqrt(squares / count)
}

#[test]
fn a_pulsation_is_cancelled_while_the_screw_becomes_faster() {
    let rms = |per_turn, within_s| rms_with_screw(per_turn, true, within_s);
    let (counted, ignored) = (rms(Some(1.0), 12.0..50.0), rms_with_screw(None, false, 12.0..50.0));
    assert!(counted < 0.5 * ignored, "{counted} {ignored}");
    // Bead that was laid while its flow changed has been seen by then.
    let (counted, searched) = (rms(Some(1.0), 31.0..38.0), rms(None, 31.0..38.0));
    assert!(counted < 0.5 * searched, "{counted} {searched}");
}

#[test]
fn a_wrong_number_of_pulses_does_no_harm() {
    let ignored = rms_with_screw(None, false, 12.0..50.0);
    for per_turn in [0.5, 0.9, 0.95, 1.05, 1.1, 1.37, 2.0, 30.0] {
        let wrong = rms_with_screw(Some(per_turn), true, 12.0..50.0);
        assert!(wrong < 1.05 * ignored, "{per_turn}: {wrong} {ignored}");
    }
}

#[test]
fn without_the_speed_of_the_screw_no_pulsation_is_cancelled() {
    let screw = ScrewPulses { per_turn: 1.0, valid: Span::from_millis(300) };
    let mut line = Line::new(DistanceSettings { screw_pulses: Some(screw), ..settings() });
    let mut found = Vec::new();
    while line.now_s < 40.0 {
        let now_s = line.now_s;
        // From 20 s on nothing is reported; from 30 s on the screw is reported to stand.
        if !(20.0..30.0).contains(&now_s) {
            let rpm = Rpm::constant(if now_s < 30.0 { 30.0 } else { 0.0 });
            line.controller.screw_reported(Stamp::from_secs(now_s), rpm);
        }
        let flow = 1.0 + 0.02 * (TAU * 0.5 * now_s).sin();
        let trace = line.step(0.25, |_| flow, 0.1);
        found.extend(trace.map(|trace| (now_s, trace.pulsation_s)));
    }
    for (at, period) in found {
        if (12.0..20.0).contains(&at) {
            assert!(period.is_some_and(|period| (period - 2.0).abs() < 1e-9), "{at}: {period:?}");
        }
        // The camera sees bead that is 1.1 s old.
        if at > 22.0 {
            assert_eq!(period, None, "{at}");
        }
    }
}
