//! Results that the paper does not give: settling, the error that remains under noise and flow
//! disturbances, and the effect of a model mismatch.

use maud::html;

use super::draw;
use super::experiments::Experiments;
use crate::core::Mm;
use crate::io::progress::Progress;
use crate::studies::barjuei2022::{
    ControlSetup, FlowDisturbance, LAYERS, LayerResult, LoopRates, Mismatch, error_ratio, lay,
    mismatched, settles_unseen, step_settles,
};
use crate::studies::error::ReproduceError;
use crate::studies::study::Section;

/// Steps of the progress bar. Derived: one for each experiment of [`run`].
pub const EXPERIMENTS: u64 = 5;
/// The rates of the distance controller, with their names.
const COLUMNS: [(LoopRates, &str); 2] =
    [(LoopRates::PAPER, "10 Hz vision, 5 Hz link"), (LoopRates::FAST, "50 Hz vision, 20 Hz link")];
/// Wavelengths with their own rows in the table \[mm\].
const WAVES_MM: [f64; 2] = [2400.0, 1200.0];
/// Wavelengths of the curve \[mm\], about equidistant in the logarithm.
const CURVE_MM: [f64; 16] = [
    2400.0, 1700.0, 1200.0, 850.0, 690.0, 616.0, 550.0, 438.0, 350.0, 279.0, 198.0, 141.0, 100.0,
    72.0, 57.0, 45.0,
];
/// Periods of a pulsation \[s\].
const PERIODS_S: [f64; 7] = [1.0, 1.5, 2.0, 2.6, 3.5, 4.5, 6.0];

/// Points of a curve over wavelength or period: the error ratio of the paper's controller and of
/// the distance controller at both rates.
type Ratios = Vec<(f64, [f64; 3])>;

/// Seeds for experiments with flow disturbances; few, because their beads are long.
pub fn disturbed_seeds(seeds: u64) -> u64 {
    seeds.min(10)
}

/// Runs the experiments and plots the response to waves and pulsations.
pub fn run(work: &mut Experiments, progress: &mut Progress) -> Result<Section, ReproduceError> {
    work.noise()?;
    progress.advance();
    work.without_noise()?;
    progress.advance();
    work.mismatched()?;
    progress.advance();
    let waves = work.waves()?;
    progress.advance();
    let pulsations = work.pulsations()?;
    progress.advance();
    let hint = "Sines of 3 % along the path with the camera 60 mm behind the nozzle, and steady \
                pulsations of 3 % from five periods after they were first seen. No feedback can do \
                anything about what is shorter than its dead time; what repeats itself can be \
                predicted.";
    let drawing = html! {
        (draw::ratios("wavelength [mm]", &waves))
        (draw::ratios("period [s]", &pulsations))
    };
    Ok(Section::new("Disturbances of the flow", hint, drawing))
}

impl Experiments {
    /// Lays one layer with a controller.
    fn lay_by(
        &self,
        cell: &crate::cell::Cell,
        who: ControlSetup,
        target_mm: f64,
    ) -> Result<LayerResult, ReproduceError> {
        let (cell, run) = who.enter(cell, &self.run, target_mm);
        Ok(lay(&cell, &run, self.seeds)?)
    }

    /// Errors of the bead's true width, with noise on the measured widths.
    fn noise(&mut self) -> Result<(), ReproduceError> {
        for target in LAYERS.map(|layer| layer.target_mm) {
            let theirs = self.lay_by(&self.cell, ControlSetup::Paper, target)?;
            for (rates, name) in COLUMNS {
                let ours = self.lay_by(&self.cell, ControlSetup::by_distance(rates), target)?;
                let case = format!("{target} mm, {name}");
                let mut row = |quantity, of: fn(&LayerResult) -> f64| {
                    self.rows.compare(&case, (quantity, "mm"), of(&theirs), of(&ours));
                };
                row("mean error of the bead", |found| found.bead_mean_error_mm);
                row("RMS error of the bead", |found| found.bead_rms_error_mm);
                row("width noise by control", |found| found.bead_sigma_mm);
            }
        }
        Ok(())
    }

