//! Stacked layers from the side, whose borders are grooves and highlights: the list
//! beside this file has five gauges in each of three images, with the borders of
//! the layer in it as they were read by hand at the gauge's middle column, to some
//! 5 px. With three polarities and two ranges that is 90 settings.

use truebead::core::{Mm, Roi, WidthRange};
use truebead::vision::{BeadAxis, Gauge, Polarity};

use super::{data, image, measure};

const LIST: &str = include_str!("concrete_layers.csv");
const POLARITIES: [Polarity; 3] = [Polarity::Bright, Polarity::Dark, Polarity::Any];
/// Widths that a user would allow for layers of some 200 px \[px\].
const RANGES: [[f64; 2]; 2] = [[100.0, 300.0], [150.0, 260.0]];

/// A gauge with the borders of the layers in it.
#[derive(Debug, Clone)]
struct Listed {
    image: String,
    roi: Roi,
    borders: Vec<f64>,
}

fn list() -> Vec<Listed> {
    let rows = LIST.lines().skip(1).map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let px = |k: usize| cells[k].parse::<usize>().unwrap();
        let roi = Roi { x: px(1), y: px(2), width: px(3), height: px(4) };
        let borders = cells[5].split(' ').map(|border| border.parse().unwrap()).collect();
        Listed { image: cells[0].to_owned(), roi, borders }
    });
    rows.collect()
}

/// Whether a width is not that of a layer that the gauge holds and the range
/// allows.
fn is_false(listed: &Listed, [min, max]: [f64; 2], width: f64, sigma: f64) -> bool {
    let layers = listed.borders.windows(2).map(|pair| pair[1] - pair[0]);
    let mut allowed = layers.filter(|layer| (min..=max).contains(layer));
    !allowed.any(|layer| {
        let off = (width - layer).abs();
        off <= 0.1 * layer || off <= 5.0 * sigma
    })
}

#[test]
fn no_layer_is_falsely_measured_in_90_settings() {
    let (mut settings, mut measured, mut wrong) = (0, 0, 0);
    for listed in list() {
        let Some(path) = data(&format!("concrete_layers/img_00{}.tiff", listed.image)) else {
            return;
        };
        let frame = image(&path);
        for polarity in POLARITIES {
            for range in RANGES {
                settings += 1;
                let [min, max] = range.map(Mm::constant);
                let gauge =
                    Gauge::new(listed.roi, BeadAxis::Horizontal, polarity, WidthRange { min, max });
                let Ok(found) = measure(gauge, &frame) else { continue };
                measured += 1;
                let (width, sigma) = (found.width.get(), found.sigma.get());
                if is_false(&listed, range, width, sigma) {
                    wrong += 1;
                    println!(
                        "falsely ok: {listed:?}, {polarity:?}, {range:?}: {width:.1} ± {sigma:.1}"
                    );
                }
            }
        }
    }
    println!(
        "concrete layers: {measured} of {settings} settings measured, {wrong} of them falsely"
    );
    assert_eq!(settings, 90);
    assert_eq!(wrong, 0);
}
