//! Mohammadi Looey et al. 2026 beside its table 1 and its case studies.

use maud::{Markup, html};

use super::strand::StrandParameters;
use super::{
    AdaptationMethod, RAMPS_PER_S, StrandExperiment, StrandSample, SubSystem, TABLE, TableCase,
};
use crate::io::progress::Progress;
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette;
use crate::report::chart::plot::{Plot, PlotLayer as Drawn, y_range};
use crate::report::chart::series::Curve;
use crate::studies::error::ReproduceError;

use crate::studies::looey2026 as experiments;
use crate::studies::publication::Publication;
use crate::studies::study::{Effort, Reproduced, Section, TableRows};

/// What progress is told of.
pub const EXPERIMENTS: u64 = 14;
const METHODS: [AdaptationMethod; 3] =
    [AdaptationMethod::NotAdaptive, AdaptationMethod::Paper, AdaptationMethod::Ours];
/// Every so many milliseconds is drawn.
const DRAWN_EVERY: u64 = 20;
/// When the disturbances of the case studies end \[s\].
const END_S: f64 = 60.0;
const MM: f64 = 1000.0;

/// Runs the experiments; none has noise that needs more than one seed.
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
    let plate = Study { name: "plate speed −40 %", part: 1, experiment: experiments::plate_step };
    let feed = Study {
        name: "feed falls by 0.5 g/s each second",
        part: 0,
        experiment: experiments::feed_ramp,
    };
    let mut sections = Vec::new();
    for study in [plate, feed] {
        sections.push(study.show(&mut rows)?);
        progress.advance();
    }
    Ok(Reproduced {
        title: "Mohammadi Looey et al. 2026",
        about: "The paper gives no gains and no parameters. Sub-system 1 was fitted to cases 1 to \
                5; cases 6 to 10, whose step cannot be in m/s as printed (here: percent of the \
                plate's speed) and whose 31.00 s are the end of the horizon, fit no linear model: \
                what a sub-system 3 with parameters of our own does stands beside them and claims \
                nothing. Ours learns the uncertainty's slope as well, with all poles of the error \
                at −2.2/s; what that costs in noise of the command is in the table."
            .to_owned(),
        rows: rows.into_vec(),
        sections,
    })
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
    let (paper, ours) = (
        experiments::ramp_errors(AdaptationMethod::Paper)?,
        experiments::ramp_errors(AdaptationMethod::Ours)?,
    );
    let names = [
        (format!("ramp of {} kg/s² in the feed", RAMPS_PER_S[0]), "e1 that stays"),
        (format!("ramp of {} m/s² in the plate", RAMPS_PER_S[1]), "e3 that stays"),
    ];
    for (((name, quantity), paper), ours) in names.into_iter().zip(paper).zip(ours) {
        let (found, formula) = paper;
        rows.push(&name, (quantity, "mm/s"), [None, Some(found * MM), Some(ours.0 * MM)]);
        rows.push(&name, ("c/(γ·p·β)", "mm/s"), [None, Some(formula * MM), None]);
        let deviation = (found / formula - 1.0).abs();
        rows.push(&name, ("deviation from c/(γ·p·β)", "1"), [None, Some(deviation), None]);
    }
    Ok(())
}

fn noise(rows: &mut TableRows) -> Result<(), ReproduceError> {
    let found = [AdaptationMethod::Paper, AdaptationMethod::Ours].map(experiments::command_noise);
    let [paper, ours] = found;
    let what = ("noise of ṁ over that of v̄1", "kg/m");
    rows.push("white noise on v̄1, 100 Hz", what, [None, Some(paper?), Some(ours?)]);
    Ok(())
}

/// One of the paper's case studies with all three laws.
struct Study {
    name: &'static str,
    /// The sub-system that is disturbed.
    part: usize,
    experiment: fn(AdaptationMethod, StrandParameters) -> StrandExperiment,
}

