//! The verdict in words, and the figures at the top of the page.

use maud::{Markup, html};

use crate::extruder::ExtruderFault;
use crate::report::html::{VerdictLevel, number};
use crate::rows::names::{extruder_fault, in_words, wrong_offset_in_words};
use crate::rows::summary::{ControlSummary, ExtruderSummary, ProfileSummary, Summary};

/// Width error above which the verdict mentions it, as a fraction of the target.
const FAR_OFF_ERROR: f64 = 0.05;
/// Fraction of the time above which the verdict mentions a limit.
const LONG_LIMITED_FRACTION: f64 = 0.10;

/// The verdict on a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Its level.
    pub level: VerdictLevel,
    /// A few sentences.
    pub text: String,
}

/// Judges a run. `max_rejected_fraction` is the cell's limit of rejected frames.
pub fn verdict(summary: &Summary, max_rejected_fraction: f64) -> Verdict {
    let mut level = VerdictLevel::Good;
    let mut sentences = vec![width_sentence(summary)];
    if summary.measured == 0 {
        level = VerdictLevel::Bad;
    } else if summary.rejected_fraction() > max_rejected_fraction {
        level = VerdictLevel::Caution;
    }
    sentences.push(rejected_sentence(summary, max_rejected_fraction));
    if let Some(control) = &summary.control {
        let (control_level, more) = control_sentences(control);
        level = level.max(control_level);
        if control.width_error_rms_settled_mm.is_none() && !is_excited(summary) {
            level = level.max(VerdictLevel::Caution);
        }
        sentences.extend(more);
        if let Some(sentence) = far_off(control, summary) {
            level = level.max(VerdictLevel::Caution);
            // Directly after the sentence about the width.
            sentences.insert(1, sentence);
        }
        if let Some(tolerance) = &control.tolerance
            && let Some(words) = tolerance.words()
        {
            if tolerance.is_exceeded() {
                level = level.max(VerdictLevel::Caution);
            }
            sentences.push(format!("By length, {words}."));
        }
    }
    if let Some(extruder) = &summary.extruder {
        let more = extruder_sentences(extruder);
        if !more.is_empty() {
            level = level.max(VerdictLevel::Caution);
        }
        sentences.extend(more);
        if let Some(profile) = &extruder.profile {
            let (profile_level, sentence) = profile_sentence(profile);
            level = level.max(profile_level);
            sentences.push(sentence);
        }
    }
    Verdict { level, text: sentences.join(" ") }
}

fn width_sentence(summary: &Summary) -> String {
    let Some(mean) = summary.width_mean_mm else {
        return "No width was measured.".to_string();
    };
    let spread = summary
        .width_std_mm
        .map_or(String::new(), |std| format!(", with a standard deviation of {std:.3} mm"));
    if is_excited(summary) {
        return format!(
            "A profile moved the extruder, and with it the bead: {mean:.3} mm wide on average{spread}."
        );
    }
    match (&summary.control, summary.target_width_mm) {
        (Some(control), Some(target)) => held_sentence(control, target),
        (_, Some(target)) => format!(
            "The bead is {mean:.3} mm wide on average{spread}; {} than its target of {target} mm.",
            more_or_less(mean - target)
        ),
        _ => format!("The bead is {mean:.3} mm wide on average{spread}."),
    }
}

/// Whether the extruder played a profile, which changes the width intentionally.
fn is_excited(summary: &Summary) -> bool {
    summary.extruder.as_ref().is_some_and(|extruder| extruder.profile.is_some())
}

fn more_or_less(difference: f64) -> String {
    let word = if difference < 0.0 { "narrower" } else { "wider" };
    format!("{:.3} mm {word}", difference.abs())
}

fn held_sentence(control: &ControlSummary, target: f64) -> String {
    match (control.width_error_rms_settled_mm, control.width_error_rms_mm) {
        (Some(settled), _) => format!(
            "Once settled, the bead was held at {target} mm with an error of {settled:.2} mm RMS."
        ),
        (None, Some(rms)) => format!(
            "The error from {target} mm is {rms:.2} mm RMS over the bead laid under control; the \
             run was too short to say how well it settles."
        ),
        (None, None) => format!(
            "No bead laid under control was measured, so nothing can be said of how well \
             {target} mm were held."
        ),
    }
}

