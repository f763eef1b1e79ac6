//! Mohammadi Looey et al. 2026 compared with its table 1 and its case studies.

use maud::{Markup, html};

use super::strand::StrandParameters;
use super::{
    AdaptationMethod, RAMPS_PER_S, StrandExperiment, StrandSample, SubSystem, TABLE, TableCase,
};
use crate::io::progress::Progress;
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette;
use crate::report::chart::series::CurvePoint;
use crate::studies::error::ReproduceError;
use crate::studies::looey2026 as experiments;
use crate::studies::plot::{Line, plot};
use crate::studies::publication::Publication;
use crate::studies::study::{Effort, Reproduced, Section, TableRows};

/// Steps of the progress bar. Derived: ten cases, ramps, noise and two case studies.
pub const EXPERIMENTS: u64 = 14;
const METHODS: [AdaptationMethod; 3] =
    [AdaptationMethod::NotAdaptive, AdaptationMethod::Paper, AdaptationMethod::Ours];
/// Number of 1 ms samples per point of a curve.
const DRAWN_EVERY: u64 = 20;
/// End of the disturbances of the case studies \[s\]. Mohammadi Looey et al. 2026, section 4.
const END_S: f64 = 60.0;
/// By definition, mm in a m and g in a kg.
const MM: f64 = 1000.0;

/// Runs the experiments; none needs more than one seed.
pub fn run(_: Effort, progress: &mut Progress) -> Result<Reproduced, ReproduceError> {
    let mut rows = TableRows::of(Publication::Looey2026);
    for case in &TABLE {
        convergence(case, &mut rows)?;
        progress.advance();
    }
    ramp_constants(&mut rows)?;
    progress.advance();
    noise(&mut rows)?;
    progress.advance();
    let study = |name, part, experiment| Study { name, part, experiment };
    let mut sections = Vec::new();
    for study in [
        study("plate speed −40 %", 1, experiments::plate_step),
        study("feed falls by 0.5 g/s each second", 0, experiments::feed_ramp),
    ] {
        sections.push(study.show(&mut rows)?);
        progress.advance();
    }
    let about = "The paper gives no gains and no parameters. Sub-system 1 was fitted to cases 1 to \
                5; cases 6 to 10, whose step cannot be in m/s as printed (here: percent of the \
                plate's speed) and whose 31.00 s are the end of the horizon, fit no linear model: \
                what a sub-system 3 with parameters of our own does stands beside them and claims \
                nothing. Ours learns the uncertainty's slope as well, with all poles of the error \
                at −2.2/s; what that costs in noise of the command is in the table.";
    let (title, about) = ("Mohammadi Looey et al. 2026", about.to_owned());
    Ok(Reproduced { title, about, rows: rows.into_vec(), sections })
}

fn convergence(case: &TableCase, rows: &mut TableRows) -> Result<(), ReproduceError> {
    let (paper, ours) = (case.run(AdaptationMethod::Paper)?, case.run(AdaptationMethod::Ours)?);
    let name = match case.of {
        SubSystem::Nozzle => format!("case {}: {:+.4} kg/s", case.number, case.size),
        SubSystem::Strand => format!("case {}: {:+} % (not claimed)", case.number, case.size),
    };
    let tracking = [Some(case.tracking_s), paper.tracking_s, ours.tracking_s];
    let estimate = [Some(case.estimate_s), paper.estimate_s, ours.estimate_s];
    rows.push(&name, ("tracking converges after", "s"), tracking);
    rows.push(&name, ("estimate converges after", "s"), estimate);
    Ok(())
}

fn ramp_constants(rows: &mut TableRows) -> Result<(), ReproduceError> {
    let paper = experiments::ramp_errors(AdaptationMethod::Paper)?;
    let ours = experiments::ramp_errors(AdaptationMethod::Ours)?;
    let names = [
        (format!("ramp of {} kg/s² in the feed", RAMPS_PER_S[0]), "e1 that stays"),
        (format!("ramp of {} m/s² in the plate", RAMPS_PER_S[1]), "e3 that stays"),
    ];
    for (((name, quantity), paper), ours) in names.into_iter().zip(paper).zip(ours) {
        let (found, formula) = paper;
        rows.compare(&name, (quantity, "mm/s"), found * MM, ours.0 * MM);
        rows.push(&name, ("c/(γ·p·β)", "mm/s"), [None, Some(formula * MM), None]);
        let deviation = (found / formula - 1.0).abs();
        rows.push(&name, ("deviation from c/(γ·p·β)", "1"), [None, Some(deviation), None]);
    }
    Ok(())
}

fn noise(rows: &mut TableRows) -> Result<(), ReproduceError> {
    let [paper, ours] =
        [AdaptationMethod::Paper, AdaptationMethod::Ours].map(experiments::command_noise);
    let what = ("noise of ṁ over that of v̄1", "kg/m");
    rows.compare("white noise on v̄1, 100 Hz", what, paper?, ours?);
    Ok(())
}