/// What a law did, thinned for drawing.
#[derive(Default)]
struct StudyTrace {
    speed: Vec<(f64, f64)>,
    error: Vec<(f64, f64)>,
    estimate: Vec<(f64, f64)>,
    unknown: Vec<(f64, f64)>,
    /// Size of the error at the end of the disturbance.
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
        Ok(Section {
            heading: self.name.to_owned(),
            hint: "The disturbance begins at 30 s and ends at 60 s. Constant parameters, eqs. (6) \
                   and (7)."
                .to_owned(),
            drawing: self.draw(&linear),
        })
    }

    fn rows(&self, [fixed, paper, ours]: &[StudyTrace; 3], plant: &str, rows: &mut TableRows) {
        let name = format!("{}{plant}", self.name);
        let end = ("error at the end of it", "mm/s");
        let without = format!("{name}, not adaptive");
        rows.push(without, end, [None, Some(fixed.end_mm_per_s), None]);
        let mut push = |quantity, of: fn(&StudyTrace) -> f64| {
            rows.push(&name, (quantity, "mm/s"), [None, Some(of(paper)), Some(of(ours))]);
        };
        push(end.0, |course| course.end_mm_per_s);
        push("largest error", |course| course.largest_mm_per_s);
        push("largest error, other sub-system", |course| course.other_mm_per_s);
    }

    fn all(&self, parameters: StrandParameters) -> Result<[StudyTrace; 3], ReproduceError> {
        let [a, b, c] = METHODS.map(|method| self.course(method, parameters));
        Ok([a?, b?, c?])
    }

    fn course(
        &self,
        method: AdaptationMethod,
        parameters: StrandParameters,
    ) -> Result<StudyTrace, ReproduceError> {
        let mut course = StudyTrace::default();
        let mut count = 0_u64;
        (self.experiment)(method, parameters).run(|moment| {
            course.see(moment, self.part);
            if count.is_multiple_of(DRAWN_EVERY) {
                course.draw(moment, self.part);
            }
            count += 1;
        })?;
        Ok(course)
    }

    fn draw(&self, [fixed, paper, ours]: &[StudyTrace; 3]) -> Markup {
        let (speed, unit) = [("v̄1 [mm/s]", "Δ1 [g/s]"), ("ū3 [mm/s]", "Δ3 [mm/s]")][self.part];
        let pick = |of: fn(&StudyTrace) -> &Vec<(f64, f64)>| {
            [fixed, paper, ours].map(|course| of(course).iter().copied().collect::<Curve>())
        };
        let truth: Curve = fixed.unknown.iter().copied().collect();
        let error = ["e1 [mm/s]", "e3 [mm/s]"][self.part];
        html! {
            (legend(&[
                ("not adaptive", palette::DEMAND, ""),
                ("the paper's controller", palette::PAPER, ""),
                ("ours", palette::OURS, ""),
                ("wanted, or true", palette::TARGET, "dash"),
            ]))
            (plot(speed, &pick(|c| &c.speed), &Wanted::Level(50.0)))
            (plot(error, &pick(|c| &c.error), &Wanted::Level(0.0)))
            (plot(unit, &pick(|c| &c.estimate), &Wanted::Course(&truth)))
        }
    }
}

impl StudyTrace {
    fn see(&mut self, moment: &StrandSample, part: usize) {
        let [own, other] = [part, 1 - part].map(|part| moment.actions[part].error.abs() * MM);
        self.largest_mm_per_s = self.largest_mm_per_s.max(own);
        self.other_mm_per_s = self.other_mm_per_s.max(other);
        if moment.t_s < END_S {
            self.end_mm_per_s = own;
        }
    }

    fn draw(&mut self, moment: &StrandSample, part: usize) {
        let action = &moment.actions[part];
        let at = |value: f64| (moment.t_s, value * MM);
        self.speed.push(at(moment.speeds[part]));
        self.error.push(at(action.error));
        self.estimate.push(at(action.estimate));
        self.unknown.push(at(moment.unknown[part]));
    }
}

/// What the courses should be.
enum Wanted<'a> {
    Level(f64),
    Course(&'a Curve),
}

fn plot(y_title: &str, [fixed, paper, ours]: &[Curve; 3], wanted: &Wanted<'_>) -> Markup {
    let Some(range) = fixed.extent() else { return html! {} };
    let axis = XAxis::time(range);
    let mut shown = vec![fixed, paper, ours];
    let mut levels = Vec::new();
    let mut layers = match wanted {
        Wanted::Level(level) => {
            levels.push(*level);
            vec![Drawn::Level(*level, palette::TARGET, "")]
        }
        Wanted::Course(course) => {
            shown.push(course);
            vec![Drawn::Demand(course, palette::TARGET)]
        }
    };
    layers.extend([
        Drawn::Curve(fixed, palette::DEMAND),
        Drawn::Curve(paper, palette::PAPER),
        Drawn::Curve(ours, palette::OURS),
    ]);
    let y_range = y_range(&shown, &levels);
    Plot { area: Area::wide(220.0), x: &axis, y_title, y_range, layers }.draw()
}
