//! Strategies under the supervisor, against plants.

use super::*;
use crate::core::{MPa, Mm, Mm2, Mm3PerS, Rpm, Span, Stamp};
use crate::extruder::adaptive::{
    Adaptation, AdaptiveGains, EstimateBounds, MracController, ScalarPlant,
};
use crate::extruder::feedforward::{InverseSettings, RightHalfPlaneZeros, Tracker};
use crate::extruder::limits::CommandLimits;
use crate::extruder::pressure::kalman::PressureNoise;
use crate::extruder::pressure::pi::PressurePiGains;
use crate::extruder::pressure::tuning::{LoopPeriods, Tuning};
use crate::extruder::pressure::vsfc::VsfcGains;
use crate::extruder::pressure::{Fopdt, InitialState};
use crate::extruder::report::ExtruderReport;
use crate::extruder::rheology::PowerLaw;
use crate::extruder::screw::control::{Scheme, ScrewSettings};
use crate::extruder::screw::feedback::PlugSetpoint;
use crate::extruder::screw::{FillFeedback, PiecewiseExponential, ScrewDesign, SpeedPulsation};
use crate::extruder::{
    CommandQuantity, ExtruderFault, ExtruderHold, ExtruderSetup, ExtruderState, Laying, PumpMode,
    Supervisor,
};
use crate::numeric::lti::{Between, Simulator, TransferFunction};
use crate::sim::hash;
use crate::sim::pressure::{Disturbances, SimPressure};
use crate::sim::screw::{Integrator, SimScrew};

const TICK: Span = Span::from_millis(5);

pub(super) fn report() -> ExtruderReport {
    ExtruderReport {
        pump: PumpMode::On,
        valve_open: true,
        screw_rpm: None,
        pressure_mpa: None,
        flow_mm3_per_s: None,
        filled_mm: None,
    }
}

fn supervisor(
    drive: CommandQuantity,
    controller: ExtruderStrategy,
    limits: CommandLimits,
) -> Supervisor {
    Supervisor::new(ExtruderSetup {
        quantity: drive,
        strategy: controller,
        limits,
        feedforward_period: TICK,
        control_period: Span::from_millis(50),
        io_period: Span::from_millis(20),
        command_valid: Span::from_millis(300),
        max_gap: Span::from_millis(200),
        max_hold: Span::from_secs(2.0),
        max_pressure: None,
        filters: crate::extruder::ReadingFilters::default(),
        robot_follows: crate::extruder::RobotFollows::Nothing,
        timing: None,
        plan: None,
    })
}

/// A plant with a command every 5 ms, none while the pump stands, and a report every 20 ms.
trait Machine {
    fn advance(&mut self, command: Option<f64>);
    fn report(&self) -> ExtruderReport;
}

/// A plant with or without a lag that reports its flow.
struct Lagging {
    simulator: Simulator,
    flow: f64,
}

impl Lagging {
    fn new(gain: f64, lag_s: f64) -> Self {
        let plant = TransferFunction::new(&[gain], &[lag_s, 1.0], 0.0).unwrap();
        let simulator = Simulator::new(&plant, TICK.secs(), Between::Held).unwrap();
        Self { simulator, flow: 0.0 }
    }
}

impl Machine for Lagging {
    fn advance(&mut self, command: Option<f64>) {
        self.flow = self.simulator.step(command.unwrap_or(0.0));
    }

    fn report(&self) -> ExtruderReport {
        ExtruderReport { flow_mm3_per_s: Mm3PerS::new(self.flow).ok(), ..report() }
    }
}

/// Runs for a time from a moment on.
fn run(side: &mut Supervisor, machine: &mut impl Machine, ticks: (u32, u32), laying: Laying) {
    let _ = commanded(side, machine, ticks, laying, true);
}

/// The same, with reports or without; gives the commands of a pump that runs.
fn commanded(
    side: &mut Supervisor,
    machine: &mut impl Machine,
    (from, to): (u32, u32),
    laying: Laying,
    reports: bool,
) -> Vec<f64> {
    let mut all = Vec::new();
    let mut last = None;
    for tick in from..to {
        let now = Stamp::from_secs(f64::from(tick) * TICK.secs());
        if reports && tick.is_multiple_of(4) {
            let runs = matches!(laying, Laying::Bead(_));
            let pump = if runs { PumpMode::On } else { PumpMode::Off };
            side.reported(now, &ExtruderReport { pump, ..machine.report() });
        }
        if let Some(command) = side.tick(now, laying) {
            last = command.pump_on.then_some(command.value);
            all.extend(last);
        }
        machine.advance(last);
    }
    all
}

struct Pressed(SimPressure);

impl Machine for Pressed {
    fn advance(&mut self, command: Option<f64>) {
        self.0.command(Rpm::new(command.unwrap_or(0.0)).unwrap());
        self.0.advance();
    }

