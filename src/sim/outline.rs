//! The outline of a bead in the image: both edges, and the ends of the bead.

use super::view::{AxisPoint, BeadView};

/// Distance between samples of an edge \[px\]: the resolution of the image.
const SAMPLE_PX: f64 = 1.0;
/// Bisections for an end of the bead between two samples. Derived: 2⁻³⁰ of a pixel is beyond
/// any resolution.
const HALVINGS: u32 = 30;

/// Signed offsets of the left and the right edge \[mm\] at a distance along the bead from the
/// middle of the gauge \[mm\]; `None` where there is no bead.
pub type BeadEdges<'a> = dyn Fn(f64) -> Option<(f64, f64)> + 'a;

/// One position along the bead, and the image points of its edges.
#[derive(Debug, Clone, Copy)]
pub struct OutlineSample {
    /// Distance along the bead \[mm\].
    pub along_mm: f64,
    /// Offsets of the left and the right edge \[mm\].
    pub offset_mm: [f64; 2],
    /// Image points of both edges.
    pub projected: [AxisPoint; 2],
}

/// The visible part of a bead.
#[derive(Debug, Clone)]
pub struct BeadOutline {
    /// In the order of growing `run`. Beyond the bead's ends its edges continue straight.
    pub samples: Vec<OutlineSample>,
    /// Laid segments within the visible part \[mm\].
    pub segments: Vec<LaidSegment>,
}

/// A segment of bead between two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaidSegment {
    /// Start \[mm\]; −∞ if it is before the visible part.
    pub from_mm: f64,
    /// End \[mm\]; +∞ if it is after the visible part.
    pub to_mm: f64,
}

impl BeadOutline {
    /// Traces the bead through an image with `run` pixels along the gauge's axis, and `margin`
    /// more on both sides. `None` without bead in view.
    pub fn trace(view: &BeadView, bead: &BeadEdges<'_>, run: f64, margin: f64) -> Option<Self> {
        let step = view.pixel_mm * SAMPLE_PX;
        let most = (run + 2.0 * margin) * 16.0 / SAMPLE_PX;
        let walk = |sign: f64| {
            let mut steps = 0.0;
            while steps < most {
                steps += 1.0;
                let Some(position) = view.px(sign * steps * step, 0.0) else {
                    return steps - 1.0;
                };
                if position.run < -margin || position.run > run + margin {
                    break;
                }
            }
            steps
        };
        let (back, ahead) = (walk(-1.0), walk(1.0));
        let mut positions = Vec::new();
        let mut count = -back;
        while count <= ahead {
            positions.push((count * step, bead(count * step)));
            count += 1.0;
        }
        let segments = segments(&positions, bead);
        let mut samples: Vec<OutlineSample> = filled(&positions)?
            .filter_map(|(along_mm, (left, right))| {
                let seen = [view.px(along_mm, left)?, view.px(along_mm, right)?];
                Some(OutlineSample { along_mm, offset_mm: [left, right], projected: seen })
            })
            .collect();
        if view.run_sign() < 0.0 {
            samples.reverse();
        }
        Some(Self { samples, segments })
    }

    /// Position across the gauge of an edge (0 left, 1 right) on a line across it \[px\].
    pub fn crossing(&self, edge: usize, run: f64) -> Option<f64> {
        let (before, after, fraction) = self.around(edge, run)?;
        let (a, b) = (before.projected[edge].cross, after.projected[edge].cross);
        Some(a + (b - a) * fraction)
    }

    /// Distance along the bead of that crossing \[mm\].
    pub fn along_at(&self, edge: usize, run: f64) -> Option<f64> {
        let (before, after, fraction) = self.around(edge, run)?;
        Some(before.along_mm + (after.along_mm - before.along_mm) * fraction)
    }

    fn around(&self, edge: usize, run: f64) -> Option<(&OutlineSample, &OutlineSample, f64)> {
        let after = self.samples.partition_point(|s| s.projected[edge].run < run);
        let (before, after) = (self.samples.get(after.checked_sub(1)?)?, self.samples.get(after)?);
        let (a, b) = (before.projected[edge].run, after.projected[edge].run);
        Some((before, after, if b > a { (run - a) / (b - a) } else { 0.0 }))
    }

    /// Whether all of a segment has been laid.
    pub fn is_whole(&self, from_mm: f64, to_mm: f64) -> bool {
        self.segments.iter().any(|s| s.from_mm <= from_mm && to_mm <= s.to_mm)
    }
}

type EdgeOffsets = Option<(f64, f64)>;

/// The samples; where there is no bead, with the offsets of the nearest bead. `None` without any
/// bead.
fn filled(positions: &[(f64, EdgeOffsets)]) -> Option<impl Iterator<Item = (f64, (f64, f64))>> {
    let mut last = positions.iter().find_map(|(_, laid)| *laid)?;
    Some(positions.iter().map(move |(along_mm, laid)| {
        last = laid.unwrap_or(last);
        (*along_mm, last)
    }))
}

fn segments(positions: &[(f64, EdgeOffsets)], bead: &BeadEdges<'_>) -> Vec<LaidSegment> {
    let mut found = Vec::new();
    let mut begun = positions.first().and_then(|(_, laid)| laid.map(|_| f64::NEG_INFINITY));
    for pair in positions.windows(2) {
        let [(before, was), (after, is)] = pair else { continue };
        match (was, is, begun) {
            (None, Some(_), _) => begun = Some(bead_end(bead, *after, *before)),
            (Some(_), None, Some(from_mm)) => {
                found.push(LaidSegment { from_mm, to_mm: bead_end(bead, *before, *after) });
                begun = None;
            }
            _ => {}
        }
    }
    found.extend(begun.map(|from_mm| LaidSegment { from_mm, to_mm: f64::INFINITY }));
    found
}

/// Position of an end of the bead, between one with and one without bead \[mm\].
fn bead_end(bead: &BeadEdges<'_>, mut with_mm: f64, mut without_mm: f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (with_mm + without_mm);
        if bead(middle).is_some() {
            with_mm = middle;
        } else {
            without_mm = middle;
        }
    }
    with_mm
}
