//! States, limits or rejected frames over time, in bounded memory. If marks change too fast to be
//! drawn, the most severe one is kept.

/// Number of segments above which short ones are merged.
const MAX_SEGMENTS: usize = 2000;
/// Number of equal parts into which short segments are merged; at most about twice as many
/// segments remain.
const MERGED_SEGMENTS: f64 = 750.0;

/// A state, a limit or a rejection. Of several that cannot all be drawn, the most severe is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mark {
    /// Severity; 0 is not drawn.
    pub severity: u8,
    /// Its name.
    pub name: &'static str,
}

/// A segment with one mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripSegment {
    /// Start.
    pub from: f64,
    /// End.
    pub to: f64,
    /// The mark.
    pub mark: Mark,
}

/// Consecutive segments of marks.
#[derive(Debug, Clone, Default)]
pub struct Strip {
    segments: Vec<StripSegment>,
}

impl Strip {
    /// Sets the mark from `x` on. If `x` decreases, the last x is used.
    pub fn push(&mut self, x: f64, mark: Mark) {
        if !x.is_finite() {
            return;
        }
        let mut from = x;
        if let Some(last) = self.segments.last_mut() {
            from = x.max(last.to);
            last.to = from;
            if last.mark == mark {
                return;
            }
        }
        self.segments.push(StripSegment { from, to: from, mark });
        if self.segments.len() > MAX_SEGMENTS {
            self.merge_short();
        }
    }

    /// The segments so far.
    pub fn segments(&self) -> &[StripSegment] {
        &self.segments
    }

    fn merge_short(&mut self) {
        let (Some(first), Some(last)) = (self.segments.first(), self.segments.last()) else {
            return;
        };
        let cell = (last.to - first.from) / MERGED_SEGMENTS;
        let mut merged: Vec<StripSegment> = Vec::with_capacity(MAX_SEGMENTS);
        for segment in self.segments.drain(..) {
            match merged.last_mut() {
                Some(last) if last.mark == segment.mark || segment.to - last.from <= cell => {
                    last.to = segment.to;
                    last.mark = last.mark.max(segment.mark);
                }
                _ => merged.push(segment),
            }
        }
        self.segments = merged;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Mark = Mark { severity: 0, name: "good" };
    const BAD: Mark = Mark { severity: 1, name: "bad" };

    #[test]
    fn a_segment_lasts_until_the_next() {
        let mut strip = Strip::default();
        for (x, mark) in [(0.0, GOOD), (1.0, GOOD), (2.0, BAD), (3.0, GOOD)] {
            strip.push(x, mark);
        }
        let bad = strip.segments()[1];
        assert_eq!((bad.from, bad.to, bad.mark), (2.0, 3.0, BAD));
        assert_eq!(strip.segments().len(), 3);
    }

    #[test]
    fn a_lone_bad_moment_survives_hours() {
        let mut strip = Strip::default();
        let other = Mark { severity: 0, name: "other" };
        for i in 0..200_000_u32 {
            let mark = if i == 77_777 {
                BAD
            } else if i % 2 == 0 {
                GOOD
            } else {
                other
            };
            strip.push(f64::from(i), mark);
        }
        assert!(strip.segments().len() <= MAX_SEGMENTS);
        let bad: Vec<_> = strip.segments().iter().filter(|segment| segment.mark == BAD).collect();
        assert!(
            bad.iter().any(|segment| (segment.from..=segment.to).contains(&77_777.0)),
            "{bad:?}"
        );
    }
}
