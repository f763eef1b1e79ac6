//! What is wrong with a program.

/// G-code that cannot be taken for a path. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GcodeError {
    /// Text that is no word.
    #[error("line {line}: \"{found}\"; a letter and a number are expected, as X10.5")]
    Word {
        /// Where.
        line: usize,
        /// What was found.
        found: String,
    },
    /// A comment without an end.
    #[error("line {0}: a comment begins with ( and does not end; close it on its line")]
    Comment(usize),
    /// A code that could move the robot otherwise than is understood.
    #[error("line {line}: {found} is not understood; {wanted}")]
    Code {
        /// Where.
        line: usize,
        /// What was found.
        found: String,
        /// What may stand there, and what to do.
        wanted: &'static str,
    },
    /// A move without a feed.
    #[error("line {0}: a move before any feed; write F and its speed a minute on it or before")]
    NoFeed(usize),
    /// A feed that is none.
    #[error("line {line}: F{found}; a feed above 0 is expected")]
    Feed {
        /// Where.
        line: usize,
        /// What was found, in the program's units a minute.
        found: f64,
    },
    /// An arc without a centre.
    #[error("line {0}: an arc without a centre; write I and J, or R")]
    NoCentre(usize),
    /// An arc whose ends are not equally far from its centre.
    #[error(
        "line {line}: the arc begins {from_mm:.3} mm from its centre and ends {to_mm:.3} mm from \
         it; both must be equal, change I and J or the end"
    )]
    Centre {
        /// Where.
        line: usize,
        /// Distance of its start \[mm\].
        from_mm: f64,
        /// Distance of its end \[mm\].
        to_mm: f64,
    },
    /// An arc that does not reach.
    #[error(
        "line {line}: an arc of radius {radius_mm:.3} mm to a position {way_mm:.3} mm away; at least \
         half of that is needed, and a full circle needs I and J"
    )]
    Radius {
        /// Where.
        line: usize,
        /// Its radius \[mm\].
        radius_mm: f64,
        /// Distance of its ends in the plane \[mm\].
        way_mm: f64,
    },
    /// A program that lays nothing.
    #[error("the program has no move that lays bead; at least one of G1, G2, G3 is expected")]
    Empty,
}
