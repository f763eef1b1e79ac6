//! Path and speed limits from G-code: G0 to G3 in the plane XY with Z, absolute or relative, in
//! millimetres or inches, feed per minute. A rapid move (G0) lays no bead: it ends one and begins the
//! next.
//!
//! The dialect is small, so it is parsed here, with line numbers in the errors. Codes that are not
//! supported and could move the robot are refused.

mod arc;
mod error;
mod state;
mod words;

pub use error::GcodeError;

use super::limits::{PathLimits, time_optimal};
use super::profile::{SpeedProfile, SpeedProfileError};
use arc::Move;
use state::{LineMotion, ModalState};

/// Largest length of the chords of an arc \[mm\]; on an arc of 5 mm radius a chord is off by 25 µm.
const MAX_CHORD_MM: f64 = 1.0;
/// Turns whose cosine is nearer to 1 are no corner: 1 − cos φ = 10⁻⁶ at φ = 0.08°.
const MIN_TURN: f64 = 1e-6;

/// Speed at the ends of beads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeadEnds {
    /// At rest.
    Rest,
    /// That of their first and last move, where the cell starts and stops them.
    Moving,
}

/// Settings of the speed limits along the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GcodeSettings {
    /// Position of the nozzle before the first line \[mm\].
    pub start_mm: [f64; 3],
    /// Largest speed, for any feed \[mm/s\].
    pub fastest_mm_per_s: f64,
    /// Acceleration, along the path and across it \[mm/s²\].
    pub accel_mm_per_s2: f64,
    /// Junction deviation \[mm\]: the speed at a corner is that of the arc which is tangent to both
    /// sides and passes the corner at this distance.
    pub corner_mm: f64,
    /// Smallest speed at a corner \[mm/s\].
    pub apex_mm_per_s: f64,
    /// Speed at the ends of beads.
    pub ends: BeadEnds,
}

/// A bead: the moves from one rapid move, or the start, to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct GcodeBead {
    /// Line of its first move.
    pub line: usize,
    /// Speed limits along its path, which begins at 0 mm.
    pub limits: PathLimits,
    /// Path and position \[mm\].
    pub position: Vec<(f64, [f64; 3])>,
}

impl GcodeBead {
    /// The time-optimal profile within the limits and an acceleration \[mm/s²\].
    pub fn nominal(&self, accel: f64) -> Result<SpeedProfile, SpeedProfileError> {
        time_optimal(&self.limits, accel)
    }
}

/// Reads all beads of a program.
pub fn read(text: &str, settings: &GcodeSettings) -> Result<Vec<GcodeBead>, GcodeError> {
    let mut state = ModalState::new(settings.start_mm);
    let mut all = Vec::new();
    let mut laid: Vec<LaidMove> = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let words = words::words(line, text)?;
        match state.interpret(line, &words)? {
            LineMotion::None => {}
            LineMotion::Rapid => all.extend(bead_of(&std::mem::take(&mut laid), settings)),
            LineMotion::Laid(moved, feed) => laid.push(LaidMove { line, moved, feed }),
        }
        if state.ended() {
            break;
        }
    }
    all.extend(bead_of(&laid, settings));
    if all.is_empty() {
        return Err(GcodeError::Empty);
    }
    Ok(all)
}

/// A move that lays bead.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LaidMove {
    line: usize,
    moved: Move,
    /// Feed \[mm/s\].
    feed: f64,
}

/// The bead of moves; `None` without a move.
fn bead_of(moves: &[LaidMove], settings: &GcodeSettings) -> Option<GcodeBead> {
    let LaidMove { line, moved: first, .. } = moves.first()?;
    // Nodes are limited by the pieces next to them.
    let end = match settings.ends {
        BeadEnds::Rest => 0.0,
        BeadEnds::Moving => settings.fastest_mm_per_s,
    };
    let mut limits = PathLimits::new(0.0, end);
    let mut position = vec![(0.0, first.at(0.0))];
    let after = moves.iter().skip(1).map(|next| Some(&next.moved)).chain([None]);
    for (LaidMove { moved, feed, .. }, next) in moves.iter().zip(after) {
        let from = limits.end_mm();
        let sideways = (settings.accel_mm_per_s2 * moved.radius_mm()).sqrt();
        let speed = feed.min(settings.fastest_mm_per_s).min(sideways);
        let there = next.map_or(end, |next| junction_speed(moved, next, settings));
        limits.extend_to(from + moved.length_mm(), speed, there);
        position.extend(
            chord_fractions(moved)
                .map(|fraction| (from + fraction * moved.length_mm(), moved.at(fraction))),
        );
    }
    Some(GcodeBead { line: *line, limits, position })
}

