//! Candidates for an edge: the strongest steps of a profile, up and down.

/// Pixels on either side of a place that are compared for a step there. Wide
/// enough to gather a blurred edge, narrow enough to keep two apart.
pub const REACH: usize = 4;

/// Steps of each sign that are kept a profile.
pub const KEPT: usize = 16;

/// A place where a profile steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Candidate {
    /// Position in the profile \[px\].
    pub at: f32,
    /// Height of the step \[grey levels\], positive.
    pub step: f32,
}

/// The strongest steps of one profile.
#[derive(Debug, Clone, Copy, Default)]
pub struct Candidates {
    up: [Candidate; KEPT],
    down: [Candidate; KEPT],
    ups: usize,
    downs: usize,
}

impl Candidates {
    /// Steps from dark to bright, in no order.
    pub fn up(&self) -> &[Candidate] {
        &self.up[..self.ups]
    }

    /// Steps from bright to dark, in no order.
    pub fn down(&self) -> &[Candidate] {
        &self.down[..self.downs]
    }

    /// Looks for the strongest steps of a profile's response that reach the
    /// floor.
    pub fn find(response: &[f32], floor: f32) -> Self {
        let mut found = Self::default();
        for u in 1..response.len().saturating_sub(1) {
            let here = response[u];
            let size = here.abs();
            if size < floor {
                continue;
            }
            let (before, after) = (response[u - 1], response[u + 1]);
            if here > 0.0 && here >= before && here > after {
                keep(&mut found.up, &mut found.ups, peak(u, before, here, after));
            } else if here < 0.0 && here <= before && here < after {
                keep(&mut found.down, &mut found.downs, peak(u, -before, size, -after));
            }
        }
        found
    }
}

/// Mean of the pixels after each place less the mean of those before it:
/// the height of a sharp step there. Places too near the ends have none.
pub fn respond(profile: &[f32], response: &mut [f32]) {
    response.fill(0.0);
    if profile.len() <= 2 * REACH {
        return;
    }
    let span = profile.len() - 2 * REACH;
    let inner = &mut response[REACH..REACH + span];
    for offset in 1..=REACH {
        let after = &profile[REACH + offset..][..span];
        let before = &profile[REACH - offset..][..span];
        for ((sum, &a), &b) in inner.iter_mut().zip(after).zip(before) {
            *sum += a - b;
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "REACH is small")]
    let scale = 1.0 / REACH as f32;
    for value in inner {
        *value *= scale;
    }
}

/// Vertex of the parabola through a peak and its neighbours.
fn peak(u: usize, before: f32, here: f32, after: f32) -> Candidate {
    let bend = before - 2.0 * here + after;
    let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    Candidate { at: u as f32 + shift.clamp(-0.5, 0.5), step: here }
}

fn keep(kept: &mut [Candidate; KEPT], count: &mut usize, new: Candidate) {
    if *count < KEPT {
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

    fn bar() -> Vec<f32> {
        (0..80).map(|u| if (20..50).contains(&u) { 120.0 } else { 40.0 }).collect()
    }

    #[test]
    fn a_sharp_step_responds_with_its_height_halfway_between_the_pixels() {
        let mut response = vec![0.0; 80];
        respond(&bar(), &mut response);
        let found = Candidates::find(&response, 20.0);
        assert_eq!((found.up().len(), found.down().len()), (1, 1));
        assert!((found.up()[0].at - 19.5).abs() <= 0.5);
        assert!((found.up()[0].step - 80.0).abs() < 1e-3);
        assert!((found.down()[0].at - 49.5).abs() <= 0.5);
    }

    #[test]
    fn only_the_strongest_are_kept() {
        let mut response = vec![0.0f32; 100];
        for k in 0..20u8 {
            response[5 + 4 * usize::from(k)] = f32::from((k * 7) % 20 + 1);
        }
        let found = Candidates::find(&response, 1.0);
        let mut steps: Vec<f32> = found.up().iter().map(|c| c.step).collect();
        steps.sort_by(f32::total_cmp);
        assert_eq!(steps, (5..=20u8).map(f32::from).collect::<Vec<f32>>());
    }

    #[test]
    fn a_profile_that_is_too_short_has_no_steps() {
        let mut response = [1.0; 8];
        respond(&[0.0; 8], &mut response);
        assert_eq!(response, [0.0; 8]);
    }
}
