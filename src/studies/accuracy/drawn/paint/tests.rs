use crate::studies::accuracy::drawn::paint::*;
use crate::studies::accuracy::drawn::scene::{Groove, Holes, Rib, Tear};

const TORN: Tear = Tear { roughness_px: 3.0, length_px: 8.0 };

/// What a person would count who cuts every pixel in sixteen: all that cannot be
/// reached from outside over what is darker than half the bead.
fn counted_width(scene: &DrawnScene, seed: u64) -> (f64, f64) {
    const CUT: usize = 4;
    let (width, height) = scene.size;
    let lines = height * POINTS_PER_PX;
    let margin = kernel(scene.blur_px).len() * POINTS_PER_PX;
    let outline = DrawnOutline::draw(scene, lines + 2 * margin, &mut Draw::new("count", seed));
    let columns = width * CUT;
    let half = 0.5 * (scene.bead_grey + scene.ground_grey);
    let dark: Vec<bool> = (0..lines)
        .flat_map(|line| {
            let steps = outline.steps(scene, line + margin);
            (0..columns).map(move |column| {
                let at = (f64::from(u32::try_from(column).unwrap()) + 0.5) / 4.0;
                steps.iter().rev().find(|step| step.at_px <= at).is_none_or(|step| step.grey < half)
            })
        })
        .collect();
    let mut outside = vec![false; dark.len()];
    let mut next: Vec<usize> =
        (0..lines).flat_map(|line| [line * columns, (line + 1) * columns - 1]).collect();
    while let Some(at) = next.pop() {
        if !dark[at] || std::mem::replace(&mut outside[at], true) {
            continue;
        }
        let (line, column) = (at / columns, at % columns);
        next.extend((column > 0).then(|| at - 1));
        next.extend((column + 1 < columns).then(|| at + 1));
        next.extend((line > 0).then(|| at - columns));
        next.extend((line + 1 < lines).then(|| at + columns));
    }
    let bead = outside.iter().filter(|outside| !**outside).count();
    let counted =
        f64::from(u32::try_from(bead).unwrap()) / 4.0 / f64::from(u32::try_from(lines).unwrap());
    (counted, outline.mean_width(margin..margin + lines))
}

#[test]
fn the_true_width_is_the_area_that_is_counted() {
    let torn = DrawnScene { edges: TORN, ..DrawnScene::default() };
    let holes = Some(Holes { count: 4, size_px: 9.0, grey: 20.0 });
    let small = DrawnScene { width_px: 60.0, size: (120, 100), ..torn.clone() };
    for scene in [torn.clone(), DrawnScene { holes, ..torn }, small] {
        for seed in 0..4 {
            let (counted, truth) = counted_width(&scene, seed);
            // Rounding to a quarter of a pixel in 800 positions: 0.072·√2/√400 = 0.005 px.
            assert!((counted - truth).abs() < 0.025, "{counted} {truth}");
        }
    }
}

#[test]
fn the_light_of_a_picture_is_that_of_its_areas() {
    let scene = DrawnScene { edges: TORN, blur_px: 0.0, ..DrawnScene::default() };
    let bare = paint(&scene, &mut Draw::new("test", 5));
    let rib = Rib { at_px: 20.0, width_px: 7.3, over_grey: -30.0 };
    let ribbed = DrawnScene { ribs: vec![rib], ..scene.clone() };
    let ribbed = paint(&ribbed, &mut Draw::new("test", 5));
    let sum = |painted: &Painted| painted.light.iter().map(|&light| f64::from(light)).sum::<f64>();
    let area = (sum(&bare) / 100.0 - 70.0 * 640.0) / 80.0;
    assert!((area - bare.truth_px).abs() < 1e-3, "{area} {}", bare.truth_px);
    assert!((sum(&ribbed) - sum(&bare) + 100.0 * 30.0 * 7.3).abs() < 2.0);
    assert!((ribbed.truth_px - bare.truth_px).abs() < 1e-9);
    // A moved and blurred image has the same light.
    let moved = DrawnScene { blur_px: 3.0, motion_px: 20.0, ..scene.clone() };
    let moved = paint(
        &DrawnScene { edges: Tear { roughness_px: 0.0, ..TORN }, ..moved },
        &mut Draw::new("test", 5),
    );
    let area = (sum(&moved) / 100.0 - 70.0 * 640.0) / 80.0;
    assert!((area - moved.truth_px).abs() < 1e-3, "{area} {}", moved.truth_px);
}

