//! What disturbs an image, against closed forms.

use super::*;
use crate::scenario::image::{
    BeadSide, Bend, EdgeShading, Grains, MotionBlur, Neighbour, Shadow, Spots, TexturePattern,
};

/// An edge of the bead of 30 mm [px].
const LEFT_PX: f64 = 359.5 - 15.0 / PAPER_SCALE;
const RIGHT_PX: f64 = 359.5 + 15.0 / PAPER_SCALE;

/// Grey of an image without light, noise and rounding.
fn scene(image: &ImageModel, width_mm: f64) -> Vec<f64> {
    let renderer = renderer(scale(), upright(), image);
    let seen = seen(&renderer, &straight(width_mm));
    let step = image.bead_grey - image.ground_grey;
    let added = seen.added_grey.unwrap_or_else(|| vec![0.0; seen.fractions.len()]);
    let grey = |(fraction, added): (&f32, &f32)| {
        image.ground_grey + step * f64::from(*fraction) + f64::from(*added)
    };
    seen.fractions.iter().zip(&added).map(grey).collect()
}

/// Straight between the pixels of a row.
fn between(scene: &[f64], row: usize, x: f64) -> f64 {
    let first = (0..720).rfind(|i| to_f64(*i) <= x).unwrap();
    let (a, b) = (scene[row * 720 + first], scene[row * 720 + first + 1]);
    a + (b - a) * (x - to_f64(first))
}

fn shaded(side: BeadSide) -> ImageModel {
    let shading = EdgeShading {
        bead_grey_per_px: 1.0,
        bead_px: 30.0,
        ground_grey_per_px: -0.5,
        ground_px: 40.0,
        side,
    };
    ImageModel { shading, ..quiet() }
}

#[test]
fn shading_grows_from_its_edge_and_ends() {
    let left = scene(&shaded(BeadSide::Left), 30.0);
    let both = scene(&shaded(BeadSide::Both), 30.0);
    let places = [(15.0, 165.0), (29.0 - 8.0, 171.0), (60.0, 180.0), (-20.0, 60.0), (-80.0, 50.0)];
    for (depth, expected) in places {
        for row in [0, 333] {
            assert!((between(&left, row, LEFT_PX + depth) - expected).abs() < 1e-2, "{depth}");
            assert!((between(&both, row, LEFT_PX + depth) - expected).abs() < 1e-2, "{depth}");
            assert!((between(&both, row, RIGHT_PX - depth) - expected).abs() < 1e-2, "{depth}");
        }
    }
    assert!((between(&left, 100, RIGHT_PX - 15.0) - 180.0).abs() < 1e-2);
    assert!((between(&left, 100, RIGHT_PX + 20.0) - 70.0).abs() < 1e-2);
    // The edge itself is as far up as without shading, but for s·φ(0).
    let bend = (1.5_f64.powi(2) + 1.0 / 12.0).sqrt() / std::f64::consts::TAU.sqrt();
    assert!((between(&left, 100, LEFT_PX) - (110.0 + 0.5 * bend)).abs() < 0.3);
}

#[test]
fn a_shadow_lies_parallel_to_its_edge_at_its_depth() {
    let shadow =
        Shadow { distance_px: 6.0, width_px: 20.0, contrast_fraction: 0.7, side: BeadSide::Left };
    let slant_deg = 12.0;
    let cos = 12_f64.to_radians().cos();
    for (bead_grey, level) in [(150.0, 14.0), (20.0, 105.0)] {
        let image = ImageModel { bead_grey, slant_deg, shadow, ..quiet() };
        let scene = scene(&image, 30.0);
        let without = self::scene(&ImageModel { bead_grey, slant_deg, ..quiet() }, 30.0);
        for row in [100, 400] {
            let lean = 12_f64.to_radians().tan() * (to_f64(row) - 269.5);
            let at = |distance: f64| 359.5 + lean - (15.0 / PAPER_SCALE + distance) / cos;
            assert!((between(&scene, row, at(16.0)) - level).abs() < 0.01);
            assert!(
                (between(&scene, row, at(6.0))
                    - between(&without, row, at(6.0))
                    - 0.5 * (level - 70.0))
                    .abs()
                    < 0.3
            );
            assert!((between(&scene, row, at(40.0)) - 70.0).abs() < 0.01);
            assert!((between(&scene, row, at(-60.0)) - bead_grey).abs() < 0.01);
        }
    }
}

#[test]
fn an_older_bead_lies_beside() {
    let neighbour =
        Neighbour { gap_px: 20.0, width_px: 50.0, contrast_fraction: 0.6, side: BeadSide::Right };
    let scene = scene(&ImageModel { neighbour, ..quiet() }, 30.0);
    for (distance, level) in [(10.0, 70.0), (45.0, 118.0), (20.0, 94.0), (70.0, 94.0), (85.0, 70.0)]
    {
        assert!((between(&scene, 50, RIGHT_PX + distance) - level).abs() < 0.5, "{distance}");
    }
    assert!((between(&scene, 50, LEFT_PX - 45.0) - 70.0).abs() < 1e-3);
}

