//! Results of the tuning: a table, `tune.json` and a page.

mod json;
mod page;
mod text;

use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::identify::camera_offset::SpeedRange;
use crate::sim::cell::SimCellError;
use crate::tune::candidate::ControllerCandidate;
use crate::tune::noise::Drift;
use crate::tune::predict::{BeadPrediction, SEEDS, TestCell};
use crate::tune::propose::{Proposal, propose, slowest_loop};
use crate::tune::stability::{LoopMargins, LoopPlant};
use crate::tune::{IdentifiedCell, Log};
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::pi::PiGains;

/// Deviation of a setting from its estimate above which there is a warning \[standard
/// deviations\]. Derived: P(|z| > 3) is 0.27 % for a normal deviate.
const PLAUSIBLE_MISMATCH: f64 = 3.0;
/// Largest accepted RMS residual of the robot's response, as a fraction of the range of speeds.
const MAX_GAIN_RATIO: f64 = 0.1;
/// Fraction of rejected frames above which the noise estimate is not representative.
const MANY_REJECTED: f64 = 0.2;

/// An analysed recording with the proposed settings.
#[derive(Debug, Clone)]
pub struct Tuned {
    /// The recording.
    pub recording: String,
    /// The cell that is tuned.
    pub cell: String,
    /// Data of the recorded run.
    pub log: Log,
    /// The identified cell.
    pub plant: IdentifiedCell,
    /// The proposed settings.
    pub proposal: Proposal,
    /// Target width \[mm\].
    pub target_mm: f64,
    /// The cell's limits.
    pub limits: SpeedLimits,
    /// Distance of the camera in the cell file and its standard deviation \[mm\].
    pub present_offset_mm: (f64, f64),
    /// PI gains in the cell file for the error in mm, with their margins at the worst speed;
    /// `None` if it has none.
    pub present_gains: Option<(PiGains, Option<LoopMargins>)>,
    /// The loop at the speed at which the target width is laid.
    pub usual: LoopPlant,
    /// Predictions for the controllers: the present one if it controls the width, the proposed PI
    /// controller, the proposed distance controller.
    pub predictions: Vec<BeadPrediction>,
    /// Predictions for the proposed distance controller with a mismatched model.
    pub mismatched: Vec<BeadPrediction>,
    /// Band within which a bead counts as settled \[mm\].
    pub band_mm: f64,
    /// Path at which the flow steps in the simulated beads \[mm\].
    pub step_at_mm: f64,
}

impl Tuned {
    /// Proposes settings for the identified cell, and simulates beads with them. Fails if the cell
    /// cannot be simulated.
    pub fn of(
        recording: String,
        cell_name: String,
        log: Log,
        plant: IdentifiedCell,
        cell: &Cell,
        run: &RunPart,
    ) -> Result<Self, SimCellError> {
        let target_mm = run.control.target.nominal().get();
        let proposal = propose(&plant, run);
        let world = TestCell::new(cell, run, &plant);
        let now = ControllerCandidate::now(run);
        let candidates = now
            .into_iter()
            .chain([ControllerCandidate::pi(&proposal), ControllerCandidate::distance(&proposal)]);
        let predictions = candidates.map(|who| world.predict(&who)).collect::<Result<_, _>>()?;
        let mismatched = ControllerCandidate::mismatched(&proposal);
        let mismatched =
            mismatched.iter().map(|who| world.predict(who)).collect::<Result<_, _>>()?;
        let at = slowest_loop(&plant, target_mm, &run.limits);
        Ok(Self {
            recording,
            cell: cell_name,
            log,
            proposal,
            target_mm,
            limits: run.limits,
            present_offset_mm: (run.camera.offset.get(), run.camera.offset_sigma.get()),
            usual: LoopPlant::at(&plant, target_mm, speed_within(&plant, target_mm, &run.limits)),
            present_gains: run.control.gains.map(|gains| (gains, at.margins(gains))),
            predictions,
            mismatched,
            band_mm: world.band_mm,
            step_at_mm: world.step_at_mm,
            plant,
        })
    }