    fn report(&self) -> ExtruderReport {
        ExtruderReport { pressure_mpa: self.0.read(), ..report() }
    }
}

fn pressed(iterate: fn(&Fopdt, PressureNoise) -> PressureChoice) -> (Supervisor, Pressed) {
    let process = Fopdt::new(0.02, 0.84, 0.41).unwrap();
    let noise = PressureNoise::new(2e-5, 4.98e-5).unwrap();
    let limits = CommandLimits::new(0.0, 90.0, 1e4).unwrap();
    let settings = PressureSettings {
        choice: iterate(&process, noise),
        model: process,
        noise,
        nozzle: PowerLaw::PP_GF28,
        limits,
    };
    let side = supervisor(
        CommandQuantity::Rpm,
        ExtruderStrategy::Pressure(Box::new(PressureLoop::new(settings))),
        limits,
    );
    let rest = InitialState { pressure: MPa::ZERO, target: MPa::ZERO, speed: Rpm::ZERO };
    let disturbed = Disturbances { noise_mpa2: 1e-6, seed: 7, ..Disturbances::default() };
    (side, Pressed(SimPressure::new(process, disturbed, Rpm::constant(90.0), rest)))
}

fn predictive(process: &Fopdt, noise: PressureNoise) -> PressureChoice {
    PressureChoice::Predictive(Tuning::of(process, &noise, LoopPeriods::MA_2026))
}

#[test]
fn the_pressure_of_a_flow_is_reached_on_every_bead_from_a_standing_screw() {
    let flow = PowerLaw::PP_GF28.flow(MPa::constant(0.6)).unwrap();
    // The second bead begins before the pressure of the first has fallen.
    for pause in [200, 3000] {
        let (mut side, mut machine) = pressed(predictive);
        for bead in 0..2 {
            let start = bead * (1000 + pause);
            run(&mut side, &mut machine, (start, start + 1000), Laying::Bead(flow));
            let pressure = machine.0.pressure();
            assert!((pressure - 0.6).abs() < 0.03, "pause {pause}, bead {bead}: {pressure}");
            assert_eq!(side.state(), ExtruderState::Running);
            run(&mut side, &mut machine, (start + 1000, start + 1000 + pause), Laying::Idle);
        }
    }
}

/// A machine whose sensor gives the same pressure for good.
struct Stuck(Pressed, MPa);

impl Machine for Stuck {
    fn advance(&mut self, command: Option<f64>) {
        self.0.advance(command);
    }

    fn report(&self) -> ExtruderReport {
        ExtruderReport { pressure_mpa: Some(self.1), ..report() }
    }
}

#[test]
fn a_pressure_that_does_not_answer_its_target_is_a_fault_before_the_screw_runs_away() {
    let flow = |pressure| PowerLaw::PP_GF28.flow(MPa::constant(pressure)).unwrap();
    let (mut side, mut machine) = pressed(predictive);
    run(&mut side, &mut machine, (0, 2000), Laying::Bead(flow(0.6)));
    let stuck = MPa::constant(machine.0.pressure());
    let mut machine = Stuck(machine, stuck);
    run(&mut side, &mut machine, (2000, 3000), Laying::Bead(flow(0.6)));
    assert_eq!(side.state(), ExtruderState::Running);
    // Five dead times and lags: 6.25 s, of 5 ms a tick.
    let commands = commanded(&mut side, &mut machine, (3000, 4200), Laying::Bead(flow(0.8)), true);
    assert_eq!(side.state(), ExtruderState::Running);
    // 0.8 MPa need 40 rpm: no more than a fifth of the step beyond, although the sensor says that 0.6
    // are there.
    let last = commands.last().copied().unwrap();
    assert!((38.0..42.5).contains(&last), "{last}");
    run(&mut side, &mut machine, (4200, 4300), Laying::Bead(flow(0.8)));
    assert_eq!(side.state(), ExtruderState::Fault(ExtruderFault::NoPressureResponse));
}

#[test]
fn a_screw_that_conveys_nothing_is_a_fault_whatever_the_noise() {
    let flow = |pressure| PowerLaw::PP_GF28.flow(MPa::constant(pressure)).unwrap();
    for (seed, step) in (0..8).flat_map(|seed| [0.1, 0.15, 0.2].map(|step| (seed, step))) {
        let (mut side, machine) = pressed(predictive);
        let mut machine = Bridged { machine, since: None, seed, reading: 0 };
        run(&mut side, &mut machine, (0, 2000), Laying::Bead(flow(0.6)));
        machine.since = Some(machine.machine.0.pressure());
        let bead = Laying::Bead(flow(0.6 + step));
        let commands = commanded(&mut side, &mut machine, (2000, 3500), bead, true);
        let what = format!("step {step}, seed {seed}");
        assert_eq!(side.state(), ExtruderState::Fault(ExtruderFault::NoPressureResponse), "{what}");
        // After the first second, in which the screw turns fast for a moment.
        let fastest = commands.iter().skip(200).copied().fold(0.0, f64::max);
        assert!(fastest < 1.25 * (0.6 + step) / 0.02, "{what}: {fastest}");
    }
}