fn rejected_sentence(summary: &Summary, max_rejected_fraction: f64) -> String {
    let percent = (1.0 - summary.rejected_fraction()) * 100.0;
    let frames = summary.frames_with_bead();
    let of_bead = if frames == summary.frames { "" } else { " that could show bead" };
    if summary.frames == 0 {
        "There was no frame at all.".to_string()
    } else if frames == 0 {
        "No frame could show bead: none was laid.".to_string()
    } else if summary.rejected_fraction() > max_rejected_fraction {
        format!(
            "Only {percent:.1} % of {frames} frames{of_bead} were measured; the cell's limit is {:.0} %.",
            (1.0 - max_rejected_fraction) * 100.0
        )
    } else {
        format!("{percent:.1} % of {frames} frames{of_bead} were measured.")
    }
}

/// Sentence about an error above a twentieth of the target, after settling or over the whole bead;
/// otherwise about a limit that acted for more than a tenth of the run. `None` without either.
fn far_off(control: &ControlSummary, summary: &Summary) -> Option<String> {
    let (error, target) = (control.width_error_rms_settled_mm?, summary.target_width_mm?);
    let fraction = control.limited_s / summary.duration_s.unwrap_or(f64::INFINITY);
    let far_off = if is_excited(summary) {
        None
    } else if error > FAR_OFF_ERROR * target {
        Some(format!("That is {:.0} % of the target.", 100.0 * error / target))
    } else {
        far_off_before(control, target)
    };
    let limited =
        || format!("The robot stood at a limit for {:.0} % of the time.", 100.0 * fraction);
    far_off.or_else(|| (fraction > LONG_LIMITED_FRACTION).then(limited))
}

/// Sentence about the error over all bead laid under control, including the settling.
fn far_off_before(control: &ControlSummary, target: f64) -> Option<String> {
    let (rms, worst) = (control.width_error_rms_mm?, control.width_error_worst?);
    (rms > FAR_OFF_ERROR * target).then(|| {
        format!(
            "Over all bead laid under control the error is {rms:.2} mm RMS, {:.0} % of the target; \
             at worst {:+.2} mm, at {:.0} mm of the path.",
            100.0 * rms / target,
            worst.error_mm,
            worst.bead_path_mm
        )
    })
}

/// Sentences about faults, holds and limits of the extruder side; empty if there were none.
fn extruder_sentences(extruder: &ExtruderSummary) -> Vec<String> {
    let total: f64 = extruder.states_s.values().sum();
    let mut sentences = Vec::new();
    if extruder.fault_reasons.contains_key(&extruder_fault(ExtruderFault::RunsOn)) {
        sentences.push("The pump ran although it was commanded to stop.".to_owned());
    }
    for (why, seconds) in &extruder.held_for_s {
        let why = in_words(why);
        sentences.push(format!("The extruder kept its last command for {seconds:.1} s ({why})."));
    }
    let limited = extruder.limited_by_s.iter().map(|(limit, s)| (limit, s / total.max(1e-9)));
    for (limit, fraction) in limited.filter(|(_, fraction)| *fraction > LONG_LIMITED_FRACTION) {
        sentences.push(format!(
            "The extruder's command stood at a limit for {:.0} % of the time ({limit}).",
            100.0 * fraction
        ));
    }
    let kept = extruder.flow_controlled;
    if let (Some(error), Some(mean)) = (kept.error_mean_mm3_per_s, kept.mean_mm3_per_s)
        && error.abs() > FAR_OFF_ERROR * mean.abs().max(1e-9)
    {
        sentences.push(format!(
            "The flow was {error:+.1} mm³/s off on average after control began, {mean:.1} mm³/s \
             flowed."
        ));
    }
    sentences
}

/// Whether a profile was played to its end, and whether the bead was longer.
fn profile_sentence(profile: &ProfileSummary) -> (VerdictLevel, String) {
    let ProfileSummary { duration_s, played_fraction, after_end_s } = *profile;
    let sentence = if played_fraction < 1.0 {
        format!(
            "The bead ended before the profile: {:.1} % of its {duration_s:.1} s were played.",
            100.0 * played_fraction
        )
    } else {
        format!(
            "The profile of {duration_s:.1} s was played to its end; bead was laid for \
             {after_end_s:.1} s more, with its last command."
        )
    };
    (VerdictLevel::with_caution(played_fraction < 1.0), sentence)
}

