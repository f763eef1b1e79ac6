//! The table for a terminal.

use std::fmt::Write as _;

use super::Tuned;
use crate::identify::camera_offset::SpeedRange;
use crate::tune::predict::{BeadPrediction, FLOW_STEP, SEEDS};
use crate::tune::stability::LoopMargins;
use crate::width_control::pi::PiGains;

impl Tuned {
    /// All results, predictions and proposed settings.
    pub fn plain(&self) -> String {
        let mut text = String::new();
        for (name, words) in self.findings() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<10} {words}");
        }
        text.push('\n');
        self.margins_table(&mut text);
        text.push('\n');
        self.predictions_table(&mut text);
        text.push('\n');
        text.push_str(&self.lines());
        text
    }

    /// Results, each with a name and a description.
    pub fn findings(&self) -> Vec<(&'static str, String)> {
        let plant = &self.plant;
        let (width, exponent, offset) = (plant.width_mm, plant.exponent, plant.offset_mm);
        let SpeedRange { min: from, max: to } = plant.study.estimate.speeds;
        vec![
            (
                "bead",
                format!(
                    "{:.2} ± {:.2} mm wide at {} mm/s; goes with speed to the power of -{:.3} ± {:.3}",
                    width.value,
                    width.sigma,
                    plant.at_speed_mm_per_s,
                    exponent.value,
                    exponent.sigma
                ),
            ),
            (
                "offset",
                format!(
                    "{:.2} ± {:.2} mm from the nozzle to the middle of the gauge (cell: {})",
                    offset.value, offset.sigma, self.present_offset_mm.0
                ),
            ),
            ("speed", format!("{:.1} to {:.1} mm/s while it was laid", from.get(), to.get())),
            ("noise", self.noise_words()),
            ("drift", self.drift_words()),
            ("robot", self.robot_words()),
            ("timing", self.timing_words()),
            (
                "widths",
                format!(
                    "{} used, {} left out, {} frames refused; {:.2} % RMS off that bead",
                    plant.study.estimate.used,
                    plant.study.estimate.left_out,
                    self.log.refused,
                    100.0 * plant.study.estimate.residual_rms
                ),
            ),
        ]
    }

    fn noise_words(&self) -> String {
        let (width, noise) = (self.plant.width_mm.value, &self.plant.width_noise);
        let rough = if noise.roughness > 0.0 {
            format!(
                "the bead is rough by {:.3} mm in means over the gauge",
                noise.roughness * width
            )
        } else {
            "no roughness seen beyond it".to_owned()
        };
        format!(
            "{:.3} ± {:.3} mm from width to width ({:.2} %); {rough}",
            self.plant.noise_mm(),
            noise.per_width.sigma * width,
            100.0 * noise.per_width.value
        )
    }

    fn robot_words(&self) -> String {
        match &self.plant.robot {
            Ok(robot) => format!(
                "responds after {:.0} ± {:.1} ms with a lag of {:.0} ± {:.1} ms{}; {:.2} mm/s RMS left",
                1e3 * robot.dead_time_s.value,
                1e3 * robot.dead_time_s.sigma,
                1e3 * robot.lag_s.value,
                1e3 * robot.lag_s.sigma,
                robot
                    .slope_mm_per_s2
                    .map_or(String::new(), |slope| { format!(", at {slope:.0} mm/s² at most") }),
                robot.residual_mm_per_s
            ),
            Err(error) => error.to_string(),
        }
    }

    fn timing_words(&self) -> String {
        let timing = &self.plant.timing;
        format!(
            "widths delayed by {:.1} ms ({:.1} ms p99); measured frames every {:.1} ms, reports {:.1} ms ({:.1} ms \
             p99), setpoints {:.1} ms",
            1e3 * timing.latency_s,
            1e3 * timing.latency_p99_s,
            1e3 * timing.frame_s,
            1e3 * timing.report_s,
            1e3 * timing.report_p99_s,
            1e3 * timing.setpoint_s
        )
    }

    /// Rows of the table of margins: the present and the proposed PI gains, each at the worst
    /// speed and at that of the target. The margins are `None` if both gains are 0.
    pub fn loops(&self) -> Vec<(String, PiGains, Option<LoopMargins>)> {
        let now = self.present_gains.iter().map(|(gains, _)| ("now", *gains));
        let settings = now.chain([("proposed", self.proposal.pi.gains)]);
        let each = settings.flat_map(|(name, gains)| {
            [self.proposal.pi.at, self.usual].map(|at| {
                let name = format!("{name}, {:.0} mm/s", at.speed_mm_per_s);
                (name, gains, at.margins(gains))
            })
        });
        each.collect()
    }

    fn margins_table(&self, text: &mut String) {
        let at = self.proposal.pi.at;
        let _ = writeln!(
            text,
            "PI loop at {} mm/s, the worst of [limits]: {:.3} mm/(mm/s) behind {:.3} s of dead time; \
             {} mm is laid at {:.0} mm/s",
            at.speed_mm_per_s, at.gain_s, at.dead_time_s, self.target_mm, self.usual.speed_mm_per_s
        );
        let _ = writeln!(
            text,
            "{:<18} {:>9} {:>10} {:>12} {:>13} {:>13} {:>6}",
            "", "kp [1/s]", "ki [1/s²]", "gain margin", "phase margin", "delay margin", "Ms"
        );
        for (name, gains, margins) in self.loops() {
            let [gain, phase, delay, most] = margin_words(margins);
            let _ = writeln!(
                text,
                "{name:<18} {:>9.3} {:>10.3} {gain:>12} {phase:>13} {delay:>13} {most:>6}",
                gains.kp_per_s, gains.ki_per_s2
            );
        }
    }

    fn predictions_table(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "predicted for {} mm, {SEEDS} beads each, in means over the gauge; settled is within {:.2} mm \
             for good",
            self.target_mm, self.band_mm
        );
        let step = format!("flow +{:.0} % settles", 100.0 * FLOW_STEP);
        let _ = writeln!(
            text,
            "{:<28} {:>14} {step:>16} {:>11} {:>10} {:>16}",
            "", "start settles", "steady RMS", "whole RMS", "speeds"
        );
        for one in &self.predictions {
            row(text, one);
        }
        let _ = writeln!(text, "by distance, with a wrong model");
        for one in &self.mismatched {
            row(text, one);
        }
    }

    /// The proposed lines of the cell file.
    pub fn lines(&self) -> String {
        let mut text =
            String::from("# proposed; nothing is applied\n[control]\nstrategy = \"distance\"\n");
        let learns = if self.proposal.distance.learns { "yes" } else { "no" };
        let _ = writeln!(text, "exponent_learns = \"{learns}\"");
        let settings = self.settings(true, 1.0);
        for table in ["control", "camera"] {
            if table == "camera" {
                text.push_str("\n[camera]\n");
            }
            for (_, key, value) in settings.iter().filter(|(of, ..)| *of == table) {
                let comment = match *key {
                    "kp_per_s" => "  # fallen back to, or with strategy = \"pi\"",
                    _ => "",
                };
                let _ = writeln!(text, "{key} = {value}{comment}");
                if *key == "ki_per_s2" {
                    text.push_str("error_unit_mm = 1.0  # the unit of these gains\n");
                }
            }
        }
        text
    }
}

