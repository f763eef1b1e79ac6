//! Segments of path.

/// A segment of path \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathSegment {
    /// Its beginning.
    pub from_mm: f64,
    /// Its end.
    pub to_mm: f64,
}
