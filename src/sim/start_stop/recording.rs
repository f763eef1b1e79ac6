//! Recordings of starts and stops, as `identify` is given them.

use super::melt::{Machine, Melt};
use crate::identify::series::Series;
use crate::sim::hash::{mix, normal_pair};

const SENSOR: u64 = 0x7365_6e73;

/// What is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Pauses of the pump, in their order \[s\].
    pub idle_s: Vec<f64>,
    /// How long the pump runs between them \[s\].
    pub runs_s: f64,
    /// Flow for each unit of the command \[mm³/s per rpm\].
    pub mm3_per_s_per_rpm: f64,
    /// From one sample of the flow to the next \[s\].
    pub step_s: f64,
    /// Standard deviation of the sensor \[mm³/s\].
    pub sensor_mm3_per_s: f64,
}

/// Command \[rpm\] and flow \[mm³/s\] of a machine that runs, pauses and runs
/// again.
pub fn record(machine: Machine, seed: u64, plan: &Recording) -> [Series; 2] {
    let mut melt = Melt::flowing(machine, seed);
    let mut command = Series::new("command_rpm", true);
    let mut flow = Series::new("flow_mm3_per_s", false);
    let runs_rpm = machine.flow_mm3_per_s / plan.mm3_per_s_per_rpm;
    command.push(0.0, runs_rpm);
    let mut logged = 0_u32;
    let mut go_on = |melt: &mut Melt, until_s: f64| {
        while melt.now_s() < until_s {
            let (dt_s, came_mm3) = melt.advance();
            if melt.now_s() >= f64::from(logged) * plan.step_s {
                let [fresh, _] = normal_pair(mix(&[seed, SENSOR, u64::from(logged)]));
                flow.push(melt.now_s(), came_mm3 / dt_s + plan.sensor_mm3_per_s * fresh);
                logged += 1;
            }
        }
    };
    go_on(&mut melt, plan.runs_s);
    for idle_s in &plan.idle_s {
        for (rpm, lasts_s) in [(0.0, *idle_s), (runs_rpm, plan.runs_s)] {
            let now_s = melt.now_s();
            command.push(now_s, rpm);
            melt.command(rpm * plan.mm3_per_s_per_rpm);
            go_on(&mut melt, now_s + lasts_s);
        }
    }
    [command, flow]
}
