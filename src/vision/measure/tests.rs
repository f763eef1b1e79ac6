use super::*;
use crate::calib::{Calibration, Camera};
use crate::frame::Pixels;
use crate::geometry::{Pose, Roi};
use crate::time::Stamp;
use crate::units::Mm;
use crate::vision::gauge::{Axis, Polarity};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const SIZE: (usize, usize) = (400, 60);
/// Edges of the bead \[px\].
const EDGES: [f64; 2] = [60.0, 300.0];

/// A bead of 150 on 70 with a blur of 1.5 px and a noise of 2.
fn frame() -> Frame {
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(11);
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    let share = |x: f64| 0.5 * (1.0 + libm::erf(x / (1.5 * std::f64::consts::SQRT_2)));
    let mut level = |x: u16| {
        let [left, right] = EDGES.map(|edge| share(f64::from(x) - edge));
        70.0 + 80.0 * (left - right) + 2.0 * noise()
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "8 bits")]
    let values = (0..60 * 400u16).map(|k| level(k % 400).round() as u8).collect();
    Frame::new(0, Stamp::START, SIZE, Pixels::Grey8(values)).unwrap()
}

fn gauge(from: usize, to: usize) -> Gauge {
    Gauge {
        roi: Roi { x: from, y: 0, width: to - from, height: 60 },
        axis: Axis::Vertical,
        polarity: Polarity::Bright,
        width_range: (Mm::constant(10.0), Mm::constant(400.0)),
        method: Method::Caliper,
        calipers: 64,
        min_contrast_grey: 6.0,
    }
}

fn measure(gauge: Gauge, surface: &SurfaceMap) -> Result<WidthMeasurement, Reject> {
    Measurer::new(gauge, None).measure(&frame(), surface)
}

/// Either the gauge shows enough of both edges, or it says so: a step that is
/// cut short seems to lie farther inside.
#[test]
fn an_edge_at_the_border_of_the_gauge_is_no_edge() {
    let scale = SurfaceMap::from_scale(1.0);
    for margin in 0..24 {
        for from in [60 - margin, 0] {
            let to = if from == 0 { 301 + margin } else { 400 };
            match measure(gauge(from, to), &scale) {
                Ok(found) => {
                    assert!((found.width.get() - 240.0).abs() < 0.1, "{from}..{to}: {found:?}");
                }
                Err(_) => assert!(margin < 8, "{margin} px beside an edge are enough"),
            }
        }
    }
    let found = measure(gauge(58, 400), &scale).unwrap_err();
    assert!(matches!(found, Reject::Clipped { .. } | Reject::NoPair { .. }), "{found}");
}

#[test]
fn images_of_another_size_than_the_calibrations_are_refused() {
    let camera = Camera { focal_px: [500.0; 2], centre_px: [200.0, 30.0], distortion: [0.0; 8] };
    let bed =
        Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), Vector3::new(0.0, 0.0, 400.0));
    let calibration = |image_size_px: [u32; 2]| Calibration::Full {
        image_size_px,
        camera,
        bed,
        robot_z: Mm::ZERO,
        quality: None,
    };
    let surface = |size: [u32; 2]| calibration(size).surface(Mm::ZERO, None);
    let width = measure(gauge(0, 400), &surface([400, 60])).unwrap().width;
    assert!((width.get() - 240.0 * 0.8).abs() < 0.1, "{width}");
    let refused = measure(gauge(0, 400), &surface([800, 120])).unwrap_err();
    assert_eq!(refused, Reject::OtherSize { image: SIZE, calibrated: [800, 120] });
    assert_eq!(refused.status(), "wrong_size");
    let said = refused.to_string();
    assert!(said.contains("400x60") && said.contains("800x120"), "{said}");
}
