//! Where a row passes a level.

use super::whole;
use super::window::Row;
use crate::vision::number::single;
use crate::vision::sheet::SPAN;

/// Pixels about a start among which the darkest is begun from.
const NEAR: usize = 3;

/// Position at which a row rises through a level, seen from outside \[px\]: inwards
/// from the darkest pixel about `start`, or outwards where that is bright already.
/// `None` where it does not within the window.
#[inline(always)]
pub fn of(row: &Row, start: f32, level: f32) -> Option<f32> {
    let start = whole(start).min(SPAN - 1);
    let near = start.saturating_sub(NEAR)..(start + NEAR + 1).min(SPAN);
    let mut at = near.min_by(|&a, &b| row[a].total_cmp(&row[b]))?;
    if row[at] < level {
        while row[at] < level {
            at += 1;
            if at >= SPAN - 1 {
                return None;
            }
        }
    } else {
        while at > 0 && row[at - 1] >= level {
            at -= 1;
        }
        if at <= 1 {
            return None;
        }
    }
    let step = row[at] - row[at - 1];
    (step > 0.0).then(|| single(at) - (row[at] - level) / step)
}
