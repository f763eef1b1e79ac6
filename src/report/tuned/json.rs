//! `tune.json`.

use serde_json::{Value, json};

use super::Tuned;
use crate::tune::stability::LoopMargins;

impl Tuned {
    /// All numbers as JSON text.
    pub fn json(&self) -> String {
        let plant = &self.plant;
        let robot = match &plant.robot {
            Ok(robot) => json!(robot),
            Err(error) => json!({ "undetermined": error.to_string() }),
        };
        let loops: Vec<Value> = self
            .loops()
            .into_iter()
            .map(|(name, gains, margins)| {
                json!({
                    "name": name,
                    "kp_per_s": gains.kp_per_s,
                    "ki_per_s2": gains.ki_per_s2,
                    "margins": margins.map(of_loop),
                })
            })
            .collect();
        let all = json!({
            "recording": self.recording,
            "cell": self.cell,
            "target_width_mm": self.target_mm,
            "found": {
                "width_mm": plant.width_mm,
                "at_speed_mm_per_s": plant.at_speed_mm_per_s,
                "exponent": plant.exponent,
                "offset_mm": plant.offset_mm,
                "gauge_mm": plant.gauge_mm,
                "noise_share": plant.width_noise.per_width,
                "roughness_share": plant.width_noise.roughness,
                "drift_per_root_m": plant.width_noise.drift,
                "robot": robot,
                "timing": plant.timing,
                "widths_used": plant.study.estimate.used,
                "widths_left_out": plant.study.estimate.left_out,
            },
            "proposed": {
                "distance": self.proposal.distance,
                "loop": self.proposal.pi.at,
                "kp_per_s": self.proposal.pi.gains.kp_per_s,
                "ki_per_s2": self.proposal.pi.gains.ki_per_s2,
            },
            "loops": loops,
            "predicted": { "settled_within_mm": self.band_mm, "controllers": self.predictions, "mismatched": self.mismatched },
            "warnings": self.warnings(),
        });
        let mut text = format!("{all:#}");
        text.push('\n');
        text
    }
}

/// Margins as JSON; infinite ones become null.
fn of_loop(margins: LoopMargins) -> Value {
    json!({
        "is_stable": margins.is_stable,
        "gain": margins.gain,
        "phase_deg": margins.phase_deg.is_finite().then_some(margins.phase_deg),
        "delay_s": margins.delay_s.is_finite().then_some(margins.delay_s),
        "sensitivity": margins.sensitivity,
    })
}
