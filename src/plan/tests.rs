//! Properties of every plan.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::flow::KNOT_S;
use super::profile::profile_of;
use super::*;
use crate::extruder::limits::CommandLimits;
use crate::numeric::lti::TransferFunction;

const ACCEL: f64 = 2000.0;

/// One lag and a dead time, 600 mm³/s for each volt.
fn extruder() -> TransferFunction {
    TransferFunction::new(&[600.0], &[0.3, 1.0], 0.05).unwrap()
}

fn task(extruder: &TransferFunction, budget_s: f64) -> PlanTask<'_> {
    let robot = RobotMotionLimits { accel_mm_per_s2: ACCEL, slowest_mm_per_s: 2.0 };
    let drive = CommandLimits::new(0.0, 10.0, 20.0).unwrap();
    PlanTask {
        limits: PlanLimits { robot, drive, budget_s },
        bead: BeadGeometry { area_mm2: 45.0, nozzle_mm: 20.0, nozzle_sigma: 0.0 },
        unmodelled: FlowUncertainty { ratio: 0.17, correlation_s: 0.15 },
        extruder,
    }
}

/// A path with corners, from rest to rest or moving.
fn path(corners: &[f64], end_mm: f64, rest: bool) -> SpeedProfile {
    let ends = if rest { 0.0 } else { 100.0 };
    let mut limits = PathLimits::new(0.0, ends);
    for corner in corners {
        limits.extend_to(*corner, 100.0, 5.0);
    }
    limits.extend_to(end_mm, 100.0, ends);
    time_optimal(&limits, ACCEL).unwrap()
}

fn keeps_its_limits(plan: &Plan, nominal: &SpeedProfile, most_s: f64) {
    assert_eq!(plan.speed.end_mm(), nominal.end_mm());
    let nodes = plan.speed.path().iter().zip(plan.speed.squares());
    for ((s0, b0), (s1, b1)) in nodes.clone().zip(nodes.clone().skip(1)) {
        assert!((b1 - b0).abs() <= 2.0 * ACCEL * (s1 - s0) * (1.0 + 1e-9) + 1e-6, "{s0} {s1}");
        for fraction in [0.0, 0.3, 0.7, 1.0] {
            let at = s0 + fraction * (s1 - s0);
            assert!(plan.speed.square_at(at) <= nominal.square_at(at) + 1e-6, "{at}");
        }
    }
    for pair in plan.command.windows(2) {
        assert!((0.0..=10.0).contains(&pair[1]), "{pair:?}");
        assert!((pair[1] - pair[0]).abs() <= 20.0 * KNOT_S + 1e-9, "{pair:?}");
    }
    assert!(KNOT_S * crate::numeric::number::to_f64(plan.command.len()) >= plan.speed.duration_s());
    assert!(plan.added_s >= -1e-9 && plan.added_s <= most_s + 1e-9, "{}", plan.added_s);
    assert!((plan.speed.duration_s() - nominal.duration_s() - plan.added_s).abs() < 1e-9);
}

fn rms(plan: &Plan, from: f64, to: f64) -> f64 {
    let inside = plan.predicted_width.iter().filter(|(at, _)| (from..=to).contains(at));
    crate::numeric::average::rms(inside.map(|(_, error)| *error))
}

#[test]
fn a_straight_path_is_unchanged() {
    let extruder = extruder();
    let nominal = path(&[], 2000.0, false);
    let plan = solve(&task(&extruder, 1.0), &nominal).unwrap();
    keeps_its_limits(&plan, &nominal, 1e-6);
    assert!(rms(&plan, 0.0, 2000.0) < 1e-6);
    assert!(plan.command.iter().all(|u| (u - 7.5).abs() < 1e-3));
}

#[test]
fn corners_of_a_long_job_are_planned_one_after_the_other() {
    let extruder = extruder();
    let nominal = path(&[400.0, 520.0, 1600.0], 2300.0, false);
    let plan = solve(&task(&extruder, 0.5), &nominal).unwrap();
    keeps_its_limits(&plan, &nominal, 1.5);
    // Without added time the surplus of each corner stays.
    let none = solve(&task(&extruder, 0.0), &nominal).unwrap();
    keeps_its_limits(&none, &nominal, 0.0);
    for (from, to) in [(300.0, 620.0), (1500.0, 1700.0)] {
        assert!(rms(&plan, from, to) < 0.4 * rms(&none, from, to), "{from}");
    }
}

#[test]
fn a_job_that_begins_and_ends_at_rest_keeps_its_limits() {
    let extruder = extruder();
    let nominal = path(&[300.0], 600.0, true);
    let plan = solve(&task(&extruder, 1.0), &nominal).unwrap();
    keeps_its_limits(&plan, &nominal, 3.0);
    let none = solve(&task(&extruder, 0.0), &nominal).unwrap();
    keeps_its_limits(&none, &nominal, 0.0);
    assert!(rms(&plan, 10.0, 590.0) < 0.5 * rms(&none, 10.0, 590.0));
}

#[test]
fn the_same_job_has_the_same_plan() {
    let extruder = extruder();
    let nominal = path(&[300.0], 600.0, false);
    let plan = || solve(&task(&extruder, 0.3), &nominal).unwrap();
    assert_eq!(plan(), plan());
}

#[test]
fn a_speed_that_the_drive_cannot_feed_is_refused() {
    let extruder = extruder();
    let nominal = profile_of(&[(0.0, 150.0), (100.0, 150.0)]).unwrap();
    let error = solve(&task(&extruder, 1.0), &nominal).unwrap_err();
    assert!(matches!(error, PlanError::Drive { command, .. } if (command - 11.25).abs() < 1e-9));
    let error = solve(&task(&extruder, f64::NAN), &path(&[], 10.0, false)).unwrap_err();
    assert!(matches!(error, PlanError::Number { what: "the time that may be added", .. }));
}

#[test]
fn a_step_of_the_nominal_speed_is_limited_to_the_acceleration() {
    let extruder = extruder();
    let nominal = profile_of(&[(0.0, 100.0), (200.0, 100.0), (200.1, 20.0), (400.0, 20.0)]);
    let plan = solve(&task(&extruder, 1.0), &nominal.unwrap()).unwrap();
    let nodes = plan.speed.path().iter().zip(plan.speed.squares());
    for ((s0, b0), (s1, b1)) in nodes.clone().zip(nodes.skip(1)) {
        assert!((b1 - b0).abs() <= 2.0 * ACCEL * (s1 - s0) * (1.0 + 1e-9) + 1e-6);
    }
}
