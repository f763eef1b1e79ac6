mod repeated;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use super::*;
use crate::control::{Controller, example_setup};
use crate::core::{Frame, Mm, MmPerS2, Pixels, RefusalReason, RobotLimits, RobotState, Size};
use crate::live::capture::MeasuredFrame;
use crate::live::journal::FrameWithEdges;
use crate::live::latency::Latency;
use crate::rows::frame_row::FrameRow;
use crate::rows::frame_row::sample::measured;
use crate::run::ports::{RecordError, SendError, Sent};
use crate::run::runner::NoRecorder;

/// Setpoints a second.
const RATE_HZ: f64 = 5.0;
/// Time between two reports of the robot \[s\].
const REPORT_S: f64 = 0.05;

fn at(s: f64) -> Stamp {
    Stamp::from_secs(s)
}

fn speed(mm_per_s: f64) -> MmPerS {
    MmPerS::constant(mm_per_s)
}

/// What happens when, in order, on a clock that moves only when it is waited for.
#[derive(Default)]
struct Script {
    now: Stamp,
    inputs: VecDeque<(Stamp, LiveInput)>,
    /// How much later than asked a wait returns \[s\].
    oversleeps_s: f64,
}

impl Script {
    fn of(mut inputs: Vec<(f64, LiveInput)>) -> Self {
        inputs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let inputs = inputs.into_iter().map(|(s, input)| (at(s), input)).collect();
        Self { inputs, ..Self::default() }
    }
}

impl Inputs for Script {
    fn now(&self) -> Stamp {
        self.now
    }

    fn next(&mut self, until: Stamp) -> Option<LiveInput> {
        let due = self.inputs.front().is_some_and(|(at, _)| *at <= until);
        let input = if due { self.inputs.pop_front() } else { None };
        let woken = input.as_ref().map_or(until + Span::from_secs(self.oversleeps_s), |it| it.0);
        self.now = self.now.max(woken);
        input.map(|(_, input)| input)
    }

    fn ignore_camera(&mut self) {
        self.inputs
            .retain(|(_, input)| !matches!(input, LiveInput::Camera(_) | LiveInput::CameraGone));
    }
}

/// Commands as they reached the robot.
type Commands = Arc<Mutex<Vec<(Stamp, Command)>>>;

struct Robot {
    commands: Commands,
    is_deaf: bool,
}

impl RobotPort for Robot {
    fn send(&mut self, now: Stamp, command: Command) -> Result<Sent, SendError> {
        if self.is_deaf {
            return Err(SendError::NotConnected { device: "robot" });
        }
        self.commands.lock().unwrap().push((now, command));
        // The write itself takes a millisecond.
        Ok(Sent { at: now + Span::from_millis(1) })
    }
}

#[derive(Default)]
struct Notes {
    rows: RefCell<Vec<FrameRow>>,
    events: RefCell<Vec<(Stamp, Event)>>,
    latencies: RefCell<Vec<Latency>>,
    setpoints: RefCell<usize>,
    repeated: RefCell<usize>,
}

impl Journal for Notes {
    fn frame(&self, row: &FrameRow, _: Option<FrameWithEdges>) {
        self.rows.borrow_mut().push(*row);
    }

    fn step(&self, now: Stamp, event: Event, _: Step) {
        self.events.borrow_mut().push((now, event));
    }

    fn latency(&self, latency: Latency) {
        self.latencies.borrow_mut().push(latency);
    }

    fn note(&self, note: RunNote) {
        match note {
            RunNote::SetpointSent => *self.setpoints.borrow_mut() += 1,
            RunNote::FrameRepeated => *self.repeated.borrow_mut() += 1,
            _ => {}
        }
    }
}

/// What a run came to.
struct Outcome {
    ending: Ending,
    /// When the last wait returned.
    ended_at: Stamp,
    commands: Vec<(Stamp, Command)>,
    notes: Notes,
    said: Vec<String>,
}