/// A machine with a noisy sensor; from some moment on its pressure is constant.
struct Bridged {
    machine: Pressed,
    since: Option<f64>,
    seed: u64,
    reading: u64,
}

impl Machine for Bridged {
    fn advance(&mut self, command: Option<f64>) {
        self.reading += 1;
        self.machine.advance(command);
    }

    fn report(&self) -> ExtruderReport {
        let [noise, _] = hash::normal_pair(hash::mix(&[self.seed, self.reading]));
        let truth = self.since.unwrap_or_else(|| self.machine.0.pressure());
        ExtruderReport { pressure_mpa: MPa::new(truth + 0.007 * noise).ok(), ..report() }
    }
}

/// A machine whose first reading is an outlier.
struct FirstWrong(Pressed, bool);

impl Machine for FirstWrong {
    fn advance(&mut self, command: Option<f64>) {
        self.1 = true;
        self.0.advance(command);
    }

    fn report(&self) -> ExtruderReport {
        let truth = self.0.report();
        if self.1 { truth } else { ExtruderReport { pressure_mpa: MPa::new(2.0).ok(), ..truth } }
    }
}

#[test]
fn an_outlier_as_the_first_reading_of_a_bead_does_not_lift_the_pressure() {
    let flow = PowerLaw::PP_GF28.flow(MPa::constant(0.6)).unwrap();
    let (mut side, machine) = pressed(predictive);
    let mut machine = FirstWrong(machine, false);
    let mut highest = 0.0_f64;
    for tick in 0..200 {
        run(&mut side, &mut machine, (10 * tick, 10 * tick + 10), Laying::Bead(flow));
        highest = highest.max(machine.0.0.pressure());
    }
    assert!(highest < 0.63, "{highest}");
}

#[test]
fn a_hold_while_the_pressure_rises_neither_overshoots_nor_faults() {
    let flow = PowerLaw::PP_GF28.flow(MPa::constant(0.6)).unwrap();
    for begins in [20, 60, 80, 120, 160] {
        for lasts in [45, 60, 100] {
            let (mut side, mut machine) = pressed(predictive);
            run(&mut side, &mut machine, (0, begins), Laying::Bead(flow));
            let end = begins + lasts;
            commanded(&mut side, &mut machine, (begins, end), Laying::Bead(flow), false);
            let mut highest = 0.0_f64;
            for tick in (end..end + 2500).step_by(10) {
                run(&mut side, &mut machine, (tick, tick + 10), Laying::Bead(flow));
                highest = highest.max(machine.0.pressure());
            }
            let what = format!("hold at {begins} for {lasts}: {highest}");
            assert_eq!(side.state(), ExtruderState::Running, "{what}");
            assert!(highest < 0.66, "{what}");
            assert!((machine.0.pressure() - 0.6).abs() < 0.03, "{what}");
        }
    }
}

/// Reports are missing for half a second from several moments on: the command must resume from
/// where it was, and the next bead must reach the same command.
fn goes_on(name: &str, make: &dyn Fn() -> (Supervisor, Box<dyn Machine>), flow: f64) {
    let bead = Laying::Bead(Mm3PerS::constant(flow));
    for phase in 0..11 {
        let (mut side, mut machine) = make();
        let mut machine = Boxed(machine.as_mut());
        let start = 2000 + phase;
        let before = commanded(&mut side, &mut machine, (0, start), bead, true);
        let steady = *before.last().unwrap();
        let held = commanded(&mut side, &mut machine, (start, start + 100), bead, false);
        assert_eq!(held.last(), held.get(held.len() - 5), "{name} {phase}");
        assert!(matches!(side.state(), ExtruderState::Holding(ExtruderHold::NoReading)), "{name}");
        let after = commanded(&mut side, &mut machine, (start + 100, start + 500), bead, true);
        assert_eq!(side.state(), ExtruderState::Running, "{name} {phase}");
        let jump = after.iter().map(|value| (value - steady).abs()).fold(0.0, f64::max);
        assert!(jump < 0.12 * steady, "{name} {phase}: {jump} of {steady}");
        run(&mut side, &mut machine, (start + 500, start + 603), Laying::Idle);
        let next = commanded(&mut side, &mut machine, (start + 603, start + 2600), bead, true);
        let reached = *next.last().unwrap();
        assert!((reached - steady).abs() < 0.05 * steady, "{name} {phase}: {reached} {steady}");
    }
}

