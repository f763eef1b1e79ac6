use super::*;

const BEAD: f64 = 150.0;
const BLUR_PX: f64 = 1.6;

/// The mean profile across an edge at 20.3 px: ground of 70 grey with a slope outwards,
/// and a groove.
fn profile(slope: f64, groove_px: f64, groove_grey: f64) -> MeanProfile {
    let at = 20.3;
    let fraction = |position: f64| 0.5 * libm::erfc(-position / (BLUR_PX * 2.0_f64.sqrt()));
    let mut grey = [0.0; PROFILE_PX];
    for (k, value) in grey.iter_mut().enumerate() {
        let position = to_f64(k) - at;
        let ground = 70.0 - slope * position.min(0.0);
        let (near, far) = (fraction(position), fraction(position + groove_px));
        let level = ground + (groove_grey - ground) * far + (BEAD - groove_grey) * near;
        *value = crate::numeric::number::narrow_to_f32(level);
    }
    MeanProfile { grey, inside: (26, 50), outside: (2, 18), on_ground: true, filled: 0.0 }
}

fn fitted(mean: &MeanProfile) -> GrooveShape {
    let blur = MeanBlur { px: BLUR_PX, variance: 0.01 };
    let (table, edge) = (&StepTable::default(), EdgeKind::Auto);
    fit(mean, &GroovePrior { table, variance: 0.25, blur, edge, roughness: 0.0, before: None })
        .unwrap()
}

#[test]
fn plain_and_shaded_ground_have_no_groove() {
    for slope in [0.0, 0.5, 1.0] {
        let shape = fitted(&profile(slope, 0.0, 70.0));
        assert!(shape.groove_probability < 0.25, "{slope}: {shape:?}");
    }
}

#[test]
fn a_groove_that_blur_fills_is_found_on_plain_and_shaded_ground() {
    for slope in [0.0, 0.5] {
        let shape = fitted(&profile(slope, 2.5, 20.0));
        assert!(shape.groove_probability > 0.9, "{slope}: {shape:?}");
        let off = shape.at - 20.3;
        assert!(off.abs() < 3.0 * shape.variance.sqrt(), "{slope}: {shape:?}");
    }
}

#[test]
fn sigma_contains_what_two_likely_shapes_leave_open() {
    let step = fitted(&profile(0.0, 0.0, 70.0));
    let other = GrooveShape { at: step.at + 1.0, ..step };
    let both = step.average_with(&other, 0.5);
    assert!((both.at - step.at - 0.5).abs() < 1e-9);
    assert!((both.variance - step.variance - 0.25).abs() < 1e-9);
}

#[test]
fn the_level_beside_the_edge_is_told_from_a_rib_within() {
    let mut mean = profile(0.0, 0.0, 70.0);
    assert!(fitted(&mean).level_off < 0.5);
    // The level farther inside is read where a bright rib lies.
    for value in &mut mean.grey[28..] {
        *value += 40.0;
    }
    let shape = fitted(&mean);
    assert!(shape.level_off > 1.0, "{shape:?}");
    assert!((shape.at - 20.3).abs() < 0.3, "{shape:?}");
}
