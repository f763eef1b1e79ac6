//! Chooses some frames for the report during the run: the first, the most uncertain, some
//! rejected ones, and an even spread over the run.

use super::image::GaugeCutout;
use crate::core::Frame;
use crate::rows::frame_row::FrameRow;
use crate::rows::names::in_words;
use crate::vision::{Edges, Gauge};

/// Largest number of frames in a report: more show more, but make the page larger.
const MAX_FRAMES: usize = 12;
/// Largest number of rejected frames among them, each with a different reason.
const MAX_REJECTED_FRAMES: usize = 4;
/// Number of evenly spaced frames above which every second one is dropped.
const MAX_SPREAD_FRAMES: usize = 16;
/// Ratio of standard deviations above which a frame replaces the most uncertain one, so that a
/// slow drift does not copy every frame.
const MIN_SIGMA_RATIO: f64 = 1.05;
/// JPEG quality of the images of a page (1 to 100): higher values make the page larger.
const JPEG_QUALITY: u8 = 82;

/// A frame of the report.
#[derive(Debug, Clone)]
pub struct ChosenFrame {
    /// Number of the frame.
    pub frame: u64,
    /// Caption of the drawing.
    pub caption: String,
    /// The drawing.
    pub jpeg: Vec<u8>,
}

/// A frame with its time and the reason for which it is kept.
#[derive(Debug, Clone)]
struct KeptCutout {
    snapshot: GaugeCutout,
    time_s: Option<f64>,
    why: &'static str,
}

/// Selects a bounded number of frames.
#[derive(Debug)]
pub struct FramePicker {
    gauge: Gauge,
    first: Option<KeptCutout>,
    largest_sigma: Option<(f64, KeptCutout)>,
    rejected: Vec<KeptCutout>,
    spread: Vec<KeptCutout>,
    stride: u64,
    measured: u64,
}

impl FramePicker {
    /// For frames that are measured with this gauge.
    pub fn new(gauge: Gauge) -> Self {
        Self {
            gauge,
            first: None,
            largest_sigma: None,
            rejected: Vec::new(),
            spread: Vec::new(),
            stride: 1,
            measured: 0,
        }
    }

