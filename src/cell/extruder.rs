//! `[extruder]` and `[extruder_plant]`: the extruder's command with its limits, and the plant of a
//! simulated cell. There are no defaults for limits.

mod adaptive;
mod command;
mod context;
mod part;
mod plant;
mod pressure;
mod readings;
mod screw;
mod strategy;

use std::path::{Path, PathBuf};

pub use adaptive::AdaptiveSettings;
pub use context::ExtruderRates;
pub use part::{BeadStart, CellContext, ExtruderPart};
pub use plant::{
    ExtruderPlant, GainRipple, InputLoad, LinearPlant, MeltPlant, PlantKind, PressurePlant,
    ScrewPlant, ScrewPulsation,
};
pub use strategy::{FeedforwardKeys, ModelSource, Strategy};

use command::read_limits;
use context::{ReadContext, read_rates};

use crate::core::{MPa, Mm, MmPerS, Span};
use crate::document::Table;
use crate::extruder::demand::section;
use crate::extruder::{
    CommandLimits, CommandQuantity, ExtruderSetup, ExtruderStrategy, FlowDemand, FlowFollows,
    ReadingFilters, RobotFollows,
};
use crate::width_control::distance::ScrewPulses;

/// The extruder side of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderSettings {
    /// Quantity of the command.
    pub drive: CommandQuantity,
    /// Range and rate of the command.
    pub limits: CommandLimits,
    /// Strategy that gives the commands.
    pub strategy: Strategy,
    /// Height of a layer.
    pub layer_height: Mm,
    /// What the flow follows.
    pub follows: FlowFollows,
    /// What the robot's speed follows besides the width.
    pub robot_follows: RobotFollows,
    /// Rates of feedforward, feedback and link.
    pub rates: ExtruderRates,
    /// Longest time without a report over which the strategy goes on.
    pub max_gap: Span,
    /// Longest hold, and longest start, before the pump is stopped.
    pub max_hold: Span,
    /// Pressure at which the pump is stopped, if the file says so.
    pub max_pressure: Option<MPa>,
    /// Filters of the readings for the strategy.
    pub filters: ReadingFilters,
    /// The file of its starts and stops, if the cell names one.
    pub starts: Option<PathBuf>,
    /// The plan of the job, if the cell names one.
    pub plan: Option<PathBuf>,
    /// How long a command holds at the extruder \[ms\].
    pub valid_ms: u64,
    /// Pulses of the flow with every turn of the screw, if the file says so.
    pub pulses_per_turn: Option<f64>,
}

/// How long a command holds at the extruder unless the file says so \[ms\].
const VALID_MS: u64 = 300;

impl ExtruderSettings {
    /// Reads `[extruder]`.
    pub fn read(table: &Table<'_>, folder: &Path) -> Option<Self> {
        let drive = table.required_choice("command", &CommandQuantity::WORDS);
        let rates = read_rates(table);
        if drive.is_none() || rates.is_none() {
            table.allow_unknown_keys();
        }
        let limits = drive.and_then(|drive| read_limits(table, drive));
        let strategy = drive.zip(rates).and_then(|(drive, rates)| {
            let context = ReadContext { folder, drive, limits, rates };
            Strategy::read(table, &context)
        });
        let height = table.number("layer_height_mm", 1e-3..=1e4);
        let robot_follows = table.choice(
            "robot_follows",
            &[("nothing", RobotFollows::Nothing), ("flow", RobotFollows::Flow)],
        );
        let follows = read_follows(table, robot_follows);
        if robot_follows == Some(RobotFollows::Flow)
            && strategy.as_ref().is_some_and(|known| !matches!(known, Strategy::Feedforward(_)))
        {
            let expected = "strategy = \"feedforward\", whose model predicts the flow";
            table.report("robot_follows", "\"flow\"", expected);
        }
        let max_gap = table.number("max_gap_s", 0.01..=60.0);
        if let Some((gap, rates)) = max_gap.zip(rates)
            && gap < shortest_s(rates.io_hz)
        {
            let shortest = shortest_s(rates.io_hz);
            let min_gap = format!("at least {shortest:.3}, one and a half periods of io_rate_hz");
            table.report("max_gap_s", gap.to_string(), min_gap);
        }
        let max_hold = table.number("max_hold_s", 0.1..=3600.0);
        if let Some((gap, hold)) = max_gap.zip(max_hold)
            && gap > hold
        {
            table.report("max_gap_s", gap.to_string(), format!("at most max_hold_s = {hold}"));
        }
        let max_pressure = table.optional_number("max_pressure_mpa", 1e-6..=1e4);
        let filters = readings::read(table);
        let named = |key| table.has(key).then(|| table.text(key)).flatten();
        let [starts, plan] = ["starts", "plan"].map(|key| named(key).map(|file| folder.join(file)));
        if plan.is_some()
            && strategy.as_ref().is_some_and(|known| !matches!(known, Strategy::Feedforward(_)))
        {
            let expected = "strategy = \"feedforward\", with the model that was planned with";
            table.report("plan", "the plan of a job", expected);
        }
        if starts.is_some() && strategy.as_ref().is_some_and(|known| !known.holds_during_start()) {
            let expected = "strategy = \"constant\" or \"feedforward\": while the flow of a start \
                            comes the strategy stands at its first command";
            table.report("starts", "how the extruder starts and stops", expected);
        }
        let valid_ms = read_valid_ms(table, rates.map(|rates| rates.io_hz));
        let pulses_per_turn = table.optional_number("pulses_per_turn", 0.01..=1000.0);
        Some(Self {
            drive: drive?,
            limits: limits?,
            strategy: strategy?,
            layer_height: Mm::new(height?).ok()?,
            follows: follows?,
            robot_follows: robot_follows?,
            rates: rates?,
            max_gap: Span::from_secs(max_gap?),
            max_hold: Span::from_secs(max_hold?),
            max_pressure: max_pressure.and_then(|pressure| MPa::new(pressure).ok()),
            filters: filters?,
            starts,
            plan,
            valid_ms: valid_ms?,
            pulses_per_turn,
        })
    }

