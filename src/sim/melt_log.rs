//! Recordings of starts and stops, as input of `extruder identify`.

use std::fmt::Write as _;

use super::melt::{Melt, MeltParameters};
use crate::identify::series::TimeSeries;
use crate::sim::hash::{mix, normal_pair};

/// Random stream of the sensor. Derived: the bytes of "sens".
const SENSOR_STREAM: u64 = 0x7365_6e73;

/// The commands and the sensor of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingPlan {
    /// Pauses of the pump, in order \[s\].
    pub idle_s: Vec<f64>,
    /// Time for which the pump runs between pauses \[s\].
    pub runs_s: f64,
    /// Flow for each unit of the command \[mm³/s per rpm\].
    pub mm3_per_s_per_rpm: f64,
    /// Sample time of the flow \[s\].
    pub step_s: f64,
    /// Standard deviation of the sensor's noise \[mm³/s\].
    pub sensor_mm3_per_s: f64,
}

/// Command \[rpm\] and flow \[mm³/s\] of a machine that runs, pauses and runs again.
pub fn record(machine: MeltParameters, seed: u64, plan: &RecordingPlan) -> [TimeSeries; 2] {
    let mut melt = Melt::steady(machine, seed);
    let mut command = TimeSeries::new("command_rpm", true);
    let mut flow = TimeSeries::new("flow_mm3_per_s", false);
    let runs_rpm = machine.flow_mm3_per_s / plan.mm3_per_s_per_rpm;
    command.push(0.0, runs_rpm);
    let mut logged = 0_u32;
    let mut go_on = |melt: &mut Melt, until_s: f64| {
        while melt.now_s() < until_s {
            let (dt_s, came_mm3) = melt.advance();
            if melt.now_s() >= f64::from(logged) * plan.step_s {
                let [fresh, _] = normal_pair(mix(&[seed, SENSOR_STREAM, u64::from(logged)]));
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

/// The example of `extruder identify`: 11 starts and stops in nine minutes.
pub fn example() -> RecordingPlan {
    RecordingPlan {
        idle_s: vec![2.0, 30.0, 5.0, 120.0, 1.0, 15.0, 8.0, 60.0, 3.0, 0.5, 240.0],
        runs_s: 6.0,
        mm3_per_s_per_rpm: 10.0,
        step_s: 0.02,
        sensor_mm3_per_s: 8.0,
    }
}

/// Command \[rpm\] and flow \[mm³/s\] as CSV text, a line for each sample of the flow.
pub fn to_csv([command, flow]: &[TimeSeries; 2]) -> String {
    let mut text = "time_s,screw_rpm,flow_mm3_per_s\n".to_owned();
    for (time_s, flow) in flow.time_s.iter().zip(&flow.values) {
        let commands = command.time_s.partition_point(|from_s| from_s <= time_s);
        let rpm = commands.checked_sub(1).and_then(|at| command.values.get(at)).unwrap_or(&0.0);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{time_s:.3},{rpm},{flow:.2}");
    }
    text
}
