//! What the PC's client does.

use std::time::Duration;

use truebead::control::Command;
use truebead::core::{RobotMode, Stamp};
use truebead::drivers::StartError;
use truebead::drivers::line::LinkTiming;
use truebead::drivers::robot::line::{LinkClient, LinkConfig, RobotLineEvent};
use truebead::io::clock::RunClock;
use truebead::link::{ErrCode, RobotFaults};
use truebead::run::ports::{RobotPort, SendError, Sent};

use crate::support::{Pc, Talk, config, listener, sim, sim_on, speed};

const HELLO: &str = "HELLO 1 fake 60 130 60\n";

#[test]
fn hello_then_a_stream_of_setpoints() {
    let sim = sim();
    let mut pc = Pc::start(config(sim.local_addr()));
    let robot = pc.until(|event| match event {
        RobotLineEvent::Up { hello: robot, .. } => Some(robot.clone()),
        _ => None,
    });
    assert_eq!((robot.min_mm_per_s, robot.max_mm_per_s), (speed(60.0), speed(150.0)));
    let mut before = Stamp::START;
    for seq in 1..=5 {
        let state = pc.until_mode(RobotMode::Print);
        assert!(state.t_ms >= 7_000_000, "the robot has a clock of its own");
        let written = pc.link.send(Command::Speed(speed(100.0))).unwrap();
        assert_eq!(written.seq, seq);
        assert!(written.at > before);
        before = written.at;
    }
    let state = pc.until_state(|state| state.seq == 5);
    assert_eq!(state.mode, RobotMode::Print);
    let sent = RobotPort::send(&mut pc.link, Stamp::START, Command::Speed(speed(90.0)));
    assert!(matches!(sent, Ok(Sent { at }) if at > before));
    pc.until_state(|state| (state.speed_mm_per_s.get() - 90.0).abs() < 0.1);
    let path = sim.history().windows(2).all(|pair| pair[0].state.path_mm <= pair[1].state.path_mm);
    assert!(path);
}

#[test]
fn setpoints_that_end_lead_to_hold_and_then_to_stop() {
    let sim = sim();
    let pc = Pc::start(LinkConfig { valid_ms: 100, ..config(sim.local_addr()) });
    pc.until_mode(RobotMode::Print);
    // A machine that is busy may need more than one before one is in time.
    loop {
        pc.link.send(Command::Speed(speed(100.0))).unwrap();
        let state = pc.until_state(|_| true);
        if state.seq > 0 {
            break;
        }
    }
    pc.until_mode(RobotMode::Hold);
    let state = pc.until_state(|state| (state.speed_mm_per_s.get() - 60.0).abs() < 0.1);
    assert_eq!(state.mode, RobotMode::Hold);
    pc.until_mode(RobotMode::Stop);
    pc.until_state(|state| state.speed_mm_per_s.get() < 0.1);
    let refused = pc.link.send(Command::Speed(speed(100.0))).unwrap_err();
    assert_eq!(refused, SendError::NotPrinting { mode: RobotMode::Stop });
}

#[test]
fn a_setpoint_ends_a_hold() {
    let sim = sim();
    let pc = Pc::start(config(sim.local_addr()));
    pc.until_mode(RobotMode::Hold);
    pc.link.send(Command::Speed(speed(100.0))).unwrap();
    assert_eq!(pc.until_mode(RobotMode::Print).seq, 1);
}

#[test]
fn a_stop_leaves_in_any_mode() {
    let sim = sim_on(listener(), 0);
    let pc = Pc::start(config(sim.local_addr()));
    assert_eq!(pc.until_state(|_| true).mode, RobotMode::Idle);
    let refused = pc.link.send(Command::Speed(speed(100.0))).unwrap_err();
    assert_eq!(refused, SendError::NotPrinting { mode: RobotMode::Idle });
    assert_eq!(pc.link.send(Command::Stop).unwrap().seq, 1);
    pc.until_state(|state| state.seq == 1);
    assert!(sim.begin_bead(truebead::core::Mm::ZERO));
    pc.until_mode(RobotMode::Print);
    assert_eq!(pc.link.send(Command::Stop).unwrap().seq, 2);
    pc.until_mode(RobotMode::Stop);
}

#[test]
fn a_robot_that_vanishes_is_found_again() {
    let sim = sim();
    let address = sim.local_addr();
    let pc = Pc::start(config(address));
    pc.until_mode(RobotMode::Print);
    pc.link.send(Command::Speed(speed(100.0))).unwrap();
    pc.until_state(|state| state.seq == 1);
    sim.stop();
    pc.until_down();
    assert_eq!(
        pc.link.send(Command::Stop).unwrap_err(),
        SendError::NotConnected { device: "robot" }
    );
    assert!(pc.until_down().contains(&format!("no robot at {address}")));
    let sim = sim_on(std::net::TcpListener::bind(address).unwrap(), 1);
    pc.until_up();
    pc.until_mode(RobotMode::Print);
    let written = pc.link.send(Command::Speed(speed(100.0))).unwrap();
    assert_eq!(written.seq, 1, "each connection counts from 1");
    drop(sim);
}

#[test]
fn a_robot_that_falls_silent_is_given_up_and_called_again() {
    let sim = sim();
    let timing = LinkTiming { silence: Duration::from_millis(200), ..LinkTiming::default() };
    let pc = Pc::start(LinkConfig { timing, ..config(sim.local_addr()) });
    pc.until_mode(RobotMode::Print);
    sim.set_faults(RobotFaults { mute: true, ..RobotFaults::default() });
    assert_eq!(pc.until_down(), "no STATE from the robot for 200 ms");
    sim.set_faults(RobotFaults::default());
    pc.until_up();
    pc.until_state(|_| true);
}

