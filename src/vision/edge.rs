//! Candidates for an edge: the strongest steps of a profile, up and down.

/// Pixels on either side of a position that are compared for a step there. Wide enough to hold a
/// blurred edge, narrow enough to keep two apart. By definition of [`respond`], which adds four and
/// four.
pub const STEP_HALF_WIDTH: usize = 4;

/// Positions that are passed over together where nothing reaches the floor. Derived: 32 numbers of
/// 16 bits fill a vector of 512 bits.
const BLOCK_PIXELS: usize = 32;

/// Steps of each sign that are kept per profile.
pub const MAX_STEPS_KEPT: usize = 16;

/// A position where a profile steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepCandidate {
    /// Position in the profile \[px\].
    pub at: f32,
    /// Height of the step \[grey levels\], positive.
    pub step: f32,
}

/// The strongest steps of one profile.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepCandidates {
    up: [StepCandidate; MAX_STEPS_KEPT],
    down: [StepCandidate; MAX_STEPS_KEPT],
    ups: usize,
    downs: usize,
}

impl StepCandidates {
    /// Steps from dark to bright, in no order.
    pub fn up(&self) -> &[StepCandidate] {
        &self.up[..self.ups]
    }

    /// Steps from bright to dark, in no order.
    pub fn down(&self) -> &[StepCandidate] {
        &self.down[..self.downs]
    }

    /// Candidates of given steps up.
    #[cfg(test)]
    pub fn of(up: impl Iterator<Item = StepCandidate>) -> Self {
        let mut found = Self::default();
        up.for_each(|step| keep(&mut found.up, &mut found.ups, step));
        found
    }

    /// Looks for the strongest steps of a profile's response that reach the
    /// floor. `unit` is a response of 1 in grey levels.
    #[inline(always)]
    pub fn find(&mut self, response: &[i16], floor: f32, unit: f32) {
        (self.ups, self.downs) = (0, 0);
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let floor = (floor / unit).ceil() as i16;
        let last = response.len().saturating_sub(1);
        for (number, block) in response.chunks(BLOCK_PIXELS).enumerate() {
            if reaches(block, floor) {
                let start = number * BLOCK_PIXELS;
                for u in start.max(1)..(start + block.len()).min(last) {
                    self.look_at([response[u - 1], response[u], response[u + 1]], u, floor, unit);
                }
            }
        }
    }

    #[inline(always)]
    fn look_at(&mut self, [before, here, after]: [i16; 3], u: usize, floor: i16, unit: f32) {
        if here >= floor {
            if here >= before && here > after {
                keep(&mut self.up, &mut self.ups, peak(u, [before, here, after], unit));
            }
        } else if here <= -floor && here <= before && here < after {
            keep(&mut self.down, &mut self.downs, peak(u, [-before, -here, -after], unit));
        }
    }
}

/// Whether any response is as strong as the floor.
#[inline(always)]
fn reaches(block: &[i16], floor: i16) -> bool {
    let mut any = 0;
    for value in block {
        any |= i16::from(value.abs() >= floor);
    }
    any != 0
}

/// Sum of the [`STEP_HALF_WIDTH`] pixels after each position less the sum of those before it: the
/// height of a sharp step there times their number. 0 too near the ends.
#[inline(always)]
pub fn respond(profile: &[u16], response: &mut [i16]) {
    let length = profile.len();
    if length <= 2 * STEP_HALF_WIDTH {
        response.fill(0);
        return;
    }
    let span = length - 2 * STEP_HALF_WIDTH;
    response[..STEP_HALF_WIDTH].fill(0);
    response[length - STEP_HALF_WIDTH..].fill(0);
    let part = |offset: usize| &profile[offset..][..span];
    let (b4, b3, b2, b1) = (part(0), part(1), part(2), part(3));
    let (a1, a2, a3, a4) = (part(5), part(6), part(7), part(8));
    let inner = &mut response[STEP_HALF_WIDTH..length - STEP_HALF_WIDTH];
    for u in 0..span {
        let before = (b1[u] + b2[u]) + (b3[u] + b4[u]);
        let after = (a1[u] + a2[u]) + (a3[u] + a4[u]);
        // Both fit 15 bits, so that the difference is a signed number of 16.
        inner[u] = after.wrapping_sub(before).cast_signed();
    }
}

/// Vertex of the parabola through a peak and its neighbours.
fn peak(u: usize, [before, here, after]: [i16; 3], unit: f32) -> StepCandidate {
    let (before, here, after) = (f32::from(before), f32::from(here), f32::from(after));
    let bend = before - 2.0 * here + after;
    let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    let u = u as f32;
    StepCandidate { at: u + shift.clamp(-0.5, 0.5), step: here * unit }
}

fn keep(kept: &mut [StepCandidate; MAX_STEPS_KEPT], count: &mut usize, new: StepCandidate) {
    if *count < MAX_STEPS_KEPT {
        kept[*count] = new;
        *count += 1;
        return;
    }
    let mut weakest = 0;
    for (index, candidate) in kept.iter().enumerate() {
        if candidate.step < kept[weakest].step {
            weakest = index;
        }
    }
    if kept[weakest].step < new.step {
        kept[weakest] = new;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar() -> Vec<u16> {
        (0..80).map(|u| if (20..50).contains(&u) { 480 } else { 160 }).collect()
    }

    /// A profile in quarters of a grey level, summed over `STEP_HALF_WIDTH`.
    const UNIT: f32 = 0.0625;

    #[test]
    fn a_sharp_step_responds_with_its_height_halfway_between_the_pixels() {
        let mut response = vec![0; 80];
        respond(&bar(), &mut response);
        let mut found = StepCandidates::default();
        found.find(&response, 20.0, UNIT);
        assert_eq!((found.up().len(), found.down().len()), (1, 1));
        assert!((found.up()[0].at - 19.5).abs() <= 0.5);
        assert!((found.up()[0].step - 80.0).abs() < 1e-3);
        assert!((found.down()[0].at - 49.5).abs() <= 0.5);
    }

    #[test]
    fn only_the_strongest_are_kept() {
        let mut response = vec![0; 100];
        for k in 0..20u8 {
            response[5 + 4 * usize::from(k)] = 16 * i16::from((k * 7) % 20 + 1);
        }
        let mut found = StepCandidates::default();
        found.find(&response, 1.0, UNIT);
        let mut steps: Vec<f32> = found.up().iter().map(|c| c.step).collect();
        steps.sort_by(f32::total_cmp);
        assert_eq!(steps, (5..=20u8).map(f32::from).collect::<Vec<f32>>());
    }

    #[test]
    fn a_profile_that_is_too_short_has_no_steps() {
        let mut response = [1; 8];
        respond(&[0; 8], &mut response);
        assert_eq!(response, [0; 8]);
    }

    #[test]
    fn the_largest_step_fits() {
        let profile: Vec<u16> = (0..40).map(|u| if u < 20 { 0 } else { 4095 }).collect();
        let mut response = vec![0; 40];
        respond(&profile, &mut response);
        assert_eq!(response.iter().max(), Some(&(4 * 4095)));
    }
}
