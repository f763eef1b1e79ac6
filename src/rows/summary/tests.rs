use super::*;
use crate::control::{Command, Fault, Hold, State, Trace};
use crate::core::{MmPerS, RobotLimits, RobotMode, RobotState};
use crate::rows::frame_row::{ControlColumns, sample};
use crate::width_control::limiter::SpeedLimit;

const TARGET: Mm = Mm::constant(42.0);

fn seconds(secs: f64) -> Stamp {
    Stamp::from_secs(secs)
}

fn robot(path: f64) -> Event {
    Event::Robot(RobotState {
        robot_time_ms: None,
        has_setpoint: false,
        mode: RobotMode::Print,
        speed_mm_per_s: MmPerS::constant(100.0),
        path_mm: Mm::new(path).unwrap(),
        z_mm: Mm::ZERO,
    })
}

fn step(state: State, limit: SpeedLimit) -> Step {
    Step {
        command: Some(Command::Speed(MmPerS::constant(100.0))),
        state,
        trace: Trace { limit, ..Trace::default() },
        extruder: None,
    }
}

fn row(width: f64, bead_path: f64, state: &'static str) -> FrameRow {
    FrameRow {
        frame: 0,
        time_s: None,
        outcome: Ok(sample::measured(width, 0.5)),
        roughness: None,
        control: Some(ControlColumns {
            bead_expected: true,
            measured_path: Some(Mm::new(bead_path).unwrap()),
            nozzle_path: None,
            speed: None,
            setpoint: None,
            state,
            limit: SpeedLimit::None,
            target: Some(Mm::constant(42.0)),
        }),
    }
}

#[test]
fn widths_and_rejections_add_up() {
    let mut builder = SummaryBuilder::new(None, false);
    let outcomes = [Ok(40.0), Ok(42.0), Err("no_pair"), Ok(44.0), Err("no_pair"), Err("saturated")];
    for (frame, outcome) in (0_u32..).zip(outcomes) {
        builder.frame(&FrameRow {
            frame: u64::from(frame),
            time_s: Some(f64::from(frame) * 0.5),
            outcome: outcome.map(|width| sample::measured(width, 0.5)),
            roughness: None,
            control: None,
        });
    }
    let summary = builder.finish();
    assert_eq!((summary.frames, summary.measured), (6, 3));
    assert_eq!(summary.rejected, BTreeMap::from([("no_pair", 2), ("saturated", 1)]));
    assert!((summary.rejected_fraction() - 0.5).abs() < 1e-12);
    assert!((summary.width_mean_mm.unwrap() - 42.0).abs() < 1e-12);
    assert!((summary.width_std_mm.unwrap() - 2.0).abs() < 1e-12);
    assert_eq!(summary.sigma_mean_mm, Some(0.5));
    assert_eq!(summary.duration_s, Some(2.5));
    assert_eq!(summary.control, None);
}

#[test]
fn only_bead_laid_under_control_counts_for_the_error() {
    let mut builder = SummaryBuilder::new(Some(TARGET), true);
    builder.step(seconds(0.0), &robot(0.0), &step(State::Priming, SpeedLimit::None));
    builder.frame(&row(50.0, 100.0, "priming"));
    builder.step(seconds(1.0), &robot(200.0), &step(State::Tracking, SpeedLimit::None));
    // Seen under control, but laid before it.
    builder.frame(&row(50.0, 199.0, "tracking"));
    builder.frame(&row(45.0, 200.0, "tracking"));
    builder.frame(&row(41.0, 700.0, "tracking"));
    builder.frame(&row(42.0, 700.1, "holding"));
    builder.frame(&row(42.5, 900.0, "tracking"));
    // The same bead, again and again, under a robot that stands still.
    builder.frame(&row(60.0, 900.0, "idle"));
    let control = builder.finish().control.unwrap();
    assert!((control.width_error_mean_mm.unwrap() - 4.5 / 4.0).abs() < 1e-12);
    let rms = ((9.0 + 1.0 + 0.25) / 4.0_f64).sqrt();
    assert!((control.width_error_rms_mm.unwrap() - rms).abs() < 1e-12);
    let worst = control.width_error_worst.unwrap();
    assert_eq!((worst.error_mm, worst.bead_path_mm), (3.0, 200.0));
    let settled = (0.25 / 2.0_f64).sqrt();
    assert!((control.width_error_rms_settled_mm.unwrap() - settled).abs() < 1e-12);
}

#[test]
fn a_new_bead_begins_anew() {
    let mut builder = SummaryBuilder::new(Some(TARGET), true);
    builder.step(seconds(0.0), &robot(300.0), &step(State::Tracking, SpeedLimit::None));
    builder.step(seconds(1.0), &robot(400.0), &step(State::Idle, SpeedLimit::None));
    builder.step(seconds(2.0), &robot(0.0), &step(State::Priming, SpeedLimit::None));
    builder.frame(&row(60.0, 350.0, "priming"));
    builder.step(seconds(3.0), &robot(100.0), &step(State::Tracking, SpeedLimit::None));
    builder.frame(&row(43.0, 150.0, "tracking"));
    let control = builder.finish().control.unwrap();
    assert_eq!(control.width_error_mean_mm, Some(1.0));
    assert_eq!(control.width_error_rms_settled_mm, None);
}