fn control_sentences(control: &ControlSummary) -> (VerdictLevel, Vec<String>) {
    let mut level = VerdictLevel::Good;
    let mut sentences = Vec::new();
    if control.faults > 0 {
        level = VerdictLevel::Bad;
        let why: Vec<String> = control.fault_reasons.keys().map(|name| in_words(name)).collect();
        let times = if control.faults == 1 { "once" } else { "more than once" };
        sentences
            .push(format!("The controller stopped with a fault {times} ({}).", why.join(", ")));
    } else {
        sentences.push("There was no fault.".to_string());
    }
    if control.width_error_rms_mm.is_none() {
        level = level.max(VerdictLevel::Caution);
    }
    // A hold while the run ends is no disturbance.
    let held: f64 =
        control.held_for_s.iter().filter(|(why, _)| **why != "stopping").map(|(_, s)| s).sum();
    if held >= 0.05 {
        level = level.max(VerdictLevel::Caution);
        sentences.push(format!("Control held for {held:.1} s."));
    }
    if control.limited_s >= 0.05 {
        sentences.push(format!("Speed limited for {:.1} s.", control.limited_s));
    }
    if let Some(wrong) = control.wrong_offset {
        level = level.max(VerdictLevel::Caution);
        sentences.push(format!("A warning: {}.", wrong_offset_in_words(wrong)));
    }
    if control.records_lost > 0 {
        level = level.max(VerdictLevel::Caution);
        sentences.push(format!("{} records were lost.", control.records_lost));
    }
    (level, sentences)
}

/// The figures as tiles.
pub fn tiles(summary: &Summary) -> Markup {
    let percent = (1.0 - summary.rejected_fraction()) * 100.0;
    let measured = if summary.frames == 0 { None } else { Some(percent) };
    html! {
        div.tiles {
            (tile("frames", &summary.frames.to_string(), "", &duration(summary)))
            (tile("measured", &number(measured, 1), "%", &format!("{} refused", summary.frames - summary.measured)))
            (tile("width", &number(summary.width_mean_mm, 2), "mm", &spread(summary)))
            @if let Some(control) = &summary.control {
                (tile("error, settled", &number(control.width_error_rms_settled_mm, 2), "mm RMS",
                    &format!("{} mm RMS over all", number(control.width_error_rms_mm, 2))))
                (tile("faults", &control.faults.to_string(), "", &format!("held {:.1} s, limited {:.1} s", control.held_s, control.limited_s)))
                @if control.latency_ms.p99.is_some() {
                    (tile("latency, 99 %", &number(control.latency_ms.p99, 2), "ms",
                        &format!("median {}, longest {}", number(control.latency_ms.p50, 2), number(control.latency_ms.max, 2))))
                }
                @if let Some(extruder) = &summary.extruder && extruder.flow_mean_mm3_per_s.is_some() {
                    (tile("flow", &number(extruder.flow_controlled.mean_mm3_per_s.or(extruder.flow_mean_mm3_per_s), 0), "mm³/s",
                        &format!("{} mm³/s RMS from the demand since control began", number(extruder.flow_controlled.error_rms_mm3_per_s, 0))))
                }
            } @else {
                (tile("uncertainty", &number(summary.sigma_mean_mm, 3), "mm", "mean standard deviation"))
                (tile("contrast", &number(summary.image_quality.contrast_median_grey, 0), "grey levels", "median, of 256"))
                (tile("blur", &number(summary.image_quality.blur_median_px, 2), "px", "median"))
            }
        }
    }
}

fn tile(name: &str, value: &str, unit: &str, small: &str) -> Markup {
    html! {
        div.tile {
            div.name { (name) }
            div.value { (value) @if !unit.is_empty() { span.unit { " " (unit) } } }
            div.small { (small) }
        }
    }
}

fn duration(summary: &Summary) -> String {
    summary.duration_s.map_or(String::new(), |secs| match secs {
        long if long >= 120.0 => format!("in {:.1} min", long / 60.0),
        short => format!("in {short:.1} s"),
    })
}

fn spread(summary: &Summary) -> String {
    let std = format!("± {}", number(summary.width_std_mm, 2));
    match summary.target_width_mm {
        Some(target) => format!("{std}, target {target} mm"),
        None => format!("{std} mm from frame to frame"),
    }
}
