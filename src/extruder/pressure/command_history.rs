//! Past commands and the response of a lag to them in closed form: a command is held until the
//! next, so the lag is exact at any moment. A dead time is a moment further back and need not be
//! a multiple of any step.

use std::collections::VecDeque;

use super::Fopdt;

/// Commands per second that are kept over the longest dead time. Derived: more than the 200 Hz of
/// the feedforward.
const MAX_COMMANDS_PER_S: f64 = 250.0;

/// A command from a moment on, and the pressure at that moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Entry {
    at_s: f64,
    /// Gain times command \[MPa\].
    drive: f64,
    /// Pressure of a process with lag and gain and no dead time \[MPa\].
    pressure: f64,
}

/// Past commands.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandHistory {
    gain: f64,
    lag_s: f64,
    /// The oldest first; never empty.
    entries: VecDeque<Entry>,
    /// Number of commands that are kept.
    capacity: usize,
}

impl CommandHistory {
    /// As if `speed_rpm` had always been commanded. Keeps what is needed to look back by
    /// `back_s`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 60 s at 250 a second, some times over"
    )]
    pub fn new(model: &Fopdt, back_s: f64, speed_rpm: f64) -> Self {
        let capacity = (back_s.clamp(0.0, 1e3) * MAX_COMMANDS_PER_S).ceil() as usize + 2;
        let entries = VecDeque::with_capacity(capacity);
        let mut history = Self { gain: 0.0, lag_s: 0.0, entries, capacity };
        history.restart(model, speed_rpm);
        history
    }

    /// As if `speed_rpm` had always been commanded to this model.
    pub fn restart(&mut self, model: &Fopdt, speed_rpm: f64) {
        (self.gain, self.lag_s) = (model.gain(), model.lag_s());
        let drive = self.gain * speed_rpm;
        self.entries.clear();
        self.entries.push_back(Entry { at_s: f64::NEG_INFINITY, drive, pressure: drive });
    }

    /// A command from `at_s` on; not before the last one.
    pub fn push(&mut self, at_s: f64, speed_rpm: f64) {
        let drive = self.gain * speed_rpm;
        let last = self.entries.back();
        if last.is_some_and(|last| drive == last.drive || at_s < last.at_s) {
            return;
        }
        let entry = Entry { at_s, drive, pressure: self.pressure_at(at_s) };
        match self.entries.back_mut() {
            Some(last) if last.at_s == at_s => *last = entry,
            _ => {
                if self.entries.len() >= self.capacity {
                    self.entries.pop_front();
                }
                self.entries.push_back(entry);
            }
        }
    }

    /// Pressure of a process with this lag and gain and no dead time \[MPa\], at a moment \[s\];
    /// for one before the oldest command, at that command. Exact (zero-order hold, closed form).
    pub fn pressure_at(&self, at_s: f64) -> f64 {
        let entry = self.in_force(at_s);
        let dt_s = if entry.at_s.is_finite() { (at_s - entry.at_s).max(0.0) } else { 0.0 };
        entry.drive + (entry.pressure - entry.drive) * libm::exp(-dt_s / self.lag_s)
    }

    /// The command in force just before: one that begins now does not count.
    fn in_force(&self, at_s: f64) -> Entry {
        let later = self.entries.partition_point(|entry| entry.at_s < at_s);
        self.entries.get(later.saturating_sub(1)).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Fopdt {
        Fopdt::new(2.0, 0.84, 0.41).unwrap()
    }

    #[test]
    fn a_step_is_the_closed_form_at_any_moment() {
        let mut history = CommandHistory::new(&model(), 1.0, 0.0);
        history.push(1.0, 0.3);
        for dt in [0.0, 0.001, 0.41, 0.4137, 2.0] {
            let x = dt / 0.84;
            let found = history.pressure_at(1.0 + dt);
            assert!((found - 0.6 * (1.0 - f64::exp(-x))).abs() < 1e-14, "{dt}");
        }
        assert_eq!(history.pressure_at(0.9), 0.0);
    }

    #[test]
    fn many_short_commands_are_the_sum_of_their_steps() {
        let mut history = CommandHistory::new(&model(), 2.0, 0.5);
        let commands: Vec<(f64, f64)> =
            (0..150).map(|i| (f64::from(i) * 0.013, f64::from(i * 7 % 11) * 0.1)).collect();
        for (at, speed) in &commands {
            history.push(*at, *speed);
        }
        for t in [0.2, 0.613, 1.1, 1.93, 2.5] {
            let mut expected = 1.0;
            let mut last = 0.5;
            for (at, speed) in commands.iter().filter(|(at, _)| *at < t) {
                expected += 2.0 * (speed - last) * (1.0 - f64::exp(-(t - at) / 0.84));
                last = *speed;
            }
            assert!((history.pressure_at(t) - expected).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn a_full_history_covers_its_span() {
        let mut history = CommandHistory::new(&model(), 0.5, 0.0);
        let mut all = CommandHistory::new(&model(), 100.0, 0.0);
        for i in 0..5000 {
            let (at, speed) = (f64::from(i) * 0.005, f64::from(i % 13));
            history.push(at, speed);
            all.push(at, speed);
        }
        for back in [0.0, 0.1, 0.4999] {
            let t = 25.0 - back;
            assert!((history.pressure_at(t) - all.pressure_at(t)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_second_command_at_the_same_moment_replaces_the_first() {
        let mut history = CommandHistory::new(&model(), 1.0, 0.0);
        history.push(1.0, 5.0);
        history.push(1.0, 0.3);
        history.push(0.5, 9.0);
        assert!((history.pressure_at(1.84) - 0.6 * (1.0 - f64::exp(-1.0))).abs() < 1e-14);
    }
}
