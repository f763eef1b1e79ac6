//! Arguments of `truebead camera offset`.

use std::path::PathBuf;

use clap::{ArgMatches, Args, Command, FromArgMatches};

use crate::cli::arguments::{WrongArguments, parse_length};
use crate::cli::board_arguments::BoardArgs;
use crate::core::Mm;

/// Finds how far the nozzle is from the middle of the gauge: a cell's `offset_mm`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead camera offset runs/first/recording.mcap
  truebead camera offset steps/recording.mcap --latency
  truebead camera offset touch.png --cell my-cell.toml --board 9x6 --square-mm 20 --nozzle-at -1,-1

From a recording: each width is of bead that was laid one offset further back, at
the speed that the robot had there. The speed must have changed clearly while
bead was laid; one run with some steps of the target width or of the speed is
enough. With --latency the time from a frame's capture to its stamp is found too.

From an image: lay a board on the bed so that the camera sees it and it reaches
under the nozzle. Let the nozzle touch it, give its position in squares from the first
inner corner (-1,-1 is the outer corner of the outermost square), and take the
image in that pose.

Exit status: 0 found, 1 not to be determined from this input, 2 wrong arguments.")]
pub struct OffsetArgs {
    /// A recording of this program, also one that was cut short (.mcap.partial), or an
    /// image of a board
    #[arg(value_name = "RECORDING.mcap|IMAGE")]
    pub input: PathBuf,
    /// Cell file
    /// [default: the one that is attached to the recording]
    #[arg(long, value_name = "CELL.toml")]
    pub cell: Option<PathBuf>,
    /// Recording: largest offset that is tried [mm]
    /// [default: 1000]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub max_mm: Option<Mm>,
    /// Recording: find the camera's latency as well, for frames that carry no time of
    /// capture
    #[arg(long)]
    pub latency: bool,
    #[command(flatten)]
    pub board: OptionalBoard,
    /// Image: where the nozzle touches the board, in squares from its first inner
    /// corner along a row and along a column; beyond it is negative
    #[arg(long, value_name = "X,Y", value_parser = parse_position, allow_hyphen_values = true)]
    pub nozzle_at: Option<[f64; 2]>,
    /// Image: standard deviation of that position [mm]
    /// [default: 0.5]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub touch_sigma_mm: Option<Mm>,
    /// Image: height of the board's printed face above the bed [mm]
    /// [default: 0]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub board_thickness_mm: Option<Mm>,
    /// Image: the robot's z when it was taken, for a camera on the flange [mm]
    /// [default: that of the calibration]
    #[arg(long, value_name = "MM", value_parser = parse_length, allow_hyphen_values = true)]
    pub robot_z_mm: Option<Mm>,
}

/// The board, if one was given: a recording needs none.
#[derive(Debug)]
pub struct OptionalBoard {
    /// A whole board.
    pub board: Option<BoardArgs>,
    /// Whether only a part of the board was given.
    pub is_part: bool,
}

impl Args for OptionalBoard {
    fn augment_args(command: Command) -> Command {
        // As for an update, in which no argument is required.
        BoardArgs::augment_args_for_update(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        BoardArgs::augment_args_for_update(command)
    }
}

impl FromArgMatches for OptionalBoard {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let is_given = matches.contains_id("board");
        let board = is_given.then(|| BoardArgs::from_arg_matches(matches)).transpose()?;
        let is_part = ["square_mm", "marker_mm"].iter().any(|part| matches.contains_id(part));
        Ok(Self { board, is_part: is_part && !is_given })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn parse_position(text: &str) -> Result<[f64; 2], String> {
    let number = |side: &str| side.trim().parse::<f64>().ok().filter(|at| at.abs() <= 1e3);
    text.split_once(',')
        .and_then(|(x, y)| Some([number(x)?, number(y)?]))
        .ok_or_else(|| "write two numbers of squares, such as -1,-1 or 4,-2.5".to_owned())
}

impl OffsetArgs {
    /// Options that are only for an image, and whether they were given.
    pub fn of_image(&self) -> [(&'static str, bool); 6] {
        [
            ("--board", self.board.board.is_some()),
            ("--square-mm or --marker-mm", self.board.is_part),
            ("--nozzle-at", self.nozzle_at.is_some()),
            ("--touch-sigma-mm", self.touch_sigma_mm.is_some()),
            ("--board-thickness-mm", self.board_thickness_mm.is_some()),
            ("--robot-z-mm", self.robot_z_mm.is_some()),
        ]
    }

    /// Refuses options that are for the other kind of input.
    pub fn refuse(&self, kind: &str, options: &[(&str, bool)]) -> Result<(), WrongArguments> {
        match options.iter().find(|(_, given)| *given) {
            None => Ok(()),
            Some((name, _)) => {
                Err(wrong!("{name} means nothing for {kind}, and {} is one", self.input.display()))
            }
        }
    }
}