#[test]
fn spots_cover_their_share_of_the_bead_and_nothing_else() {
    let image = ImageModel { spots: Spots { covered_fraction: 0.05, size_px: 4.0 }, ..quiet() };
    let renderer = renderer(scale(), upright(), &image);
    let view = renderer.view(None).unwrap();
    let bead = straight(30.0);
    let outline = BeadOutline::trace(&view, &bead, 540.0, 720.0).unwrap();
    let mut sum = 0.0;
    for seq in 0..20 {
        let added = renderer.coverage(seq, &outline, &view).added_grey.unwrap();
        sum += added.iter().map(|grey| f64::from(*grey)).sum::<f64>();
        let beside = |x: usize| to_f64(x) < LEFT_PX - 8.0 || to_f64(x) > RIGHT_PX + 8.0;
        assert!((0..added.len()).all(|i| !beside(i % 720) || added[i] == 0.0));
    }
    let area = 20.0 * 540.0 * 30.0 / PAPER_SCALE;
    let fraction = sum / area / (255.0 - 150.0);
    // Four standard errors of some 200,000 spots.
    assert!((fraction - 0.05).abs() < 0.05 * 4.0 * 0.003, "{fraction}");
}

#[test]
fn grains_cover_their_share_of_either_edge() {
    let grains = Grains { rows_fraction: 0.3, size_px: 12.0, grey: 230.0 };
    let image = ImageModel { grains, blur_px: 0.0, ..quiet() };
    let renderer = renderer(scale(), upright(), &image);
    let view = renderer.view(None).unwrap();
    let bead = straight(30.0);
    let outline = BeadOutline::trace(&view, &bead, 540.0, 720.0).unwrap();
    let mut rows = [0_u32; 2];
    for seq in 0..10 {
        let added = renderer.coverage(seq, &outline, &view).added_grey.unwrap();
        for (count, edge) in rows.iter_mut().zip([LEFT_PX, RIGHT_PX]) {
            let at = (0..720).rfind(|i| to_f64(*i) - 0.5 <= edge).unwrap();
            *count += (0..540).map(|row| u32::from(added[row * 720 + at] > 40.0)).sum::<u32>();
        }
        let far = |x: f64| (x - LEFT_PX).abs() > 14.0 && (x - RIGHT_PX).abs() > 14.0;
        assert!((0..added.len()).all(|i| !far(to_f64(i % 720)) || added[i] == 0.0));
    }
    for count in rows {
        assert!((f64::from(count) / 5400.0 - 0.3).abs() < 0.03, "{rows:?}");
    }
}

#[test]
fn what_is_brighter_than_the_sensor_bears_is_saturated() {
    let image = ImageModel {
        bead_grey: 300.0,
        ground_grey: 175.0,
        light_ratio: 1.0,
        ..ImageModel::default()
    };
    let renderer = renderer(scale(), upright(), &image);
    let pixels = grey(&renderer.render(0, Stamp::START, None, &straight(30.0)).unwrap().frame);
    let middle = (0..540).flat_map(|row| (260..460).map(move |x| row * 720 + x));
    assert!(middle.clone().all(|i| pixels[i] == 255.0));
    let ground: f64 = (0..540).map(|row| pixels[row * 720 + 50]).sum::<f64>() / 540.0;
    assert!((ground - 175.0).abs() < 0.7);
    let noisy = ImageModel { bead_grey: 255.0, ..image };
    let renderer = super::renderer(scale(), upright(), &noisy);
    let pixels = grey(&renderer.render(0, Stamp::START, None, &straight(30.0)).unwrap().frame);
    let mean = middle.clone().map(|i| pixels[i]).sum::<f64>() / to_f64(middle.count());
    // The upper half of the noise is cut off: s·φ(0) is missing.
    assert!((mean - (255.0 - 4.0 / std::f64::consts::TAU.sqrt())).abs() < 0.1, "{mean}");
}

#[test]
fn a_moving_picture_is_the_mean_of_shifted_ones() {
    let motion = MotionBlur { length_px: 6.0, direction_deg: 90.0 };
    for blur_px in [0.8, 1.5] {
        let moving = scene(&ImageModel { blur_px, motion, ..quiet() }, 30.0);
        let mut mean = vec![0.0; 720];
        for i in 0..600 {
            let lateral_mm = ((f64::from(i) + 0.5) / 100.0 - 3.0) * PAPER_SCALE;
            let still = scene_row(&ImageModel { blur_px, lateral_mm, ..quiet() });
            mean.iter_mut().zip(still).for_each(|(mean, grey)| *mean += grey / 600.0);
        }
        for (x, mean) in mean.iter().enumerate() {
            assert!((moving[333 * 720 + x] - mean).abs() < 1e-3, "{x}: {mean}");
        }
    }
    // Along the edges nothing changes.
    let motion = MotionBlur { length_px: 6.0, direction_deg: 0.0 };
    let (moving, still) = (scene(&ImageModel { motion, ..quiet() }, 30.0), scene(&quiet(), 30.0));
    assert!(moving.iter().zip(&still).all(|(a, b)| (a - b).abs() < 1e-3));
}

