//! Histogram of latencies on a logarithmic axis.

use maud::{Markup, html};

use super::area::{Area, round};
use super::axis::{AxisScale, PageExtent};
use super::palette;
use super::range::ValueRange;
use crate::numeric::number::to_f64;
use crate::numeric::statistics::Distribution;

/// Bars per factor of two: more give a finer resolution, but noisier counts.
const BARS_PER_OCTAVE: usize = 8;

/// Counts over milliseconds as bars, with lines at the median and the 99 % quantile.
pub fn draw(latencies: &Distribution) -> Markup {
    let bars = latencies.bars(BARS_PER_OCTAVE);
    let (Some(first), Some(last)) = (bars.first(), bars.last()) else { return html! {} };
    let area = Area::wide(230.0);
    let x = AxisScale::log(ValueRange::new(first.0.min(last.1 / 4.0), last.1), area.across());
    let most = bars.iter().map(|bar| bar.2).max().unwrap_or(1);
    let y = AxisScale::linear(ValueRange::new(0.0, to_f64(most) * 1.12), area.upwards());
    let PageExtent { from: bottom, to: top } = area.upwards();
    let inner = html! {
        (area.y_grid(&y, "setpoints"))
        (area.vertical_grid(&x.ticks(0), &x, "latency [ms]"))
        @for (low, high, count) in &bars {
            @let (from, to) = (x.position(*low), x.position(*high));
            @let upper = y.position(to_f64(*count));
            @if *count > 0 {
                rect x=(round(from + 0.5)) y=(round(upper)) width=(round((to - from - 1.0).max(0.5)))
                    height=(round((bottom - upper).max(1.0))) fill=(palette::SETPOINT.css()) {
                    title { (format!("{low:.2} to {high:.2} ms: {count}")) }
                }
            }
        }
        @for (name, q, row) in [("median", 0.5, 12.0), ("99 %", 0.99, 30.0)] {
            @if let Some(value) = latencies.quantile(q) {
                @let at = round(x.position(value));
                line.level x1=(at) x2=(at) y1=(top) y2=(bottom) stroke=(palette::TARGET.css()) {}
                text.label x=(at - 5.0) y=(top + row) text-anchor="end" {
                    (name) " " (format!("{value:.2} ms"))
                }
            }
        }
    };
    area.svg("how the latencies are distributed", &inner)
}