impl Outcome {
    fn setpoints_at(&self) -> Vec<f64> {
        let speeds = self.commands.iter().filter(|(_, it)| matches!(it, Command::Speed(_)));
        speeds.map(|(at, _)| (at.secs() * 1e6).round() / 1e6).collect()
    }

    fn has(&self, wanted: impl Fn(&Event) -> bool) -> bool {
        self.notes.events.borrow().iter().any(|(_, event)| wanted(event))
    }
}

/// A run of a cell, before it begins.
struct Run<K> {
    script: Script,
    recorder: K,
    is_deaf: bool,
    duration: Option<Span>,
    limits: SpeedLimits,
}

impl Run<NoRecorder> {
    fn of(inputs: Vec<(f64, LiveInput)>) -> Self {
        let limits = example_setup().limits;
        let script = Script::of(inputs);
        Self { script, recorder: NoRecorder, is_deaf: false, duration: None, limits }
    }
}

impl<K: Recorder> Run<K> {
    fn go(self) -> Outcome {
        let (commands, notes) = (Commands::default(), Notes::default());
        let robot = Robot { commands: Arc::clone(&commands), is_deaf: self.is_deaf };
        let controller = Controller::new(example_setup());
        let said = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&said);
        let robot: Box<dyn RobotPort> = Box::new(robot);
        let settings = ControlSettings {
            rate_hz: RATE_HZ,
            limits: self.limits,
            duration: self.duration,
            ends_with_steps: false,
        };
        let runner = Runner::with_extruder(controller, robot, None, self.recorder);
        let operator = Operator {
            notice: Box::new(move |line| heard.lock().unwrap().push(line.to_owned())),
            status: Box::new(|_| {}),
        };
        let mut thread = ControlThread::new(settings, self.script, runner, None, &notes, operator);
        let ending = thread.run();
        let ended_at = thread.inputs.now;
        drop(thread);
        let commands = commands.lock().unwrap().clone();
        let said = said.lock().unwrap().clone();
        Outcome { ending, ended_at, commands, notes, said }
    }
}

fn up() -> LiveInput {
    LiveInput::Robot(RobotEvent::Up {
        at: Stamp::START,
        limits: RobotLimits {
            name: "script".into(),
            min_mm_per_s: speed(10.0),
            max_mm_per_s: speed(300.0),
            hold_mm_per_s: speed(60.0),
        },
    })
}

fn report(s: f64, mode: RobotMode) -> LiveInput {
    let moving = example_setup().cell.start_speed.get();
    LiveInput::Robot(RobotEvent::State {
        at: at(s),
        state: RobotState {
            robot_time_ms: None,
            has_setpoint: true,
            mode,
            speed_mm_per_s: speed(moving),
            path_mm: Mm::constant(moving * s),
            z_mm: Mm::ZERO,
        },
    })
}

/// A robot that prints from the start until a time.
fn printing(until_s: f64) -> Vec<(f64, LiveInput)> {
    let mut inputs = vec![(0.0, up())];
    let mut s = 0.01;
    while s < until_s {
        inputs.push((s, report(s, RobotMode::Print)));
        s += REPORT_S;
    }
    inputs
}

#[test]
fn setpoints_leave_on_a_fixed_grid_whatever_comes_between() {
    let outcome = Run { duration: Some(Span::from_secs(1.1)), ..Run::of(printing(1.2)) }.go();
    assert_eq!(outcome.ending, Ending::TimeOver);
    assert_eq!(outcome.setpoints_at(), [0.2, 0.4, 0.6, 0.8, 1.0]);
    assert_eq!(*outcome.notes.setpoints.borrow(), 5);
}

#[test]
fn a_machine_that_oversleeps_leaves_setpoints_out_and_keeps_the_grid() {
    let inputs = vec![(0.0, up()), (0.01, report(0.01, RobotMode::Print))];
    let mut run = Run { duration: Some(Span::from_secs(1.5)), ..Run::of(inputs) };
    run.script.oversleeps_s = 0.25;
    let outcome = run.go();
    // Woken at 0.45 for 0.2, then due at 0.6 and woken at 0.85, and so on.
    assert_eq!(outcome.setpoints_at(), [0.45, 0.85, 1.25]);
}