/// One row of an image of 3 rows.
fn scene_row(image: &ImageModel) -> Vec<f64> {
    let roi = Roi { x: 40, y: 0, width: 640, height: 3 };
    let image = ImageModel { size_px: [720, 3], ..*image };
    let renderer = renderer(scale(), gauge(roi, BeadAxis::Vertical), &image);
    let fractions = seen(&renderer, &straight(30.0)).fractions;
    fractions[720..1440].iter().map(|fraction| 70.0 + 80.0 * f64::from(*fraction)).collect()
}

#[test]
fn a_texture_has_its_size_and_is_of_the_frame() {
    let texture = TexturePattern { sigma_grey: 5.0, length_px: 3.0 };
    let renderer = renderer(scale(), upright(), &ImageModel { texture, ..quiet() });
    let frame = |seq| grey(&renderer.render(seq, Stamp::START, None, &|_| None).unwrap().frame);
    let (a, b) = (frame(0), frame(1));
    assert_eq!(frame(0), a);
    let mean = |of: &dyn Fn(usize) -> f64| (0..a.len()).map(of).sum::<f64>() / to_f64(a.len());
    assert!((mean(&|i| (a[i] - 70.0).powi(2)) - 25.0).abs() < 1.5);
    assert!(mean(&|i| (a[i] - 70.0) * (b[i] - 70.0)).abs() < 1.5);
}

#[test]
fn the_edges_of_a_curve_lie_on_circles() {
    for radius_px in [500.0, -700.0] {
        let bend = Bend { radius_mm: radius_px * PAPER_SCALE, corner_deg: 0.0 };
        let renderer = renderer(scale(), upright(), &ImageModel { blur_px: 2.0, bend, ..quiet() });
        let bead = straight(30.0);
        let truth = renderer.render(0, Stamp::START, None, &bead).unwrap().truth.unwrap();
        assert!((truth.width_mm - 30.0).abs() < 1e-9);
        assert!(truth.roughness_mm < 1e-9);
        let fractions = fractions(&renderer, &bead);
        let half = 15.0 / PAPER_SCALE;
        for row in [30, 150, 269, 420, 510] {
            let dy = to_f64(row) - 269.5;
            let x = |offset: f64| {
                let radius = radius_px - offset;
                359.5 + radius_px - radius.signum() * (radius * radius - dy * dy).sqrt()
            };
            let found = [true, false].map(|rising| half_way(&renderer, &fractions, row, rising));
            assert!((found[0] - x(-half)).abs() < 0.02, "{radius_px} {row}: {found:?}");
            assert!((found[1] - x(half)).abs() < 0.02, "{radius_px} {row}: {found:?}");
            let sum: f64 =
                fractions[row * 720..][..720].iter().map(|fraction| f64::from(*fraction)).sum();
            assert!((sum - (x(half) - x(-half))).abs() < 0.02, "{radius_px} {row}: {sum}");
        }
    }
}

#[test]
fn a_corner_keeps_the_width_of_both_halves() {
    let bend = Bend { radius_mm: 0.0, corner_deg: 40.0 };
    let renderer = renderer(scale(), upright(), &ImageModel { bend, ..quiet() });
    let bead = straight(20.0);
    let truth = renderer.render(0, Stamp::START, None, &bead).unwrap().truth.unwrap();
    assert!((truth.width_mm - 20.0).abs() < 1e-9);
    let fractions = fractions(&renderer, &bead);
    let (half, apart) = (20_f64.to_radians(), 20.0 / PAPER_SCALE / 20_f64.to_radians().cos());
    for row in [40, 150, 400, 500] {
        let sum: f64 =
            fractions[row * 720..][..720].iter().map(|fraction| f64::from(*fraction)).sum();
        assert!((sum - apart).abs() < 1e-3, "{row}: {sum} {apart}");
        let left = 359.5 - 0.5 * apart + half.tan() * (to_f64(row) - 269.5).abs();
        assert!((half_way(&renderer, &fractions, row, true) - left).abs() < 0.02, "{row}");
    }
}

#[test]
fn a_horizontal_bead_is_disturbed_like_a_vertical_one() {
    let size_px = [300, 300];
    let roi = Roi { x: 20, y: 20, width: 260, height: 260 };
    let shadow =
        Shadow { distance_px: 6.0, width_px: 20.0, contrast_fraction: 0.7, side: BeadSide::Left };
    let bend = Bend { radius_mm: 60.0, corner_deg: 0.0 };
    let image = ImageModel { size_px, bend, shadow, ..shaded(BeadSide::Right) };
    let added = |axis| {
        let renderer = renderer(scale(), gauge(roi, axis), &image);
        seen(&renderer, &straight(18.0)).added_grey.unwrap()
    };
    let (up, right) = (added(BeadAxis::Vertical), added(BeadAxis::Horizontal));
    for (row, column) in (0..300).flat_map(|row| (0..300).map(move |column| (row, column))) {
        let turned = up[(299 - column) * 300 + row];
        assert!((right[row * 300 + column] - turned).abs() < 2e-3, "{row} {column}");
    }
}
