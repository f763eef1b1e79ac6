//! The figures that a run prints at its end, and its exit status.

use std::path::Path;
use std::process::ExitCode;

use super::status::WITH_LOSS;
use crate::live::LiveReport;
use crate::live::control::Ending;
use crate::rows::names;
use crate::rows::summary::Summary;
use crate::rows::summary::tolerance::ToleranceSummary;

/// Prints the figures of a run to standard output, and returns its status.
pub fn tell(report: &LiveReport, out: &Path, max_rejected: f64) -> ExitCode {
    print_figures(&report.summary);
    say!("report     {}", out.join("report.html").display());
    match &report.recording {
        Ok(recording) => say!("recording  {}", recording.path.display()),
        Err(incomplete) => tell!("warning: {incomplete}"),
    }
    status(report, max_rejected)
}

/// Prints the figures to standard output.
pub fn print_figures(summary: &Summary) {
    say!("frames     {}, {} measured", summary.frames, summary.measured);
    for (reason, count) in &summary.rejected {
        say!("           {count} {reason}");
    }
    if let (Some(mean), Some(std)) = (summary.width_mean_mm, summary.width_std_mm) {
        say!("width      {mean:.3} mm on average, standard deviation {std:.3} mm");
    }
    for sentence in &summary.advice {
        say!("hint       {sentence}");
    }
    let Some(control) = &summary.control else { return };
    if let Some(target) = summary.target_width_mm {
        say!("target     {target} mm");
    }
    if let (Some(mean), Some(rms)) = (control.width_error_mean_mm, control.width_error_rms_mm) {
        say!("error      {mean:.3} mm mean, {rms:.3} mm RMS as measured, since control began");
    }
    if let Some(worst) = control.width_error_worst {
        say!("worst      {:+.3} mm, at {:.0} mm of the path", worst.error_mm, worst.bead_path_mm);
    }
    if let Some(settled) = control.width_error_rms_settled_mm {
        say!("settled    {settled:.3} mm RMS, from 500 mm after that");
    }
    if let Some(words) = control.tolerance.as_ref().and_then(ToleranceSummary::words) {
        say!("tolerance  {words}");
    }
    if let (Some(p50), Some(p99)) = (control.latency_ms.p50, control.latency_ms.p99) {
        say!("latency    {p50:.2} ms median, {p99:.2} ms p99");
    }
    if let Some(extruder) = &summary.extruder {
        let kept = extruder.flow_controlled;
        if let (Some(error), Some(mean)) = (kept.error_rms_mm3_per_s, kept.mean_mm3_per_s) {
            say!(
                "flow       {mean:.1} mm³/s on average, {error:.1} mm³/s RMS from the demand, \
                 since control began"
            );
        } else if let Some(mean) = extruder.flow_mean_mm3_per_s {
            say!("flow       {mean:.1} mm³/s on average; the width's control did not begin");
        }
    }
    if let Some(profile) = summary.extruder.as_ref().and_then(|extruder| extruder.profile) {
        say!(
            "profile    {:.1} % of {:.1} s played, bead laid for {:.1} s after it",
            100.0 * profile.played_fraction,
            profile.duration_s,
            profile.after_end_s
        );
    }
    if control.robot_reports_ignored > 0 {
        say!(
            "robot      {} reports not used: its own time, on the robot link t_ms, did not rise",
            control.robot_reports_ignored
        );
    }
    if let Some(wrong) = control.wrong_offset {
        say!("offset     {}", names::wrong_offset_in_words(wrong));
    }
    say!("faults     {}", control.faults);
    for (reason, count) in &control.fault_reasons {
        say!("           {count} {}", names::in_words(reason));
    }
}

/// The exit status of a run; prints the reason if it is not 0.
pub fn status(report: &LiveReport, max_rejected: f64) -> ExitCode {
    let faults = report.summary.control.as_ref().map_or(0, |control| control.faults);
    match &report.ending {
        Ending::CameraLost(why) => {
            tell!("error: the camera gives no more frames: {why}");
            return ExitCode::FAILURE;
        }
        Ending::RobotLimits(why) | Ending::ExtruderUnfit(why) => {
            tell!("error: {why}");
            return ExitCode::from(2);
        }
        Ending::RecordingLost(why) => {
            tell!("error: control ended in hold, because the run could not be recorded: {why}");
            return ExitCode::from(WITH_LOSS);
        }
        _ if faults > 0 => {
            let times = if faults == 1 { "once".to_owned() } else { format!("{faults} times") };
            tell!("error: the controller gave up {times}; the run's report says why");
            return ExitCode::FAILURE;
        }
        _ if report.pump_runs => {
            tell!(
                "error: the pump was commanded to stop and did not say that it stops; look at the extruder"
            );
            return ExitCode::FAILURE;
        }
        Ending::Asked | Ending::TimeOver | Ending::LastFrame | Ending::StepsOver => {}
    }
    let control = report.summary.control.as_ref();
    let at_work = |state: &&str| matches!(*state, "priming" | "tracking");
    if control.is_some_and(|control| !control.states_s.keys().any(at_work))
        && report.ending != Ending::Asked
    {
        let connected = control.is_some_and(|control| control.was_connected);
        let why = match report.ending {
            Ending::LastFrame => "the camera's frames ended before the robot printed",
            _ if !connected => {
                "no robot answered; see that it listens where [robot] address says. Nothing was \
                 laid"
            }
            _ => "the robot never printed; start its program. Nothing was laid",
        };
        tell!("warning: {why}, and nothing was controlled");
        return ExitCode::from(WITH_LOSS);
    }
    // A run that is ended early may show little more than the start of the bead; rejected frames
    // are no loss then.
    if report.ending != Ending::Asked
        && let Some(status) = status_of_rejections(&report.summary, max_rejected)
    {
        return status;
    }
    if report.ending != Ending::Asked
        && let Some(status) = status_of_tolerance(&report.summary)
    {
        return status;
    }
    if report.recording.is_err() { ExitCode::from(WITH_LOSS) } else { ExitCode::SUCCESS }
}

/// Warns of a width that was out of tolerance on too much of the length, and returns the status for
/// it.
pub fn status_of_tolerance(summary: &Summary) -> Option<ExitCode> {
    let tolerance = summary.control.as_ref()?.tolerance.as_ref()?;
    tolerance.is_exceeded().then(|| {
        tell!("warning: the width was out of tolerance: {}", tolerance.words().unwrap_or_default());
        ExitCode::from(WITH_LOSS)
    })
}

/// Warns of too many rejected frames, and returns the status for them; `None` if they are few.
pub fn status_of_rejections(summary: &Summary, max_rejected: f64) -> Option<ExitCode> {
    let rejected = summary.rejected_fraction();
    (rejected > max_rejected).then(|| {
        tell!(
            "warning: {:.1} % of the frames were refused, the cell's limit is {:.1} %",
            rejected * 100.0,
            max_rejected * 100.0
        );
        ExitCode::from(WITH_LOSS)
    })
}
