//! `plan.csv`: robot and extruder at each time of a plan.

use super::{PlanFacts, PlannedBead};

/// Time between rows \[s\]; each point of the job has an additional row.
const STEP_S: f64 = 0.01;
/// Distance to the row of a point below which a row of the even grid is left out \[s\].
const CORNER_STEP_S: f64 = 1e-3;

/// The table of all beads. The time of each bead begins at 0.
pub fn to_csv(beads: &[PlannedBead], facts: &PlanFacts) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let command = format!("command_{}", facts.unit.word());
    let head = "bead,time_s,path_mm,x_mm,y_mm,z_mm,speed_mm_per_s,nominal_speed_mm_per_s";
    writer.write_record(head.split(',').chain([&command, "flow_mm3_per_s", "width_mm"]))?;
    for (number, bead) in (1_u32..).zip(beads) {
        for time_s in moments(bead) {
            writer.write_record(row(number, bead, time_s, facts))?;
        }
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// Times of the rows \[s\]: those of the job's points, and an even grid between them.
fn moments(bead: &PlannedBead) -> Vec<f64> {
    let end_s = bead.plan.speed.duration_s();
    let points = bead.position.iter().map(|(path_mm, _)| bead.plan.speed.time_at(*path_mm));
    let mut fixed: Vec<f64> = points.map(|time_s| time_s.clamp(0.0, end_s)).collect();
    fixed.extend([0.0, end_s]);
    fixed.sort_by(f64::total_cmp);
    fixed.dedup_by(|later, earlier| *later - *earlier < CORNER_STEP_S);
    let even = (1_u32..).map(|k| STEP_S * f64::from(k)).take_while(|time_s| *time_s < end_s);
    let mut all: Vec<f64> = even.filter(|time_s| !beside(&fixed, *time_s)).collect();
    all.extend(fixed);
    all.sort_by(f64::total_cmp);
    all
}

fn beside(fixed: &[f64], time_s: f64) -> bool {
    let after = fixed.partition_point(|point| *point < time_s);
    let near =
        |at: usize| fixed.get(at).is_some_and(|point| (point - time_s).abs() < CORNER_STEP_S);
    near(after) || (after > 0 && near(after - 1))
}

fn row(number: u32, bead: &PlannedBead, time_s: f64, facts: &PlanFacts) -> [String; 11] {
    let path_mm = bead.plan.speed.path_at(time_s).min(bead.nominal.end_mm());
    let [x, y, z] = position_at(&bead.position, path_mm);
    let width = fraction_at(&bead.planned.width, path_mm)
        .map_or_else(String::new, |error| format!("{:.4}", facts.width_mm * (1.0 + error)));
    let (speed, nominal) = (bead.plan.speed.speed_at(path_mm), bead.nominal.speed_at(path_mm));
    let command = bead.plan.command_at(time_s) + facts.idle;
    let [time, path, x, y, z, speed, nominal, command] =
        [time_s, path_mm, x, y, z, speed, nominal, command].map(|value| format!("{value:.6}"));
    let flow = format!("{:.4}", bead.planned.flow_at(time_s));
    [number.to_string(), time, path, x, y, z, speed, nominal, command, flow, width]
}

/// Position at a path length \[mm\]: a straight line between two points of the job.
fn position_at(position: &[(f64, [f64; 3])], path_mm: f64) -> [f64; 3] {
    let after = position.partition_point(|(at, _)| *at < path_mm);
    let last = position.last().map_or([0.0; 3], |(_, point)| *point);
    let Some((to_mm, to)) = position.get(after) else { return last };
    let Some((from_mm, from)) = after.checked_sub(1).and_then(|at| position.get(at)) else {
        return *to;
    };
    let fraction = (path_mm - from_mm) / (to_mm - from_mm);
    std::array::from_fn(|axis| from[axis] + fraction * (to[axis] - from[axis]))
}

/// Width error at a path length; `None` within half a nozzle of the ends, where the mean is not
/// complete.
fn fraction_at(width: &[(f64, f64)], path_mm: f64) -> Option<f64> {
    let after = width.partition_point(|(at, _)| *at < path_mm);
    let (to_mm, to) = width.get(after)?;
    let (from_mm, from) = width.get(after.checked_sub(1)?)?;
    Some(from + (path_mm - from_mm) / (to_mm - from_mm) * (to - from))
}
