//! Ma et al. 2026 beside its published step, sine and steady figures.

use maud::html;

use super::experiment::{PressureExperiment, TestedController};
use super::margins::margins;
use super::plant::Factors;
use crate::core::units::{Mm, MmPerS};
use crate::extruder::demand;
use crate::extruder::rheology::PowerLaw;
use crate::io::progress::Progress;
use crate::report::chart::palette;
use crate::report::chart::palette::Ink;
use crate::report::chart::range::Range;
use crate::studies::error::ReproduceError;
use crate::studies::publication::Publication;
use crate::studies::study::{Effort, Reproduced, Section, TableRows};

mod draw;

use draw::{courses, curves, singles};

/// What progress is told of.
pub const EXPERIMENTS: u64 = 6;
const SEEDS: u64 = 5;
const KPA: f64 = 1000.0;
/// The paper's two laws, in its order, with their colours.
const THEIRS: [(TestedController, Ink); 2] =
    [(TestedController::Pi, palette::DEMAND), (TestedController::Vsfc, palette::PAPER)];
const OURS: (TestedController, Ink) = (TestedController::Predictive, palette::OURS);

/// Runs the experiments.
pub fn run(effort: Effort, progress: &mut Progress) -> Result<Reproduced, ReproduceError> {
    let seeds = effort.seeds.unwrap_or(SEEDS);
    let mut work = Work { seeds, rows: TableRows::of(Publication::Ma2026) };
    work.targets();
    let mut sections = Vec::new();
    let parts = [Work::step, Work::robustness, Work::sine, Work::steady, Work::load, Work::margins];
    for part in parts {
        sections.extend(part(&mut work)?);
        progress.advance();
    }
    let about = format!(
        "Means over {seeds} seeds where there is noise. The plant is the paper's: dead time \
         0.41 s, lag 0.84 s, gain 1; sensor at 50 Hz, commands at 20 Hz. The paper names no \
         gains; those of its two controllers are fitted to its step figures, all else follows. Our controller \
         has one tuning for all experiments, by rules from the model and the noise."
    );
    Ok(Reproduced { title: "Ma et al. 2026", about, rows: work.rows.into_vec(), sections })
}

struct Work {
    seeds: u64,
    rows: TableRows,
}

type Part = Result<Option<Section>, ReproduceError>;

impl Work {
    /// Target pressures of the paper's print speeds, eq. (5).
    fn targets(&mut self) {
        let Ok(section) = demand::section(Mm::constant(3.0), Mm::constant(1.5)) else { return };
        for speed in [30.0, 40.0, 50.0] {
            let flow = MmPerS::constant(speed) * section;
            let pressure = PowerLaw::PP_GF28.pressure(flow).ok().map(f64::from);
            let case = format!("bead of 3 × 1.5 mm at {speed} mm/s");
            self.rows.push(case, ("target pressure", "MPa"), [None, pressure, None]);
        }
    }

    fn step(&mut self) -> Part {
        let experiment = PressureExperiment::step(Factors::NONE);
        let ours = experiment.run(OURS.0)?;
        let best = ours.step_figures();
        let mut drawn = Vec::new();
        for ((tried, ink), published) in THEIRS.into_iter().zip([(23.37, 0.96), (17.37, 1.06)]) {
            let course = experiment.run(tried)?;
            let found = course.step_figures();
            let case = format!("step 0 → 0.6 MPa, {}", tried.name());
            let overshoot = [Some(published.0), Some(found.overshoot), Some(best.overshoot)];
            self.rows.push(&case, ("overshoot", "%"), overshoot);
            let rise = [Some(published.1), found.rise_s, best.rise_s];
            self.rows.push(&case, ("rise to 90 %", "s"), rise);
            self.rows.push(&case, ("IAE", "MPa·s"), [None, Some(found.iae), Some(best.iae)]);
            drawn.push((tried.name(), ink, course));
        }
        let smith = experiment.run(TestedController::SmithPi)?.step_figures();
        let case = "step 0 → 0.6 MPa, Smith-PI with two degrees of freedom";
        let (overshoot, rise) = (Some(smith.overshoot), smith.rise_s);
        self.rows.push(case, ("overshoot", "%"), [None, overshoot, Some(best.overshoot)]);
        self.rows.push(case, ("rise to 90 %", "s"), [None, rise, best.rise_s]);
        drawn.push(("ours", OURS.1, ours));
        Ok(Some(Section {
            heading: "Step of the target".to_owned(),
            hint: "From rest to 0.6 MPa, without noise.".to_owned(),
            drawing: courses(&drawn, Range::new(0.0, 5.0)),
        }))
    }

