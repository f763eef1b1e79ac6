//! What the paper leaves wanting: how soon a layer settles, what noise and
//! disturbances of the flow leave of it, and what happens when the controller is
//! told wrong.

use maud::html;

use super::draw;
use super::experiments::Experiments;
use crate::core::units::Mm;
use crate::io::progress::Progress;
use crate::studies::barjuei2022::{
    ControlSetup, FlowDisturbance, LAYERS, LayerResult, LoopRates, Mismatch, error_ratio, lay,
    mismatched, settles_unseen, step_settles,
};
use crate::studies::error::ReproduceError;
use crate::studies::study::Section;

/// What progress is told of.
pub const EXPERIMENTS: u64 = 5;
/// Both columns of rates by distance, with what they are called.
const COLUMNS: [(LoopRates, &str); 2] =
    [(LoopRates::PAPER, "10 Hz vision, 5 Hz link"), (LoopRates::FAST, "50 Hz vision, 20 Hz link")];
/// Wavelengths that are asked for by name \[mm\], and those of the curve.
const WAVES_MM: [f64; 2] = [2400.0, 1200.0];
const CURVE_MM: [f64; 16] = [
    2400.0, 1700.0, 1200.0, 850.0, 690.0, 616.0, 550.0, 438.0, 350.0, 279.0, 198.0, 141.0, 100.0,
    72.0, 57.0, 45.0,
];
/// Periods of a pulsation \[s\].
const PERIODS_S: [f64; 7] = [1.0, 1.5, 2.0, 2.6, 3.5, 4.5, 6.0];

/// Seeds of flow sines and pulsations, which take long beads.
pub fn disturbed_seeds(seeds: u64) -> u64 {
    seeds.min(10)
}

/// Runs the experiments and draws the answers to waves and pulsations.
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
    Ok(Section {
        heading: "Disturbances of the flow".to_owned(),
        hint: "Sines of 3 % along the path with the camera 60 mm behind the nozzle, and steady \
               pulsations of 3 % from five periods after they were first seen. No feedback can do \
               anything about what is shorter than its dead time; what repeats itself can be \
               predicted."
            .to_owned(),
        drawing: html! {
            (draw::ratios("wavelength [mm]", &waves))
            (draw::ratios("period [s]", &pulsations))
        },
    })
}

impl Experiments {
    /// One layer by distance.
    fn by_distance(
        &self,
        cell: &crate::cell::Cell,
        rates: LoopRates,
        target_mm: f64,
    ) -> Result<LayerResult, ReproduceError> {
        let (cell, run) = ControlSetup::by_distance(rates).enter(cell, &self.run, target_mm);
        Ok(lay(&cell, &run, self.seeds)?)
    }

    /// The bead itself with noise on the widths.
    fn noise(&mut self) -> Result<(), ReproduceError> {
        for layer in &LAYERS {
            let target = layer.target_mm;
            let (cell, run) = ControlSetup::Paper.enter(&self.cell, &self.run, target);
            let theirs = lay(&cell, &run, self.seeds)?;
            for (rates, name) in COLUMNS {
                let ours = self.by_distance(&self.cell, rates, target)?;
                let case = format!("{target} mm, {name}");
                let pairs = [
                    ("mean error of the bead", theirs.bead_mean_error_mm, ours.bead_mean_error_mm),
                    ("RMS error of the bead", theirs.bead_rms_error_mm, ours.bead_rms_error_mm),
                    ("width noise by control", theirs.bead_scatter_mm, ours.bead_scatter_mm),
                ];
                for (quantity, theirs, ours) in pairs {
                    self.rows.push(&case, (quantity, "mm"), [None, Some(theirs), Some(ours)]);
                }
            }
        }
        Ok(())
    }