#[test]
fn a_run_ends_with_a_stop_and_waits_for_the_robot_to_stand() {
    let mut inputs = printing(1.0);
    inputs.push((0.5, LiveInput::StopRequested));
    inputs.push((0.7, report(0.7, RobotMode::Stop)));
    inputs.retain(|(s, input)| *s < 0.7 || !matches!(input, LiveInput::Robot(_)) || *s == 0.7);
    let outcome = Run::of(inputs).go();
    assert_eq!(outcome.ending, Ending::Asked);
    assert_eq!(
        outcome.commands.last().map(|(at, it)| (at.secs(), *it)),
        Some((0.5, Command::Stop))
    );
    assert_eq!(outcome.ended_at, at(0.7));
}

#[test]
fn a_robot_that_never_stands_is_waited_for_no_longer_than_the_timeout() {
    let mut inputs = printing(5.0);
    inputs.push((0.5, LiveInput::StopRequested));
    let outcome = Run::of(inputs).go();
    assert_eq!(outcome.ended_at, at(0.5) + SHUTDOWN_TIMEOUT);
}

#[test]
fn a_link_that_is_gone_is_not_waited_for() {
    let inputs = vec![(0.0, up()), (0.3, LiveInput::StopRequested), (0.35, LiveInput::DeviceGone)];
    assert_eq!(Run::of(inputs).go().ended_at, at(0.35));
}

#[test]
fn the_last_frame_ends_the_run() {
    for last in [LiveInput::Camera(CameraMessage::Ended(None)), LiveInput::CameraGone] {
        let mut inputs = printing(1.0);
        inputs.push((0.3, last));
        assert_eq!(Run::of(inputs).go().ending, Ending::LastFrame);
    }
}

#[test]
fn a_lost_camera_holds_and_ends_the_run_when_the_hold_has_lasted_too_long() {
    let hold_s = example_setup().control.max_hold.secs();
    let mut inputs = printing(hold_s + 3.0);
    let lost = CameraMessage::Ended(Some("the cable".into()));
    inputs.push((0.3, LiveInput::Camera(lost)));
    let outcome = Run::of(inputs).go();
    assert_eq!(outcome.ending, Ending::CameraLost("the cable".into()));
    assert!(outcome.said.contains(&"camera lost: the cable".to_owned()), "{:?}", outcome.said);
    assert!(outcome.has(|event| matches!(event, Event::CameraLost { .. })));
    let stop = outcome.commands.iter().find(|(_, it)| *it == Command::Stop).unwrap();
    let waited = stop.0.secs() - 0.3;
    assert!(waited > hold_s && waited < hold_s + 2.0 / RATE_HZ, "{waited}");
}

/// Keeps some records and fails then.
struct SmallDisk(usize);

impl Recorder for SmallDisk {
    fn record(&mut self, _: Stamp, _: &Event, _: &Step) -> Result<(), RecordError> {
        self.0 = self.0.checked_sub(1).ok_or(RecordError("disk full".into()))?;
        Ok(())
    }
}

#[test]
fn a_full_disk_stops_the_robot() {
    let Run { script, is_deaf, duration, limits, .. } = Run::of(printing(2.0));
    let outcome = Run { script, recorder: SmallDisk(10), is_deaf, duration, limits }.go();
    assert_eq!(outcome.ending, Ending::RecordingLost("disk full".into()));
    assert_eq!(outcome.commands.last().map(|(_, it)| *it), Some(Command::Stop));
}

#[test]
fn an_alarm_of_the_recorder_stops_the_robot() {
    let mut inputs = printing(2.0);
    inputs.push((0.5, LiveInput::RecordingLost(RecordError("disk gone".into()))));
    let outcome = Run::of(inputs).go();
    assert_eq!(outcome.ending, Ending::RecordingLost("disk gone".into()));
    assert_eq!(outcome.commands.last().map(|(_, it)| *it), Some(Command::Stop));
}

