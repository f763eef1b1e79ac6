//! `[extruder_plant]`: the extruder's plant in a simulated cell. Nothing here moves a real machine,
//! so most keys have defaults.

use super::pressure::{read_nozzle, read_process};
use super::screw::read_screw;
use crate::core::{Rpm, Span};
use crate::document::Table;
use crate::extruder::pressure::Fopdt;
use crate::extruder::rheology::PowerLaw;
use crate::extruder::screw::{Screw, ScrewDesign};
use crate::extruder::strategy::RequiredReading;
use crate::numeric::lti::TransferFunction;

const ANY_COEFFICIENT: std::ops::RangeInclusive<f64> = -1e12..=1e12;
/// Coefficients that a numerator or a denominator may have.
const COEFFICIENT_COUNTS: [usize; 6] = [1, 2, 3, 4, 5, 6];

/// The simulated extruder of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderPlant {
    /// Model from commands to flow.
    pub kind: PlantKind,
    /// Delay from the command to run until material moves.
    pub start_delay: Span,
    /// Delay from the command to stop until nothing moves.
    pub stop_delay: Span,
    /// Delay from the command to open or close the valve until it has done so.
    pub valve_delay: Span,
}

/// Model from commands to flow.
#[derive(Debug, Clone, PartialEq)]
pub enum PlantKind {
    /// A transfer function, or a gain, with disturbances.
    Linear(LinearPlant),
    /// Lag and dead time to a pressure, and a power law from it to flow.
    Pressure(PressurePlant),
    /// A screw that is filled through its feed.
    Screw(ScrewPlant),
    /// Melt before a nozzle, from which it recedes while the pump stands.
    Melt(MeltPlant),
}

impl PlantKind {
    /// Whether it has a sensor for a reading.
    pub const fn reports(&self, reading: RequiredReading) -> bool {
        match self {
            Self::Linear(plant) => match reading {
                RequiredReading::Flow => plant.sensor_noise.is_some(),
                RequiredReading::Screw => plant.screw_lag_s.is_some(),
                RequiredReading::Pressure | RequiredReading::Filled => false,
            },
            Self::Pressure(_) => {
                matches!(reading, RequiredReading::Pressure | RequiredReading::Screw)
            }
            Self::Screw(_) => matches!(reading, RequiredReading::Filled),
            Self::Melt(_) => false,
        }
    }
}

/// A pressure at the nozzle in a simulated cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressurePlant {
    /// From the screw's speed to the pressure.
    pub process: Fopdt,
    /// From the pressure to flow.
    pub nozzle: PowerLaw,
    /// Fastest that the screw turns.
    pub max_speed: Rpm,
    /// Noise of the sensor \[MPa\].
    pub sensor_noise_mpa: f64,
    /// Ripple of the gain.
    pub gain_wave: GainRipple,
    /// A load at the input of the process.
    pub load: InputLoad,
}

/// A sinusoidal ripple of a gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainRipple {
    /// Amplitude as a fraction of the gain.
    pub fraction: f64,
    /// Period \[s\].
    pub period_s: f64,
}

/// An unmeasured step at the input of a process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputLoad {
    /// Its height \[rpm\].
    pub rpm: f64,
    /// When it begins \[s\].
    pub at_s: f64,
}

/// Melt that recedes in pauses and drools after stops, in a simulated cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeltPlant {
    /// Flow for each unit of the command \[mm³/s\].
    pub gain_mm3_per_s: f64,
    /// From a command until the drive acts \[s\].
    pub dead_time_s: f64,
    /// Time constant of the screw \[s\].
    pub screw_lag_s: f64,
    /// Melt that is stored under pressure at the usual flow, over that flow \[s\].
    pub stored_s: f64,
    /// Volume of the void at the nozzle after a long pause \[mm³\].
    pub void_mm3: f64,
    /// Standard deviation of that volume from pause to pause, as a fraction.
    pub void_sigma: f64,
    /// Standard deviation of the flow, as a fraction.
    pub flow_sigma: f64,
}

