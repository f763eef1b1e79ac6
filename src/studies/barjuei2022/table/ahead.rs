//! Results that the paper does not give: settling, the error that remains under noise and flow
//! disturbances, and the effect of a model mismatch.

use maud::html;

use super::draw;
use super::experiments::Experiments;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::core::Mm;
use crate::io::progress::Progress;
use crate::studies::barjuei2022::{
    ControlSetup, FlowDisturbance, LAYERS, LayerResult, LoopRates, Mismatch, NEAR_OFFSET,
    error_ratio, lay, mismatched, realistic, settles_unseen, step_settles,
};
use crate::studies::error::ReproduceError;
use crate::studies::study::Section;

/// Steps of the progress bar. Derived: one for each experiment of [`run`].
pub const EXPERIMENTS: u64 = 5;
/// The rates of the distance controller, with their names.
const COLUMNS: [(LoopRates, &str); 2] =
    [(LoopRates::PAPER, "10/5 Hz"), (LoopRates::FAST, "50/20 Hz")];
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

/// A cell with some noise.
struct NoiseLevel {
    name: &'static str,
    cell: Cell,
    run: RunPart,
}

impl NoiseLevel {
    /// The noise that was fitted to the paper's tables, and that of rendered frames.
    fn both(work: &Experiments) -> [Self; 2] {
        let (cell, run) = realistic(&work.cell, &work.run);
        [
            Self { name: "noise 0.36 mm", cell: work.cell.clone(), run: work.run.clone() },
            Self { name: "noise 0.003 mm, roughness 0.1 mm", cell, run },
        ]
    }

    /// What is laid, with rates and noise, and how far behind the nozzle the camera looks.
    fn case(&self, what: &str, rates: &str, offset: Mm) -> String {
        format!("{what}; {rates}, camera {} mm behind, {}", offset.get(), self.name)
    }
}

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
    let levels = NoiseLevel::both(work);
    let waves = work.waves(&levels)?;
    progress.advance();
    let pulsations = work.pulsations(&levels)?;
    progress.advance();
    let hint = "Sines of 3 % along the path with the camera 60 mm behind the nozzle, and steady \
                pulsations of 3 % from five periods after they were first seen. No feedback can do \
                anything about what is shorter than its dead time; what repeats itself can be \
                predicted.";
    let drawing = html! {
        @for ((level, waves), pulsations) in levels.iter().zip(&waves).zip(&pulsations) {
            p { (level.name) ":" }
            (draw::ratios("wavelength [mm]", waves))
            (draw::ratios("period [s]", pulsations))
        }
    };
    Ok(Section::new("Disturbances of the flow", hint, drawing))
}

impl Experiments {
    /// Lays one layer with a controller.
    fn lay_by(
        &self,
        level: &NoiseLevel,
        who: ControlSetup,
        target_mm: f64,
    ) -> Result<LayerResult, ReproduceError> {
        let (cell, run) = who.enter(&level.cell, &level.run, target_mm);
        Ok(lay(&cell, &run, self.seeds)?)
    }

    /// Errors of the bead's true width, with noise on the measured widths.
    fn noise(&mut self) -> Result<(), ReproduceError> {
        for level in NoiseLevel::both(self) {
            for target in LAYERS.map(|layer| layer.target_mm) {
                let theirs = self.lay_by(&level, ControlSetup::Paper, target)?;
                for (rates, name) in COLUMNS {
                    let ours = self.lay_by(&level, ControlSetup::by_distance(rates), target)?;
                    let case = level.case(&format!("{target} mm"), name, self.run.camera.offset);
                    let mut row = |quantity, of: fn(&LayerResult) -> f64| {
                        self.rows.compare(&case, (quantity, "mm"), of(&theirs), of(&ours));
                    };
                    row("mean error of the bead", |found| found.bead_mean_error_mm);
                    row("RMS error of the bead", |found| found.bead_rms_error_mm);
                    row("standard deviation of the bead", |found| found.bead_sigma_mm);
                }
            }
        }
        Ok(())
    }

