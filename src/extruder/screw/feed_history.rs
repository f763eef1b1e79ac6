//! What was fed, as long as it is on its way. Between two commands the feed is
//! held, so that a row of the moments at which it changed is all of it.

/// Changes of the feed over a coordinate that only grows: seconds, or metres
/// that were conveyed. It holds a fixed number and forgets the oldest.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedHistory {
    changes: Box<[Change]>,
    /// Place of the oldest, and how many there are.
    first: usize,
    count: usize,
    /// What was fed before the oldest change.
    initial_fill: f64,
}

/// From here on this share is fed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Change {
    from: f64,
    fill: f64,
}

/// A stretch over which the feed was held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedSegment {
    /// Its length, in the coordinate's unit.
    pub length: f64,
    /// Share that was fed.
    pub fill: f64,
}

impl FeedHistory {
    /// Room for a number of changes, at least one, after a feed that has been
    /// held for as long as matters.
    pub fn new(capacity: usize, before: f64) -> Self {
        let changes = vec![Change::default(); capacity.max(1)].into_boxed_slice();
        Self { changes, first: 0, count: 0, initial_fill: before }
    }

    /// From `from` on `fill` is fed. A second share at the same place takes the
    /// place of the first.
    pub fn push(&mut self, from: f64, fill: f64) {
        let last = self.count.checked_sub(1).map(|last| self.get(last));
        if last.is_some_and(|last| last.from >= from) {
            self.count -= 1;
        } else if last.map_or(self.initial_fill, |last| last.fill) == fill {
            return;
        }
        if self.count == self.changes.len() {
            self.initial_fill = self.get(0).fill;
            self.first = self.slot(1);
            self.count -= 1;
        }
        let slot = self.slot(self.count);
        if let Some(change) = self.changes.get_mut(slot) {
            *change = Change { from, fill };
            self.count += 1;
        }
    }

    /// The share that is fed now.
    pub fn last(&self) -> f64 {
        self.count.checked_sub(1).map_or(self.initial_fill, |last| self.get(last).fill)
    }

    /// The share that was fed at a place.
    pub fn at(&self, coordinate: f64) -> f64 {
        self.first_after(coordinate)
            .checked_sub(1)
            .map_or(self.initial_fill, |found| self.get(found).fill)
    }

    /// Where the feed changes next after a place.
    pub fn next_change(&self, coordinate: f64) -> Option<f64> {
        let found = self.first_after(coordinate);
        (found < self.count).then(|| self.get(found).from)
    }

    /// The held stretches between two places, in order.
    pub fn segments(&self, from: f64, to: f64) -> impl Iterator<Item = FeedSegment> + '_ {
        let mut at = from;
        let mut next = self.first_after(from);
        let mut fill = next.checked_sub(1).map_or(self.initial_fill, |found| self.get(found).fill);
        std::iter::from_fn(move || {
            if at >= to {
                return None;
            }
            let change = (next < self.count).then(|| self.get(next));
            let end = change.map_or(to, |change| change.from.min(to));
            let piece = FeedSegment { length: end - at, fill };
            at = end;
            next += 1;
            fill = change.map_or(fill, |change| change.fill);
            Some(piece)
        })
    }

    /// Number of the first change that lies beyond a place.
    fn first_after(&self, coordinate: f64) -> usize {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.get(middle).from <= coordinate {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }

    fn slot(&self, number: usize) -> usize {
        let slot = self.first + number;
        if slot >= self.changes.len() { slot - self.changes.len() } else { slot }
    }

    fn get(&self, number: usize) -> Change {
        self.changes.get(self.slot(number)).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pieces(history: &FeedHistory, from: f64, to: f64) -> Vec<(f64, f64)> {
        history.segments(from, to).map(|piece| (piece.length, piece.fill)).collect()
    }

    #[test]
    fn what_was_held_before_the_first_change_lasts_until_it() {
        let mut history = FeedHistory::new(4, 0.2);
        assert_eq!(pieces(&history, -1.0, 1.0), [(2.0, 0.2)]);
        history.push(0.5, 0.7);
        history.push(1.5, 0.7);
        history.push(2.0, 0.1);
        assert_eq!(pieces(&history, 0.0, 3.0), [(0.5, 0.2), (1.5, 0.7), (1.0, 0.1)]);
        assert_eq!(pieces(&history, 0.5, 1.0), [(0.5, 0.7)]);
        assert_eq!(pieces(&history, 1.0, 1.0), []);
        assert_eq!([history.at(0.4), history.at(0.5), history.at(9.0)], [0.2, 0.7, 0.1]);
        assert_eq!(history.next_change(0.5), Some(2.0));
        assert_eq!(history.next_change(2.0), None);
    }

    #[test]
    fn what_was_applied_takes_the_place_of_what_was_decided() {
        let mut history = FeedHistory::new(4, 0.2);
        history.push(1.0, 0.9);
        history.push(1.0, 0.6);
        assert_eq!(pieces(&history, 0.0, 2.0), [(1.0, 0.2), (1.0, 0.6)]);
        history.push(2.0, 0.6);
        history.push(2.0, 0.3);
        assert_eq!(pieces(&history, 1.0, 3.0), [(1.0, 0.6), (1.0, 0.3)]);
    }

    proptest! {
        #[test]
        fn a_full_history_still_tells_the_latest(
            fills in prop::collection::vec(0.0..0.9_f64, 1..40),
            from in 0.0..5.0_f64,
        ) {
            let mut history = FeedHistory::new(8, 0.5);
            for (second, fill) in (0_u32..).zip(&fills) {
                history.push(f64::from(second), *fill);
            }
            let end = f64::from(u32::try_from(fills.len()).unwrap());
            let from = (end - 7.0 + from).min(end).max(0.0);
            let mut at = from;
            for piece in history.segments(from, end) {
                let middle = at + 0.5 * piece.length;
                let held = (0_u32..40).zip(&fills).rfind(|(second, _)| f64::from(*second) <= middle);
                prop_assert_eq!(Some(&piece.fill), held.map(|(_, fill)| fill));
                at += piece.length;
            }
            prop_assert!((at - end).abs() < 1e-12);
        }
    }
}
