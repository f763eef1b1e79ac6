use super::*;
use crate::core::{Mm, MmPerS};
use crate::rows::frame_row::sample;
use crate::width_control::limiter::SpeedLimit;

fn rows_of(with_control: bool, rows: &[FrameRow]) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = WidthsWriter::create(folder.path(), with_control).unwrap();
    for row in rows {
        writer.write(row).unwrap();
    }
    let path = writer.finish().unwrap();
    assert_eq!(path, folder.path().join("widths.csv"));
    std::fs::read_to_string(path).unwrap().lines().map(str::to_string).collect()
}

#[test]
fn the_file_begins_as_promised() {
    let lines = rows_of(false, &[]);
    assert_eq!(
        lines[0],
        "frame,time_s,status,width_mm,sigma_mm,left_x_px,left_y_px,right_x_px,right_y_px,\
         roughness_mm,roughness_length_mm,slant_deg,contrast_grey,blur_px,noise_grey,saturated_share,used_share"
    );
}

#[test]
fn a_measured_row_has_every_number() {
    let mut row = FrameRow {
        frame: 7,
        time_s: Some(0.14),
        outcome: Ok(sample::measured(42.0, 0.02)),
        roughness: Some(sample::roughness()),
        control: None,
    };
    let lines = rows_of(false, &[row]);
    assert_eq!(
        lines[1],
        "7,0.140000000,ok,42.000000,0.020000,100.250000,269.500000,431.750000,269.500000,\
         0.100000,5.000000,0.000000,120.000000,1.500000,2.000000,0.010000,0.980000"
    );
    (row.time_s, row.roughness) = (None, None);
    let open = &rows_of(false, &[row])[1];
    assert!(open.starts_with("7,,ok,42.000000,"));
    assert!(open.ends_with("269.500000,,,0.000000,120.000000,1.500000,2.000000,0.010000,0.980000"));
}

#[test]
fn a_rejected_row_keeps_frame_time_and_status() {
    let row = FrameRow {
        frame: 8,
        time_s: Some(1.5),
        outcome: Err("low_contrast"),
        roughness: None,
        control: None,
    };
    assert_eq!(rows_of(false, &[row])[1], "8,1.500000000,low_contrast,,,,,,,,,,,,,,");
}

#[test]
fn a_run_says_where_the_robot_was_and_what_the_controller_did() {
    let control = ControlColumns {
        bead_expected: true,
        measured_path: Some(Mm::constant(10.0)),
        nozzle_path: Some(Mm::constant(100.0)),
        speed: Some(MmPerS::constant(80.5)),
        setpoint: None,
        state: "tracking",
        limit: SpeedLimit::MinSpeed,
        target: None,
    };
    let row = FrameRow {
        frame: 0,
        time_s: Some(0.0),
        outcome: Err("no_pair"),
        roughness: None,
        control: Some(control),
    };
    let lines = rows_of(true, &[row]);
    assert!(lines[0].ends_with(
        ",used_share,bead_path_mm,nozzle_path_mm,speed_mm_per_s,setpoint_mm_per_s,state,limit,\
         target_mm"
    ));
    assert_eq!(lines[1], "0,0.000000000,no_pair,,,,,,,,,,,,,,,,,,,,,");
}

#[test]
fn a_killed_run_leaves_all_but_the_last_second() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = WidthsWriter::create(folder.path(), false).unwrap();
    for frame in 0..=10_u32 {
        let row = FrameRow {
            frame: u64::from(frame),
            time_s: Some(f64::from(frame) * 0.25),
            outcome: Err("no_pair"),
            roughness: None,
            control: None,
        };
        writer.write(&row).unwrap();
    }
    let kept = std::fs::read_to_string(folder.path().join("widths.csv.partial")).unwrap();
    assert!(kept.lines().count() > 8, "{kept}");
    assert!(!folder.path().join("widths.csv").exists());
}

#[test]
fn a_folder_that_is_gone_is_named() {
    let error = WidthsWriter::create(Path::new("/nonexistent/out"), false).unwrap_err();
    assert!(error.to_string().contains("/nonexistent/out/widths.csv.partial"), "{error}");
}

#[test]
fn numbers_that_are_not_numbers_stay_empty() {
    assert_eq!(decimals(Some(f64::NAN), 6), "");
    assert_eq!(decimals(Some(-1e-9), 6), "0.000000");
    assert_eq!(decimals(Some(-1.25), 2), "-1.25");
}
