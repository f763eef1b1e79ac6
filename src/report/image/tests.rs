use super::*;
use crate::core::{Mm, Pixels, Size, Stamp, WidthRange};
use crate::rows::frame_row::sample;
use crate::vision::{BeadAxis, Polarity};

fn gauge(roi: Roi) -> Gauge {
    Gauge {
        calipers: 16,
        ..Gauge::new(
            roi,
            BeadAxis::Vertical,
            Polarity::Bright,
            WidthRange { min: Mm::constant(1.0), max: Mm::constant(100.0) },
        )
    }
}

fn grey(size: (usize, usize), value: u8) -> Frame {
    Frame::new(
        3,
        Stamp::START,
        Size::new(size.0, size.1),
        Pixels::Grey8(vec![value; size.0 * size.1]),
    )
    .unwrap()
}

/// Centre of what is coloured like an ink, weighted by nothing.
fn centre_of(image: &image::RgbImage, colour: Rgb) -> (f64, f64) {
    let close =
        |pixel: &image::Rgb<u8>| pixel.0.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 40);
    let (mut x_sum, mut y_sum, mut count) = (0.0, 0.0, 0.0);
    for (x, y, pixel) in image.enumerate_pixels() {
        if close(pixel) {
            x_sum += f64::from(x);
            y_sum += f64::from(y);
            count += 1.0;
        }
    }
    (x_sum / count, y_sum / count)
}

#[test]
fn an_edge_is_drawn_where_it_was_found() {
    let roi = Roi { x: 40, y: 20, width: 100, height: 60 };
    let edge = [ImagePoint::new(60.25, 50.0)];
    let edges = Edges { left: &edge, right: &[] };
    let cutout =
        GaugeCutout::take(&grey((200, 100), 128), &gauge(roi), Some(edges), Err("no_pair"));
    let image = cutout.draw();
    // The cut is 116 px wide and begins at 32, 12; it is enlarged six times.
    assert_eq!(image.dimensions(), (116 * 6, 76 * 6));
    let (x, y) = centre_of(&image, LEFT_EDGE.light);
    let expected = ((60.25 - 32.0 + 0.5) * 6.0 - 0.5, (50.0 - 12.0 + 0.5) * 6.0 - 0.5);
    assert!((x - expected.0).abs() < 0.6 && (y - expected.1).abs() < 0.6, "{x} {y} {expected:?}");
}

#[test]
fn a_drawing_is_small_whatever_the_camera() {
    let roi = Roi { x: 10, y: 10, width: 2900, height: 1900 };
    let cutout = GaugeCutout::take(
        &grey((3000, 2000), 128),
        &gauge(roi),
        None,
        Ok(sample::measured(42.0, 0.1)),
    );
    assert_eq!(cutout.draw().width(), 720);
    assert!(cutout.jpeg(80).unwrap().len() < 100_000);
    assert!(cutout.png().unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn a_gauge_outside_the_image_is_no_obstacle() {
    let roi = Roi { x: 500, y: 500, width: 100, height: 100 };
    let png = GaugeCutout::take(&grey((64, 48), 20), &gauge(roi), None, Err("wrong_size")).png();
    assert!(png.is_some());
}
