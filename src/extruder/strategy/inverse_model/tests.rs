use super::*;
use crate::core::Rpm;
use crate::extruder::CommandLimits;
use crate::extruder::feedforward::{
    ExtruderModel, InverseSettings, RightHalfPlaneZeros, ScrewSpeed,
};
use crate::extruder::strategy::tests::report;
use crate::numeric::lti::{Between, Simulator, TransferFunction};

const PERIOD: Span = Span::from_millis(5);

fn strategy(
    model: &TransferFunction,
    limits: CommandLimits,
    about: OperatingPoint,
    time_constant_s: f64,
) -> InverseFeedforward {
    let settings = InverseSettings {
        time_constant_s,
        right_zeros: RightHalfPlaneZeros::Refuse,
        preview: Span::ZERO,
        max_delay: Span::from_secs(1.0),
        limits,
        period: PERIOD,
    };
    InverseFeedforward::new(Tracker::new(model, &settings).unwrap(), about)
}

/// Flow over its demand over time, and the commands.
fn response(
    controller: &mut InverseFeedforward,
    plant: &mut Simulator,
    flow: f64,
    limits: CommandLimits,
) -> Vec<f64> {
    let wanted = Mm3PerS::constant(flow);
    let mut last = limits.apply(controller.begin(Stamp::START, wanted).value, 0.0, PERIOD).0;
    controller.settle(Stamp::START, last);
    let mut response_of = vec![plant.step(last) / flow];
    for _ in 0..1000 {
        controller.feedforward(PERIOD, wanted);
        last = limits.apply(controller.demand().value, last, PERIOD).0;
        controller.settle(Stamp::START, last);
        response_of.push(plant.step(last) / flow);
    }
    response_of
}

#[test]
fn without_limits_the_flow_follows_the_placed_poles() {
    for (num, den, poles) in [
        (vec![12.0], vec![0.84, 1.0], 1),
        (vec![18.0], vec![0.656, 0.975, 1.0], 2),
        (vec![9.175, 149.2, 905.3], vec![1.0, 12.84, 47.52], 0),
        (vec![2.0, 10.0], vec![0.1, 0.8, 1.7, 1.0], 2),
    ] {
        let model = TransferFunction::new(&num, &den, 0.0).unwrap();
        let limits = CommandLimits::new(-1e6, 1e6, 1e12).unwrap();
        let mut controller = strategy(&model, limits, OperatingPoint::default(), 0.1);
        let mut plant = Simulator::new(&model, 0.005, Between::Held).unwrap();
        let response_of = response(&mut controller, &mut plant, 500.0, limits);
        for (k, fraction) in (0_u32..).zip(&response_of).skip(20) {
            let x = f64::from(k) * 0.005 / 0.1;
            let expected = match poles {
                0 => 1.0,
                1 => 1.0 - f64::exp(-x),
                _ => 1.0 - (1.0 + x) * f64::exp(-x),
            };
            assert!((fraction - expected).abs() < 0.04, "{num:?} {k}: {fraction} {expected}");
        }
        assert!((response_of[1000] - 1.0).abs() < 1e-6, "{num:?}");
    }
}

#[test]
fn an_extruder_at_rest_reaches_its_flow_within_its_limits() {
    let model = TransferFunction::new(&[18.0], &[0.656, 0.975, 1.0], 0.0).unwrap();
    let limits = CommandLimits::new(0.0, 60.0, 400.0).unwrap();
    let mut controller = strategy(&model, limits, OperatingPoint::default(), 0.25);
    let mut plant = Simulator::new(&model, 0.005, Between::Held).unwrap();
    let response_of = response(&mut controller, &mut plant, 540.0, limits);
    let settled = |response_of: &[f64]| {
        response_of.iter().rposition(|fraction| (fraction - 1.0).abs() > 0.05).unwrap()
    };
    let mut steady = Simulator::new(&model, 0.005, Between::Held).unwrap();
    let alone: Vec<f64> = (0..2000).map(|_| steady.step(30.0) / 540.0).collect();
    let (with, without) = (settled(&response_of), settled(&alone));
    assert!(2 * with < without, "{with} {without}");
    let most = response_of.iter().fold(0.0_f64, |most, fraction| most.max(*fraction));
    assert!(most < 1.03, "{most}");
}

fn forecast(model: &TransferFunction, screw: ScrewSpeed, ahead: Span) -> FlowForecast {
    let drive = TransferFunction::gain(1.0).unwrap();
    let whole = ExtruderModel { drive, flow: model.clone() };
    FlowForecast::new(&whole, screw, ahead, PERIOD).unwrap()
}