    fn robustness(&mut self) -> Part {
        let mut drawn = Vec::new();
        for (name, factors) in Factors::singles() {
            let experiment = PressureExperiment::step(factors);
            let ours = experiment.run(OURS.0)?;
            let best = ours.step_figures();
            for (tried, _) in THEIRS {
                let found = experiment.run(tried)?.step_figures();
                let case = format!("{name}, {}", tried.name());
                let overshoot = [None, Some(found.overshoot), Some(best.overshoot)];
                self.rows.push(&case, ("overshoot", "%"), overshoot);
                self.rows.push(&case, ("rise to 90 %", "s"), [None, found.rise_s, best.rise_s]);
            }
            let noisy = self.mean(|seed| {
                Ok(experiment.clone().noisy(seed).run(OURS.0)?.step_figures().overshoot)
            })?;
            let case = format!("{name}, with noise");
            self.rows.push(case, ("overshoot", "%"), [None, None, Some(noisy)]);
            drawn.push(ours);
        }
        for (tried, _) in THEIRS {
            let (theirs, ours) = (worst(tried)?, worst(OURS.0)?);
            let case = format!("worst of all 27 combinations of ±20 %, {}", tried.name());
            self.rows.push(case, ("overshoot", "%"), [None, Some(theirs), Some(ours)]);
        }
        Ok(Some(Section {
            heading: "A model that is off by 20 %".to_owned(),
            hint: "Our controller, from rest to 0.6 MPa, with gain, lag or dead time of the plant 20 % \
                   above or below the model's, one at a time."
                .to_owned(),
            drawing: singles(&drawn),
        }))
    }

    fn sine(&mut self) -> Part {
        let rms = |tried| {
            self.mean(|seed| Ok(PressureExperiment::sine(seed).run(tried)?.tracking(20.0).0))
        };
        let (unaware, best) = (rms(OURS.0)?, rms(TestedController::Previewed)?);
        let found = [rms(TestedController::Pi)?, rms(TestedController::Vsfc)?];
        for (((tried, _), found), published) in THEIRS.into_iter().zip(found).zip([0.0153, 0.0193])
        {
            let case = format!("sine 0.65 ± 0.1 MPa, 20 s, {}", tried.name());
            let values = [Some(published), Some(found), Some(best)].map(|v| v.map(|v| v * KPA));
            self.rows.push(case, ("RMSE, ours with preview", "kPa"), values);
        }
        let case = "sine 0.65 ± 0.1 MPa, 20 s, nothing known ahead";
        self.rows.push(case, ("RMSE", "kPa"), [None, None, Some(unaware * KPA)]);
        let mut drawn = Vec::new();
        for (tried, ink) in THEIRS.into_iter().chain([(TestedController::Previewed, OURS.1)]) {
            drawn.push((tried.name(), ink, PressureExperiment::sine(0).run(tried)?));
        }
        Ok(Some(Section {
            heading: "Sine".to_owned(),
            hint: "0.65 ± 0.1 MPa in 20 s, with noise. Ours is given the target ahead, as far as \
                   the robot's path determines it."
                .to_owned(),
            drawing: html! {
                (courses(&drawn, Range::new(20.0, 60.0)))
                (curves(&drawn, Range::new(20.0, 60.0), "error [kPa]", |course, at| {
                    let pressure = course.pressure.get(at)?;
                    Some((pressure - course.target.get(at)?) * KPA)
                }))
            },
        }))
    }

    fn steady(&mut self) -> Part {
        let figure = |tried, pick: fn((f64, f64)) -> f64| {
            self.mean(|seed| {
                Ok(pick(PressureExperiment::steady(seed).run(tried)?.steadiness(20.0)))
            })
        };
        let sigma = |pair: (f64, f64)| pair.0 * KPA;
        let cv = |pair: (f64, f64)| pair.1;
        let best = (figure(OURS.0, sigma)?, figure(OURS.0, cv)?);
        let mut found = Vec::new();
        for (tried, _) in THEIRS {
            found.push((tried, figure(tried, sigma)?, figure(tried, cv)?));
        }
        for ((tried, sigma, cv), published) in found.into_iter().zip([(8.1, 6.74), (14.7, 3.37)]) {
            let case = format!("steady at 0.6 MPa with drift, {}", tried.name());
            let of_sigma = [Some(published.0), Some(sigma), Some(best.0)];
            self.rows.push(&case, ("σ of the pressure", "kPa"), of_sigma);
            let of_cv = [Some(published.1), Some(cv), Some(best.1)];
            self.rows.push(&case, ("CV of the screw speed", "%"), of_cv);
        }
        let mut drawn = Vec::new();
        for (tried, ink) in THEIRS.into_iter().chain([OURS]) {
            drawn.push((tried.name(), ink, PressureExperiment::steady(0).run(tried)?));
        }
        Ok(Some(Section {
            heading: "Steady extrusion with drift".to_owned(),
            hint: "0.6 MPa; the gain drifts by 3 % in 60 s and by 1.5 % in 17 s. The published \
                   figures are those of the paper's machine, whose drift is not given: 30 mm/s \
                   for σ (14.7 … 21.0 kPa for VSFC-Smith), 50 mm/s for the variation, \"about \
                   half\" of the PID's for VSFC-Smith. To follow this drift fully the screw must \
                   vary by 2.3 %; with 1.2 % at least 7 kPa of it stay in the pressure. Ours takes \
                   noise for a step of the load once in some 20 s, and takes it back within a \
                   second: the price of its quick answer to a true one."
                .to_owned(),
            drawing: courses(&drawn, Range::new(20.0, 120.0)),
        }))
    }

