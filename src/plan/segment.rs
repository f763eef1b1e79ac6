//! Pieces of path.

/// A piece of path \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathSegment {
    /// Where it begins.
    pub from_mm: f64,
    /// Where it ends.
    pub to_mm: f64,
}
