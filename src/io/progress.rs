//! Progress on standard error: a bar on a terminal, plain lines otherwise.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time before the first plain line; shorter work prints none.
const FIRST_LINE: Duration = Duration::from_secs(2);
/// Time between plain lines: a longer one gives shorter logs, a shorter one more information.
const NEXT_LINE: Duration = Duration::from_secs(5);

/// Progress of a task.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    what: &'static str,
    unit: &'static str,
    plain: bool,
    next_line: Duration,
    printed: bool,
}

impl Progress {
    /// Starts; `what` is the work ("measuring"), `unit` the counted items ("frames"). Prints
    /// nothing if `quiet`.
    pub fn new(what: &'static str, unit: &'static str, total: Option<u64>, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if terminal && !quiet {
            ProgressDrawTarget::stderr_with_hz(8)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(total, target);
        let template = if total.is_some() {
            "{msg} {wide_bar} {pos}/{len} {prefix}, {eta} left"
        } else {
            "{msg} {spinner} {pos} {prefix}, {elapsed}"
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what);
        bar.set_prefix(unit);
        Self { bar, what, unit, plain: !terminal && !quiet, next_line: FIRST_LINE, printed: false }
    }

    /// Sets the number of completed items.
    pub fn set(&mut self, done: u64) {
        self.bar.set_position(done);
        if self.plain && self.bar.elapsed() >= self.next_line {
            self.next_line = self.bar.elapsed() + NEXT_LINE;
            self.say(done, "");
        }
    }

    /// Counts one completed item.
    pub fn advance(&mut self) {
        self.set(self.bar.position() + 1);
    }

    /// Writes a line above the bar.
    pub fn note(&self, line: &str) {
        self.bar.suspend(|| write_note(line));
    }

    /// Ends; the bar disappears, plain lines get a last one.
    pub fn finish(mut self) {
        let done = self.bar.position();
        self.bar.finish_and_clear();
        if self.printed {
            self.say(done, ", done");
        }
    }

    fn say(&mut self, done: u64, end: &str) {
        self.printed = true;
        let line = line(self.what, self.unit, done, self.bar.length(), self.bar.elapsed());
        let _ = writeln!(std::io::stderr(), "{line}{end}");
    }
}

/// A line on a terminal that is kept up to date; nothing elsewhere.
#[derive(Debug, Clone)]
pub struct StatusDisplay(ProgressBar);

impl StatusDisplay {
    /// An empty line; it stays empty if `quiet`.
    pub fn new(quiet: bool) -> Self {
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(None, target);
        // As long as the terminal is wide; the rest is cut off.
        if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Replaces the line.
    pub fn show(&self, line: &str) {
        self.0.set_message(line.to_owned());
    }

    /// Writes a line above it.
    pub fn note(&self, line: &str) {
        self.0.suspend(|| write_note(line));
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

fn write_note(line: &str) {
    // A closed standard error does not stop the work.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Progress of work in several threads.
#[derive(Debug)]
pub struct SharedProgress(Mutex<Progress>);

impl SharedProgress {
    /// As [`Progress::new`], with a known total.
    pub fn new(what: &'static str, unit: &'static str, total: u64, quiet: bool) -> Self {
        Self(Mutex::new(Progress::new(what, unit, Some(total), quiet)))
    }

    /// Counts one completed item.
    pub fn advance(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).advance();
    }

    /// As [`Progress::finish`].
    pub fn finish(self) {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner).finish();
    }
}

fn line(what: &str, unit: &str, done: u64, total: Option<u64>, elapsed: Duration) -> String {
    let secs = elapsed.as_secs();
    match total.filter(|total| *total > 0) {
        Some(total) => {
            let percent = u128::from(done) * 100 / u128::from(total);
            format!("{what}: {done} of {total} {unit} ({percent} %), {secs} s")
        }
        None => format!("{what}: {done} {unit}, {secs} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_lines_say_how_far() {
        let three = Duration::from_millis(3400);
        assert_eq!(
            line("measuring", "frames", 50, Some(200), three),
            "measuring: 50 of 200 frames (25 %), 3 s"
        );
        assert_eq!(line("running", "frames", 50, None, three), "running: 50 frames, 3 s");
        assert_eq!(line("running", "frames", 0, Some(0), three), "running: 0 frames, 3 s");
    }

    #[test]
    fn a_quiet_bar_counts_and_says_nothing() {
        let mut progress = Progress::new("measuring", "frames", Some(3), true);
        progress.advance();
        progress.advance();
        assert_eq!(progress.bar.position(), 2);
        assert!(progress.bar.is_hidden() && !progress.printed);
        progress.finish();
    }
}