/// Fractions of a move at which its positions are given.
fn chord_fractions(moved: &Move) -> impl Iterator<Item = f64> + use<> {
    let count =
        if moved.radius_mm().is_finite() { (moved.length_mm() / MAX_CHORD_MM).ceil() } else { 1.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
    let pieces = (count as u32).max(1);
    (1..=pieces).map(move |piece| f64::from(piece) / f64::from(pieces))
}

/// Largest speed at the corner between two moves \[mm/s\]: v² = a·δ·c/(1 − c), with c the cosine of
/// half the turn: the radius of the arc that is tangent to both sides and passes the corner at the
/// distance δ, with the acceleration as centripetal.
fn junction_speed(before: &Move, after: &Move, settings: &GcodeSettings) -> f64 {
    let (from, to) = (before.direction(1.0), after.direction(0.0));
    let cosine: f64 = from.iter().zip(to).map(|(a, b)| a * b).sum();
    if cosine > 1.0 - MIN_TURN {
        return settings.fastest_mm_per_s;
    }
    let half = (0.5 * (1.0 + cosine)).max(0.0).sqrt();
    let square = settings.accel_mm_per_s2 * settings.corner_mm * half / (1.0 - half);
    square
        .sqrt()
        .clamp(settings.apex_mm_per_s, settings.fastest_mm_per_s.max(settings.apex_mm_per_s))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::plan::position::distance;

    const SETTINGS: GcodeSettings = GcodeSettings {
        start_mm: [0.0; 3],
        fastest_mm_per_s: 100.0,
        accel_mm_per_s2: 2000.0,
        corner_mm: 0.0,
        apex_mm_per_s: 2.0,
        ends: BeadEnds::Rest,
    };

    #[test]
    fn a_right_angle_is_the_corner_of_the_nominal_profile() {
        let text = "G21 G90\nG1 X200 F6000 ; there\nY200 (and up)\n";
        let all = read(text, &SETTINGS).unwrap();
        let profile = all[0].nominal(2000.0).unwrap();
        assert_eq!((all.len(), profile.end_mm()), (1, 400.0));
        assert!((profile.speed_at(200.0) - 2.0).abs() < 1e-9);
        assert!((profile.speed_at(100.0) - 100.0).abs() < 1e-9);
        assert_eq!(all[0].position[1], (200.0, [200.0, 0.0, 0.0]));
        // 0.1 mm of rounding: v² = 2000·0.1·c/(1 − c), c = cos 45°.
        let rounded = read(text, &GcodeSettings { corner_mm: 0.1, ..SETTINGS }).unwrap();
        let speed = rounded[0].nominal(2000.0).unwrap().speed_at(200.0);
        assert!((speed - 21.974).abs() < 1e-3, "{speed}");
    }

    #[test]
    fn relative_inches_are_the_same_path_as_absolute_millimetres() {
        let mm = read("G1 F600 X25.4\nX50.8 Y25.4 Z2.54\n", &SETTINGS).unwrap();
        let inch = read("G20 G91\nG1 F23.622047244 X1\nX1Y1Z.1\n", &SETTINGS).unwrap();
        for ((s, p), (t, q)) in mm[0].position.iter().zip(&inch[0].position) {
            assert!((s - t).abs() < 1e-9 && distance(*p, *q) < 1e-9);
        }
        let speed = inch[0].nominal(2000.0).unwrap().speed_at(10.0);
        assert!((speed - 10.0).abs() < 1e-6, "{speed}");
    }

    #[test]
    fn an_arc_has_its_length_and_the_speed_of_its_radius() {
        // Half a circle to the left, r = 1 mm: π mm, v² = a·r.
        let all = read("G3 X0 Y2 I0 J1 F6000\n", &SETTINGS).unwrap();
        let profile = all[0].nominal(2000.0).unwrap();
        assert!((profile.end_mm() - std::f64::consts::PI).abs() < 1e-9);
        let top = 2000.0_f64.sqrt();
        assert!((profile.speed_at(profile.end_mm() / 2.0) - top).abs() < 1e-9);
        let middle = all[0].position[2].1;
        assert!(distance(middle, [1.0, 1.0, 0.0]) < 1e-9, "{middle:?}");
        // The same by its radius; clockwise it turns to the other side.
        let radius = read("G3 X0 Y2 R1 F6000\n", &SETTINGS).unwrap();
        assert!((radius[0].limits.end_mm() - all[0].limits.end_mm()).abs() < 1e-6);
        let right = read("G2 X0 Y2 I0 J1 F6000\n", &SETTINGS).unwrap();
        assert!(right[0].position[2].1[0] < 0.0);
    }

    #[test]
    fn a_straight_continuation_is_no_corner_and_a_rapid_move_ends_the_bead() {
        let text = "G1 X10 F6000\nX20\nG0 X30\nG1 X40\nM30\nG1 X500\n";
        let all = read(text, &SETTINGS).unwrap();
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].line, all[1].line), (1, 4));
        assert!(all[0].nominal(2000.0).unwrap().speed_at(10.0) > 99.0);
        assert_eq!(all[1].position[0].1, [30.0, 0.0, 0.0]);
    }

    #[test]
    fn a_bead_with_moving_ends_begins_and_ends_at_its_feed() {
        let text = "G1 X200 F6000\nY200\nY300 F3000\nG0 X0\nG1 X50\n";
        let all = read(text, &GcodeSettings { ends: BeadEnds::Moving, ..SETTINGS }).unwrap();
        let speeds = |at: usize, path_mm: f64| all[at].nominal(2000.0).unwrap().speed_at(path_mm);
        let found = [speeds(0, 0.0), speeds(0, 200.0), speeds(0, 500.0), speeds(1, 0.0)];
        for (found, expected) in found.iter().zip([100.0, 2.0, 50.0, 50.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn unsupported_codes_are_refused_with_their_line() {
        let word = |text: &str| read(text, &SETTINGS).unwrap_err().to_string();
        for (text, parts) in [
            ("G1 F600 X1\nG1 X2 Y=3", ["line 2", "Y="]),
            ("G1 X10", ["line 1", "feed"]),
            ("G1 F600 X1\nG5 X3", ["line 2", "G5"]),
            ("G1 F600 X1\nG28", ["line 2", "G28"]),
            ("G92\nG1 F600 X1", ["line 1", "G92"]),
            ("G2 X2 F600", ["line 1", "I and J"]),
            ("G2 X2 I5 J0 F600", ["line 1", "5.000"]),
            ("G2 X9 R1 F600", ["line 1", "9.000"]),
            ("G1 F0 X1", ["line 1", "F0"]),
            ("G18", ["line 1", "G18"]),
            ("; nothing", ["no move", "G1"]),
        ] {
            let words = word(text);
            assert!(parts.iter().all(|part| words.contains(part)), "{text}: {words}");
        }
    }
}
