use proptest::prelude::*;

use super::*;
use crate::link::PcLine;

const CLOCK_MS: u64 = 5_000_000;

fn ms(t: u64) -> Stamp {
    Stamp::from_ns(t * 1_000_000)
}

fn mm_per_s(value: f64) -> MmPerS {
    MmPerS::constant(value)
}

fn printing(bead: Option<f64>) -> VirtualRobot {
    let bead = bead.map(Mm::constant);
    let params = RobotParams { bead, clock_start_ms: CLOCK_MS, ..RobotParams::default() };
    let mut cell = VirtualRobot::new(params, Stamp::START).unwrap();
    cell.connect(Stamp::START);
    cell.take(Stamp::START, PcLine::Hello);
    assert!(cell.begin_bead(Stamp::START, Mm::ZERO));
    cell
}

/// A setpoint that refers to a `STATE` sent just now.
fn speed(seq: u64, value: f64, valid_ms: u64, now_ms: u64) -> PcLine {
    PcLine::Speed { seq, speed: mm_per_s(value), valid_ms, ref_t_ms: CLOCK_MS + now_ms }
}

fn refusal(answer: Option<RobotLine>) -> ErrCode {
    match answer {
        Some(RobotLine::Err { code, .. }) => code,
        other => panic!("expected ERR, found {other:?}"),
    }
}

#[test]
fn hello_is_answered_with_the_limits() {
    let mut cell = VirtualRobot::new(RobotParams::default(), Stamp::START).unwrap();
    let answer = cell.take(Stamp::START, PcLine::Hello).unwrap();
    assert_eq!(answer.format(), "HELLO 1 truebead-sim 60 150 60\n");
}

#[test]
fn a_setpoint_runs_out_to_hold_and_a_second_later_to_stop() {
    let mut cell = printing(None);
    assert_eq!(cell.take(ms(100), speed(1, 100.0, 300, 100)), None);
    assert_eq!(cell.state(ms(399)).mode, RobotMode::Print);
    assert!((cell.state(ms(399)).speed_mm_per_s.get() - 100.0).abs() < 1e-3);
    assert_eq!(cell.state(ms(400)).mode, RobotMode::Hold);
    assert!((cell.state(ms(900)).speed_mm_per_s.get() - 60.0).abs() < 1e-3);
    assert_eq!(cell.state(ms(1399)).mode, RobotMode::Hold);
    let stopped = cell.state(ms(1400));
    assert_eq!((stopped.mode, stopped.seq, stopped.t_ms), (RobotMode::Stop, 1, CLOCK_MS + 1400));
    assert_eq!(refusal(cell.take(ms(1500), speed(2, 100.0, 300, 1500))), ErrCode::Mode);
    assert!(cell.state(ms(3000)).speed_mm_per_s.get() < 1e-6);
    cell.acknowledge(ms(3000));
    assert_eq!(cell.mode(), RobotMode::Idle);
}

#[test]
fn one_late_look_sees_what_many_would_have_seen() {
    let mut cell = printing(None);
    assert_eq!(cell.state(ms(60_000)).mode, RobotMode::Stop);
}

#[test]
fn a_setpoint_in_hold_returns_to_print() {
    let mut cell = printing(None);
    cell.take(ms(0), speed(1, 100.0, 100, 0));
    assert_eq!(cell.state(ms(500)).mode, RobotMode::Hold);
    assert_eq!(cell.take(ms(600), speed(2, 90.0, 300, 600)), None);
    let state = cell.state(ms(700));
    assert_eq!((state.mode, state.seq), (RobotMode::Print, 2));
}

#[test]
fn a_bead_without_any_setpoint_ends_in_stop() {
    let mut cell = printing(None);
    assert_eq!(cell.state(ms(999)).mode, RobotMode::Print);
    assert!((cell.state(ms(999)).speed_mm_per_s.get() - 112.5).abs() < 1e-6);
    assert_eq!(cell.state(ms(1000)).mode, RobotMode::Hold);
    assert_eq!(cell.state(ms(2000)).mode, RobotMode::Stop);
}

#[test]
fn what_is_void_on_arrival_is_stale() {
    let mut cell = printing(None);
    assert_eq!(refusal(cell.take(ms(300), speed(1, 100.0, 300, 0))), ErrCode::Stale);
    assert_eq!(cell.take(ms(300), speed(2, 100.0, 300, 1)), None);
    assert_eq!(cell.state(ms(300)).mode, RobotMode::Print);
    assert_eq!(cell.state(ms(301)).mode, RobotMode::Hold);
}

#[test]
fn a_robot_holds_its_own_limits() {
    let mut cell = printing(None);
    for (seq, line) in [
        speed(1, 59.9, 300, 0),
        speed(2, 150.1, 300, 0),
        speed(3, -100.0, 300, 0),
        speed(4, 100.0, 99, 0),
        speed(5, 100.0, 1001, 0),
        speed(6, 100.0, 300, 60_000),
    ]
    .into_iter()
    .enumerate()
    {
        assert_eq!(refusal(cell.take(ms(10), line)), ErrCode::Range, "line {seq}");
    }
    assert_eq!(cell.state(ms(10)).seq, 0);
    assert_eq!(cell.take(ms(10), speed(7, 150.0, 1000, 10)), None);
    assert_eq!(cell.take(ms(10), speed(8, 60.0, 100, 10)), None);
}

