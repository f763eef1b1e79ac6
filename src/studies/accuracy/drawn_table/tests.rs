use super::*;
use crate::studies::accuracy::drawn::{self, DrawnParameter, DrawnSet};

fn set(name: &str) -> DrawnSet {
    drawn::named(name).remove(0)
}

fn outcome(frame: u32, width: Result<Deviation, FrameRejection>) -> DrawnOutcome {
    let value = 0.5 * libm::exp(f64::from(frame) / 300.0 * libm::log(12.0));
    let roughness = if frame.is_multiple_of(2) { 0.0 } else { 1.0 };
    let parameters = vec![
        DrawnParameter { name: "blur_px", value, range: (0.5, 6.0) },
        DrawnParameter { name: "roughness_px", value: roughness, range: (0.5, 2.0) },
    ];
    DrawnOutcome { frame: frame.into(), parameters, width }
}

fn off(error_px: f64) -> Deviation {
    Deviation { error_px, sigma_px: 0.1 }
}

fn refused(status: &'static str, names_gamma: bool) -> FrameRejection {
    FrameRejection { status, names_gamma }
}

/// Frames whose errors are as their sigma.
fn good() -> Vec<DrawnOutcome> {
    let sign = |frame: u32| if frame % 4 < 2 { 0.1 } else { -0.1 };
    (0..300).map(|frame| outcome(frame, Ok(off(sign(frame))))).collect()
}

#[test]
fn frames_are_counted_within_thirds_and_judged() {
    let set = set("blur");
    let mut outcomes = good();
    let all_kept = figures(&set, &outcomes);
    assert_eq!(all_kept.len(), 1 + 3 + 4);
    assert!(all_kept.iter().all(|part| part.missed.is_empty()), "{all_kept:?}");
    assert_eq!(all_kept[1].frames + all_kept[2].frames + all_kept[3].frames, 300);
    assert_eq!(all_kept[4].part, SetPart::Zero { parameter: "roughness_px" });
    let rough: Vec<usize> = all_kept[4..].iter().map(|part| part.frames).collect();
    assert_eq!(rough, [150, 0, 150, 0]);
    outcomes[299].width = Ok(off(4.0));
    for outcome in &mut outcomes[..40] {
        outcome.width = Err(refused("unsure", true));
    }
    let bad = figures(&set, &outcomes);
    assert_eq!((bad[0].silent, bad[0].worst[0], bad[0].rejected["unsure"]), (1, 299, 40));
    let missed = &bad[0].missed;
    assert!(missed[0].starts_with("measured 86.67") && missed[1].starts_with("z 2."), "{missed:?}");
    assert!(bad[1].missed.is_empty() && !bad[3].missed.is_empty(), "{bad:?}");
    let text = markdown(&[set], &bad);
    assert!(text.contains("blur_px 0.500 to 6.000") && text.contains("MISSED: measured"), "{text}");
}

#[test]
fn refusals_are_judged_by_status_and_words() {
    let mut outcomes = good();
    outcomes[7].width = Err(refused("ambiguous", true));
    assert!(figures(&set("ribs-strong"), &outcomes)[0].missed.is_empty());
    assert!(figures(&set("gamma"), &outcomes)[0].missed.is_empty());
    outcomes[8].width = Err(refused("no_pair", false));
    assert_eq!(figures(&set("ribs-strong"), &outcomes)[0].missed, ["refused otherwise 1"]);
    let missed = figures(&set("gamma"), &outcomes)[0].missed.join("");
    assert_eq!(missed, "refused without a word on gamma 1");
}

#[test]
fn with_all_frames_a_limit_has_no_allowance() {
    let set = set("torn");
    let outcomes = |count: u32| -> Vec<DrawnOutcome> {
        let width = |frame: u32| match frame % 80 {
            0 => Err(refused("unsure", true)),
            _ if frame.is_multiple_of(2) => Ok(off(0.1)),
            _ => Ok(off(-0.1)),
        };
        (0..count).map(|frame| outcome(frame % 300, width(frame))).collect()
    };
    // 98.75 % are measured, 99 % are asked for.
    assert!(figures(&set, &outcomes(3_000))[0].missed.is_empty());
    assert_eq!(figures(&set, &outcomes(30_000))[0].missed, ["measured 98.75 %"]);
}
