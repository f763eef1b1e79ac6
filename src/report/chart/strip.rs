//! What held from when to when, in bounded memory: states, limits, refused
//! frames. Where it changes too fast to be drawn the worse is kept.

/// Spells that are kept before they are gathered.
const MAX_SEGMENTS: usize = 2000;
/// Spells that a gathered strip is made of, at the most about twice as many.
const MERGED_SEGMENTS: f64 = 750.0;

/// What held; the higher severity wins where there is no room for both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mark {
    /// 0 is nothing worth drawing.
    pub severity: u8,
    /// Its name.
    pub name: &'static str,
}

/// A stretch over which a mark held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Where it began.
    pub from: f64,
    /// Where it ended.
    pub to: f64,
    /// What held.
    pub mark: Mark,
}

/// Spells one after the other.
#[derive(Debug, Clone, Default)]
pub struct Strip {
    segments: Vec<Segment>,
}

impl Strip {
    /// From `x` on this holds. x must not fall; where it does it counts as the
    /// last one.
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
        self.segments.push(Segment { from, to: from, mark });
        if self.segments.len() > MAX_SEGMENTS {
            self.merge_short();
        }
    }

    /// What has been gathered so far.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    fn merge_short(&mut self) {
        let (Some(first), Some(last)) = (self.segments.first(), self.segments.last()) else {
            return;
        };
        let cell = (last.to - first.from) / MERGED_SEGMENTS;
        let mut gathered: Vec<Segment> = Vec::with_capacity(MAX_SEGMENTS);
        for spell in self.segments.drain(..) {
            match gathered.last_mut() {
                Some(last) if last.mark == spell.mark || spell.to - last.from <= cell => {
                    last.to = spell.to;
                    last.mark = last.mark.max(spell.mark);
                }
                _ => gathered.push(spell),
            }
        }
        self.segments = gathered;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Mark = Mark { severity: 0, name: "good" };
    const BAD: Mark = Mark { severity: 1, name: "bad" };

    #[test]
    fn a_spell_lasts_until_the_next() {
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
        let bad: Vec<_> = strip.segments().iter().filter(|spell| spell.mark == BAD).collect();
        assert!(bad.iter().any(|spell| (spell.from..=spell.to).contains(&77_777.0)), "{bad:?}");
    }
}
