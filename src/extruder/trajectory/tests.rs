#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::core::{Mm, Span, Unit};

/// 100 mm/s for a second, down to 20 mm/s within a second, then 20 mm/s for a second.
fn text() -> String {
    let mut text =
        "bead,time_s,path_mm,x_mm,speed_mm_per_s,command_rpm,flow_mm3_per_s\n".to_owned();
    for bead in 1..=2 {
        for k in 0..=300_u32 {
            let t = f64::from(k) * 0.01;
            let slow = (t - 1.0).clamp(0.0, 1.0);
            let speed = 100.0 - 80.0 * slow;
            let path = 100.0 * t - 40.0 * slow * slow - 80.0 * (t - 2.0).max(0.0);
            let command = 30.0 - 10.0 * f64::from(bead) * slow;
            let flow = 4.0 * speed;
            let row = format!("{bead},{t:.2},{path:.6},0,{speed:.6},{command:.6},{flow:.6}\n");
            text.push_str(&row);
        }
    }
    text
}

#[test]
fn a_plan_is_read_by_position_and_constant_beyond_its_ends() {
    let job = read(&text()).unwrap();
    assert_eq!((job.unit, job.beads().len()), (Unit::Rpm, 2));
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    };
    let bead = job.bead(0);
    close(bead.end().get(), 180.0);
    close(bead.section_mm2(), 4.0);
    let half_slow = bead.at(Mm::constant(140.0));
    close(half_slow.time_s, 1.5);
    close(half_slow.command, 25.0);
    close(half_slow.flow.get(), 240.0);
    close(job.bead(1).at(Mm::constant(140.0)).command, 20.0);
    close(job.bead(2).at(Mm::constant(140.0)).command, 25.0);
    // Beyond the ends.
    close(bead.at(Mm::constant(-5.0)).command, 30.0);
    close(bead.at(Mm::constant(500.0)).command, 20.0);
    close(bead.at(Mm::constant(500.0)).flow.get(), 80.0);
    assert_eq!(job.commands().1, 30.0);
    close(job.speeds().0, 20.0);
    close(job.steepest_speed(), 80.0);
    close(job.steepest_command(), 20.0);
}

#[test]
fn the_speed_of_a_setpoint_is_the_mean_over_its_time() {
    let job = read(&text()).unwrap();
    let speed =
        |path: f64, lasts: f64| job.bead(0).speed(Mm::constant(path), Span::from_secs(lasts)).get();
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    };
    close(speed(10.0, 0.2), 100.0);
    // From 1.5 s on: 60 mm/s, falling by 80 mm/s².
    close(speed(140.0, 0.2), 52.0);
    close(speed(170.0, 1.0), 20.0);
    close(speed(500.0, 0.2), 20.0);
    close(speed(-20.0, 0.2), 100.0);
}

#[test]
fn an_invalid_plan_is_refused_with_its_line() {
    let refused =
        |from: &str, to: &str| read(&text().replacen(from, to, 1)).unwrap_err().to_string();
    assert!(refused("path_mm,", "way,").contains("no column path_mm"));
    assert!(refused("command_rpm", "screw").contains("nothing for the command"));
    assert!(refused("command_rpm", "command_apples").contains("command_apples"));
    let words = refused("1,0.05,5.000000", "1,0.05,far");
    assert!(words.contains("line 7") && words.contains("\"far\""), "{words}");
    let words = refused("1,0.05,5.000000", "1,0.05,1.000000");
    assert!(words.contains("line 7") && words.contains("path_mm"), "{words}");
    let short = text().len() - 40;
    let words = read(&text()[..short]).unwrap_err().to_string();
    assert!(words.contains("cut short"), "{words}");
    let words = refused("1,0.05,", "1,0.03,");
    assert!(words.contains("time_s"), "{words}");
    let words = refused("1,0.00,0.000000", "1,0.00,3.000000");
    assert!(words.contains("line 2") && words.contains("0 where a bead begins"), "{words}");
    assert!(
        read("bead,time_s,path_mm,speed_mm_per_s,command_rpm,flow_mm3_per_s\n")
            .unwrap_err()
            .to_string()
            .contains("fewer than two rows")
    );
}