    /// Warnings for the user of the proposed settings.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        warnings
            .extend(self.log.cut_short().map(|why| format!("{why}; fewer pieces determine less")));
        warnings.extend(self.gains_warning());
        warnings.extend(self.offset_warning());
        if let Err(error) = &self.plant.robot {
            warnings.push(format!("{error}; a robot of 10 Hz without dead time is taken instead"));
        }
        warnings.extend(self.robot_warning());
        for one in self.predictions.iter().filter(|one| one.stopped > 0) {
            warnings.push(format!(
                "{}: the controller gave up {} of {SEEDS} predicted beads",
                one.name, one.stopped
            ));
        }
        if let [.., pi, distance] = self.predictions.as_slice()
            && distance.steady_rms_mm > pi.steady_rms_mm
        {
            warnings.push(
                "the distance controller is predicted to be no steadier than the PI controller on this cell; \
                 it needs a robot that follows within a part of the way to the camera (--controller pi \
                 writes the PI controller)"
                    .to_owned(),
            );
        }
        let speed = self.plant.speed_for(self.target_mm);
        let (min, max) = (self.limits.min_speed.get(), self.limits.max_speed.get());
        if !(min..=max).contains(&speed) {
            warnings.push(format!(
                "the target of {} mm would take {speed:.1} mm/s, and [limits] are {min} to {max} \
                 mm/s",
                self.target_mm
            ));
        }
        let all = self.log.refused + self.log.widths.len() as u64;
        #[expect(clippy::cast_precision_loss, reason = "counts of frames")]
        let fraction = self.log.refused as f64 / all.max(1) as f64;
        if fraction > MANY_REJECTED {
            warnings.push(format!(
                "{:.0} % of the frames gave no width; see why with truebead process",
                100.0 * fraction
            ));
        }
        warnings
    }

    fn gains_warning(&self) -> Option<String> {
        let (_, margins) = self.present_gains.as_ref()?;
        let margins = (*margins)?;
        if margins.are_sufficient() {
            return None;
        }
        let at = self.proposal.pi.at.speed_mm_per_s;
        Some(if margins.is_stable {
            format!(
                "the cell's PI gains leave a gain margin of {:.2} and {:.0}° of phase at {at} mm/s; \
                 2 and 45° are what a loop is to have",
                margins.gain, margins.phase_deg
            )
        } else {
            format!("the cell's PI gains are unstable at {at} mm/s: the width would oscillate")
        })
    }

    fn robot_warning(&self) -> Option<String> {
        let robot = self.plant.robot.ok()?;
        let SpeedRange { min: from, max: to } = self.plant.study.estimate.speeds;
        (robot.residual_mm_per_s > MAX_GAIN_RATIO * (to - from).get()).then(|| {
            format!(
                "the robot does not respond with a dead time, a lag and a largest slope: the residual of \
                 its reported speed is {:.1} mm/s RMS; the predictions are not valid",
                robot.residual_mm_per_s
            )
        })
    }

    fn offset_warning(&self) -> Option<String> {
        let (now, sigma) = self.present_offset_mm;
        let found = self.plant.offset_mm;
        let off = (now - found.value).abs();
        (off > PLAUSIBLE_MISMATCH * found.sigma.hypot(sigma))
            .then(|| format!("the cell has offset_mm = {now}, {off:.1} mm from what was found"))
    }

    /// Proposed settings of the cell file: table, key and value. `unit_mm` is the cell's
    /// `error_unit_mm`.
    pub fn settings(
        &self,
        by_distance: bool,
        unit_mm: f64,
    ) -> Vec<(&'static str, &'static str, f64)> {
        let (distance, gains) = (self.proposal.distance, self.proposal.pi.gains);
        let mut settings = Vec::new();
        if by_distance {
            settings.push(("control", "exponent", rounded(distance.exponent, 4)));
            settings.push(("control", "drift_per_root_m", rounded(distance.drift_per_root_m, 3)));
        }
        settings.extend([
            ("control", "kp_per_s", rounded(gains.kp_per_s * unit_mm, 4)),
            ("control", "ki_per_s2", rounded(gains.ki_per_s2 * unit_mm, 4)),
            ("camera", "offset_mm", rounded(distance.offset_mm, 4)),
            ("camera", "offset_sigma_mm", rounded(distance.offset_sigma_mm, 2)),
        ]);
        settings
    }

    /// The estimated drift, or its upper limit, in words.
    fn drift_words(&self) -> String {
        match self.plant.width_noise.drift {
            Drift::Estimated { per_root_m, low, high } => format!(
                "{:.2} % along a metre ({:.2} to {:.2} %)",
                100.0 * per_root_m,
                100.0 * low,
                100.0 * high
            ),
            Drift::AtMost(most) => {
                format!("none seen; at most {:.2} % along a metre (95 %)", 100.0 * most)
            }
        }
    }
}

/// Speed at which the target width is laid, clamped to the limits \[mm/s\].
fn speed_within(plant: &IdentifiedCell, target_mm: f64, limits: &SpeedLimits) -> f64 {
    let (min, max) = (limits.min_speed.get().max(1.0), limits.max_speed.get());
    plant.speed_for(target_mm).max(min).min(max)
}

/// Rounded to `digits` significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}
