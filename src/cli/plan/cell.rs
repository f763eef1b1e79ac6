//! The cell for a plan: model, limits and bead.

use super::arguments::PlanArgs;
use super::bead::{JobBead, wrong_job};
use crate::assembly::extruder::Behaviour;
use crate::assembly::{LoadedCell, extruder};
use crate::cell::extruder::Strategy;
use crate::cell::file::{ExtruderPart, Purpose, RunPart};
use crate::cli::arguments::WrongArguments;
use crate::cli::print::warn;
use crate::extruder::CommandLimits;
use crate::extruder::demand::section;
use crate::identify::model_file as model;
use crate::io::recorder::ExtruderFile;
use crate::numeric::lti::TransferFunction;
use crate::plan;
use crate::report::planned::PlanFacts;

/// Correlation time of the unmodelled flow \[s\]: white noise through a lag of 0.15 s in table 3 of
/// the bead characterisation thesis (papers.md, 001).
const CORRELATION_S: f64 = 0.15;

/// A range of commands, in the unit of the drive.
#[derive(Debug, Clone, Copy)]
pub struct CommandRange {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

/// The part of a cell that a plan needs.
#[derive(Debug)]
pub struct PlannedExtruder {
    /// Name of the cell in messages.
    name: String,
    /// Transfer function from the command, relative to [`PlanFacts::idle`], to the flow \[mm³/s\].
    transfer: TransferFunction,
    /// Limits of the command relative to [`PlanFacts::idle`]; the flow is never negative within
    /// them.
    drive: CommandLimits,
    /// Limits of the command itself.
    command_limits: CommandLimits,
    /// Name of the model and range of its input, if it was identified.
    identified: Option<(String, CommandRange)>,
    /// Largest speed of the robot \[mm/s\].
    pub fastest_mm_per_s: f64,
    /// Largest acceleration of the robot \[mm/s²\].
    pub accel_mm_per_s2: f64,
    /// Length over which the nozzle averages the laid volume \[mm\].
    pub nozzle_mm: f64,
    /// The bead and the command's unit.
    pub facts: PlanFacts,
}

impl PlannedExtruder {
    /// Reads the cell, its model and its limits.
    pub fn read(args: &PlanArgs) -> anyhow::Result<Self> {
        let loaded = LoadedCell::read(&args.cell, Purpose::Run)?;
        let name = loaded.path.display().to_string();
        let absent = |what: &str| wrong!("{name}: {what}");
        let Some(run) = &loaded.cell.run else {
            return Err(absent("found no robot, expected a cell that is ready for run").into());
        };
        let Some(part) = &run.extruder else {
            let what = "[extruder]: found nothing, expected an extruder with a model: strategy = \
                        \"feedforward\"";
            return Err(absent(what).into());
        };
        let Strategy::Feedforward(keys) = &part.extruder.strategy else {
            let what = "extruder.strategy: found one without a model from its command to the \
                        flow, expected \"feedforward\" with model, library or mm3_per_turn";
            return Err(absent(what).into());
        };
        let mut warnings = Vec::new();
        let file = extruder::strategy_file(part, &name, &mut warnings)?;
        warn(&warnings);
        let behaviour = extruder::behaviour(keys, part, &name, file.as_ref())?;
        let identified = identified(file.as_ref())?;
        Self::of(args, (run, part), (name, identified), behaviour)
    }

