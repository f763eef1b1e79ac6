//! What the PC's client and the simulated extruder do with each other.

use std::net::{SocketAddr, TcpListener};
use std::time::Duration;

use crossbeam_channel::{Receiver, unbounded};
use truebead::cell::extruder::{LinearPlant, ScrewPulsation};
use truebead::core::Span;
use truebead::drivers::extruder::DriveRange;
use truebead::drivers::extruder::line::{ExtruderClient, ExtruderConfig, ExtruderLineEvent};
use truebead::drivers::line::LinkTiming;
use truebead::extruder::{CommandQuantity, ExtruderCommand, ExtruderLimits, PumpMode};
use truebead::io::clock::RunClock;
use truebead::link::ErrCode;
use truebead::link::extruder::{ExtruderFaults, ExtruderStatus, on_wire};
use truebead::numeric::lti::TransferFunction;
use truebead::run::ports::SendError;
use truebead::sim::extruder::{Delays, LinearPlantSim, SimExtruder};
use truebead::simulators::extruder::{ExtruderOptions, ExtruderSim};

/// What should happen does so long before; only a failure waits for it.
const PATIENCE: Duration = Duration::from_secs(20);
const RUN: ExtruderCommand = ExtruderCommand { pump_on: true, valve_open: true, value: 60.0 };
const RANGE: DriveRange = DriveRange { quantity: CommandQuantity::Rpm, min: 0.0, max: 90.0 };
const OFF: ExtruderCommand = ExtruderCommand { pump_on: false, valve_open: false, value: 0.0 };

fn sim_on(listener: TcpListener) -> ExtruderSim {
    let plant = LinearPlant {
        transfer: TransferFunction::gain(10.0).unwrap(),
        unknown_input: 0.0,
        unknown_input_per_s: 0.0,
        flow_noise: 0.0,
        flow_noise_lag_s: 0.15,
        sensor_noise: Some(0.0),
        screw_lag_s: None,
        pulsation: ScrewPulsation::NONE,
    };
    let plant = LinearPlantSim::new(&plant, 1).unwrap();
    let options = ExtruderOptions {
        hello: ExtruderLimits {
            name: "sim".into(),
            quantity: CommandQuantity::Rpm,
            min: 0.0,
            max: 90.0,
        },
        plant: SimExtruder::new(Box::new(plant), Delays::default()),
        state_period: Span::from_millis(20),
        clock_start_ms: 7_000_000,
        fails_after: None,
    };
    ExtruderSim::spawn(listener, RunClock::start(), options, Box::new(|_, _| {})).unwrap()
}

fn sim() -> ExtruderSim {
    sim_on(TcpListener::bind("127.0.0.1:0").unwrap())
}

fn config(address: SocketAddr) -> ExtruderConfig {
    ExtruderConfig {
        address: address.to_string(),
        range: RANGE,
        valid_ms: 1000,
        timing: LinkTiming {
            hello: Duration::from_secs(5),
            first_delay: Duration::from_millis(10),
            longest_delay: Duration::from_millis(50),
            ..LinkTiming::default()
        },
    }
}

struct Pc {
    link: ExtruderClient,
    events: Receiver<ExtruderLineEvent>,
}

impl Pc {
    fn start(config: ExtruderConfig) -> Self {
        let (sender, events) = unbounded();
        let report = move |event| sender.send(event).is_ok();
        let link = ExtruderClient::start(config, RunClock::start(), report).unwrap();
        Self { link, events }
    }

    fn until<T>(&self, wanted: impl Fn(ExtruderLineEvent) -> Option<T>) -> T {
        loop {
            if let Some(found) = wanted(self.events.recv_timeout(PATIENCE).unwrap()) {
                return found;
            }
        }
    }

    fn until_state(&self, wanted: impl Fn(&ExtruderStatus) -> bool) -> ExtruderStatus {
        self.until(|event| match event {
            ExtruderLineEvent::State { state, .. } if wanted(&state) => Some(state),
            _ => None,
        })
    }

    fn until_down(&self) -> String {
        self.until(|event| match event {
            ExtruderLineEvent::Down { reason, .. } => Some(reason),
            _ => None,
        })
    }

    fn until_up(&self) -> ExtruderLimits {
        self.until(|event| match event {
            ExtruderLineEvent::Up { hello, .. } => Some(hello),
            _ => None,
        })
    }
}