#[test]
fn the_count_is_checked_on_each_connection_and_shared_with_stop() {
    let mut cell = printing(None);
    cell.take(ms(0), speed(1, 100.0, 300, 0));
    assert_eq!(refusal(cell.take(ms(10), speed(1, 100.0, 300, 0))), ErrCode::Sequence);
    assert_eq!(refusal(cell.take(ms(10), speed(4, 100.0, 300, 0))), ErrCode::Sequence);
    assert_eq!(cell.take(ms(10), speed(5, 100.0, 300, 0)), None);
    cell.connect(ms(20));
    assert_eq!(cell.state(ms(20)).seq, 0);
    assert_eq!(refusal(cell.take(ms(20), speed(1, 100.0, 300, 0))), ErrCode::Form);
    cell.take(ms(20), PcLine::Hello);
    assert_eq!(cell.take(ms(20), speed(1, 100.0, 300, 0)), None);
    assert_eq!(cell.take(ms(30), PcLine::Stop { seq: 2 }), None);
    assert_eq!(cell.state(ms(30)).mode, RobotMode::Stop);
}

#[test]
fn loss_of_the_connection_lets_the_last_setpoint_run_out() {
    let mut cell = printing(None);
    cell.take(ms(0), speed(1, 100.0, 300, 0));
    cell.disconnect(ms(10));
    assert_eq!(cell.state(ms(299)).mode, RobotMode::Print);
    assert_eq!(cell.state(ms(300)).mode, RobotMode::Hold);
}

#[test]
fn a_stop_is_obeyed_even_where_the_count_is_broken() {
    let mut cell = printing(None);
    assert_eq!(refusal(cell.take(ms(10), PcLine::Stop { seq: 7 })), ErrCode::Sequence);
    let state = cell.state(ms(10));
    assert_eq!((state.mode, state.seq), (RobotMode::Stop, 0));
}

#[test]
fn stop_out_of_motion_needs_no_acknowledging() {
    let mut cell = VirtualRobot::new(RobotParams::default(), Stamp::START).unwrap();
    cell.take(ms(0), PcLine::Hello);
    assert_eq!(cell.take(ms(0), PcLine::Stop { seq: 1 }), None);
    assert_eq!(cell.mode(), RobotMode::Idle);
}

#[test]
fn a_bead_ends_where_it_ends_however_seldom_one_looks() {
    let mut cell = printing(Some(50.0));
    let state = cell.state(ms(2000));
    assert_eq!(state.mode, RobotMode::Idle);
    // What follows the end is the way to a standstill from 112.5 mm/s.
    assert!((50.0..54.0).contains(&state.path_mm.get()), "{}", state.path_mm);
    assert!(cell.begin_bead(ms(2000), Mm::constant(1.0)));
    assert_eq!(cell.state(ms(2001)).z_mm, Mm::constant(1.0));
}

#[test]
fn faults_can_be_rehearsed() {
    let mut cell = printing(None);
    cell.take(ms(0), speed(1, 100.0, 1000, 0));
    cell.set_faults(ms(0), RobotFaults { speed_ratio: 0.8, mute: true, ..RobotFaults::default() });
    assert!((cell.state(ms(900)).speed_mm_per_s.get() - 80.0).abs() < 1e-3);
    assert_eq!(cell.report(ms(900)), None);
    cell.set_faults(ms(900), RobotFaults { refuse: Some(ErrCode::Mode), ..RobotFaults::default() });
    assert_eq!(refusal(cell.take(ms(900), speed(2, 100.0, 300, 900))), ErrCode::Mode);
    cell.fail(ms(901));
    assert_eq!(cell.state(ms(5000)).mode, RobotMode::Fault);
}

#[test]
fn a_robot_that_cannot_be_is_refused() {
    let start = mm_per_s(200.0);
    let error = VirtualRobot::new(RobotParams { start, ..RobotParams::default() }, Stamp::START);
    let text = error.unwrap_err().to_string();
    assert_eq!(text, "the start speed must be within 60 mm/s to 150 mm/s, found 200 mm/s");
    let params = RobotParams { bandwidth_hz: f64::NAN, ..RobotParams::default() };
    assert!(VirtualRobot::new(params, Stamp::START).is_err());
}

proptest! {
    /// Whatever comes, whenever: the path never falls, the speed stays within
    /// zero and the fastest, and looking more often changes nothing.
    #[test]
    fn any_conversation_keeps_the_robot_within_bounds(
        lines in prop::collection::vec(
            (0_u64..400, 40.0..170.0_f64, 50_u64..1100, 0_u64..600, 0..10_u8), 1..40),
    ) {
        let mut often = printing(Some(300.0));
        let mut seldom = often.clone();
        let (mut now, mut path) = (0, Mm::ZERO);
        for (seq, (pause, value, valid_ms, age, what)) in (1..).zip(lines) {
            for t in now..now + pause {
                let state = often.state(ms(t));
                prop_assert!(state.path_mm >= path);
                prop_assert!((-1e-9..=150.0 + 1e-9).contains(&state.speed_mm_per_s.get()));
                path = state.path_mm;
            }
            now += pause;
            let ref_t_ms = CLOCK_MS + now.saturating_sub(age);
            let line = if what == 0 {
                PcLine::Stop { seq }
            } else {
                PcLine::Speed { seq, speed: mm_per_s(value), valid_ms, ref_t_ms }
            };
            prop_assert_eq!(often.take(ms(now), line), seldom.take(ms(now), line));
            if what == 1 {
                often.acknowledge(ms(now));
                seldom.acknowledge(ms(now));
                often.begin_bead(ms(now), Mm::ZERO);
                seldom.begin_bead(ms(now), Mm::ZERO);
            }
        }
        let (a, b) = (often.state(ms(now)), seldom.state(ms(now)));
        prop_assert_eq!((a.mode, a.seq, a.t_ms), (b.mode, b.seq, b.t_ms));
        prop_assert!((a.path_mm.get() - b.path_mm.get()).abs() < 1e-4);
    }
}
