//! Laws under the supervisor, against plants.

use super::*;
use crate::extruder::limits::CommandLimits;
use crate::extruder::pressure::kalman::Noise;
use crate::extruder::pressure::tuning::Tuning;
use crate::extruder::pressure::{Fopdt, Running};
use crate::extruder::rheology::PowerLaw;
use crate::extruder::screw::control::{Scheme, ScrewSettings};
use crate::extruder::screw::law::Setpoint;
use crate::extruder::screw::{FillLaw, PiecewiseExponential, Pulsation, ScrewDesign};
use crate::extruder::{
    Drive, ExtruderHold, ExtruderSetup, ExtruderState, Laying, PumpMode, Supervisor,
};
use crate::sim::pressure::{Disturbed, Plant};
use crate::sim::screw::{Integrator, ScrewPlant};
use crate::units::{MPa, Mm, Rpm};

const TICK: Span = Span::from_millis(5);

fn report() -> ExtruderReport {
    ExtruderReport {
        pump: PumpMode::On,
        valve_open: true,
        screw_rpm: None,
        pressure_mpa: None,
        flow_mm3_per_s: None,
        filled_mm: None,
    }
}

fn supervisor(drive: Drive, law: Law, limits: CommandLimits) -> Supervisor {
    Supervisor::new(ExtruderSetup {
        drive,
        law,
        limits,
        feedforward_period: TICK,
        control_period: Span::from_millis(50),
        io_period: Span::from_millis(20),
        max_gap: Span::from_millis(200),
        max_hold: Span::from_secs(2.0),
        max_pressure: None,
    })
}

/// Something that is told a command every 5 ms, none while the pump stands,
/// and reports every 20 ms.
trait Machine {
    fn advance(&mut self, command: Option<f64>);
    fn report(&self) -> ExtruderReport;
}

/// Runs for a time from a moment on.
fn run(side: &mut Supervisor, machine: &mut impl Machine, (from, to): (u32, u32), laying: Laying) {
    let mut told = None;
    for tick in from..to {
        let now = Stamp::from_secs(f64::from(tick) * TICK.secs());
        if tick.is_multiple_of(4) {
            side.reported(now, &machine.report());
        }
        if let Some(command) = side.tick(now, laying) {
            told = command.pump_on.then_some(command.value);
        }
        machine.advance(told);
    }
}

struct Pressed(Plant);

impl Machine for Pressed {
    fn advance(&mut self, command: Option<f64>) {
        self.0.command(Rpm::new(command.unwrap_or(0.0)).unwrap());
        self.0.advance();
    }

    fn report(&self) -> ExtruderReport {
        ExtruderReport { pressure_mpa: Some(self.0.read()), ..report() }
    }
}

#[test]
fn the_pressure_of_a_flow_is_reached_on_every_bead_from_a_standing_screw() {
    let process = Fopdt::new(0.02, 0.84, 0.41).unwrap();
    let noise = Noise::new(2e-5, 4.98e-5).unwrap();
    let limits = CommandLimits::new(0.0, 90.0, 1e4).unwrap();
    let settings = PressureSettings {
        choice: PressureChoice::Predictive(Tuning::of(&process, &noise, 0.1).unwrap()),
        model: process,
        noise,
        nozzle: PowerLaw::PP_GF28,
        limits,
    };
    let mut side = supervisor(Drive::Rpm, Law::Pressure(PressureLoop::new(settings)), limits);
    let rest = Running { pressure: MPa::ZERO, target: MPa::ZERO, speed: Rpm::ZERO };
    let disturbed = Disturbed { noise_mpa2: 4.98e-5, seed: 7, ..Disturbed::default() };
    let mut machine = Pressed(Plant::new(process, disturbed, Rpm::constant(90.0), rest));
    let flow = PowerLaw::PP_GF28.flow(MPa::constant(0.6)).unwrap();
    for bead in 0..2 {
        let start = bead * 4000;
        run(&mut side, &mut machine, (start, start + 1000), Laying::Bead(flow));
        let pressure = machine.0.pressure();
        assert!((pressure - 0.6).abs() < 0.02, "bead {bead}: {pressure}");
        assert_eq!(side.state(), ExtruderState::Running);
        run(&mut side, &mut machine, (start + 1000, start + 4000), Laying::Idle);
        assert!(machine.0.pressure() < 0.01);
    }
}

struct Filled(ScrewPlant);

impl Machine for Filled {
    fn advance(&mut self, command: Option<f64>) {
        if let Some(fill) = command {
            self.0.advance(fill);
        }
    }

    fn report(&self) -> ExtruderReport {
        ExtruderReport { filled_mm: Mm::new(self.0.plug_m() * 1000.0).ok(), ..report() }
    }
}

fn screw() -> (Supervisor, Filled) {
    let pulsation = Pulsation { share: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
    let screw = ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap();
    let setpoint = Setpoint { plug: Mm::constant(160.0), most: 0.9 };
    let law = PiecewiseExponential::new(&screw, setpoint, 36.3194).unwrap();
    let law = FillLaw::Exponential(law);
    let settings = ScrewSettings {
        screw,
        law,
        scheme: Scheme::Exact,
        period: Span::from_millis(50),
        before: screw.holding(0.1),
    };
    let law = Law::Screw(ScrewFill::new(&settings).unwrap());
    let side = supervisor(Drive::Filling, law, CommandLimits::new(0.0, 0.9, 1e3).unwrap());
    let scheme = Integrator::RungeKutta(TICK.secs());
    (side, Filled(ScrewPlant::new(screw, scheme, TICK.secs(), 0.1, screw.holding(0.1))))
}

#[test]
fn what_was_on_its_way_when_the_screw_stood_still_is_known_on_the_next_bead() {
    let (mut side, mut machine) = screw();
    let bead = Laying::Bead(Mm3PerS::constant(1.0));
    // The first bead ends while the feed is on its way to the plug.
    run(&mut side, &mut machine, (0, 200), bead);
    run(&mut side, &mut machine, (200, 5000), Laying::Idle);
    run(&mut side, &mut machine, (5000, 5800), bead);
    let plug = machine.0.plug_m();
    assert!((plug - 0.16).abs() < 0.001, "{plug}");
}

#[test]
fn a_screw_filled_beyond_its_length_is_a_hold_until_it_reads_right() {
    let (mut side, mut machine) = screw();
    let bead = Laying::Bead(Mm3PerS::constant(1.0));
    run(&mut side, &mut machine, (0, 400), bead);
    let bad = ExtruderReport { filled_mm: Some(Mm::constant(250.0)), ..report() };
    let at = |tick: u32| Stamp::from_secs(f64::from(tick) * TICK.secs());
    for tick in 400..500 {
        side.reported(at(tick), &bad);
        let _ = side.tick(at(tick), bead);
    }
    assert_eq!(side.state(), ExtruderState::Holding(ExtruderHold::BadReading));
    run(&mut side, &mut machine, (500, 520), bead);
    assert_eq!(side.state(), ExtruderState::Running);
}