    fn load(&mut self) -> Part {
        let experiment = PressureExperiment::load(Factors::NONE);
        let ours = experiment.run(OURS.0)?;
        let best = ours.load_figures(5.0);
        let mut drawn = Vec::new();
        for (tried, ink) in THEIRS {
            let course = experiment.run(tried)?;
            let found = course.load_figures(5.0);
            let case = format!("step of the load, {}", tried.name());
            let peak = [None, Some(found.peak), Some(best.peak)];
            self.rows.push(&case, ("largest error for each unit", "1"), peak);
            self.rows.push(
                &case,
                ("IAE for each unit", "s"),
                [None, Some(found.iae), Some(best.iae)],
            );
            drawn.push((tried.name(), ink, course));
        }
        let peak = self.mean(|seed| {
            let course = PressureExperiment::load(Factors::NONE).noisy(seed).run(OURS.0)?;
            Ok(course.load_figures(5.0).peak)
        })?;
        let case = "step of the load, with noise";
        self.rows.push(case, ("largest error for each unit", "1"), [None, None, Some(peak)]);
        drawn.push(("ours", OURS.1, ours));
        Ok(Some(Section {
            heading: "Step of the load".to_owned(),
            hint: "0.1 at the plant's input after 5 s, without noise. No controller can keep the error \
                   below 0.386 of it: the correction comes a dead time late."
                .to_owned(),
            drawing: courses(&drawn, Range::new(4.0, 12.0)),
        }))
    }

    fn margins(&mut self) -> Part {
        let best = margins(OURS.0)?;
        for tried in [TestedController::Pi, TestedController::Vsfc, TestedController::SmithPi] {
            let found = margins(tried)?;
            let case = format!("margins, {}", tried.name());
            self.rows.push(&case, ("gain", "1"), [None, Some(found.gain), Some(best.gain)]);
            let dead_time = [None, Some(found.dead_time_s), Some(best.dead_time_s)];
            self.rows.push(&case, ("dead time", "s"), dead_time);
        }
        Ok(None)
    }

    #[expect(clippy::cast_precision_loss, reason = "a count of seeds")]
    fn mean(
        &self,
        figure: impl Fn(u64) -> Result<f64, ReproduceError>,
    ) -> Result<f64, ReproduceError> {
        let all: Result<Vec<f64>, _> = (0..self.seeds).map(figure).collect();
        let all = all?;
        Ok(all.iter().sum::<f64>() / all.len().max(1) as f64)
    }
}

/// The largest overshoot over all combinations of errors \[%\].
fn worst(tried: TestedController) -> Result<f64, ReproduceError> {
    let mut worst = 0.0_f64;
    for factors in Factors::all() {
        worst = worst.max(PressureExperiment::step(factors).run(tried)?.step_figures().overshoot);
    }
    Ok(worst)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_published_figure_has_a_row_with_what_both_laws_give() {
        let effort = Effort { seeds: Some(1), frame_seeds: None };
        let mut progress = Progress::new("reproducing", "experiments", None, true);
        let done = run(effort, &mut progress).unwrap();
        let published: Vec<f64> = done.rows.iter().filter_map(|row| row.published).collect();
        for figure in [23.37, 0.96, 17.37, 1.06, 15.3, 19.3, 8.1, 6.74, 14.7] {
            assert!(published.iter().any(|p| (p - figure).abs() < 1e-9), "{figure}");
        }
        for row in done.rows.iter().filter(|row| row.published.is_some()) {
            assert!(row.simulated.is_some() && row.ours.is_some(), "{row:?}");
        }
        for section in &done.sections {
            let drawn = section.drawing.clone().into_string();
            assert!(drawn.contains("time [s]") && !drawn.contains("NaN"), "{}", section.heading);
        }
    }
}
