//! `[extruder.pressure]`: the process from the screw's speed to the pressure at
//! the nozzle, the nozzle's power law, and which controller holds the pressure.

use super::context::ReadContext;
use crate::document::Table;
use crate::extruder::pressure::Fopdt;
use crate::extruder::pressure::kalman::PressureNoise;
use crate::extruder::pressure::pi::PressurePiGains;
use crate::extruder::pressure::tuning::{LoopPeriods, Tuning};
use crate::extruder::pressure::vsfc::VsfcGains;
use crate::extruder::rheology::PowerLaw;
use crate::extruder::strategy::{PressureChoice, PressureSettings};

/// Largest rate of the loop \[Hz\]: the controllers keep as many commands a second.
const MAX_LOOP_HZ: f64 = 250.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ControllerWord {
    Predictive,
    Vsfc,
    Pi,
}

const CONTROLLER_WORDS: [(&str, ControllerWord); 3] = [
    ("predictive", ControllerWord::Predictive),
    ("vsfc", ControllerWord::Vsfc),
    ("pi", ControllerWord::Pi),
];

/// Reads the process; the same keys stand in the plant of a simulated cell.
pub fn read_process(table: &Table<'_>) -> Option<Fopdt> {
    let gain = table.number("gain_mpa_per_rpm", 1e-9..=1e9);
    let lag = table.number("lag_s", 1e-3..=60.0);
    let dead = table.number("dead_time_s", 0.0..=60.0);
    or_report(table, "gain_mpa_per_rpm", Fopdt::new(gain?, lag?, dead?))
}

/// Reads the nozzle; the same keys stand in the plant of a simulated cell.
pub fn read_nozzle(table: &Table<'_>) -> Option<PowerLaw> {
    let flow = table.number("flow_at_1_mpa_g_per_min", 1e-9..=1e12);
    let exponent = table.number("flow_exponent", 0.1..=10.0);
    let density = table.number("density_g_per_cm3", 1e-3..=50.0);
    or_report(table, "flow_exponent", PowerLaw::new(flow?, exponent?, density?))
}

/// Reads the loop with its controller. Gains have no defaults; the predictive controller has no
/// gains, its settings come from process and noise.
pub(super) fn read(table: &Table<'_>, context: &ReadContext<'_>) -> Option<PressureSettings> {
    let model = read_process(table);
    let nozzle = read_nozzle(table);
    let sigma = table.number("sensor_noise_mpa", 1e-9..=1e3);
    let drift = table.number_or("drift_mpa2", 0.0..=1e3, 2e-5);
    let word = table.choice("controller", &CONTROLLER_WORDS);
    if word.is_none() {
        table.allow_unknown_keys();
    }
    if context.rates.feedforward_hz > MAX_LOOP_HZ {
        let found = format!("a pressure loop at {} Hz", context.rates.feedforward_hz);
        table.report("controller", found, format!("feedforward_rate_hz of at most {MAX_LOOP_HZ}"));
    }
    let noise = or_report(table, "sensor_noise_mpa", PressureNoise::new(drift?, sigma?.powi(2)));
    let choice = match word? {
        ControllerWord::Predictive => {
            let rates = context.rates;
            let periods =
                LoopPeriods { reading_s: 1.0 / rates.io_hz, command_s: 1.0 / rates.control_hz };
            Some(PressureChoice::Predictive(Tuning::of(&model?, &noise?, periods)))
        }
        ControllerWord::Vsfc => read_vsfc(table, noise?).map(PressureChoice::Vsfc),
        ControllerWord::Pi => read_pi(table).map(PressureChoice::Pi),
    };
    Some(PressureSettings {
        choice: choice?,
        model: model?,
        noise: noise?,
        nozzle: nozzle?,
        limits: context.limits?,
    })
}

fn read_vsfc(table: &Table<'_>, noise: PressureNoise) -> Option<VsfcGains> {
    let kp = table.number("kp_rpm_per_mpa", 0.0..=1e9);
    let ki = table.number("ki_rpm_per_mpa_s", 0.0..=1e9);
    let zone_fraction = table.number_or("weak_zone_fraction", 0.0..=1.0, 0.3);
    or_report(table, "kp_rpm_per_mpa", VsfcGains::new(kp?, ki?, zone_fraction?, noise.sigma()))
}

fn read_pi(table: &Table<'_>) -> Option<PressurePiGains> {
    let kp = table.number("kp_rpm_per_mpa", 0.0..=1e9);
    let integral = table.number("integral_time_s", 1e-3..=1e4);
    let integral = integral?;
    let tracking = table.optional_number("tracking_time_s", 1e-3..=1e4);
    or_report(
        table,
        "kp_rpm_per_mpa",
        PressurePiGains::new(kp?, integral, tracking.unwrap_or(integral)),
    )
}

fn or_report<T, E: std::fmt::Display>(
    table: &Table<'_>,
    key: &'static str,
    found: Result<T, E>,
) -> Option<T> {
    found.inspect_err(|error| table.report(key, "a setting that cannot be", error.to_string())).ok()
}