#[test]
fn an_encoder_shows_a_drive_that_differs_from_its_model() {
    // The screw turns at three quarters of its command.
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
    let limits = CommandLimits::new(0.0, 90.0, 1e6).unwrap();
    let predicted_with = |screw| {
        let mut controller = strategy(&model, limits, OperatingPoint::default(), 0.1)
            .with_forecast(forecast(&model, screw, Span::ZERO));
        let mut last = controller.begin(Stamp::START, Mm3PerS::constant(480.0)).value;
        for _ in 0..2000 {
            controller.settle(Stamp::START, last);
            let screw_rpm = Some(Rpm::new(0.75 * last).unwrap());
            controller.reported(Stamp::START, &ExtruderReport { screw_rpm, ..report() }).unwrap();
            controller.feedforward(PERIOD, Mm3PerS::constant(480.0));
            last = controller.demand().value;
        }
        (controller.required_reading().is_some(), controller.predicted_flow().unwrap().get())
    };
    let (needs, flow) = predicted_with(ScrewSpeed::Measured);
    assert!(needs && (flow - 360.0).abs() < 0.1, "{needs} {flow}");
    let (needs, flow) = predicted_with(ScrewSpeed::Modelled);
    assert!(!needs && (flow - 480.0).abs() < 0.1, "{needs} {flow}");
}

#[test]
fn the_flow_is_predicted_from_the_applied_command() {
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.2).unwrap();
    let limits = CommandLimits::new(0.0, 60.0, 1e6).unwrap();
    let about = OperatingPoint { command: 30.0, flow_mm3_per_s: 360.0 };
    let ahead = Span::from_millis(100);
    let mut controller = strategy(&model, limits, about, 0.25).with_forecast(forecast(
        &model,
        ScrewSpeed::Modelled,
        ahead,
    ));
    let mut plant = Simulator::new(&model, 0.005, Between::Held).unwrap();
    let mut last = controller.begin(Stamp::START, Mm3PerS::constant(480.0)).value.min(60.0);
    assert_eq!(controller.predicted_flow(), Some(Mm3PerS::ZERO));
    let (mut predicted, mut flows) = (Vec::new(), Vec::new());
    for _ in 0..600 {
        controller.settle(Stamp::START, last);
        flows.push(plant.step(last));
        controller.feedforward(PERIOD, Mm3PerS::constant(480.0));
        predicted.push(controller.predicted_flow().unwrap().get());
        last = controller.demand().value.clamp(0.0, 60.0);
    }
    // 100 ms are 20 periods.
    for (last, flow) in predicted.iter().zip(&flows[20..]) {
        assert!((last - flow).abs() < 5.0, "{last} {flow}");
    }
    assert!(flows[30] < 5.0 && flows[599] > 475.0);
}

#[test]
fn missed_ticks_are_made_up_for() {
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
    let limits = CommandLimits::new(0.0, 90.0, 1e6).unwrap();
    let ended = |ticks: i64, count: usize| {
        let mut controller = strategy(&model, limits, OperatingPoint::default(), 0.25)
            .with_forecast(forecast(&model, ScrewSpeed::Modelled, Span::ZERO));
        let _ = controller.begin(Stamp::START, Mm3PerS::constant(480.0));
        controller.settle(Stamp::START, 40.0);
        for _ in 0..count {
            controller.feedforward(Span::from_millis(5 * ticks), Mm3PerS::constant(480.0));
        }
        (controller.demand().value, controller.predicted_flow().unwrap().get())
    };
    let (whole, missed) = (ended(1, 60), ended(3, 20));
    assert!((whole.0 - missed.0).abs() < 1e-9 && (whole.1 - missed.1).abs() < 1e-9);
}

#[test]
fn until_the_pump_runs_the_command_is_that_of_a_steady_flow() {
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
    let limits = CommandLimits::new(0.0, 90.0, 1e6).unwrap();
    let mut controller = strategy(&model, limits, OperatingPoint::default(), 0.1);
    assert!((controller.begin(Stamp::START, Mm3PerS::constant(480.0)).value - 40.0).abs() < 1e-9);
    controller.settle(Stamp::START, 40.0);
    controller.feedforward(PERIOD, Mm3PerS::constant(480.0));
    assert!(controller.demand().value > 100.0, "{}", controller.demand().value);
}

#[test]
fn poles_faster_than_the_commands_are_refused() {
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
    let with = |time_constant_s| {
        Tracker::new(
            &model,
            &InverseSettings {
                time_constant_s,
                right_zeros: RightHalfPlaneZeros::Refuse,
                preview: Span::ZERO,
                max_delay: Span::ZERO,
                limits: CommandLimits::new(0.0, 90.0, 1e6).unwrap(),
                period: PERIOD,
            },
        )
    };
    assert!(with(0.02).is_ok());
    let error = with(0.019).unwrap_err().to_string();
    assert!(error.contains("at least 0.02 s"), "{error}");
}

#[test]
fn a_model_about_another_point_is_followed_from_there() {
    let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
    let about = OperatingPoint { command: 30.0, flow_mm3_per_s: 400.0 };
    let limits = CommandLimits::new(0.0, 90.0, 1e6).unwrap();
    let mut controller = strategy(&model, limits, about, 0.1);
    let mut last = controller.begin(Stamp::START, Mm3PerS::constant(460.0)).value;
    for _ in 0..2000 {
        controller.settle(Stamp::START, last.clamp(0.0, 90.0));
        controller.feedforward(PERIOD, Mm3PerS::constant(460.0));
        last = controller.demand().value;
    }
    assert!((last - 35.0).abs() < 1e-9, "{last}");
}