    /// How soon a layer settles.
    fn without_noise(&mut self) -> Result<(), ReproduceError> {
        let mut quiet = self.cell.clone();
        quiet.simulation.width_noise = Mm::ZERO;
        for layer in &LAYERS {
            let target = layer.target_mm;
            let (cell, run) = ControlSetup::Paper.enter(&quiet, &self.run, target);
            let theirs = lay(&cell, &run, self.seeds)?;
            for (rates, name) in COLUMNS {
                let ours = self.by_distance(&quiet, rates, target)?;
                let case = format!("{target} mm, without noise, {name}");
                let settled = [None, theirs.settled_mm, ours.settled_mm];
                self.rows.push(&case, ("settles to 0.5 mm after", "mm"), settled);
                let ratio = ours.error_integral_mm2 / theirs.error_integral_mm2;
                let what = ("integral of the error's size, over the paper's", "1");
                self.rows.push(&case, what, [None, Some(1.0), Some(ratio)]);
                let who = ControlSetup::by_distance(rates);
                let unseen = settles_unseen(&quiet, &self.run, who, target, self.seeds)?;
                let what = ("settles with nothing seen before after", "mm");
                self.rows.push(&case, what, [None, None, Some(unseen)]);
            }
        }
        let step = |who| step_settles(&quiet, &self.run, who, self.seeds);
        let theirs = step(ControlSetup::Paper)?;
        for (rates, name) in COLUMNS {
            let ours = step(ControlSetup::by_distance(rates))?;
            let case = format!("8 % flow step, {name}");
            let found = [theirs, ours].map(|way| way.is_finite().then_some(way));
            self.rows.push(case, ("settles to 0.5 mm after", "mm"), [None, found[0], found[1]]);
        }
        Ok(())
    }

    /// A controller that is told wrong, and a camera that sees wrong.
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
                for (quantity, found) in [
                    ("RMS error of the bead once settled", found.median_mm),
                    ("the same, mean over seeds", found.mean_mm),
                ] {
                    self.rows.push(case.clone(), (quantity, "mm"), [None, None, Some(found)]);
                }
            }
        }
        Ok(())
    }

    /// Sines along the path.
    fn waves(&mut self) -> Result<Vec<(f64, [f64; 3])>, ReproduceError> {
        let mut curve = Vec::new();
        for wavelength in CURVE_MM {
            let ratios = self.answer(FlowDisturbance::Wave(wavelength))?;
            curve.push((wavelength, ratios));
            if WAVES_MM.contains(&wavelength) {
                self.push_ratios(&format!("flow sine of {wavelength} mm"), ratios);
            }
        }
        let worst = |which: usize| curve.iter().map(|(_, r)| r[which]).fold(0.0, f64::max);
        self.push_ratios("flow sine of the worst wavelength", [worst(0), worst(1), worst(2)]);
        curve.reverse();
        Ok(curve)
    }

    /// Pulsations of the pump.
    fn pulsations(&mut self) -> Result<Vec<(f64, [f64; 3])>, ReproduceError> {
        let mut curve = Vec::new();
        for period in PERIODS_S {
            let ratios = self.answer(FlowDisturbance::Pulsation(period))?;
            self.push_ratios(&format!("pulsation of {period} s"), ratios);
            curve.push((period, ratios));
        }
        Ok(curve)
    }

    /// The paper's loop, and by distance at both rates.
    fn answer(&self, what: FlowDisturbance) -> Result<[f64; 3], ReproduceError> {
        let seeds = disturbed_seeds(self.seeds);
        let by = |who| error_ratio(&self.cell, &self.run, who, what, seeds);
        let [(slow, _), (fast, _)] = COLUMNS;
        let ours = [slow, fast].map(ControlSetup::by_distance);
        Ok([by(ControlSetup::Paper)?, by(ours[0])?, by(ours[1])?])
    }

    fn push_ratios(&mut self, case: &str, [paper, slow, fast]: [f64; 3]) {
        for ((_, name), ours) in COLUMNS.into_iter().zip([slow, fast]) {
            let quantity = ("error over that without control", "1");
            self.rows.push(format!("{case}, {name}"), quantity, [None, Some(paper), Some(ours)]);
        }
    }
}
