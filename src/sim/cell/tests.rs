#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::path::Path;

use super::*;
use crate::calibration::Calibration;
use crate::cell::file::Purpose;
use crate::control::Step;
use crate::extruder::start_stop::{BeadConditions, StartStopTiming};
use crate::extruder::strategy::ConstantCommand;
use crate::extruder::{ExtruderSetup, ExtruderStrategy};
use crate::identify::start_stop::file;
use crate::numeric::average::rms;
use crate::run::runner::NoRecorder;

const CELL: &str = include_str!("../../../cells/starts.toml");
const STARTS: &str = include_str!("../../../models/starts/simulated.toml");
/// Pauses before the beads \[s\].
const PAUSES_S: [f64; 6] = [0.0, 1.0, 3.0, 10.0, 60.0, 300.0];
/// Section of the bead \[mm²\], and how long a start and what drools are watched \[s\].
const SECTION_MM2: f64 = 10.0;
const WATCHED_S: f64 = 3.5;

/// Void and drool of starts and stops \[mm³\].
#[derive(Debug, Default)]
struct Volumes {
    void_mm3: f64,
    drool_mm3: f64,
    speed: f64,
    last: Option<Stamp>,
    began: Stamp,
    left_mm: f64,
    bead_start: f64,
}

impl Observer for Volumes {
    fn step(&mut self, _: Stamp, event: &Event, _: &Step) {
        if let Event::Robot(state) = event {
            let lays = state.mode == RobotMode::Print;
            self.speed = if lays { state.speed_mm_per_s.get() } else { 0.0 };
            self.left_mm = 600.0 - (state.path_mm.get() - self.bead_start);
        }
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}

    fn flow(&mut self, now: Stamp, _: Option<Mm3PerS>, flow: Mm3PerS) {
        let dt = self.last.replace(now).map_or(0.0, |last| (now - last).secs());
        let starts = (now - self.began).secs() < WATCHED_S;
        let stops = self.left_mm < 40.0;
        if starts || stops {
            let more = (flow.get() - SECTION_MM2 * self.speed) * dt;
            if more > 0.0 { self.drool_mm3 += more } else { self.void_mm3 -= more }
        }
    }
}

/// Void and drool of beads after all pauses, in a cell that knows starts and stops or not.
fn lost(seed: u64, knows: bool) -> (f64, f64) {
    let mut cell = Cell::parse(Path::new("starts.toml"), CELL, Purpose::Run).unwrap();
    cell.simulation.seed = seed;
    let run = cell.run.clone().unwrap();
    let part = run.extruder.clone().unwrap();
    let speed = run.robot.start_speed;
    let laid = BeadConditions {
        flow: part.demand.nominal(),
        speed,
        min_speed_ratio: run.limits.min_speed / speed,
        robot_lag: Span::from_millis(41),
    };
    let timing =
        StartStopTiming::new(file::parse("starts.toml", STARTS).unwrap().parameters, laid).unwrap();
    let setup = part.extruder.setup(ExtruderStrategy::Constant(ConstantCommand(20.0)));
    let plant = SimExtruder::of(part.plant.as_ref().unwrap(), seed, part.plant_nominal).unwrap();
    let rig = CommandedExtruder {
        setup: ExtruderSetup { timing: knows.then_some(timing), ..setup },
        demand: part.demand,
        plant,
        nominal_flow: part.plant_nominal,
    };
    let calibration = Calibration::Scale { mm_per_px: 0.02, sigma: None };
    let mut sim = SimCell::with_extruder(&cell, &run, calibration, NoRecorder, Some(rig)).unwrap();
    let mut volumes = Volumes::default();
    for pause_s in PAUSES_S {
        sim.rest(Span::from_secs(pause_s), &mut volumes);
        volumes.began = sim.now;
        assert!(sim.layer(Mm::ZERO, &mut volumes).complete);
    }
    sim.rest(Span::from_secs(4.0), &mut volumes);
    (volumes.void_mm3, volumes.drool_mm3)
}

#[test]
fn starts_and_stops_that_are_known_lose_a_fifth_of_what_others_do() {
    let sums = [false, true].map(|knows| {
        let all: Vec<(f64, f64)> = (1..=4).map(|seed| lost(seed, knows)).collect();
        let (voids, drools) =
            all.iter().fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        eprintln!("{knows}: void {voids:.0} mm³, drool {drools:.0} mm³");
        (voids, drools)
    });
    let [without, with] = sums;
    assert!(5.0 * (with.0 + with.1) < without.0 + without.1, "{sums:?}");
}

const EXTRUDER_CELL: &str = include_str!("../../../cells/extruder.toml");

/// The newest period of a pulsation \[s\].
#[derive(Debug, Default)]
struct FoundPeriod(Option<f64>);

impl Observer for FoundPeriod {
    fn step(&mut self, _: Stamp, _: &Event, step: &Step) {
        self.0 = step.trace.distance.map_or(self.0, |trace| trace.pulsation_s);
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}
}

/// Period that was found in a bead \[s\], and the RMS error of its width \[mm\]. The screw turns at
/// 28 rpm and makes one pulse in a turn.
fn with_pulsating_screw(extruder_keys: &str, control_keys: &str) -> (Option<f64>, f64) {
    let pulsating = "gain_mm3_per_s = 2785.7143\nscrew_lag_s = 0.3\nflow_pulse_amplitude = 0.08";
    let text = EXTRUDER_CELL
        .replace("constant_rpm = 60.0", &format!("constant_rpm = 28.0\n{extruder_keys}"))
        .replace("exponent = 0.25", &format!("exponent = 0.25\n{control_keys}"))
        .replace("gain_mm3_per_s = 1300.0", pulsating)
        .replace("path_mm = 2000.0", "path_mm = 3000.0");
    let cell = Cell::parse(Path::new("extruder.toml"), &text, Purpose::Run).unwrap();
    let run = cell.run.clone().unwrap();
    let part = run.extruder.clone().unwrap();
    let commanded = CommandedExtruder {
        setup: part.extruder.setup(ExtruderStrategy::Constant(ConstantCommand(28.0))),
        demand: part.demand,
        plant: SimExtruder::of(part.plant.as_ref().unwrap(), 1, part.plant_nominal).unwrap(),
        nominal_flow: part.plant_nominal,
    };
    let scale = Calibration::Scale { mm_per_px: 0.126_582, sigma: None };
    let mut sim = SimCell::with_extruder(&cell, &run, scale, NoRecorder, Some(commanded)).unwrap();
    let mut found = FoundPeriod::default();
    assert!(sim.layer(Mm::ZERO, &mut found).complete);
    let errors = (1500..2900).map(|mm| sim.bead().smooth_width_at(f64::from(mm)).unwrap() - 40.0);
    (found.0, rms(errors))
}

#[test]
fn the_pulsation_of_a_screw_is_cancelled_by_its_reported_speed() {
    let (none, ignored) = with_pulsating_screw("", "pulsation = \"ignore\"");
    let (searched, _) = with_pulsating_screw("", "");
    let (counted, cancelled) = with_pulsating_screw("pulses_per_turn = 1.0", "");
    let off = |period_s: Option<f64>| (period_s.unwrap() / (60.0 / 28.0) - 1.0).abs();
    assert_eq!(none, None);
    assert!(off(counted) < 1e-6 && off(searched) > 1e-4, "{counted:?} {searched:?}");
    assert!(cancelled < 0.4 * ignored, "{cancelled} {ignored}");
}
