//! The modal state of a program and the motion of a line.

use super::arc::{Centre, Move};
use super::error::GcodeError;
use super::words::Word;
use crate::plan::position::distance;

/// Codes that do not change the path: the plane XY, no compensation, a work offset, exact stop and
/// continuous path, no cycle, feed per minute (numbers as in ISO 6983-1 and RS274/NGC).
const IGNORED_CODES: [f64; 9] = [17.0, 40.0, 49.0, 54.0, 61.0, 64.0, 80.0, 90.1, 94.0];
/// Millimetres in an inch. By definition (international yard, 1959).
const MM_PER_INCH: f64 = 25.4;
const KNOWN_CODES: &str = "G0 to G3, G20, G21, G90 and G91 are, and what moves nothing is passed over \
                     (docs/src/reference/job-files.md has all words); write the move with these";

/// Motion of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineMotion {
    /// No move.
    None,
    /// A rapid move.
    Rapid,
    /// A move that lays bead, and its feed \[mm/s\].
    Laid(Move, f64),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Rapid,
    Line,
    Right,
    Left,
}

/// The state that carries over from one line to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalState {
    here: [f64; 3],
    mode: Option<Mode>,
    relative: bool,
    unit_mm: f64,
    feed: Option<f64>,
    ended: bool,
}

/// Positions and centre of a line, in the program's units.
#[derive(Debug, Clone, Copy, Default)]
struct LineWords {
    axes: [Option<f64>; 3],
    centre_offset: [Option<f64>; 2],
    radius: Option<f64>,
}

impl ModalState {
    /// At a position \[mm\], absolute and in millimetres.
    pub fn new(here: [f64; 3]) -> Self {
        Self { here, mode: None, relative: false, unit_mm: 1.0, feed: None, ended: false }
    }

    /// Whether the program is over (M2, M30).
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// Interprets the words of a line.
    pub fn interpret(&mut self, line: usize, words: &[Word]) -> Result<LineMotion, GcodeError> {
        // Units apply to all numbers of the line.
        for word in words.iter().filter(|word| word.letter == 'G') {
            self.apply_code(line, word.number, words)?;
        }
        let mut line_words = LineWords::default();
        for Word { letter, number } in words.iter().copied() {
            match letter {
                'X'..='Z' => line_words.axes[letter as usize - 'X' as usize] = Some(number),
                'I' | 'J' => {
                    line_words.centre_offset[letter as usize - 'I' as usize] = Some(number);
                }
                'R' => line_words.radius = Some(number),
                'F' if number > 0.0 => self.feed = Some(number * self.unit_mm / 60.0),
                'F' => return Err(GcodeError::Feed { line, found: number }),
                'M' => self.ended |= number == 2.0 || number == 30.0,
                'G' | 'S' | 'T' | 'E' | 'P' | 'D' | 'H' => {}
                _ => return Err(unknown(line, letter, number)),
            }
        }
        self.motion(line, &line_words)
    }

    fn apply_code(&mut self, line: usize, number: f64, words: &[Word]) -> Result<(), GcodeError> {
        match number {
            0.0 => self.mode = Some(Mode::Rapid),
            1.0 => self.mode = Some(Mode::Line),
            2.0 => self.mode = Some(Mode::Right),
            3.0 => self.mode = Some(Mode::Left),
            20.0 => self.unit_mm = MM_PER_INCH,
            21.0 => self.unit_mm = 1.0,
            90.0 => self.relative = false,
            91.0 => self.relative = true,
            // Setting the extruder's position moves nothing.
            92.0 if words.iter().all(|word| matches!(word.letter, 'G' | 'E'))
                && words.iter().any(|word| word.letter == 'E') => {}
            _ if IGNORED_CODES.contains(&number) => {}
            _ => return Err(unknown(line, 'G', number)),
        }
        Ok(())
    }

    fn motion(&mut self, line: usize, line_words: &LineWords) -> Result<LineMotion, GcodeError> {
        let circle =
            line_words.centre_offset.iter().any(Option::is_some) || line_words.radius.is_some();
        if line_words.axes.iter().all(Option::is_none) && !circle {
            return Ok(LineMotion::None);
        }
        let found = || "a position without a move".to_owned();
        let wanted = "write G0, G1, G2 or G3 on it or before";
        let mode = self.mode.ok_or_else(|| GcodeError::Code { line, found: found(), wanted })?;
        let from = self.here;
        let mut to = from;
        for (to, number) in to.iter_mut().zip(line_words.axes) {
            let Some(number) = number else { continue };
            *to = number * self.unit_mm + if self.relative { *to } else { 0.0 };
        }
        self.here = to;
        let moved = match mode {
            Mode::Rapid => return Ok(LineMotion::Rapid),
            // A line of length zero lays no bead.
            Mode::Line if distance(from, to) <= 0.0 => return Ok(LineMotion::None),
            Mode::Line => Move::Line { from, to },
            Mode::Left | Mode::Right => {
                let centre = self.centre(line, line_words)?;
                Move::arc(line, from, to, centre, mode == Mode::Left)?
            }
        };
        Ok(LineMotion::Laid(moved, self.feed.ok_or(GcodeError::NoFeed(line))?))
    }

    fn centre(&self, line: usize, line_words: &LineWords) -> Result<Centre, GcodeError> {
        match (line_words.centre_offset, line_words.radius) {
            ([None, None], Some(radius)) => Ok(Centre::Radius(radius * self.unit_mm)),
            ([None, None], None) => Err(GcodeError::NoCentre(line)),
            (beside, _) => Ok(Centre::Offset(beside.map(|c| c.unwrap_or(0.0) * self.unit_mm))),
        }
    }
}

fn unknown(line: usize, letter: char, number: f64) -> GcodeError {
    GcodeError::Code { line, found: format!("{letter}{number}"), wanted: KNOWN_CODES }
}
