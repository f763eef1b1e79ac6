//! The feed on its way to the plug. Between two commands the feed is constant, so that its changes
//! describe all of it.

use std::collections::VecDeque;

/// Changes of the feed over a coordinate that only grows: seconds, or metres conveyed. It keeps a
/// fixed number of changes and discards the oldest.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedHistory {
    changes: VecDeque<Change>,
    capacity: usize,
    /// Fill ratio of the feed before the oldest change.
    initial_fill: f64,
}

/// The fill ratio of the feed from a coordinate on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    from: f64,
    fill: f64,
}

/// A segment of constant feed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedSegment {
    /// Its length, in the coordinate's unit.
    pub length: f64,
    /// Fill ratio.
    pub fill: f64,
}

impl FeedHistory {
    /// For a number of changes, at least one, after a feed that has long been constant.
    pub fn new(capacity: usize, initial_fill: f64) -> Self {
        let capacity = capacity.max(1);
        Self { changes: VecDeque::with_capacity(capacity), capacity, initial_fill }
    }

    /// From `from` on `fill` is fed. A second change at the same coordinate replaces the first.
    pub fn push(&mut self, from: f64, fill: f64) {
        if self.changes.back().is_some_and(|last| last.from >= from) {
            self.changes.pop_back();
        } else if self.last() == fill {
            return;
        }
        if self.changes.len() == self.capacity
            && let Some(oldest) = self.changes.pop_front()
        {
            self.initial_fill = oldest.fill;
        }
        self.changes.push_back(Change { from, fill });
    }

    /// The fill ratio now.
    pub fn last(&self) -> f64 {
        self.changes.back().map_or(self.initial_fill, |last| last.fill)
    }

    /// The fill ratio at a coordinate.
    pub fn at(&self, coordinate: f64) -> f64 {
        self.fill_before(self.first_after(coordinate))
    }

    /// The coordinate of the next change.
    pub fn next_change(&self, coordinate: f64) -> Option<f64> {
        self.changes.get(self.first_after(coordinate)).map(|change| change.from)
    }

    /// The segments of constant feed between two coordinates, in order.
    pub fn segments(&self, from: f64, to: f64) -> impl Iterator<Item = FeedSegment> + '_ {
        let mut at = from;
        let mut next = self.first_after(from);
        std::iter::from_fn(move || {
            if at >= to {
                return None;
            }
            let fill = self.fill_before(next);
            let end = self.changes.get(next).map_or(to, |change| change.from.min(to));
            let piece = FeedSegment { length: end - at, fill };
            at = end;
            next += 1;
            Some(piece)
        })
    }

    /// Number of the first change after a coordinate.
    fn first_after(&self, coordinate: f64) -> usize {
        self.changes.partition_point(|change| change.from <= coordinate)
    }

    /// The fill ratio before a change.
    fn fill_before(&self, number: usize) -> f64 {
        let change = number.checked_sub(1).and_then(|before| self.changes.get(before));
        change.map_or(self.initial_fill, |change| change.fill)
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
    fn the_initial_feed_lasts_until_the_first_change() {
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
    fn a_second_change_at_the_same_coordinate_replaces_the_first() {
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
        fn a_full_history_keeps_the_latest(
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