struct Boxed<'a>(&'a mut dyn Machine);

impl Machine for Boxed<'_> {
    fn advance(&mut self, command: Option<f64>) {
        self.0.advance(command);
    }

    fn report(&self) -> ExtruderReport {
        self.0.report()
    }
}

#[test]
fn no_strategy_jumps_after_a_hold_and_each_reaches_its_command_on_the_next_bead() {
    let flow = PowerLaw::PP_GF28.flow(MPa::constant(0.6)).unwrap().get();
    let of = |iterate: fn(&Fopdt, PressureNoise) -> PressureChoice| {
        move || {
            let (side, machine) = pressed(iterate);
            (side, Box::new(machine) as Box<dyn Machine>)
        }
    };
    goes_on("predictive", &of(predictive), flow);
    let vsfc = |_: &Fopdt, noise: PressureNoise| {
        PressureChoice::Vsfc(VsfcGains::new(40.0, 60.0, 0.3, noise.sigma()).unwrap())
    };
    goes_on("vsfc", &of(vsfc), flow);
    let pi = |_: &Fopdt, _| PressureChoice::Pi(PressurePiGains::new(50.0, 1.0, 1.0).unwrap());
    goes_on("pi", &of(pi), flow);
    let filled = || {
        let (side, machine) = screw();
        (side, Box::new(machine) as Box<dyn Machine>)
    };
    goes_on("screw", &filled, 1.0);
    goes_on("feedforward", &inverse, 460.0);
    goes_on("adaptive", &adaptive, 460.0);
}

fn inverse() -> (Supervisor, Box<dyn Machine>) {
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
    let limits = CommandLimits::new(0.0, 90.0, 200.0).unwrap();
    let settings = InverseSettings {
        time_constant_s: 0.1,
        right_zeros: RightHalfPlaneZeros::Refuse,
        preview: Span::ZERO,
        max_delay: Span::ZERO,
        limits,
        period: TICK,
    };
    let controller = InverseFeedforward::new(
        Tracker::new(&model, &settings).unwrap(),
        OperatingPoint::default(),
    );
    let side = supervisor(
        CommandQuantity::Rpm,
        ExtruderStrategy::Feedforward(Box::new(controller)),
        limits,
    );
    (side, Box::new(Lagging::new(12.0, 0.84)))
}

fn adaptive() -> (Supervisor, Box<dyn Machine>) {
    let plant = ScalarPlant { state_gain_per_s: -2.0, input_gain: 4.0 };
    let adaptation = Adaptation::Ramp { learning_rate: 0.5, weight: 1.0, slope_rate_per_s: 0.3 };
    let safety = EstimateBounds { bound: Some(0.001), leakage_per_s: 0.0 };
    let gains = AdaptiveGains { feedback: 0.2, error_feedback: 0.0, adaptation, safety };
    let controller = MracController::new(plant, gains, Span::from_millis(50)).unwrap();
    // 100 mm²: 2 kg/s for each m/s, 1e5 mm³/s for each m/s; less 10 %.
    let nozzle = NozzleModel { section: Mm2::constant(100.0), pressure_kg_per_s: 0.0 };
    let limits = CommandLimits::new(0.0, 0.1, 1.0).unwrap();
    let controller = ExtruderStrategy::Adaptive(AdaptiveNozzle::new(controller, nozzle));
    let side = supervisor(CommandQuantity::MassFlow, controller, limits);
    (side, Box::new(Lagging::new(0.9 * 2e5, 0.5)))
}

struct Filled(SimScrew);

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
    let pulsation = SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
    let screw = ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap();
    let setpoint = PlugSetpoint { plug: Mm::constant(160.0), max_fill: 0.9 };
    let controller = PiecewiseExponential::new(&screw, setpoint, 36.3194).unwrap();
    let controller = FillFeedback::Exponential(controller);
    let settings = ScrewSettings {
        screw,
        feedback: controller,
        scheme: Scheme::Exact,
        period: Span::from_millis(50),
        initial_fill: screw.holding_fill(0.1),
    };
    let controller = ExtruderStrategy::Screw(ScrewFill::new(&settings).unwrap());
    let side = supervisor(
        CommandQuantity::Filling,
        controller,
        CommandLimits::new(0.0, 0.9, 1e3).unwrap(),
    );
    let scheme = Integrator::RungeKutta(TICK.secs());
    (side, Filled(SimScrew::new(screw, scheme, TICK.secs(), 0.1, screw.holding_fill(0.1))))
}

#[test]
fn material_on_a_stopped_screw_is_known_on_the_next_bead() {
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
fn a_screw_filled_beyond_its_length_is_a_hold_until_a_plausible_reading() {
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
