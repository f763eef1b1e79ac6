use crate::report::html::VerdictLevel;
use crate::report::synthetic;
use crate::rows::summary::Summary;

/// Where a person wants to look at the pages: a folder in this variable keeps
/// them.
const KEEP: &str = "TRUEBEAD_TEST_REPORTS";

fn page_of(name: &str, make: fn(&std::path::Path) -> Summary) -> (Summary, String) {
    let temporary = tempfile::tempdir().unwrap();
    let folder = std::env::var_os(KEEP)
        .map_or(temporary.path().to_path_buf(), |keep| std::path::Path::new(&keep).join(name));
    let summary = make(&folder);
    for leftover in std::fs::read_dir(&folder).unwrap() {
        let name = leftover.unwrap().file_name();
        assert!(!name.to_string_lossy().ends_with(".partial"), "{name:?}");
    }
    (summary, std::fs::read_to_string(folder.join("report.html")).unwrap())
}

/// The page without its images, whose base64 text may contain any word, and without its style
/// sheet.
fn text_of(page: &str) -> String {
    let body = page.split_once("</style>").unwrap().1;
    body.split('"').filter(|part| !part.starts_with("data:image/jpeg;base64,")).collect()
}

#[test]
fn a_run_leaves_a_page_that_needs_nothing_but_itself() {
    let (summary, page) = page_of("run", synthetic::run);
    let text = text_of(&page);
    assert!(!page.contains("@import") && !page.contains("url("));
    for foreign in ["http:", "https:", "//cdn", "<script", "<link", "src=\"/", "NaN", "inf "] {
        assert!(!text.contains(foreign), "{foreign}");
    }
    assert!(page.contains("Run of cell.toml &lt;demo &amp; more&gt;"));
    assert!(!page.contains("<demo"));
    assert!(page.len() < 3_000_000, "{}", page.len());
    assert_eq!(page.matches("<figure ").count(), 12);
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    for word in
        ["From frame to setpoint", "Along the bead", "Refused frames", "no STATE for 500 ms"]
    {
        assert!(page.contains(word), "{word}");
    }
    assert_eq!(summary.control.unwrap().faults, 1);
}

#[test]
fn frames_without_a_controller_have_only_what_applies() {
    let (summary, page) = page_of("process", synthetic::process);
    assert_eq!((summary.frames, summary.measured), (300, 220));
    assert!(page.contains("Frame by frame") && page.contains("What the camera saw"));
    for word in ["setpoint", "Along the bead", "latency", "faults", "time [s]"] {
        assert!(!text_of(&page).contains(word), "{word}");
    }
}

#[test]
fn a_run_without_a_frame_still_has_a_page() {
    let (summary, page) = page_of("nothing", |folder| {
        crate::report::run::RunPage::log(synthetic::options(folder, "Nothing", true))
            .unwrap()
            .finish()
            .unwrap()
    });
    assert_eq!(summary.frames, 0);
    assert!(page.contains("There was no frame at all."));
    assert!(!text_of(&page).contains("NaN"));
}

#[test]
fn hours_make_a_page_no_larger_than_minutes() {
    let (summary, page) = page_of("hours", synthetic::hours);
    assert_eq!(summary.frames, synthetic::HOURS_OF_FRAMES);
    assert!(page.len() < 1_500_000, "{}", page.len());
    assert!(page.contains("time [h]") && page.contains("along the path [m]"));
}

#[test]
fn the_page_says_what_to_improve_about_light_and_lens() {
    let (_, page) = page_of("light", |folder| {
        let options = synthetic::options(folder, "Blurred", false);
        let mut log = crate::report::run::RunPage::log(options).unwrap();
        let mut measured = crate::rows::frame_row::sample::measured(42.0, 0.02);
        measured.hints.blur_px = 4.1;
        for frame in 0..20 {
            let outcome = Ok(measured);
            let row = crate::rows::frame_row::FrameRow {
                frame,
                time_s: None,
                outcome,
                roughness: None,
                control: None,
            };
            log.frame(&row, None, None).unwrap();
        }
        log.finish().unwrap()
    });
    let text = text_of(&page);
    assert!(text.contains("Blur 4.1 px: refocus"), "the advice");
    assert!(text.contains("rows that the width comes from [%]"), "the plot");
    let (_, page) = page_of("unadvised", synthetic::process);
    assert!(text_of(&page).contains("nothing to improve") != page.contains("class=\"advice\""));
}

#[test]
fn curves_keep_to_the_grid_that_they_are_drawn_on() {
    // A style's width and height win over those of an svg within another, which
    // would be stretched then, and its curves lie beside their axes.
    let (_, page) = page_of("stretched", synthetic::run);
    let style = page.split_once("</style>").unwrap().0;
    for rule in style.split('}') {
        let Some((selector, properties)) = rule.split_once('{') else { continue };
        let every_svg = selector.trim().trim_end_matches("*/").ends_with("svg");
        assert!(!every_svg || !properties.contains("width"), "{rule}");
    }
    let outer = page.matches("<svg viewBox").count();
    assert_eq!(outer, page.matches("\" role=\"img\"").count());
    assert!(page.contains("svg[role=\"img\"] {"));
}

#[test]
fn a_run_that_was_too_short_to_be_judged_is_not_good() {
    let (mut summary, _) = page_of("hours", synthetic::hours);
    let control = summary.control.as_mut().unwrap();
    (control.faults, control.limited_s, control.width_error_rms_settled_mm) = (0, 0.0, Some(0.01));
    control.held_for_s.clear();
    (control.wrong_offset, control.tolerance) = (None, None);
    let judged = super::headline::verdict(&summary, 1.0);
    summary.control.as_mut().unwrap().width_error_rms_settled_mm = None;
    let too_short = super::headline::verdict(&summary, 1.0);
    assert_eq!(too_short.level, VerdictLevel::Caution, "{too_short:?}");
    assert_eq!(judged.level, VerdictLevel::Good, "{judged:?}");
}
