//! Levels on either side of an edge, band by band.

use super::{Clearance, EdgeTracer, TraceInput};
use crate::numeric::number::narrow_to_f32;
use crate::numeric::rank;
use crate::vision::path;
use crate::vision::strip::GreyPixel;

/// Distance from the edge of the first pixel whose level is picked, and between such pixels \[px\].
const PICK_PX: (f32, f32) = (5.0, 3.0);

impl EdgeTracer {
    /// Levels on either side of the edge in every band, as the median of a few
    /// positions in its profile and of its neighbours.
    #[inline(always)]
    pub fn pick_levels<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        self.pick_raw_levels(scene);
        self.smooth_levels();
    }

    /// Picks levels again along the course, where it was drawn through better positions; `room` is
    /// the distance on either side that holds only the edge \[px\].
    pub fn pick_levels_within<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, room: Clearance) {
        let (path, course) = (&mut self.values.path, &self.course);
        path.clear();
        let middles = (0..scene.bands.count()).map(|band| narrow_to_f32(scene.bands.middle(band)));
        path.extend(middles.map(|middle| course.at(middle)[0]));
        self.pick_levels_in(scene, [narrow_to_f32(room.before), narrow_to_f32(room.after)]);
        self.smooth_levels();
        self.levels.draw(scene.bands, &self.values.path, &self.values.before, &self.values.step);
        self.course.take_levels(&self.levels);
    }

    /// Smooths the picked levels from band to band.
    fn smooth_levels(&mut self) {
        path::median_of_three(&mut self.values.before);
        path::median_of_three(&mut self.values.step);
        path::smooth(&self.values.before, &mut self.scratch.rough);
        std::mem::swap(&mut self.values.before, &mut self.scratch.rough);
        path::smooth(&self.values.step, &mut self.scratch.rough);
        std::mem::swap(&mut self.values.step, &mut self.scratch.rough);
        self.steady_steps();
    }

    /// Picks levels on either side of the edge, each band for itself.
    pub fn pick_raw_levels<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        let inside = 0.45 * scene.width_px;
        let room = if scene.bead_after { [f32::INFINITY, inside] } else { [inside, f32::INFINITY] };
        self.pick_levels_in(scene, room);
    }

    /// Picks levels on either side of the edge within the room before it and after it \[px\].
    fn pick_levels_in<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, room: [f32; 2]) {
        self.values.before.clear();
        self.values.step.clear();
        let (left, right) = (picked(-1.0, room[0]), picked(1.0, room[1]));
        let unit = scene.bands.unit;
        for (band, &at) in self.values.path.iter().enumerate() {
            let profile = scene.bands.profile(band);
            #[expect(clippy::cast_possible_truncation, reason = "a position in the gauge")]
            let at = (at + 0.5) as isize;
            let before = unit * level(profile, at, left);
            self.values.before.push(before);
            self.values.step.push(unit * level(profile, at, right) - before);
        }
    }

    /// Raises steps that are small or reversed, compared with the median, to 0.3 of it.
    pub fn steady_steps(&mut self) {
        self.scratch.sorted.clear();
        self.scratch.sorted.extend_from_slice(&self.values.step);
        let Some(typical) = rank::median(&mut self.scratch.sorted) else { return };
        let typical = if typical.abs() < 1.0 { 1.0f32.copysign(typical) } else { typical };
        for step in &mut self.values.step {
            if *step / typical < 0.3 {
                *step = 0.3 * typical;
            }
        }
    }
}

/// Distances from an edge at which its level on one side is picked \[px\].
#[expect(clippy::cast_possible_truncation, reason = "a few pixels")]
fn picked(sign: f32, room: f32) -> [isize; 5] {
    let near = PICK_PX.0.min(0.4 * room);
    let apart = PICK_PX.1.min((room - near) / 5.0);
    [0.0, 1.0, 2.0, 3.0, 4.0].map(|k| (sign * (near + k * apart)).round() as isize)
}

/// Level at some distances from an edge: the median of five pixels.
#[inline(always)]
fn level(profile: &[u16], at: isize, distances: [isize; 5]) -> f32 {
    let last = profile.len() - 1;
    median_of_five(distances.map(|distance| {
        let position = usize::try_from(at + distance).unwrap_or(0).min(last);
        f32::from(profile[position])
    }))
}

#[inline(always)]
fn median_of_five(values: [f32; 5]) -> f32 {
    let [first, second, third, fourth, last] = values;
    let low = first.min(second).max(third.min(fourth));
    let high = first.max(second).min(third.max(fourth));
    // The extremes of the four are out; the last lies among the rest.
    low.min(high).max(last.min(low.max(high)))
}
