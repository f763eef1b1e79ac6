//! Columns of a recording about extruder, robot and bead, for the identification of a model.

use crate::control::{Event, Step};
use crate::core::{MPa, Mm, Mm3PerS, MmPerS, RobotState, Rpm, Stamp, Unit};
use crate::extruder::demand::section;
use crate::extruder::{ExtruderCommand, ExtruderReport, PumpMode};
use crate::identify::series::TimeSeries;
use crate::io::recording::{RecordedEntry, RecordingError};

/// Name of the command's column, before its unit.
pub const COMMAND: &str = "command";

/// Facts of the cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadFacts {
    /// Unit of the extruder's command; `None` if it is not commanded.
    pub command: Option<Unit>,
    /// Height of a layer; `None` if it is unknown.
    pub layer_height: Option<Mm>,
    /// Path length from the nozzle back to the measured part of the bead.
    pub offset: Mm,
}

/// The columns of a bead.
#[derive(Debug, Clone, PartialEq)]
pub struct BeadColumns {
    /// Columns, on the clock of the run; those without a sample are omitted.
    pub columns: Vec<TimeSeries>,
    /// Remarks about the columns.
    pub notes: Vec<String>,
}

/// The columns of one bead: the longest interval in which the robot lays bead, and the pump runs
/// if it sends reports. Fails if the recording becomes unreadable.
pub fn columns(
    entries: impl IntoIterator<Item = Result<RecordedEntry, RecordingError>>,
    facts: &BeadFacts,
) -> Result<BeadColumns, RecordingError> {
    let mut collector = ColumnCollector::new(facts);
    for entry in entries {
        match entry? {
            RecordedEntry::Event { now, event, .. } => collector.event(now, &event),
            RecordedEntry::Step { now, step, .. } => collector.step(now, &step),
            RecordedEntry::Frame(_) => {}
        }
    }
    Ok(collector.finish(facts))
}

/// An interval of time \[s\].
#[derive(Debug, Clone, Copy)]
struct BeadInterval {
    from_s: f64,
    to_s: f64,
}

impl BeadInterval {
    fn length_s(&self) -> f64 {
        self.to_s - self.from_s
    }
}

/// Intervals over which a condition holds.
#[derive(Debug, Default)]
struct Intervals {
    all: Vec<BeadInterval>,
    is_open: bool,
}

impl Intervals {
    fn observe(&mut self, now_s: f64, is_so: bool, is_new: bool) {
        match self.all.last_mut() {
            Some(last) if is_so && self.is_open && !is_new => last.to_s = now_s,
            _ if is_so => self.all.push(BeadInterval { from_s: now_s, to_s: now_s }),
            _ => {}
        }
        self.is_open = is_so;
    }
}

struct ColumnCollector {
    command: TimeSeries,
    reported: [TimeSeries; 4],
    speed: TimeSeries,
    path: TimeSeries,
    width: TimeSeries,
    laying: Intervals,
    pumping: Intervals,
    /// Whether there are reports of an extruder.
    has_pump: bool,
}

impl ColumnCollector {
    fn new(facts: &BeadFacts) -> Self {
        let measured = |name: &str| TimeSeries::new(name, false);
        let unit = facts.command.unwrap_or(Unit::One).word();
        Self {
            command: TimeSeries::new(format!("{COMMAND}_{unit}"), true),
            reported: ["screw_rpm", "pressure_mpa", "flow_mm3_per_s", "filled_mm"].map(measured),
            speed: measured("speed_mm_per_s"),
            path: measured("path_mm"),
            width: measured("width_mm"),
            laying: Intervals::default(),
            pumping: Intervals::default(),
            has_pump: false,
        }
    }

    fn event(&mut self, now: Stamp, event: &Event) {
        match event {
            Event::Robot(state) => self.robot(now.secs(), state),
            Event::Extruder(report) => self.extruder(now.secs(), report),
            Event::Measured { captured_at, width_mm, .. } => {
                self.width.push(captured_at.secs(), width_mm.get());
            }
            _ => {}
        }
    }

    fn step(&mut self, now: Stamp, step: &Step) {
        let command = step.extruder.as_ref().and_then(|side| side.command);
        if let Some(ExtruderCommand { pump_on: true, value, .. }) = command {
            self.command.push(now.secs(), value);
        }
    }

    fn robot(&mut self, now_s: f64, state: &RobotState) {
        let path = state.path_mm.get();
        let falls = self.path.values.last().is_some_and(|last| path < *last);
        self.laying.observe(now_s, state.mode.lays_bead(), falls);
        self.speed.push(now_s, state.speed_mm_per_s.get());
        self.path.push(now_s, path);
    }