#[test]
fn commands_turn_the_pump_and_run_out_with_pump_and_valve_at_rest() {
    let sim = sim();
    let pc = Pc::start(ExtruderConfig { valid_ms: 200, ..config(sim.local_addr()) });
    let hello = pc.until_up();
    assert_eq!((hello.quantity, hello.min, hello.max), (CommandQuantity::Rpm, 0.0, 90.0));
    let mut seq = 0;
    // A machine that is busy may need more than one before one is in time.
    let flowing = loop {
        let state = pc.until_state(|_| true);
        if state.report.flow_mm3_per_s.is_some_and(|flow| flow.get() > 599.0) {
            break state;
        }
        seq += 1;
        assert_eq!(pc.link.send(RUN).unwrap().seq, seq);
    };
    assert!(flowing.t_ms >= 7_000_000, "the extruder has a clock of its own");
    assert_eq!(flowing.report.pump, PumpMode::On);
    assert!(flowing.report.valve_open && flowing.report.pressure_mpa.is_none());
    let out = pc.until_state(|state| state.report.pump == PumpMode::Off);
    assert!(!out.report.valve_open);
    assert_eq!(sim.command(), OFF);
}

#[test]
fn an_extruder_that_vanishes_is_found_again_and_counts_from_one() {
    let sim = sim();
    let address = sim.local_addr();
    let pc = Pc::start(config(address));
    pc.until_state(|_| true);
    pc.link.send(RUN).unwrap();
    pc.until_state(|state| state.seq == 1);
    sim.stop();
    pc.until_down();
    assert_eq!(pc.link.send(RUN).unwrap_err(), SendError::NotConnected { device: "extruder" });
    assert!(pc.until_down().contains(&format!("no extruder at {address}")));
    let sim = sim_on(TcpListener::bind(address).unwrap());
    pc.until_up();
    pc.until_state(|_| true);
    assert_eq!(pc.link.send(RUN).unwrap().seq, 1);
    drop(sim);
}

#[test]
fn silence_ends_a_connection_and_the_pump_goes_to_rest() {
    let sim = sim();
    let timing = LinkTiming { silence: Duration::from_millis(200), ..LinkTiming::default() };
    let pc = Pc::start(ExtruderConfig { timing, ..config(sim.local_addr()) });
    pc.until_state(|_| true);
    pc.link.send(RUN).unwrap();
    pc.until_state(|state| state.report.pump == PumpMode::On);
    sim.set_faults(ExtruderFaults { mute: true, ..ExtruderFaults::default() });
    assert_eq!(pc.until_down(), "no STATE from the extruder for 200 ms");
    sim.set_faults(ExtruderFaults::default());
    pc.until_up();
    pc.until_state(|state| state.report.pump == PumpMode::Off);
}

#[test]
fn a_failed_pump_is_reported_and_no_command_makes_it_run() {
    let sim = sim();
    let pc = Pc::start(config(sim.local_addr()));
    pc.until_state(|_| true);
    pc.link.send(RUN).unwrap();
    pc.until_state(|state| state.report.pump == PumpMode::On);
    sim.fail();
    pc.until_state(|state| state.report.pump == PumpMode::Fault);
    pc.link.send(RUN).unwrap();
    let code = pc.until(|event| match event {
        ExtruderLineEvent::Refused { code, .. } => Some(code),
        _ => None,
    });
    assert_eq!(code, ErrCode::Mode);
    assert_eq!(sim.pump(), PumpMode::Off);
}

#[test]
fn nothing_leaves_for_an_extruder_that_does_not_fit_the_cell() {
    let sim = sim();
    for (range, part) in [
        (DriveRange { max: 120.0, ..RANGE }, "takes 0 to 90 rpm"),
        (DriveRange { quantity: CommandQuantity::Flow, ..RANGE }, "mm3_per_s"),
    ] {
        let pc = Pc::start(ExtruderConfig { range, ..config(sim.local_addr()) });
        let limits = pc.until_up();
        assert!(range.unfit(&limits, on_wire).unwrap().contains(part));
        pc.until_state(|_| true);
        let refused = pc.link.send(OFF).unwrap_err();
        assert!(matches!(&refused, SendError::Unfit(why) if why.contains(part)), "{refused}");
    }
    let pc = Pc::start(config(sim.local_addr()));
    pc.until_state(|_| true);
    let beyond = ExtruderCommand { value: 90.5, ..RUN };
    let refused = pc.link.send(beyond).unwrap_err();
    assert_eq!(refused.to_string(), "90.5 rpm is not within 0 to 90");
}