fn row(text: &mut String, one: &BeadPrediction) {
    let distance = |mm: Option<f64>| mm.map_or("not".to_owned(), |mm| format!("{mm:.0} mm"));
    let (fast, slow) = one.speeds_mm_per_s;
    let _ = writeln!(
        text,
        "{:<28} {:>14} {:>16} {:>8.3} mm {:>7.3} mm {:>16}",
        one.name,
        distance(one.start_settles_mm),
        distance(one.step_settles_mm),
        one.steady_rms_mm,
        one.whole_rms_mm,
        format!("{slow:.0} to {fast:.0} mm/s")
    );
}

/// A margin with its unit, or words for infinity.
fn with_unit(margin: f64, words: impl Fn(f64) -> String) -> String {
    if margin.is_finite() { words(margin) } else { "no end".to_owned() }
}

/// Margins as text.
pub fn margin_words(margins: Option<LoopMargins>) -> [String; 4] {
    let Some(margins) = margins else { return ["–", "–", "–", "–"].map(str::to_owned) };
    if !margins.is_stable {
        let gain = format!("{:.2}", margins.gain);
        return [gain, "unstable".to_owned(), "unstable".to_owned(), "–".to_owned()];
    }
    [
        format!("{:.2}", margins.gain),
        with_unit(margins.phase_deg, |phase| format!("{phase:.0}°")),
        with_unit(margins.delay_s, |delay| format!("{delay:.2} s")),
        margins.sensitivity.map_or("–".to_owned(), |most| format!("{most:.2}")),
    ]
}
