//! How alike two keys are, to guess which one was meant.

/// Letters that two keys share at their beginnings, and at their ends.
pub(super) fn shared_ends(known: &str, found: &str) -> [usize; 2] {
    let beginning = known.bytes().zip(found.bytes()).take_while(|(a, b)| a == b).count();
    let end = known.bytes().rev().zip(found.bytes().rev()).take_while(|(a, b)| a == b).count();
    [beginning, end]
}

/// Whether an unknown key looks like a known one that was mistyped: same
/// beginning, or the same letters but for one or two.
pub(super) fn resembles(known: &str, found: &str) -> bool {
    let [beginning, end] = shared_ends(known, found);
    let longest = known.len().max(found.len());
    beginning + end + 2 >= longest || (beginning >= 6 && beginning * 2 >= longest)
}
