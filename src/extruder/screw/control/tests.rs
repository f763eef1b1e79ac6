use super::*;
use crate::extruder::screw::feedback::PlugSetpoint;
use crate::extruder::screw::{PiecewiseExponential, SaturatedLinear, ScrewDesign, SpeedPulsation};
use proptest::prelude::*;

const SETPOINT: PlugSetpoint = PlugSetpoint { plug: Mm::constant(160.0), max_fill: 0.9 };

fn settings(scheme: Scheme) -> ScrewSettings {
    let pulsation = SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
    let screw = ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap();
    let controller = PiecewiseExponential::new(&screw, SETPOINT, 36.0).unwrap();
    let controller = FillFeedback::Exponential(controller);
    let before = screw.holding_fill(0.1);
    ScrewSettings {
        screw,
        feedback: controller,
        scheme,
        period: Span::from_millis(5),
        initial_fill: before,
    }
}

fn control(scheme: Scheme) -> ScrewControl {
    ScrewControl::new(&settings(scheme)).unwrap()
}

fn at(ms: i64) -> Stamp {
    Stamp::START + Span::from_millis(ms)
}

#[test]
fn the_prediction_of_a_held_plug_is_constant_and_arrives_after_its_delay() {
    for scheme in [Scheme::Exact, Scheme::Paper] {
        let step = control(scheme).step(at(0), Mm::constant(100.0)).unwrap();
        assert!((step.plug.get() - 100.0).abs() < 1e-9, "{scheme:?}");
        assert!((step.arrival.secs() - 1.137).abs() < 6e-3, "{scheme:?}");
        assert!((step.fill - settings(scheme).feedback.fill(0.1)).abs() < 1e-9);
    }
}

#[test]
fn a_plug_outside_the_screw_is_an_error_and_the_feed_stays() {
    for scheme in [Scheme::Exact, Scheme::Paper] {
        let mut control = control(scheme);
        let fed = control.step(at(0), Mm::constant(150.0)).unwrap().fill;
        for (tick, plug) in (1..).zip([-0.1, 200.0, 1e6]) {
            let fault = control.step(at(5 * tick), Mm::constant(plug)).unwrap_err();
            assert!(matches!(fault, ScrewFault::PlugOutsideScrew { .. }), "{plug}");
            assert_eq!(control.fed(), fed);
        }
        assert!(control.step(at(20), Mm::constant(150.0)).is_ok());
    }
    let fault = control(Scheme::Exact).step(at(0), Mm::constant(250.0)).unwrap_err();
    assert_eq!(
        fault.to_string(),
        "a plug of 250 mm was measured in a screw of 200 mm; check the sensor's zero and unit"
    );
}

#[test]
fn steps_off_the_grid_of_the_scheme_are_errors() {
    let plug = Mm::constant(120.0);
    let mut exact = control(Scheme::Exact);
    exact.step(at(10), plug).unwrap();
    for early in [0, 10, 12] {
        let fault = exact.step(at(early), plug).unwrap_err();
        assert!(matches!(fault, ScrewFault::TooSoon { .. }), "{early}");
    }
    assert!(exact.step(at(13), plug).is_ok());
    assert!(exact.step(at(900), plug).is_ok());
    let mut paper = control(Scheme::Paper);
    paper.step(at(0), plug).unwrap();
    let fault = paper.step(at(8), plug).unwrap_err();
    assert!(matches!(fault, ScrewFault::OffGrid { .. }));
    assert!(paper.step(at(500), plug).is_ok());
}

#[test]
fn the_applied_feed_counts_and_not_the_decided_one() {
    for scheme in [Scheme::Exact, Scheme::Paper] {
        let (mut informed, mut uninformed) = (control(scheme), control(scheme));
        for tick in 0..100 {
            let plug = Mm::constant(120.0);
            let _ = uninformed.step(at(5 * tick), plug).unwrap();
            let _ = informed.step(at(5 * tick), plug).unwrap();
            informed.applied(at(5 * tick), 0.1).unwrap();
            assert_eq!(informed.fed(), 0.1);
        }
        let predicted = |control: &mut ScrewControl| {
            control.step(at(500), Mm::constant(120.0)).unwrap().plug.get()
        };
        assert!(predicted(&mut informed) + 5.0 < predicted(&mut uninformed));
        for fill in [-0.1, 1.0, f64::NAN] {
            assert!(matches!(informed.applied(at(500), fill), Err(ScrewFault::FillOutOfRange(_))));
        }
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let sound = settings(Scheme::Exact);
    let refused = |settings| ScrewControl::new(&settings).unwrap_err();
    let filled = ScrewSettings { initial_fill: 1.0, ..sound };
    assert!(matches!(refused(filled), ScrewError::InitialFill(_)));
    let still = ScrewSettings { period: Span::ZERO, ..sound };
    assert!(matches!(refused(still), ScrewError::NotPositive { name: "period", .. }));
    let often = ScrewSettings { period: Span::from_ns(1_000), ..sound };
    assert!(matches!(refused(often), ScrewError::TooManySteps { .. }));
    let belt = Screw { conveying: Conveying::AtSpeedOnTheWay, ..sound.screw };
    let belt = ScrewSettings { screw: belt, scheme: Scheme::Paper, ..sound };
    assert_eq!(refused(belt), ScrewError::SchemeOnTheWay);
    let broken = Screw { theta2_per_m: f64::NAN, ..sound.screw };
    let broken = ScrewSettings { screw: broken, ..sound };
    assert!(matches!(refused(broken), ScrewError::NotPositive { name: "theta2_per_m", .. }));
}

proptest! {
    #[test]
    fn the_feed_keeps_its_limits_whatever_is_measured(
        plugs in prop::collection::vec(-20.0..220.0_f64, 1..300),
        relative_amplitude in 0.0..0.9_f64,
        rad_per_s in 0.0..8.0_f64,
        phase_rad in -4.0..4.0_f64,
        slope in 7.0..2_000.0_f64,
        paper in any::<bool>(),
        belt in any::<bool>(),
        straight in any::<bool>(),
    ) {
        let pulsation = SpeedPulsation { relative_amplitude, rad_per_s, phase_rad };
        let screw = ScrewDesign::DIAGNE_2015.screw(pulsation).unwrap();
        let conveying =
            if belt && !paper { Conveying::AtSpeedOnTheWay } else { Conveying::AtPresentSpeed };
        let screw = Screw { conveying, ..screw };
        let feedback = if straight {
            FillFeedback::Saturated(SaturatedLinear::new(&screw, SETPOINT, slope).unwrap())
        } else {
            FillFeedback::Exponential(PiecewiseExponential::new(&screw, SETPOINT, slope).unwrap())
        };
        let scheme = if paper { Scheme::Paper } else { Scheme::Exact };
        let settings = ScrewSettings { screw, feedback, ..settings(scheme) };
        let mut control = ScrewControl::new(&settings).unwrap();
        for (tick, plug) in (0..).zip(plugs) {
            let step = control.step(at(5 * tick), Mm::constant(plug));
            prop_assert!((0.0..=0.9).contains(&control.fed()));
            if let Ok(step) = step {
                prop_assert_eq!(step.fill, control.fed());
                prop_assert!((0.0..=200.0).contains(&step.plug.get()));
                prop_assert!(step.arrival >= at(5 * tick));
            }
        }
    }
}
