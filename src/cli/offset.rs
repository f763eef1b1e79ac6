//! `truebead offset`: how far behind the nozzle the camera looks.

mod board;
pub mod recording;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgMatches, Args, Command, FromArgMatches};

use super::WrongArguments;
use super::calibrate::{BoardArgs, parse_length};
use crate::core::units::Mm;

/// What an MCAP file begins with.
const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// Finds how far the nozzle is from the middle of the gauge: `offset_mm` of a cell.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  truebead offset runs/first/recording.mcap
  truebead offset touch.png --cell my-cell.toml --board 9x6 --square-mm 20 --nozzle-at -1,-1

From a recording: each width is of bead that was laid one offset further back, at
the speed that the robot had there. The speed must have changed clearly while
bead was laid; one run with some steps of the target width or of the speed is
enough.

From a picture: lay a board on the bed so that the camera sees it and it reaches
under the nozzle. Let the nozzle touch it, tell where in squares from the first
inner corner (-1,-1 is the outer corner of the outermost square), and take the
picture in that pose.

Exit status: 0 found, 1 not to be told from this input, 2 wrong arguments.")]
pub struct OffsetArgs {
    /// A recording of this program, also one that was cut short (.mcap.partial), or a
    /// picture of a board
    #[arg(value_name = "RECORDING.mcap|IMAGE")]
    input: PathBuf,
    /// Cell file
    /// [default: the one that is attached to the recording]
    #[arg(long, value_name = "CELL.toml")]
    cell: Option<PathBuf>,
    /// Recording: largest offset that is tried [mm]
    /// [default: 1000]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    max_mm: Option<Mm>,
    #[command(flatten)]
    board: Told,
    /// Picture: where the nozzle touches the board, in squares from its first inner
    /// corner along a row and along a column; beyond it is negative
    #[arg(long, value_name = "X,Y", value_parser = parse_place, allow_hyphen_values = true)]
    nozzle_at: Option<[f64; 2]>,
    /// Picture: standard deviation of that place [mm]
    /// [default: 0.5]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    touch_sigma_mm: Option<Mm>,
    /// Picture: height of the board's printed face above the bed [mm]
    /// [default: 0]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    board_thickness_mm: Option<Mm>,
    /// Picture: the robot's z when it was taken, for a camera on the flange [mm]
    /// [default: that of the calibration]
    #[arg(long, value_name = "MM", value_parser = parse_length, allow_hyphen_values = true)]
    robot_z_mm: Option<Mm>,
}

/// The board, if one was told: a recording needs none.
#[derive(Debug)]
struct Told {
    board: Option<BoardArgs>,
    /// A part of one, without its counts.
    is_part: bool,
}

impl Args for Told {
    fn augment_args(command: Command) -> Command {
        // As for an update, in which nothing is required.
        BoardArgs::augment_args_for_update(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        BoardArgs::augment_args_for_update(command)
    }
}

impl FromArgMatches for Told {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let is_told = matches.contains_id("board");
        let board = is_told.then(|| BoardArgs::from_arg_matches(matches)).transpose()?;
        let is_part = ["square_mm", "marker_mm"].iter().any(|part| matches.contains_id(part));
        Ok(Self { board, is_part: is_part && !is_told })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn parse_place(text: &str) -> Result<[f64; 2], String> {
    let number = |side: &str| side.trim().parse::<f64>().ok().filter(|at| at.abs() <= 1e3);
    text.split_once(',')
        .and_then(|(x, y)| Some([number(x)?, number(y)?]))
        .ok_or_else(|| "write two numbers of squares, such as -1,-1 or 4,-2.5".to_owned())
}

/// Runs the command; the answer goes to standard output.
pub fn run(args: &OffsetArgs) -> anyhow::Result<ExitCode> {
    if is_recording(&args.input)? {
        args.refuse("a recording", &args.of_picture())?;
        recording::run(args)?;
    } else {
        args.refuse("a picture", &[("--max-mm", args.max_mm.is_some())])?;
        board::run(args)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl OffsetArgs {
    fn of_picture(&self) -> [(&'static str, bool); 6] {
        [
            ("--board", self.board.board.is_some()),
            ("--square-mm or --marker-mm", self.board.is_part),
            ("--nozzle-at", self.nozzle_at.is_some()),
            ("--touch-sigma-mm", self.touch_sigma_mm.is_some()),
            ("--board-thickness-mm", self.board_thickness_mm.is_some()),
            ("--robot-z-mm", self.robot_z_mm.is_some()),
        ]
    }

    fn refuse(&self, kind: &str, options: &[(&str, bool)]) -> Result<(), WrongArguments> {
        match options.iter().find(|(_, given)| *given) {
            None => Ok(()),
            Some((name, _)) => Err(WrongArguments::new(format!(
                "{name} means nothing for {kind}, and {} is one",
                self.input.display()
            ))),
        }
    }
}

/// Told by what the file begins with, whatever it is called.
fn is_recording(path: &Path) -> Result<bool, WrongArguments> {
    let wrong = |what: String| WrongArguments::new(format!("{}: {what}", path.display()));
    if path.is_dir() {
        return Err(wrong("a folder, expected a recording or a picture".to_owned()));
    }
    let mut begin = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MCAP.len() as u64).read_to_end(&mut begin))
        .map_err(|error| wrong(error.to_string()))?;
    Ok(begin == MCAP)
}

/// What the cell has now beside what was found, and the line for its file.
fn tell(offset_mm: f64, sigma_mm: f64, now: Option<Mm>) {
    if let Some(now) = now.map(Mm::get) {
        let off = offset_mm - now;
        say!(
            "cell       has offset_mm = {now}: {:.2} mm {}, {:.1} standard deviations",
            off.abs(),
            if off < 0.0 { "too much" } else { "too little" },
            off.abs() / sigma_mm
        );
    } else {
        say!("cell       has no offset_mm, or is not complete enough to be run");
    }
    say!();
    let places = if sigma_mm < 0.05 { 2 } else { 1 };
    say!("[camera]");
    say!("offset_mm = {offset_mm:.places$}");
    say!("offset_sigma_mm = {sigma_mm:.places$}");
}