/// A linear plant from command to flow.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPlant {
    /// From command to flow \[mm³/s per unit of the command\].
    pub transfer: TransferFunction,
    /// Input disturbance at the start of the run \[unit of the command\].
    pub unknown_input: f64,
    /// Growth of the input disturbance \[unit of the command per second\].
    pub unknown_input_per_s: f64,
    /// Standard deviation of the unmodelled flow \[mm³/s\].
    pub flow_noise: f64,
    /// Correlation time of the unmodelled flow \[s\].
    pub flow_noise_lag_s: f64,
    /// Noise of the flow sensor \[mm³/s\]; `None` without a sensor.
    pub sensor_noise: Option<f64>,
    /// Time constant with which the screw follows a command in rpm, as its encoder reports \[s\];
    /// `None` for a screw that follows at once and has no encoder.
    pub screw_lag_s: Option<f64>,
    /// Pulsation of the flow with the turns of the screw.
    pub pulsation: ScrewPulsation,
}

/// A sinusoidal pulsation of a flow with the turns of the screw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewPulsation {
    /// Amplitude as a fraction of the flow.
    pub amplitude: f64,
    /// Pulses in a turn.
    pub per_turn: f64,
}

impl ScrewPulsation {
    /// None.
    pub const NONE: Self = Self { amplitude: 0.0, per_turn: 1.0 };
}

/// A screw in a simulated cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewPlant {
    /// The true parameters of the screw.
    pub screw: Screw,
    /// Flow of a screw that is filled all along, at its mean speed \[mm³/s\].
    pub full_flow_mm3_per_s: f64,
    /// Filled length at the start of the run \[m\].
    pub start_m: f64,
    /// Fill ratio of the feed until then.
    pub initial_fill: f64,
    /// Noise of the sensor of the filled length \[mm\].
    pub sensor_noise_mm: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PlantWord {
    Direct,
    Linear,
    Pressure,
    Screw,
    Melt,
}

const PLANT_WORDS: [(&str, PlantWord); 5] = [
    ("direct", PlantWord::Direct),
    ("linear", PlantWord::Linear),
    ("pressure", PlantWord::Pressure),
    ("screw", PlantWord::Screw),
    ("melt", PlantWord::Melt),
];

impl ExtruderPlant {
    /// Reads `[extruder_plant]`.
    pub fn read(table: &Table<'_>) -> Option<Self> {
        let word = table.required_choice("kind", &PLANT_WORDS);
        let kind = word.and_then(|word| match word {
            PlantWord::Direct => {
                let gain = table.number("gain_mm3_per_s", 1e-9..=1e12)?;
                let transfer = TransferFunction::gain(gain).ok()?;
                read_linear(table, transfer).map(PlantKind::Linear)
            }
            PlantWord::Linear => {
                let transfer = read_transfer(table)?;
                read_linear(table, transfer).map(PlantKind::Linear)
            }
            PlantWord::Pressure => read_pressure_plant(table).map(PlantKind::Pressure),
            PlantWord::Screw => read_screw_plant(table).map(PlantKind::Screw),
            PlantWord::Melt => read_melt(table).map(PlantKind::Melt),
        });
        if kind.is_none() {
            table.allow_unknown_keys();
        }
        let delay = |key| table.number_or(key, 0.0..=60.0, 0.0).map(Span::from_secs);
        let (start, stop) = (delay("start_delay_s"), delay("stop_delay_s"));
        let valve = delay("valve_delay_s");
        Some(Self { kind: kind?, start_delay: start?, stop_delay: stop?, valve_delay: valve? })
    }
}

fn read_transfer(table: &Table<'_>) -> Option<TransferFunction> {
    for (key, what) in [
        (
            "numerator",
            "the coefficients of a linear plant's numerator, the highest power of s \
                       first, such as [18.0]",
        ),
        ("denominator", "those of its denominator, such as [0.656, 0.975, 1.0]"),
    ] {
        if !table.has(key) {
            table.report_absent(key, what);
        }
    }
    let [num, den] = ["numerator", "denominator"].map(|key| {
        let row = || table.row(key, &COEFFICIENT_COUNTS, ANY_COEFFICIENT);
        table.has(key).then(row).flatten()
    });
    let dead_time = table.number_or("dead_time_s", 0.0..=1e3, 0.0);
    let (num, den) = (num?, den?);
    let transfer = match TransferFunction::new(&num, &den, dead_time?) {
        Ok(transfer) => transfer,
        Err(error) => {
            table.report("denominator", format!("{den:?}"), error.to_string());
            return None;
        }
    };
    if !transfer.is_stable() {
        table.report("denominator", format!("{den:?}"), "a plant that is stable");
        return None;
    }
    Some(transfer)
}

