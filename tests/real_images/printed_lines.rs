//! Printed lines 3 mm apart, photographed from two heights: the list beside this
//! file has 20 lines at three places in each photo, with the borders that were
//! read by hand from magnified crops, at half level between line and plate, of the
//! ten columns about the place. They are good to some 0.5 px.

use std::collections::BTreeMap;

use truebead::core::{Mm, Roi, WidthRange};
use truebead::vision::{BeadAxis, Gauge, Polarity, WidthMeasurement};

use super::statistics::{median, sizes};
use super::{data, image, measure};

const LIST: &str = include_str!("printed_lines.csv");
/// Distance of neighbouring lines \[mm\].
const PITCH_MM: f64 = 3.0;
/// Lines and places that are judged; line 0 only gives line 1 its scale.
const LINES: std::ops::RangeInclusive<u32> = 1..=20;
const PLACES: u32 = 3;
/// A simple script (blur, half level in each column, robust line) differs between
/// the two photos by 0.38 % in the median; the limit is the larger of that and 1 %.
const MAX_MEDIAN_DIFFERENCE: f64 = 0.01;

/// A line at a place in a photo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Spot {
    photo: u32,
    place: u32,
    line: u32,
}

/// What the list says of a spot \[px\].
#[derive(Debug, Clone, Copy)]
struct Listed {
    x: usize,
    middle: f64,
    /// Width that was read by hand.
    width: Option<f64>,
}

fn list() -> BTreeMap<Spot, Listed> {
    let rows = LIST.lines().skip(1).map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let whole = |k: usize| cells[k].parse::<u32>().unwrap();
        let border = |k: usize| cells[k].parse::<f64>().ok();
        let spot = Spot { photo: whole(0), place: whole(1), line: whole(2) };
        let width = border(5).zip(border(6)).map(|(upper, lower)| lower - upper);
        let listed = Listed { x: cells[3].parse().unwrap(), middle: border(4).unwrap(), width };
        (spot, listed)
    });
    rows.collect()
}

/// Pixels between neighbouring lines at a spot.
fn pitch_px(list: &BTreeMap<Spot, Listed>, spot: Spot) -> f64 {
    let at = |line| list.get(&Spot { line, ..spot }).map(|listed| listed.middle);
    match (at(spot.line - 1), at(spot.line + 1)) {
        (Some(before), Some(after)) => 0.5 * (after - before),
        // The last line of the list.
        (Some(before), None) => list[&spot].middle - before,
        _ => unreachable!("line 0 is not judged"),
    }
}

/// A gauge as long as twice the pitch along a line and as high as the pitch.
fn gauge(listed: &Listed, pitch_px: f64) -> Gauge {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
    let (half_width, half_height, middle) = (
        pitch_px.round() as usize,
        (0.5 * pitch_px).round() as usize,
        listed.middle.round() as usize,
    );
    let roi = Roi {
        x: listed.x - half_width,
        y: middle - half_height,
        width: 2 * half_width,
        height: 2 * half_height,
    };
    let range = WidthRange { min: Mm::constant(8.0), max: Mm::constant(45.0) };
    Gauge::new(roi, BeadAxis::Horizontal, Polarity::Bright, range)
}

/// Measures all spots; prints each that is refused.
fn measured(list: &BTreeMap<Spot, Listed>) -> Option<BTreeMap<Spot, WidthMeasurement>> {
    let mut found = BTreeMap::new();
    for photo in [45, 50] {
        let path = data(&format!("printed_lines/gold_captured_frame{photo}_4-5.jpg"))?;
        let frame = image(&path);
        for (spot, listed) in list.iter().filter(|(spot, _)| spot.photo == photo) {
            if !LINES.contains(&spot.line) {
                continue;
            }
            match measure(gauge(listed, pitch_px(list, *spot)), &frame) {
                Ok(width) => drop(found.insert(*spot, width)),
                Err(reject) => println!("{spot:?}: {} ({reject})", reject.status()),
            }
        }
    }
    Some(found)
}

fn all_spots(photo: u32) -> impl Iterator<Item = Spot> {
    LINES.flat_map(move |line| (0..PLACES).map(move |place| Spot { photo, place, line }))
}

#[test]
fn at_least_54_of_60_places_are_measured_in_each_photo() {
    let list = list();
    let Some(found) = measured(&list) else { return };
    for photo in [45, 50] {
        let count = all_spots(photo).filter(|spot| found.contains_key(spot)).count();
        println!("printed lines, photo at {photo} mm: {count} of 60 measured");
        assert!(count >= 54, "{photo} mm: {count}");
    }
}

#[test]
fn a_line_is_as_wide_from_45_as_from_50_mm() {
    let list = list();
    let Some(found) = measured(&list) else { return };
    let width_mm =
        |spot: Spot| Some(found.get(&spot)?.width.get() * PITCH_MM / pitch_px(&list, spot));
    let differences: Vec<f64> = all_spots(45)
        .filter_map(|spot| Some(width_mm(Spot { photo: 50, ..spot })? / width_mm(spot)? - 1.0))
        .collect();
    let difference = median(&sizes(&differences));
    println!(
        "printed lines, 45 against 50 mm: median difference {:.2} %, {} pairs, mean {:+.2} %",
        100.0 * difference,
        differences.len(),
        100.0 * median(&differences)
    );
    assert!(difference <= MAX_MEDIAN_DIFFERENCE, "{difference}");
}

#[test]
fn no_width_is_far_from_what_is_read_by_hand() {
    let list = list();
    let Some(found) = measured(&list) else { return };
    let mut wrong = Vec::new();
    let mut ratios = Vec::new();
    for (spot, width) in &found {
        let by_hand = list[spot].width.unwrap();
        let off = width.width.get() - by_hand;
        ratios.push(off / by_hand);
        if off.abs() > 0.1 * by_hand && off.abs() > 5.0 * width.sigma.get() {
            wrong.push((*spot, by_hand, width.width, width.sigma));
        }
    }
    println!(
        "printed lines, against reading by hand: median {:+.1} %, median size {:.1} %, largest {:.1} %",
        100.0 * median(&ratios),
        100.0 * median(&sizes(&ratios)),
        100.0 * sizes(&ratios).into_iter().fold(0.0, f64::max)
    );
    for entry in &wrong {
        println!("wrong: {entry:?}");
    }
    assert!(wrong.is_empty(), "{} widths are wrong", wrong.len());
}