    /// Considers a frame; most are dropped immediately.
    pub fn offer(&mut self, row: &FrameRow, frame: &Frame, edges: Option<Edges<'_>>) {
        let gauge = self.gauge;
        let keep = |why| KeptCutout {
            snapshot: GaugeCutout::take(frame, &gauge, edges, row.outcome),
            time_s: row.time_s,
            why,
        };
        let measured = match &row.outcome {
            Err(status) => {
                let known = self.rejected.iter().any(|kept| kept.snapshot.outcome == Err(*status));
                if self.rejected.len() < MAX_REJECTED_FRAMES && !known {
                    self.rejected.push(keep("refused"));
                }
                return;
            }
            Ok(measured) => measured,
        };
        if self.first.is_none() {
            self.first = Some(keep("first"));
        }
        let sigma = measured.sigma.get();
        if self.largest_sigma.as_ref().is_none_or(|(most, _)| sigma > most * MIN_SIGMA_RATIO) {
            self.largest_sigma = Some((sigma, keep("largest sigma")));
        }
        if self.measured.is_multiple_of(self.stride) {
            self.spread.push(keep(""));
        }
        self.measured += 1;
        if self.spread.len() > MAX_SPREAD_FRAMES {
            let mut index = 0;
            self.spread.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
    }

    /// Drawings of the selected frames, sorted by frame number.
    pub fn finish(self) -> Vec<ChosenFrame> {
        let mut chosen: Vec<KeptCutout> = self.rejected;
        chosen.extend(self.first);
        let least_sure = self.largest_sigma.map(|(_, kept)| kept);
        if let Some(kept) = least_sure.filter(|kept| is_new(&chosen, kept)) {
            chosen.push(kept);
        }
        let room = MAX_FRAMES.saturating_sub(chosen.len());
        let mut spread = self.spread;
        spread.retain(|kept| is_new(&chosen, kept));
        for index in evenly(spread.len(), room) {
            chosen.push(spread[index].clone());
        }
        chosen.sort_by_key(|kept| kept.snapshot.frame);
        chosen.iter().filter_map(draw).collect()
    }
}

/// Whether a frame has not been selected yet.
fn is_new(chosen: &[KeptCutout], kept: &KeptCutout) -> bool {
    chosen.iter().all(|other| other.snapshot.frame != kept.snapshot.frame)
}

/// `wanted` of `count` indices, evenly spaced; the last index is one of them.
fn evenly(count: usize, wanted: usize) -> Vec<usize> {
    let wanted = wanted.min(count);
    (1..=wanted).map(|part| part * count / wanted - 1).collect()
}

fn draw(kept: &KeptCutout) -> Option<ChosenFrame> {
    let mut parts = Vec::new();
    if let Some(time_s) = kept.time_s {
        parts.push(format!("{time_s:.2} s"));
    }
    match &kept.snapshot.outcome {
        Ok(measured) => {
            parts.push(format!("{:.3} ± {:.3} mm", measured.width.get(), measured.sigma.get()));
        }
        Err(status) => parts.push(format!("refused: {}", in_words(status))),
    }
    if kept.snapshot.outcome.is_ok() && !kept.why.is_empty() {
        parts.push(kept.why.to_string());
    }
    Some(ChosenFrame {
        frame: kept.snapshot.frame,
        caption: parts.join(" · "),
        jpeg: kept.snapshot.jpeg(JPEG_QUALITY)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Mm, Pixels, Roi, Size, Stamp, WidthRange};
    use crate::rows::frame_row::sample;
    use crate::vision::{BeadAxis, Polarity};

    fn picker() -> FramePicker {
        FramePicker::new(Gauge {
            calipers: 8,
            ..Gauge::new(
                Roi { x: 4, y: 4, width: 24, height: 16 },
                BeadAxis::Vertical,
                Polarity::Any,
                WidthRange { min: Mm::constant(1.0), max: Mm::constant(100.0) },
            )
        })
    }

    fn offer(picker: &mut FramePicker, seq: u64, outcome: Result<f64, &'static str>) {
        let frame =
            Frame::new(seq, Stamp::START, Size::new(32, 24), Pixels::Grey8(vec![90; 32 * 24]))
                .unwrap();
        let row = FrameRow {
            frame: seq,
            time_s: None,
            outcome: outcome.map(|sigma| sample::measured(42.0, sigma)),
            roughness: None,
            control: None,
        };
        picker.offer(&row, &frame, None);
    }

    #[test]
    fn a_long_run_is_shown_from_end_to_end() {
        let mut picker = picker();
        for seq in 0..3000 {
            let outcome = match seq {
                700..710 => Err("no_pair"),
                1500 => Err("saturated"),
                1234 => Ok(0.5),
                _ => Ok(0.02),
            };
            offer(&mut picker, seq, outcome);
        }
        assert!(picker.spread.len() <= MAX_SPREAD_FRAMES);
        let chosen = picker.finish();
        let frames: Vec<u64> = chosen.iter().map(|chosen| chosen.frame).collect();
        assert!(frames.len() <= MAX_FRAMES && frames.len() >= 8, "{frames:?}");
        for frame in [0, 700, 1234, 1500] {
            assert!(frames.contains(&frame), "{frames:?}");
        }
        assert!(*frames.last().unwrap() > 2500, "{frames:?}");
        assert!(frames.windows(2).all(|pair| pair[0] < pair[1]));
        let refused = chosen.iter().find(|chosen| chosen.frame == 700).unwrap();
        assert_eq!(refused.caption, "refused: no pair");
    }

    #[test]
    fn a_run_of_one_frame_shows_it_once() {
        let mut picker = picker();
        offer(&mut picker, 0, Ok(0.02));
        let chosen = picker.finish();
        assert_eq!(chosen.len(), 1);
        assert_eq!(chosen[0].caption, "42.000 ± 0.020 mm · first");
    }
}
