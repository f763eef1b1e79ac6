//! How much of a bead has been laid, by the robot's reports.

use crate::control::Event;

/// Path of the nozzle since the bead began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LaidLength {
    start_mm: Option<f64>,
    /// Path since the first report that lays bead \[mm\].
    pub path_mm: f64,
}

impl LaidLength {
    /// Follows the reports of a robot that lays bead.
    pub fn follow(&mut self, event: &Event) {
        if let Event::Robot(state) = event
            && state.mode.lays_bead()
        {
            let path_mm = state.path_mm.get();
            self.path_mm = path_mm - *self.start_mm.get_or_insert(path_mm);
        }
    }
}
