//! A start-stop model as text.

use super::StartStudy;
use crate::identify::digits::three_digits;
use crate::identify::start_stop::file::{ParameterKey, START_PARAMETERS, STOP_PARAMETERS};
use crate::report::identify::table::{put, significant};

/// Pauses for which the delay is printed \[s\].
const SHOWN_PAUSES_S: [f64; 4] = [1.0, 10.0, 60.0, 200.0];

/// A short table.
pub fn text(study: &StartStudy) -> String {
    let mut text = String::new();
    data(&mut text, study);
    let line = format!("{:<24}{:>12}{:>14}  {}", "", "value", "std. error", "unit");
    put(&mut text, "start", &line);
    parameters(&mut text, study, &START_PARAMETERS);
    put(&mut text, "stop", &line);
    parameters(&mut text, study, &STOP_PARAMETERS);
    meaning(&mut text, study);
    for warning in &study.warnings {
        put(&mut text, "warning", warning);
    }
    text
}

fn data(text: &mut String, study: &StartStudy) {
    let (logs, seen) = (&study.logs, &study.file.data);
    let lasts_s = |series: &crate::identify::series::TimeSeries| {
        series.time_s.last().zip(series.time_s.first()).map_or(0.0, |(last, first)| last - first)
    };
    let line = format!(
        "{}: {} samples, {:.1} s; {} runs of the pump",
        logs.source,
        logs.flow.len(),
        lasts_s(&logs.flow),
        study.fit.runs
    );
    put(text, "data", &line);
    put(text, "input", &logs.input.to_string());
    put(text, "output", &logs.output.to_string());
    let [shortest_s, longest_s] = seen.idle_range_s.map(three_digits);
    let [least, most] = seen.flow_range_mm3_per_s.map(three_digits);
    let (starts, left_out) = (seen.starts, study.left_out());
    let line = format!(
        "{starts} after pauses of {shortest_s} to {longest_s} s, to {least} to {most} mm³/s"
    );
    put(text, "starts", &line);
    if left_out > 0 {
        let line = format!(
            "{left_out} left out: the pump ran when the record began, the run after it was too short \
             or uneven, or samples are missing"
        );
        put(text, "", &line);
    }
    put(text, "stops", &seen.stops.to_string());
}

fn parameters(text: &mut String, study: &StartStudy, list: &[ParameterKey]) {
    for one in list {
        let [value, sigma] =
            [&study.fit.parameters, &study.fit.sigma].map(|of| significant((one.of)(of)));
        put(text, "", &format!("{:<24}{value:>12}{sigma:>14}  {}", one.key, one.unit));
    }
}

/// Explains the parameters by their effect on a bead of the log.
fn meaning(text: &mut String, study: &StartStudy) {
    let (of, flow) = (&study.fit.parameters, study.flow_mm3_per_s());
    let [_, longest_s] = study.file.data.idle_range_s;
    let seen = SHOWN_PAUSES_S.iter().filter(|idle_s| **idle_s <= longest_s);
    let given = |idle_s: &f64| format!("{:.2} s after {idle_s} s", of.delay_s(*idle_s, flow));
    let delays: Vec<String> = seen.map(given).collect();
    put(text, "first flow", &format!("at {} mm³/s: {}", three_digits(flow), delays.join(", ")));
    put(text, "sigma", &format!("{:.4} s of the delays about the model", study.fit.delay_sigma_s));
    let line = format!(
        "{} mm³ come after the command to stop; the flow is down to a tenth {:.2} s after it",
        three_digits(flow * of.total_after_stop_s()),
        of.falls_to_s(0.1)
    );
    put(text, "after it", &line);
}