fn read_linear(table: &Table<'_>, transfer: TransferFunction) -> Option<LinearPlant> {
    let unknown = table.number_or("unknown_input", ANY_COEFFICIENT, 0.0);
    let unknown_per_s = table.number_or("unknown_input_per_s", ANY_COEFFICIENT, 0.0);
    let noise = table.number_or("flow_noise_mm3_per_s", 0.0..=1e12, 0.0);
    let lag = table.number_or("flow_noise_lag_s", 1e-3..=1e3, 0.15);
    let sensor = table.optional_number("flow_sensor_noise_mm3_per_s", 0.0..=1e12);
    let screw = table.optional_number("screw_lag_s", 0.0..=60.0);
    let pulse_amplitude = table.number_or("flow_pulse_amplitude", 0.0..=0.9, 0.0);
    let pulses_per_turn = table.number_or("flow_pulses_per_turn", 0.01..=1000.0, 1.0);
    let pulsation = ScrewPulsation { amplitude: pulse_amplitude?, per_turn: pulses_per_turn? };
    if screw.is_none() && pulsation.amplitude > 0.0 {
        let expected = "screw_lag_s beside it: the flow pulsates with the turns of the screw";
        table.report("flow_pulse_amplitude", pulsation.amplitude.to_string(), expected);
    }
    Some(LinearPlant {
        transfer,
        unknown_input: unknown?,
        unknown_input_per_s: unknown_per_s?,
        flow_noise: noise?,
        flow_noise_lag_s: lag?,
        sensor_noise: sensor,
        screw_lag_s: screw,
        pulsation,
    })
}

fn read_melt(table: &Table<'_>) -> Option<MeltPlant> {
    let gain = table.number("gain_mm3_per_s", 1e-9..=1e12);
    let dead_time = table.number_or("dead_time_s", 0.0..=60.0, 0.12);
    let screw = table.number_or("screw_lag_s", 1e-3..=60.0, 0.07);
    let stored = table.number_or("stored_s", 1e-3..=60.0, 0.3);
    let void = table.number_or("void_mm3", 0.0..=1e9, 650.0);
    let void_sigma = table.number_or("void_sigma", 0.0..=1.0, 0.03);
    let flow_sigma = table.number_or("flow_sigma", 0.0..=1.0, 0.01);
    Some(MeltPlant {
        gain_mm3_per_s: gain?,
        dead_time_s: dead_time?,
        screw_lag_s: screw?,
        stored_s: stored?,
        void_mm3: void?,
        void_sigma: void_sigma?,
        flow_sigma: flow_sigma?,
    })
}

fn read_pressure_plant(table: &Table<'_>) -> Option<PressurePlant> {
    let process = read_process(table);
    let nozzle = read_nozzle(table);
    let max_speed = table.number("max_rpm", 1e-6..=1e6);
    let noise = table.number_or("sensor_noise_mpa", 0.0..=1e3, 0.0);
    let wave = table.number_or("gain_wave_fraction", 0.0..=0.9, 0.0);
    let period = table.number_or("gain_wave_period_s", 0.1..=1e6, 60.0);
    let load = table.number_or("load_rpm", -1e6..=1e6, 0.0);
    let load_at = table.number_or("load_at_s", 0.0..=1e6, 0.0);
    Some(PressurePlant {
        process: process?,
        nozzle: nozzle?,
        max_speed: Rpm::new(max_speed?).ok()?,
        sensor_noise_mpa: noise?,
        gain_wave: GainRipple { fraction: wave?, period_s: period? },
        load: InputLoad { rpm: load?, at_s: load_at? },
    })
}

fn read_screw_plant(table: &Table<'_>) -> Option<ScrewPlant> {
    let screw = read_screw(table, Some(ScrewDesign::DIAGNE_2015));
    let full = table.number("full_flow_mm3_per_s", 1e-9..=1e12);
    let start = table.number_or("start_filled_mm", 0.0..=1e5, 100.0);
    let noise = table.number_or("filled_noise_mm", 0.0..=1e3, 0.0);
    let (screw, start_m) = (screw?, start? / 1000.0);
    if start_m >= screw.length_m {
        let found = format!("{} mm", start_m * 1000.0);
        table.report("start_filled_mm", found, "less than length_mm");
        return None;
    }
    Some(ScrewPlant {
        screw,
        full_flow_mm3_per_s: full?,
        start_m,
        initial_fill: screw.holding_fill(start_m),
        sensor_noise_mm: noise?,
    })
}