#[test]
fn a_robot_with_narrower_limits_gets_no_setpoint() {
    let limits = SpeedLimits {
        min_speed: speed(1.0),
        max_speed: speed(900.0),
        max_accel: MmPerS2::constant(1000.0),
    };
    let outcome = Run { limits, ..Run::of(printing(2.0)) }.go();
    assert!(matches!(&outcome.ending, Ending::RobotLimits(why) if why.contains("`script`")));
    assert_eq!(outcome.setpoints_at(), [0.0; 0]);
}

#[test]
fn a_setpoint_that_could_not_leave_is_not_counted_as_sent() {
    let run = Run { is_deaf: true, duration: Some(Span::from_secs(1.0)), ..Run::of(printing(1.0)) };
    let outcome = run.go();
    assert_eq!((outcome.ending, *outcome.notes.setpoints.borrow()), (Ending::TimeOver, 0));
}

#[test]
fn a_frame_that_cannot_be_read_has_its_row() {
    let mut inputs = printing(1.0);
    let reason = "cut short".to_owned();
    let unreadable = CameraMessage::Unreadable { seq: 7, at: at(0.3), reason };
    inputs.push((0.31, LiveInput::Camera(unreadable)));
    let outcome = Run { duration: Some(Span::from_secs(0.5)), ..Run::of(inputs) }.go();
    let rows = outcome.notes.rows.borrow();
    let [row] = rows.as_slice() else { panic!("{} rows", rows.len()) };
    assert_eq!((row.frame, row.time_s, row.outcome.err()), (7, Some(0.3), Some("unreadable")));
}

#[test]
fn a_refusal_reaches_the_operator_and_the_log() {
    let mut inputs = printing(1.0);
    let text = "line 4: RANGE too fast".to_owned();
    let refused = RobotEvent::Refused { at: at(0.3), reason: RefusalReason::OutOfRange, text };
    inputs.push((0.3, LiveInput::Robot(refused)));
    let outcome = Run { duration: Some(Span::from_secs(0.5)), ..Run::of(inputs) }.go();
    assert!(outcome.said.contains(&"robot refused line 4: RANGE too fast".to_owned()));
    assert!(outcome.has(|event| {
        matches!(event, Event::SetpointRefused { reason: RefusalReason::OutOfRange, .. })
    }));
}

#[test]
fn a_camera_that_is_waited_for_is_reported_and_does_not_end_the_run() {
    let mut inputs = printing(1.0);
    let waiting = CameraMessage::Waiting("http://camera: connection refused".into());
    inputs.push((0.1, LiveInput::Camera(waiting)));
    inputs.push((0.4, LiveInput::StopRequested));
    let outcome = Run::of(inputs).go();
    assert_eq!(outcome.ending, Ending::Asked);
    let reported = outcome.said.iter().filter(|line| line.contains("connection refused")).count();
    assert_eq!(reported, 1);
    assert!(outcome.notes.rows.borrow().is_empty());
}

#[test]
fn a_report_whose_clock_has_not_risen_is_not_passed_on() {
    let with_clock = |s: f64, mm_per_s: f64| {
        let mut input = report(s, RobotMode::Print);
        if let LiveInput::Robot(RobotEvent::State { state, .. }) = &mut input {
            (state.robot_time_ms, state.speed_mm_per_s) = (Some(7), speed(mm_per_s));
        }
        input
    };
    let mut inputs = vec![(0.0, up())];
    inputs.extend([(0.1, with_clock(0.1, 90.0)), (0.2, with_clock(0.2, 95.0))]);
    let reason = "cut short".to_owned();
    let frame = CameraMessage::Unreadable { seq: 0, at: at(0.2), reason };
    inputs.push((0.3, LiveInput::Camera(frame)));
    let outcome = Run { duration: Some(Span::from_secs(0.5)), ..Run::of(inputs) }.go();
    let rows = outcome.notes.rows.borrow();
    assert_eq!(rows[0].control.unwrap().speed, Some(speed(90.0)));
}