    /// The flow of a bead of this width at this speed; reports a bead that is
    /// narrower than it is high.
    pub fn demand(&self, table: &Table<'_>, width: Mm, speed: MmPerS) -> Option<FlowDemand> {
        match section(width, self.layer_height) {
            Ok(section) => Some(FlowDemand::new(section, speed, self.follows)),
            Err(error) => {
                table.report("layer_height_mm", self.layer_height.to_string(), error.to_string());
                None
            }
        }
    }

    /// How long a command is valid: `valid_ms`, and never less than two commands are apart; that
    /// is checked only where the extruder is reached over a link.
    fn command_valid(&self) -> Span {
        let valid = Span::from_millis(i64::try_from(self.valid_ms).unwrap_or(i64::MAX));
        valid.max(Span::from_secs(shortest_s(self.rates.io_hz)))
    }

    /// Pulses of the flow by the screw. Its speed is valid as long as a command is: then it stands.
    pub fn screw_pulses(&self) -> Option<ScrewPulses> {
        let valid = self.command_valid();
        self.pulses_per_turn.map(|per_turn| ScrewPulses { per_turn, valid })
    }

    /// The setup of the extruder side with the controller of a strategy. Start and stop times and
    /// the plan are in other files, and `None` here.
    pub fn setup(&self, strategy: ExtruderStrategy) -> ExtruderSetup {
        let period = |hz: f64| Span::from_secs(1.0 / hz);
        ExtruderSetup {
            quantity: self.drive,
            strategy,
            limits: self.limits,
            feedforward_period: period(self.rates.feedforward_hz),
            control_period: period(self.rates.control_hz),
            io_period: period(self.rates.io_hz),
            command_valid: self.command_valid(),
            max_gap: self.max_gap,
            max_hold: self.max_hold,
            max_pressure: self.max_pressure,
            filters: self.filters,
            robot_follows: self.robot_follows,
            timing: None,
            plan: None,
        }
    }
}

/// Shortest time that reports may stay away, and that a command holds, at an extruder that is
/// commanded and reports `io_hz` times a second: one and a half periods \[s\].
fn shortest_s(io_hz: f64) -> f64 {
    1.5 / io_hz
}

/// How long a command holds at an extruder that is commanded and reports `io_hz` times a
/// second \[ms\].
fn read_valid_ms(table: &Table<'_>, io_hz: Option<f64>) -> Option<u64> {
    let valid_ms = table.integer_or("valid_ms", 100..=1000, VALID_MS)?;
    if let Some(io_hz) = io_hz
        && table.has("driver")
        && u32::try_from(valid_ms).is_ok_and(|ms| f64::from(ms) < 1e3 * shortest_s(io_hz))
    {
        let shortest_ms = 1e3 * shortest_s(io_hz);
        let expected = format!("at least {shortest_ms:.0}, one and a half periods of io_rate_hz");
        table.report("valid_ms", valid_ms.to_string(), expected);
    }
    Some(valid_ms)
}

/// Reads what the flow follows. A flow that follows a robot which follows the flow is refused: they
/// would slow each other down to standstill.
fn read_follows(table: &Table<'_>, robot_follows: Option<RobotFollows>) -> Option<FlowFollows> {
    let words = [("robot", FlowFollows::Robot), ("start_speed", FlowFollows::StartSpeed)];
    if robot_follows != Some(RobotFollows::Flow) {
        return table.choice("follows", &words);
    }
    if !table.has("follows") {
        return Some(FlowFollows::StartSpeed);
    }
    let follows = table.choice("follows", &words);
    if follows == Some(FlowFollows::Robot) {
        let expected = "\"start_speed\": with robot_follows = \"flow\" the robot goes by the flow";
        table.report("follows", "\"robot\"", expected);
    }
    follows
}