#[test]
fn time_is_spent_in_the_state_that_the_step_before_left() {
    let mut builder = SummaryBuilder::new(Some(TARGET), true);
    builder.step(seconds(0.0), &Event::Tick, &step(State::Idle, SpeedLimit::None));
    builder.step(seconds(1.0), &Event::Tick, &step(State::Tracking, SpeedLimit::MaxSpeed));
    // No setpoint, no word of a limit: it still acts.
    builder.step(seconds(1.5), &Event::Tick, &Step { state: State::Tracking, ..Step::default() });
    builder.step(
        seconds(3.0),
        &Event::Tick,
        &step(State::Holding(Hold::NoWidth), SpeedLimit::None),
    );
    builder.step(
        seconds(7.0),
        &Event::Tick,
        &step(State::Fault(Fault::HeldTooLong(Hold::NoWidth)), SpeedLimit::None),
    );
    builder.step(
        seconds(8.0),
        &Event::Tick,
        &step(State::Fault(Fault::HeldTooLong(Hold::NoWidth)), SpeedLimit::None),
    );
    let control = builder.finish().control.unwrap();
    assert!((control.limited_s - 2.0).abs() < 1e-9);
    assert_eq!(control.limited_by_s.keys().copied().collect::<Vec<_>>(), ["max_speed"]);
    assert!((control.held_s - 4.0).abs() < 1e-9);
    assert!((control.states_s["tracking"] - 2.0).abs() < 1e-9);
    assert!((control.states_s["fault"] - 1.0).abs() < 1e-9);
    assert_eq!(control.faults, 1);
    assert_eq!(control.fault_reasons["held_too_long_no_width"], 1);
}

#[test]
fn counts_reach_the_file_under_their_promised_keys() {
    let mut builder = SummaryBuilder::new(Some(TARGET), true);
    let up = Event::LinkUp {
        robot: RobotLimits {
            name: "r".into(),
            min_mm_per_s: MmPerS::ZERO,
            max_mm_per_s: MmPerS::ZERO,
            hold_mm_per_s: MmPerS::ZERO,
        },
    };
    builder.step(seconds(0.0), &up, &step(State::Idle, SpeedLimit::None));
    builder.step(seconds(1.0), &up, &step(State::Idle, SpeedLimit::None));
    let trace = Trace { report_ignored: true, ..Trace::default() };
    builder.step(seconds(1.0), &robot(1.0), &Step { trace, ..Step::default() });
    builder.latency(2.0, 100.0);
    builder.latency(f64::NAN, f64::INFINITY);
    builder.note(&RunNote::SetpointSent);
    builder.note(&RunNote::FramesSuperseded(3));
    builder.note(&RunNote::FrameRepeated);
    let folder = tempfile::tempdir().unwrap();
    let path = builder.finish().write(folder.path()).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    assert_eq!(json["latency_ms"], serde_json::json!({"p50": 2.0, "p99": 2.0, "max": 2.0}));
    assert_eq!(json["send_wait_ms"]["max"], 100.0);
    assert_eq!(json["setpoints_sent"], 1);
    assert_eq!(json["frames_superseded"], 3);
    assert_eq!(json["link_reconnects"], 1);
    assert_eq!(json["robot_reports_ignored"], 1);
    assert_eq!(json["repeated"], 1);
    assert_eq!(json["target_width_mm"], 42.0);
    assert_eq!(json["faults"], 0);
    assert_eq!(json["limited_s"], 0.0);
    assert_eq!(json["width_error_rms_settled_mm"], serde_json::Value::Null);
    assert_eq!(json["width_mean_mm"], serde_json::Value::Null);
}

#[test]
fn light_that_is_too_strong_is_answered_with_advice() {
    let mut builder = SummaryBuilder::new(None, false);
    let mut measured = sample::measured(42.0, 0.1);
    builder.frame(&FrameRow {
        frame: 0,
        time_s: None,
        outcome: Ok(measured),
        roughness: None,
        control: None,
    });
    assert!(builder.finish().advice.is_empty());
    measured.hints.saturated_fraction = 0.25;
    for frame in 1..9 {
        builder.frame(&FrameRow {
            frame,
            time_s: None,
            outcome: Ok(measured),
            roughness: None,
            control: None,
        });
    }
    let json = serde_json::to_value(builder.finish()).unwrap();
    let advice = json["advice"][0].as_str().unwrap();
    assert!(advice.contains("22 %") && advice.contains("shorten the exposure"), "{advice}");
}