    fn extruder(&mut self, now_s: f64, report: &ExtruderReport) {
        self.has_pump = true;
        self.pumping.observe(now_s, report.pump == PumpMode::On, false);
        let values = [
            report.screw_rpm.map(Rpm::get),
            report.pressure_mpa.map(MPa::get),
            report.flow_mm3_per_s.map(Mm3PerS::get),
            report.filled_mm.map(Mm::get),
        ];
        for (column, value) in self.reported.iter_mut().zip(values) {
            if let Some(value) = value {
                column.push(now_s, value);
            }
        }
    }

    /// The longest interval with bead and a running pump, and the number of such intervals.
    fn longest_interval(&self) -> (Option<BeadInterval>, usize) {
        let both = |bead: &BeadInterval| -> Vec<BeadInterval> {
            if !self.has_pump {
                return vec![*bead];
            }
            let cut = self.pumping.all.iter().map(|pump| BeadInterval {
                from_s: pump.from_s.max(bead.from_s),
                to_s: pump.to_s.min(bead.to_s),
            });
            cut.filter(|interval| interval.length_s() > 0.0).collect()
        };
        let all: Vec<BeadInterval> = self.laying.all.iter().flat_map(both).collect();
        let longest = all.iter().max_by(|a, b| a.length_s().total_cmp(&b.length_s()));
        (longest.copied(), all.len())
    }

    fn finish(self, facts: &BeadFacts) -> BeadColumns {
        let mut notes = Vec::new();
        let (interval, count) = self.longest_interval();
        let Some(interval) = interval else {
            let what = "no bead was laid with a running pump: there is nothing to find a model in";
            return BeadColumns { columns: Vec::new(), notes: vec![what.to_owned()] };
        };
        if count > 1 {
            notes.push(format!(
                "{count} beads were laid; the longest is taken, {:.2} to {:.2} s",
                interval.from_s, interval.to_s
            ));
        }
        let cut = |column: &TimeSeries| column.within(interval.from_s, interval.to_s);
        let bead =
            BeadSeries { path: cut(&self.path), speed: cut(&self.speed), width: cut(&self.width) };
        let (laid, more) = bead.laid(facts);
        notes.extend(more);
        let command = facts.command.map(|_| cut(&self.command));
        let columns = command.into_iter().chain(self.reported.iter().map(cut));
        let BeadSeries { path, speed, width } = bead;
        let columns = columns.chain([speed, path, width]).chain(laid);
        BeadColumns { columns: columns.filter(|column| !column.is_empty()).collect(), notes }
    }
}

/// Reports of robot and camera during one bead.
struct BeadSeries {
    path: TimeSeries,
    speed: TimeSeries,
    width: TimeSeries,
}

impl BeadSeries {
    /// Width and flow of the bead at the times when it was laid: the camera sees bead that left
    /// the nozzle when the path was shorter by the offset.
    fn laid(&self, facts: &BeadFacts) -> ([TimeSeries; 2], Option<String>) {
        let mut width = TimeSeries::new("laid_width_mm", false);
        let mut flow = TimeSeries::new("laid_flow_mm3_per_s", false);
        let mut too_narrow = 0_usize;
        for (measured_s, measured) in self.width.time_s.iter().zip(&self.width.values) {
            let position = self.path.at(*measured_s).map(|path| path - facts.offset.get());
            let Some(laid_s) = position.and_then(|position| self.time_at(position)) else {
                continue;
            };
            width.push(laid_s, *measured);
            let Some(height) = facts.layer_height else { continue };
            match self.flow(laid_s, *measured, height) {
                Some(value) => flow.push(laid_s, value),
                None => too_narrow += 1,
            }
        }
        let note = match facts.layer_height {
            None if !width.is_empty() => Some(
                "there is no laid_flow_mm3_per_s: the cell has no layer height; give it with \
                 --layer-height-mm"
                    .to_owned(),
            ),
            Some(height) if too_narrow > 0 => Some(format!(
                "{too_narrow} of {} widths are less than the layer's height of {height} and are \
                 not in laid_flow_mm3_per_s",
                width.len()
            )),
            _ => None,
        };
        ([width, flow], note)
    }

    /// Time at which the nozzle first reached a position on the path \[s\].
    fn time_at(&self, position: f64) -> Option<f64> {
        let after = self.path.values.partition_point(|path| *path < position);
        let before = after.checked_sub(1)?;
        let (from, to) = (*self.path.values.get(before)?, *self.path.values.get(after)?);
        let (from_s, to_s) = (*self.path.time_s.get(before)?, *self.path.time_s.get(after)?);
        Some(from_s + (to_s - from_s) * (position - from) / (to - from))
    }

    fn flow(&self, laid_s: f64, width: f64, height: Mm) -> Option<f64> {
        let section = section(Mm::new(width).ok()?, height).ok()?;
        let speed = MmPerS::new(self.speed.at(laid_s)?).ok()?;
        Some((speed * section).get())
    }
}

#[cfg(test)]
mod tests;