    fn of(
        args: &PlanArgs,
        (run, part): (&RunPart, &ExtruderPart),
        (name, identified): (String, Option<(String, CommandRange)>),
        behaviour: Behaviour,
    ) -> anyhow::Result<Self> {
        let Behaviour { transfer, operating_point: about } = behaviour;
        if !run.control.target.is_constant() {
            refuse!("{name}: found a target that changes, expected one target_width_mm");
        }
        let target = run.control.target.nominal();
        let area = section(target, part.extruder.layer_height).map_err(WrongArguments::new)?;
        let limits = part.extruder.limits;
        let idle = about.command - about.flow_mm3_per_s / transfer.dc_gain();
        let (min, max) = limits.about(idle).range();
        let drive = CommandLimits::new(min.max(0.0), max, limits.rate_per_s())
            .map_err(|error| wrong!("{name}: [extruder]: {error}"))?;
        Ok(Self {
            name,
            transfer,
            drive,
            command_limits: limits,
            identified,
            fastest_mm_per_s: run.limits.max_speed.get(),
            accel_mm_per_s2: run.limits.max_accel.get(),
            nozzle_mm: args.nozzle_mm.unwrap_or(target.get()),
            facts: PlanFacts {
                width_mm: target.get(),
                area_mm2: area.get(),
                idle,
                unit: part.extruder.drive.unit(),
            },
        })
    }

    /// The task for the planner.
    pub fn task(&self, args: &PlanArgs) -> plan::PlanTask<'_> {
        let robot = plan::RobotMotionLimits {
            accel_mm_per_s2: self.accel_mm_per_s2,
            slowest_mm_per_s: args.apex_mm_per_s,
        };
        plan::PlanTask {
            limits: plan::PlanLimits { robot, drive: self.drive, budget_s: args.budget_s },
            bead: plan::BeadGeometry {
                area_mm2: self.facts.area_mm2,
                nozzle_mm: self.nozzle_mm,
                nozzle_sigma: args.nozzle_sigma,
            },
            unmodelled: plan::FlowUncertainty {
                ratio: args.unmodelled_fraction,
                correlation_s: CORRELATION_S,
            },
            extruder: &self.transfer,
        }
    }

    /// Refuses speeds that robot or extruder cannot reach.
    pub fn check_speeds(
        &self,
        beads: &[JobBead],
        job: &std::path::Path,
    ) -> Result<(), WrongArguments> {
        let squares = || beads.iter().flat_map(|bead| bead.nominal.squares().iter().copied());
        let fastest = squares().fold(0.0, f64::max).sqrt();
        if fastest > self.fastest_mm_per_s * (1.0 + 1e-9) {
            let what = format!(
                "found {fastest:.3} mm/s, expected at most {} mm/s, max_speed_mm_per_s of {}",
                self.fastest_mm_per_s, self.name
            );
            return Err(wrong_job(job, &what));
        }
        let first = beads.iter().filter_map(|bead| bead.nominal.squares().first().copied());
        let slowest = first.fold(f64::INFINITY, f64::min).sqrt();
        for speed in [fastest, slowest] {
            let flow = speed * self.facts.area_mm2;
            let command = flow / self.transfer.dc_gain() + self.facts.idle;
            let (min, max) = self.command_limits.range();
            if command < min || command > max {
                let unit = self.facts.unit;
                let what = format!(
                    "{speed:.3} mm/s take {flow:.1} mm³/s and so {command:.4} {unit}, but \
                     [extruder] of {} allows {min} to {max} {unit}; change the job's speed there",
                    self.name
                );
                return Err(wrong_job(job, &what));
            }
        }
        Ok(())
    }

    /// Warning of commands outside the range of the model's data; `None` if all are within it.
    pub fn beyond(&self, planned: CommandRange) -> Option<String> {
        let (source, CommandRange { min: least, max: most }) = self.identified.as_ref()?;
        let CommandRange { min: low, max: high } = planned;
        let unit = self.facts.unit;
        (low < *least || high > *most).then(|| {
            format!(
                "{source}: it was identified from {least} to {most} {unit}, and the plan has \
                 commands from {low:.4} to {high:.4} {unit}; what it says there is a guess"
            )
        })
    }
}

fn identified(file: Option<&ExtruderFile>) -> anyhow::Result<Option<(String, CommandRange)>> {
    let Some(file) = file else { return Ok(None) };
    let model = model::parse(&file.source, &file.text)?;
    let (min, max) = model.input_range;
    Ok(Some((file.source.clone(), CommandRange { min, max })))
}