#[test]
fn a_blurred_edge_is_exact_wherever_it_lies_within_a_pixel() {
    for (blur_px, motion_px) in [(0.5, 0.0), (1.5, 0.0), (6.0, 0.0), (1.5, 20.0)] {
        let table = StepTable::new(blur_px, motion_px);
        for place in 0..10_u32 {
            let at_px = 60.0 + 0.1 * f64::from(place) + 0.03;
            let ground = BrightnessStep { at_px: f64::NEG_INFINITY, grey: 70.0, concrete: false };
            let steps = vec![ground, BrightnessStep { at_px, grey: 150.0, concrete: true }];
            let mut row = vec![0.0; 120];
            let lines = std::iter::repeat_n(steps, POINTS_PER_PX);
            table.fill(&mut row, lines, &|step| step.grey);
            for (pixel, &light) in row.iter().enumerate() {
                let left = f64::from(u32::try_from(pixel).unwrap());
                // The mean over pixel and motion of Φ, by the midpoint rule.
                let n = 160_u32;
                let mean = |length: f64, of: &dyn Fn(f64) -> f64| {
                    let at = |k: u32| length * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                    (0..n).map(|k| of(at(k))).sum::<f64>() / f64::from(n)
                };
                let step = |x: f64| 0.5 * libm::erfc(-(x - at_px) / blur_px / 2_f64.sqrt());
                let share = mean(1.0, &|u| {
                    if motion_px > 0.0 {
                        mean(motion_px, &|v| step(left + 0.5 + u + v))
                    } else {
                        step(left + 0.5 + u)
                    }
                });
                if pixel.is_multiple_of(3) || motion_px == 0.0 {
                    let wanted = 70.0 + 80.0 * share;
                    assert!((f64::from(light) - wanted).abs() < 5e-3, "{pixel}: {light} {wanted}");
                }
            }
        }
    }
}

#[test]
fn beyond_a_groove_lies_ground_or_a_bead() {
    let groove = |neighbour| Some(Groove { width_px: 30.0, grey: 10.0, neighbour });
    let grooves = [groove(true), groove(false)];
    let scene = DrawnScene { grooves, edges: TORN, ..DrawnScene::default() };
    let painted = paint(&scene, &mut Draw::new("test", 6));
    let row = &painted.light[50 * 640..][..640];
    let places = [20, 139, 320, 501, 620].map(|column: usize| row[column].round());
    assert_eq!(places, [150.0, 10.0, 150.0, 10.0, 70.0]);
    let bare = paint(&DrawnScene { grooves: [None; 2], ..scene }, &mut Draw::new("test", 6));
    assert!((bare.truth_px - painted.truth_px).abs() < 1e-9);
}

#[test]
fn a_texture_has_in_the_picture_the_size_asked_for() {
    let texture =
        crate::studies::accuracy::drawn::scene::Patches { size_grey: 12.0, length_px: 4.0 };
    let scene = DrawnScene { texture, ..DrawnScene::default() };
    let painted = paint(&scene, &mut Draw::new("test", 7));
    let inside: Vec<f64> = (0..100)
        .flat_map(|row| painted.light[row * 640 + 200..row * 640 + 440].iter())
        .map(|&light| f64::from(light) - 150.0)
        .collect();
    let variance = inside.iter().map(|light| light * light).sum::<f64>() / 24_000.0;
    // A patch of 2·4² pixels counts as one: 750 of them give a variance to 5 %.
    assert!((variance / 144.0 - 1.0).abs() < 0.2, "{variance}");
}