#[test]
fn three_lines_without_sense_in_a_row_end_the_connection() {
    let listener = listener();
    let pc = Pc::start(config(listener.local_addr().unwrap()));
    let mut robot = Talk::answer(&listener, HELLO);
    pc.until_up();
    robot.say("rubbish\nSTATE 1 0 RUN 0 0 0\nSTATE 2 0 IDLE 0 0 0\n");
    robot.say("ERR\nSTATE 3 0 IDLE 1e3 0 0\nSTATE 4 0 IDLE 0 0 0\n");
    assert_eq!(pc.until_state(|state| state.t_ms == 4).mode, RobotMode::Idle);
    robot.say(&format!("{}\n\u{e9}\nSTATE 5\n", "x".repeat(500)));
    assert!(pc.until_down().contains("make no sense"));
    robot.hear_the_end();
    let _again = Talk::answer(&listener, HELLO);
    pc.until_up();
}

#[test]
fn a_robot_of_another_version_is_not_taken() {
    let listener = listener();
    let timing = LinkTiming { hello: Duration::from_millis(100), ..LinkTiming::default() };
    let pc = Pc::start(LinkConfig { timing, ..config(listener.local_addr().unwrap()) });
    let _robot = Talk::answer(&listener, "HELLO 2 fake 60 130 60\n");
    assert_eq!(pc.until_down(), "the robot did not answer HELLO");
    assert_eq!(
        pc.link.send(Command::Stop).unwrap_err(),
        SendError::NotConnected { device: "robot" }
    );
}

#[test]
fn what_lies_outside_the_limits_never_leaves_the_pc() {
    let listener = listener();
    let min = speed(70.0);
    let mut pc = Pc::start(LinkConfig { min, ..config(listener.local_addr().unwrap()) });
    let mut robot = Talk::answer(&listener, HELLO);
    pc.until_up();
    assert_eq!(
        pc.link.send(Command::Speed(speed(100.0))).unwrap_err(),
        SendError::NoState { device: "robot" }
    );
    robot.say("STATE 4711 0 PRINT 112.5 0 0\n");
    pc.until_mode(RobotMode::Print);
    for value in [69.9, 130.1, 0.0, -100.0, f64::MAX] {
        let refused = pc.link.send(Command::Speed(speed(value))).unwrap_err();
        assert!(matches!(refused, SendError::OutsideLimits { .. }), "{value}: {refused}");
    }
    pc.link.send(Command::Speed(speed(130.0))).unwrap();
    pc.link.send(Command::Speed(speed(70.0))).unwrap();
    pc.link.close();
    assert_eq!(robot.hear().as_deref(), Some("SPEED 1 130 1000 4711"));
    assert_eq!(robot.hear().as_deref(), Some("SPEED 2 70 1000 4711"));
    assert_eq!(robot.hear().as_deref(), Some("BYE"));
    assert_eq!(robot.hear(), None);
}

#[test]
fn a_refusal_is_reported() {
    let sim = sim();
    let pc = Pc::start(config(sim.local_addr()));
    pc.until_mode(RobotMode::Print);
    sim.set_faults(RobotFaults { refuse: Some(ErrCode::Range), ..RobotFaults::default() });
    pc.link.send(Command::Speed(speed(100.0))).unwrap();
    let refused = pc.until(|event| match event {
        RobotLineEvent::Refused { seq, code, .. } => Some((*seq, *code)),
        _ => None,
    });
    assert_eq!(refused, (1, ErrCode::Range));
}

#[test]
fn a_robot_that_takes_no_bytes_does_not_hold_the_pc_up() {
    let listener = listener();
    let timing = LinkTiming { silence: Duration::from_secs(60), ..LinkTiming::default() };
    let pc = Pc::start(LinkConfig { timing, ..config(listener.local_addr().unwrap()) });
    let _robot = Talk::answer(&listener, HELLO);
    pc.until_up();
    let failed = loop {
        if let Err(why) = pc.link.send(Command::Stop) {
            break why;
        }
    };
    assert_eq!(
        failed,
        SendError::Write {
            device: "robot",
            reason: "the robot does not take any bytes".to_owned()
        }
    );
    assert_eq!(
        pc.link.send(Command::Stop).unwrap_err(),
        SendError::NotConnected { device: "robot" }
    );
    assert_eq!(pc.until_down(), failed.to_string());
}

#[test]
fn a_client_ends_while_nobody_answers() {
    let address = listener().local_addr().unwrap();
    let mut pc = Pc::start(config(address));
    assert!(pc.until_down().starts_with("no robot at 127.0.0.1"));
    pc.link.close();
    assert!(pc.events.try_iter().count() <= 1, "one reason is told once");
}

#[test]
fn a_configuration_that_cannot_work_is_refused() {
    let start = |config| LinkClient::start(config, RunClock::start(), |_| true).unwrap_err();
    let good = config(([127, 0, 0, 1], 1).into());
    let found = start(LinkConfig { valid_ms: 50, ..good.clone() });
    assert_eq!(found, StartError::Valid { found: 50 });
    let found = start(LinkConfig { min: speed(200.0), ..good });
    assert!(matches!(found, StartError::Limits { .. }));
}