    /// Settling without measurement noise.
    fn without_noise(&mut self) -> Result<(), ReproduceError> {
        let mut quiet = self.cell.clone();
        quiet.simulation.width_noise = Mm::ZERO;
        for target in LAYERS.map(|layer| layer.target_mm) {
            let theirs = self.lay_by(&quiet, ControlSetup::Paper, target)?;
            for (rates, name) in COLUMNS {
                let who = ControlSetup::by_distance(rates);
                let ours = self.lay_by(&quiet, who, target)?;
                let case = format!("{target} mm, without noise, {name}");
                let what = ("settles to 0.5 mm after", "mm");
                self.rows.compare(&case, what, theirs.settled_mm, ours.settled_mm);
                let ratio = ours.error_integral_mm2 / theirs.error_integral_mm2;
                let what = ("integral of the error's size, over the paper's", "1");
                self.rows.compare(&case, what, 1.0, ratio);
                let unseen = settles_unseen(&quiet, &self.run, who, target, self.seeds)?;
                self.rows.ours(&case, ("settles with nothing seen before after", "mm"), unseen);
            }
        }
        let step = |who| step_settles(&quiet, &self.run, who, self.seeds);
        let theirs = step(ControlSetup::Paper)?;
        for (rates, name) in COLUMNS {
            let found = [theirs, step(ControlSetup::by_distance(rates))?];
            let [theirs, ours] = found.map(|way| way.is_finite().then_some(way));
            let case = format!("8 % flow step, {name}");
            self.rows.compare(case, ("settles to 0.5 mm after", "mm"), theirs, ours);
        }
        Ok(())
    }

    /// A controller with a model mismatch, and a camera with outliers and missing widths.
    fn mismatched(&mut self) -> Result<(), ReproduceError> {
        let offset = |factor| Mismatch { offset: factor, ..Mismatch::NONE };
        let all = |factor| Mismatch { offset: factor, outliers: 0.1, missing: 0.2 };
        let cases = [
            ("nothing wrong", 0.25, Mismatch::NONE),
            ("distance 20 % too long", 0.25, offset(1.2)),
            ("distance 20 % too short", 0.25, offset(0.8)),
            ("b 50 % too large", 0.375, Mismatch::NONE),
            ("b 50 % too small", 0.125, Mismatch::NONE),
            ("one width in ten an outlier", 0.25, Mismatch { outliers: 0.1, ..Mismatch::NONE }),
            ("one width in five missing", 0.25, Mismatch { missing: 0.2, ..Mismatch::NONE }),
            ("all of it, too long and too large", 0.375, all(1.2)),
            ("all of it, too long and too small", 0.125, all(1.2)),
            ("all of it, too short and too large", 0.375, all(0.8)),
            ("all of it, too short and too small", 0.125, all(0.8)),
        ];
        for (rates, name) in COLUMNS {
            for (what, exponent, mismatch) in cases {
                let who = ControlSetup::Distance(rates, exponent);
                let found = mismatched(&self.cell, &self.run, who, mismatch, self.seeds)?;
                let case = format!("42 mm, {what}, {name}");
                let quantity = ("RMS error of the bead once settled", "mm");
                self.rows.ours(&case, quantity, found.median_mm);
                self.rows.ours(&case, ("the same, mean over seeds", "mm"), found.mean_mm);
            }
        }
        Ok(())
    }

    /// Sinusoidal flow along the path.
    fn waves(&mut self) -> Result<Ratios, ReproduceError> {
        let mut curve = Vec::new();
        for wavelength in CURVE_MM {
            let ratios = self.error_ratios(FlowDisturbance::Wave(wavelength))?;
            curve.push((wavelength, ratios));
            if WAVES_MM.contains(&wavelength) {
                self.push_ratios(&format!("flow sine of {wavelength} mm"), ratios);
            }
        }
        let worst = |which: usize| curve.iter().map(|(_, r)| r[which]).fold(0.0, f64::max);
        self.push_ratios("flow sine of the worst wavelength", [0, 1, 2].map(worst));
        curve.reverse();
        Ok(curve)
    }

    /// Pulsations of the pump.
    fn pulsations(&mut self) -> Result<Ratios, ReproduceError> {
        let mut curve = Vec::new();
        for period in PERIODS_S {
            let ratios = self.error_ratios(FlowDisturbance::Pulsation(period))?;
            self.push_ratios(&format!("pulsation of {period} s"), ratios);
            curve.push((period, ratios));
        }
        Ok(curve)
    }

    /// Error ratios of the paper's controller, and of the distance controller at both rates.
    fn error_ratios(&self, what: FlowDisturbance) -> Result<[f64; 3], ReproduceError> {
        let seeds = disturbed_seeds(self.seeds);
        let by = |who| error_ratio(&self.cell, &self.run, who, what, seeds);
        let [slow, fast] = COLUMNS.map(|(rates, _)| ControlSetup::by_distance(rates));
        Ok([by(ControlSetup::Paper)?, by(slow)?, by(fast)?])
    }

    fn push_ratios(&mut self, case: &str, [paper, slow, fast]: [f64; 3]) {
        for ((_, name), ours) in COLUMNS.into_iter().zip([slow, fast]) {
            let quantity = ("error over that without control", "1");
            self.rows.compare(format!("{case}, {name}"), quantity, paper, ours);
        }
    }
}
