//! Errors of a G-code program.

/// G-code that describes no path. Lines are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GcodeError {
    /// Text that is not a word.
    #[error("line {line}: \"{found}\"; a letter and a number are expected, as X10.5")]
    Word {
        /// Line.
        line: usize,
        /// What was found.
        found: String,
    },
    /// A comment without an end, in a line.
    #[error("line {0}: a comment begins with ( and does not end; close it on its line")]
    Comment(usize),
    /// An unsupported code that could move the robot.
    #[error("line {line}: {found} is not understood; {wanted}")]
    Code {
        /// Line.
        line: usize,
        /// What was found.
        found: String,
        /// What is supported.
        wanted: &'static str,
    },
    /// A move without a feed, in a line.
    #[error("line {0}: a move before any feed; write F and its speed a minute on it or before")]
    NoFeed(usize),
    /// A feed that is not positive.
    #[error("line {line}: F{found}; a feed above 0 is expected")]
    Feed {
        /// Line.
        line: usize,
        /// What was found, in the program's units a minute.
        found: f64,
    },
    /// An arc without a centre, in a line.
    #[error("line {0}: an arc without a centre; write I and J, or R")]
    NoCentre(usize),
    /// An arc whose ends have different radii.
    #[error(
        "line {line}: the arc begins {from_mm:.3} mm from its centre and ends {to_mm:.3} mm from \
         it; both must be equal, change I and J or the end"
    )]
    Centre {
        /// Line.
        line: usize,
        /// Distance of its start \[mm\].
        from_mm: f64,
        /// Distance of its end \[mm\].
        to_mm: f64,
    },
    /// An arc whose radius is too small.
    #[error(
        "line {line}: an arc of radius {radius_mm:.3} mm to a position {way_mm:.3} mm away; at least \
         half of that is needed, and a full circle needs I and J"
    )]
    Radius {
        /// Line.
        line: usize,
        /// Its radius \[mm\].
        radius_mm: f64,
        /// Distance of its ends in the plane \[mm\].
        way_mm: f64,
    },
    /// A program without a bead.
    #[error("the program has no move that lays bead; at least one of G1, G2, G3 is expected")]
    Empty,
}