/// One of the paper's case studies, with all three controllers.
struct Study {
    name: &'static str,
    /// The sub-system that is disturbed.
    part: usize,
    experiment: fn(AdaptationMethod, StrandParameters) -> StrandExperiment,
}

/// The response with one controller, thinned for drawing.
#[derive(Default)]
struct StudyTrace {
    speed: Vec<CurvePoint>,
    error: Vec<CurvePoint>,
    estimate: Vec<CurvePoint>,
    unknown: Vec<CurvePoint>,
    /// Magnitude of the error at the end of the disturbance.
    end_mm_per_s: f64,
    largest_mm_per_s: f64,
    other_mm_per_s: f64,
}

impl Study {
    fn show(&self, rows: &mut TableRows) -> Result<Section, ReproduceError> {
        let linear = self.all(StrandParameters::Constant)?;
        let real = self.all(StrandParameters::WithInputs(experiments::operating_point()))?;
        self.rows(&linear, "", rows);
        self.rows(&real, ", parameters with the inputs", rows);
        let hint = "The disturbance begins at 30 s and ends at 60 s. Constant parameters, eqs. (6) \
                    and (7).";
        Ok(Section::new(self.name, hint, self.draw(&linear)))
    }

    fn rows(&self, [fixed, paper, ours]: &[StudyTrace; 3], plant: &str, rows: &mut TableRows) {
        let name = format!("{}{plant}", self.name);
        let end = "error at the end of it";
        let without = format!("{name}, not adaptive");
        rows.push(without, (end, "mm/s"), [None, Some(fixed.end_mm_per_s), None]);
        let mut push = |quantity, of: fn(&StudyTrace) -> f64| {
            rows.compare(&name, (quantity, "mm/s"), of(paper), of(ours));
        };
        push(end, |trace| trace.end_mm_per_s);
        push("largest error", |trace| trace.largest_mm_per_s);
        push("largest error, other sub-system", |trace| trace.other_mm_per_s);
    }

    fn all(&self, parameters: StrandParameters) -> Result<[StudyTrace; 3], ReproduceError> {
        let [a, b, c] = METHODS.map(|method| self.trace(method, parameters));
        Ok([a?, b?, c?])
    }

    fn trace(
        &self,
        method: AdaptationMethod,
        parameters: StrandParameters,
    ) -> Result<StudyTrace, ReproduceError> {
        let mut trace = StudyTrace::default();
        let mut count = 0_u64;
        (self.experiment)(method, parameters).run(|sample| {
            trace.observe(sample, self.part);
            if count.is_multiple_of(DRAWN_EVERY) {
                trace.draw(sample, self.part);
            }
            count += 1;
        })?;
        Ok(trace)
    }

    fn draw(&self, traces: &[StudyTrace; 3]) -> Markup {
        let (speed, unit) = [("v̄1 [mm/s]", "Δ1 [g/s]"), ("ū3 [mm/s]", "Δ3 [mm/s]")][self.part];
        let error = ["e1 [mm/s]", "e3 [mm/s]"][self.part];
        let inks = [palette::DEMAND, palette::PAPER, palette::OURS];
        let plot = |y_title, target: Line<'_>, of: fn(&StudyTrace) -> &[CurvePoint]| {
            let found = traces.iter().zip(inks);
            let found = found.map(|(trace, ink)| Line::curve("", ink, of(trace).iter().copied()));
            let lines: Vec<Line<'_>> = std::iter::once(target).chain(found).collect();
            let Some(range) = lines[1].extent() else { return html! {} };
            plot(Area::wide(220.0), &XAxis::time(range), y_title, &lines, &[])
        };
        let level = |value| Line::level("", palette::TARGET, value, "");
        let truth = Line::demand("", palette::TARGET, traces[0].unknown.iter().copied());
        html! {
            (legend(&[
                ("not adaptive", palette::DEMAND, ""),
                ("the paper's controller", palette::PAPER, ""),
                ("ours", palette::OURS, ""),
                ("wanted, or true", palette::TARGET, "dash"),
            ]))
            (plot(speed, level(50.0), |trace| &trace.speed))
            (plot(error, level(0.0), |trace| &trace.error))
            (plot(unit, truth, |trace| &trace.estimate))
        }
    }
}

impl StudyTrace {
    fn observe(&mut self, sample: &StrandSample, part: usize) {
        let [own, other] = [part, 1 - part].map(|part| sample.actions[part].error.abs() * MM);
        self.largest_mm_per_s = self.largest_mm_per_s.max(own);
        self.other_mm_per_s = self.other_mm_per_s.max(other);
        if sample.t_s < END_S {
            self.end_mm_per_s = own;
        }
    }

    fn draw(&mut self, sample: &StrandSample, part: usize) {
        let action = &sample.actions[part];
        let at = |value: f64| (sample.t_s, value * MM);
        self.speed.push(at(sample.speeds[part]));
        self.error.push(at(action.error));
        self.estimate.push(at(action.estimate));
        self.unknown.push(at(sample.unknown[part]));
    }
}
