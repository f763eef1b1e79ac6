use super::*;
use crate::core::{Frame, Pixels, Roi, Size, Stamp};
use crate::numeric::blurred_step::StepTable;
use crate::vision::blur_estimate::BlurEstimate;
use crate::vision::edge_windows::Grouping;
use crate::vision::gauge::{BeadAxis, GaugeView};
use crate::vision::row_range::RowRange;
use crate::vision::strip::{GaugeRowsOfDepth, RowLayout};

const ROWS: usize = 100;
const COLUMNS: usize = 160;
const LINES: [RowRange; 4] =
    [RowRange::new(0, 25), RowRange::new(25, 50), RowRange::new(50, 75), RowRange::new(75, 100)];
const BLUR_PX: f64 = 1.6;
/// Standard deviation of a pixel of 8 bits as fractions of a step of 80 levels.
const NOISE: f64 = 0.05;

/// What is expected: a position a little off the edge, and levels.
const EXPECTED: [f32; 3] = [79.8, 70.0, 80.0];

/// A step from 70 to 150 at 80.3 px and what lies beside it, without noise.
fn overlay(beside: impl Fn(f64) -> f64) -> Overlay {
    let table = StepTable::default();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 16 bits")]
    let shown = |x: u16| {
        let away = f64::from(x) - 80.3;
        let level = 70.0 + 80.0 * table.at(away / BLUR_PX).0 + beside(away);
        (level * 257.0).round() as u16
    };
    let columns = u16::try_from(COLUMNS).unwrap();
    let values = (0..ROWS).flat_map(|_| (0..columns).map(shown)).collect();
    let frame =
        Frame::new(0, Stamp::START, Size::new(COLUMNS, ROWS), Pixels::Grey16(values)).unwrap();
    let view = GaugeView::new(Roi { x: 0, y: 0, width: COLUMNS, height: ROWS }, BeadAxis::Vertical);
    let mut layout = RowLayout::default();
    let GaugeRowsOfDepth::Words(strip) = layout.strips(&frame, &view, None) else { unreachable!() };
    let mut sheet = EdgeWindows::default();
    sheet.read(&strip, &LINES, Grouping { steepest: 0.0, max_rows: 1 }, |_| EXPECTED);
    let mut overlay = Overlay::default();
    overlay.lay(&sheet);
    overlay
}

/// The shape of the edge with its blur known to four percent.
fn shape(overlay: &Overlay) -> StepShape {
    let table = StepTable::default();
    let room = Clearance { before: 45.0, after: 45.0 };
    let fit = overlay.with(&table).first_fit(NOISE, room).unwrap();
    overlay
        .with(&table)
        .shape(&fit, BlurEstimate { px: fit.step.blur, sd_px: 0.04 * BLUR_PX })
        .unwrap()
}

#[test]
fn a_plain_edge_is_plain_as_far_as_can_be_seen() {
    let shape = shape(&overlay(|_| 0.0));
    assert!((shape.step.at - 0.5).abs() < 0.002, "{shape:?}");
    assert!((shape.step.blur - BLUR_PX).abs() < 0.01, "{shape:?}");
    assert!(!shape.is_bent());
    assert!(shape.extent.before > 40.0 && shape.extent.after > 40.0);
}

/// The shadow's flank, 6 or 8 px before the edge, leads the way to a level of 14.
#[test]
fn a_shadow_close_by_does_not_move_the_edge() {
    let table = StepTable::default();
    for away in [6.0, 8.0] {
        let dark = |at: f64| -56.0 * table.at(-(at + away) / BLUR_PX).0;
        let shape = shape(&overlay(dark));
        assert!((shape.step.at - 0.5).abs() < 0.01, "{shape:?}");
        assert!((shape.step.before).abs() < 0.01, "{shape:?}");
        let [before, after] = shape.flanks.0;
        let flank = before.unwrap();
        assert!((flank.at - 0.5 + away).abs() < 0.05, "{flank:?}");
        assert!((flank.height + 0.7).abs() < 0.02, "{flank:?}");
        assert_eq!(after, None);
        // What the flank leaves open counts; from 5 blurs on it is little.
        let sd_px = shape.variance.sqrt();
        assert!(if away < 7.0 { (0.01..0.2).contains(&sd_px) } else { sd_px < 0.03 }, "{sd_px}");
    }
}

/// Light that falls off as exp(−x/30 px), from 1 grey level/px at the edge.
#[test]
fn shading_that_falls_off_is_followed_by_a_parabola() {
    let falling = |at: f64| if at > 0.0 { 30.0 * (1.0 - libm::exp(-at / 30.0)) } else { 0.0 };
    let shape = shape(&overlay(falling));
    let [before, after] = shape.shading;
    assert!((after.slope * 80.0 - 1.0).abs() < 0.15, "{after:?}");
    assert!(after.bend < 0.0);
    assert!(before.slope.abs() < 1e-3 && before.bend == 0.0);
}

/// The mean slope over two pixels is (Φ((x + 1)/s) − Φ((x − 1)/s))/2.
#[test]
fn the_steepest_slope_is_that_of_a_gaussian_flank() {
    let room = Clearance { before: 45.0, after: 45.0 };
    let (slope, at) = slopes::ProfileSlopes::of(&overlay(|_| 0.0)).steepest(room).unwrap();
    let fraction = |x: f64| 0.5 * (1.0 + libm::erf(x / (BLUR_PX * 2f64.sqrt())));
    // The pixel at 80 is nearest to the edge at 80.3.
    let expected = 0.5 * (fraction(1.0 - 0.3) - fraction(-1.0 - 0.3));
    assert!((slope - expected).abs() < 5e-4, "{slope} {expected}");
    assert!(at.abs() < 1e-9, "{at}");
}

/// Beyond three blurs nothing but the slope of the surroundings is left of a straight shade.
#[test]
fn an_even_shade_comes_back_as_its_slope() {
    let shade = |at: f64| if at > 0.0 { 0.8 * at } else { 0.0 };
    let shape = shape(&overlay(shade));
    assert!((shape.shading[1].slope - 0.01).abs() < 1e-3, "{shape:?}");
    assert!(shape.shading[0].slope.abs() < 1e-3 && !shape.is_bent(), "{shape:?}");
    assert!((shape.step.at - 0.5).abs() < 0.04, "{shape:?}");
}