    /// Settling without measurement noise.
    fn without_noise(&mut self) -> Result<(), ReproduceError> {
        let mut cell = self.cell.clone();
        cell.simulation.width_noise = Mm::ZERO;
        let quiet = NoiseLevel { name: "without noise", cell, run: self.run.clone() };
        for target in LAYERS.map(|layer| layer.target_mm) {
            let theirs = self.lay_by(&quiet, ControlSetup::Paper, target)?;
            for (rates, name) in COLUMNS {
                let who = ControlSetup::by_distance(rates);
                let ours = self.lay_by(&quiet, who, target)?;
                let case = quiet.case(&format!("{target} mm"), name, self.run.camera.offset);
                let what = ("settles to 0.5 mm after", "mm");
                self.rows.compare(&case, what, theirs.settled_mm, ours.settled_mm);
                let ratio = ours.error_integral_mm2 / theirs.error_integral_mm2;
                let what = ("integral of the error's size, over the paper's", "1");
                self.rows.compare(&case, what, 1.0, ratio);
                let unseen = settles_unseen(&quiet.cell, &quiet.run, who, target, self.seeds)?;
                self.rows.ours(&case, ("settles with nothing seen before after", "mm"), unseen);
            }
        }
        let step = |who| step_settles(&quiet.cell, &quiet.run, who, self.seeds);
        let theirs = step(ControlSetup::Paper)?;
        for (rates, name) in COLUMNS {
            let found = [theirs, step(ControlSetup::by_distance(rates))?];
            let [theirs, ours] = found.map(|way| way.is_finite().then_some(way));
            let case = quiet.case("8 % flow step", name, NEAR_OFFSET);
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
        for level in NoiseLevel::both(self) {
            let lay = |who, what| mismatched(&level.cell, &level.run, who, what, self.seeds);
            for (what, exponent, mismatch) in cases {
                let theirs = lay(ControlSetup::Paper, mismatch)?;
                for (rates, name) in COLUMNS {
                    let ours = lay(ControlSetup::Distance(rates, exponent), mismatch)?;
                    let what = format!("42 mm, {what}");
                    let case = level.case(&what, name, self.run.camera.offset);
                    let quantity = ("RMS error of the bead once settled", "mm");
                    self.rows.compare(&case, quantity, theirs.median_mm, ours.median_mm);
                    let quantity = ("the same, mean over seeds", "mm");
                    self.rows.compare(&case, quantity, theirs.mean_mm, ours.mean_mm);
                }
            }
        }
        Ok(())
    }

    /// Sinusoidal flow along the path, at each noise level.
    fn waves(&mut self, levels: &[NoiseLevel; 2]) -> Result<Vec<Ratios>, ReproduceError> {
        let mut curves = Vec::new();
        for level in levels {
            let mut curve = Vec::new();
            for wavelength in CURVE_MM {
                let ratios = self.error_ratios(level, FlowDisturbance::Wave(wavelength))?;
                curve.push((wavelength, ratios));
                if WAVES_MM.contains(&wavelength) {
                    self.push_ratios(
                        level,
                        &format!("flow sine of {wavelength} mm"),
                        NEAR_OFFSET,
                        ratios,
                    );
                }
            }
            let worst = |which: usize| curve.iter().map(|(_, r)| r[which]).fold(0.0, f64::max);
            let case = "flow sine of the worst wavelength";
            self.push_ratios(level, case, NEAR_OFFSET, [0, 1, 2].map(worst));
            curve.reverse();
            curves.push(curve);
        }
        Ok(curves)
    }

    /// Pulsations of the pump, at each noise level.
    fn pulsations(&mut self, levels: &[NoiseLevel; 2]) -> Result<Vec<Ratios>, ReproduceError> {
        let mut curves = Vec::new();
        for level in levels {
            let mut curve = Vec::new();
            for period in PERIODS_S {
                let ratios = self.error_ratios(level, FlowDisturbance::Pulsation(period))?;
                let case = format!("pulsation of {period} s");
                self.push_ratios(level, &case, self.run.camera.offset, ratios);
                curve.push((period, ratios));
            }
            curves.push(curve);
        }
        Ok(curves)
    }

    /// Error ratios of the paper's controller, and of the distance controller at both rates.
    fn error_ratios(
        &self,
        level: &NoiseLevel,
        what: FlowDisturbance,
    ) -> Result<[f64; 3], ReproduceError> {
        let seeds = disturbed_seeds(self.seeds);
        let by = |who| error_ratio(&level.cell, &level.run, who, what, seeds);
        let [slow, fast] = COLUMNS.map(|(rates, _)| ControlSetup::by_distance(rates));
        Ok([by(ControlSetup::Paper)?, by(slow)?, by(fast)?])
    }

    fn push_ratios(
        &mut self,
        level: &NoiseLevel,
        what: &str,
        offset: Mm,
        [paper, slow, fast]: [f64; 3],
    ) {
        for ((_, name), ours) in COLUMNS.into_iter().zip([slow, fast]) {
            let quantity = ("error over that without control", "1");
            self.rows.compare(level.case(what, name, offset), quantity, paper, ours);
        }
    }
}
