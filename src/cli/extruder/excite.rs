//! `truebead extruder excite`: profiles that excite an extruder.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::{Args, Subcommand};

use super::log::columns::units;
use crate::cli::arguments::{WrongArguments, refuse_replacing};
use crate::core::{Quantity, Unit};
use crate::identify::command_profile::{CommandProfile, file};
use crate::identify::digits::six_digits;
use crate::identify::excitation::{Excitation, Waveform};
use crate::io::atomic_file::write_atomic;

/// Shortest accepted hold time \[s\]; a shorter one probably has a wrong unit.
const SHORTEST_S: f64 = 1e-3;
/// Default period of a cell's commands \[s\]: `io_rate_hz` of 50 Hz.
const DEFAULT_PERIOD_S: f64 = 0.02;

/// Writes a profile that excites an extruder, so that its model can be found.
///
/// A cell plays it on the extruder while everything is logged; `truebead extruder identify`
/// finds the model in the log.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  truebead extruder excite prbs --low 20 --high 40 --hold-s 0.7 --quantity screw_rpm --out profile.csv
  truebead extruder excite gaussian --low 2 --high 4 --hold-s 1.5 --duration-s 90 --quantity drive_v --out profile.csv
  truebead extruder excite steps --levels 20,40,30,20 --hold-s 15 --quantity screw_rpm --out profile.csv

Which hold time: about a third of the time in which the extruder answers; it is excited
up to 0.44 / hold time. The whole should last ten times as long as the slowest answer.

The file has the columns time_s and the quantity; each value holds until the next line,
and the last line marks the end."
)]
pub struct ExciteArgs {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Debug, Subcommand)]
enum Kind {
    Prbs(PrbsArgs),
    Gaussian(GaussianArgs),
    Steps(StepsArgs),
}

/// A pseudo-random binary sequence of maximal length between two levels
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Example:
  truebead extruder excite prbs --low 20 --high 40 --hold-s 0.7 --quantity screw_rpm --out profile.csv"
)]
struct PrbsArgs {
    /// Level of a zero
    #[arg(long)]
    low: f64,
    /// Level of a one
    #[arg(long)]
    high: f64,
    /// Bits of its shift register, 3 to 16: it repeats itself after 2^N − 1 bits
    /// [default: 7, or what a longer --duration-s takes]
    #[arg(long, value_name = "N")]
    bits: Option<u32>,
    #[command(flatten)]
    all: CommonArgs,
}

/// Levels that are drawn at random, normally distributed
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Example:
  truebead extruder excite gaussian --low 2 --high 4 --hold-s 1.5 --duration-s 90 \\
      --quantity drive_v --out profile.csv"
)]
struct GaussianArgs {
    /// Smallest level
    #[arg(long)]
    low: f64,
    /// Largest level
    #[arg(long)]
    high: f64,
    /// Mean level
    /// [default: midway]
    #[arg(long)]
    mean: Option<f64>,
    /// Standard deviation
    /// [default: a sixth of the way from the smallest to the largest level]
    #[arg(long)]
    sigma: Option<f64>,
    /// The same seed gives the same levels
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    all: CommonArgs,
}

fn parse_level(text: &str) -> Result<f64, String> {
    let level = text.trim().parse::<f64>().ok().filter(|level| level.is_finite());
    level.ok_or_else(|| "expected numbers with a comma between them, such as 20,40,30".to_owned())
}

/// Levels that are given, one after the other
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Example:
  truebead extruder excite steps --levels 20,40,30,20 --hold-s 15 --quantity screw_rpm --out profile.csv"
)]
struct StepsArgs {
    /// The levels, such as 20,40,30
    #[arg(long, value_delimiter = ',', value_parser = parse_level, required = true,
          allow_hyphen_values = true)]
    levels: Vec<f64>,
    #[command(flatten)]
    all: CommonArgs,
}

#[derive(Debug, Args)]
struct CommonArgs {
    /// How long each level is held; the bit time of a sequence [s]
    #[arg(long, alias = "bit-s", value_name = "S")]
    hold_s: f64,
    /// How long it lasts, without what is before and after [s]
    /// [default: one period of a sequence, each of the steps once]
    #[arg(long, value_name = "S")]
    duration_s: Option<f64>,
    /// Time at the middle level (steps: the first one) before it [s]
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    lead_in_s: f64,
    /// The same after it [s]
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    lead_out_s: f64,
    /// What is commanded: the column's name, which ends with its unit (see the examples)
    #[arg(long, value_name = "NAME")]
    quantity: String,
    /// File to write; one that is there already is refused
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
}

/// Runs the command; the result goes to standard output.
pub fn run(args: &ExciteArgs) -> Result<()> {
    let (shape, level, all) = match &args.kind {
        Kind::Prbs(prbs) => {
            let bits = prbs.bits.unwrap_or_else(|| bits_for(&prbs.all));
            let shape = Waveform::Prbs { bits, low: prbs.low, high: prbs.high };
            (shape, f64::midpoint(prbs.low, prbs.high), &prbs.all)
        }
        Kind::Gaussian(gaussian) if gaussian.all.duration_s.is_none() => {
            refuse!("random levels have no end: give --duration-s");
        }
        Kind::Gaussian(gaussian) => {
            let &GaussianArgs { low, high, seed, .. } = gaussian;
            let mean = gaussian.mean.unwrap_or(f64::midpoint(low, high));
            let sigma = gaussian.sigma.unwrap_or((high - low) / 6.0);
            (Waveform::Gaussian { mean, sigma, low, high, seed }, mean, &gaussian.all)
        }
        Kind::Steps(steps) => {
            let first = steps.levels.first().copied().unwrap_or(0.0);
            (Waveform::Stairs(steps.levels.clone()), first, &steps.all)
        }
    };
    all.check()?;
    refuse_replacing(&all.out, "file")?;
    let excitation = Excitation { shape, hold_s: all.hold_s, duration_s: all.duration_s };
    let profile = excitation
        .profile()
        .and_then(|profile| Ok(profile.with_lead(level, all.lead_in_s, all.lead_out_s)?))
        .map_err(WrongArguments::new)?;
    let band = excitation.band_hz().map_err(WrongArguments::new)?;
    write_atomic(&all.out, file::to_csv(&profile, &all.quantity).as_bytes())?;
    tell(&profile, &all.quantity, &all.out);
    print_band(&excitation, band);
    Ok(())
}

impl CommonArgs {
    fn check(&self) -> Result<(), WrongArguments> {
        if Quantity::of_column(&self.quantity, None).is_none() || self.quantity.contains(',') {
            let (name, units) = (&self.quantity, units());
            refuse!("--quantity {name}: expected a name that ends with its unit, one of {units}");
        }
        self.check_commanded()?;
        if self.hold_s < SHORTEST_S {
            refuse!(
                "--hold-s {}: expected {SHORTEST_S} s or more: no extruder is commanded so often, and none \
                 answers so fast",
                self.hold_s
            );
        }
        for (name, value) in [("--lead-in-s", self.lead_in_s), ("--lead-out-s", self.lead_out_s)] {
            if !(0.0..=86_400.0).contains(&value) {
                refuse!("{name} {value}: expected 0 to 86400 s");
            }
        }
        Ok(())
    }

    /// Refuses a quantity of the bead: it cannot be commanded.
    fn check_commanded(&self) -> Result<(), WrongArguments> {
        match Unit::of_column(&self.quantity) {
            Some(unit @ (Unit::Mm | Unit::Mm2)) => Err(wrong!(
                "--quantity {}: no extruder is commanded a {}; that is what comes of it. Expected what is \
                 commanded, such as screw_rpm, drive_v, nozzle_mpa or flow_mm3_per_s",
                self.quantity,
                if unit == Unit::Mm { "width or a length" } else { "section" }
            )),
            _ => Ok(()),
        }
    }
}

/// Number of bits of the shortest sequence that does not repeat itself; at least 7.
fn bits_for(all: &CommonArgs) -> u32 {
    let bits = all.duration_s.unwrap_or(0.0) / all.hold_s;
    (7..16).find(|n| f64::from((1_u32 << n) - 1) >= bits).unwrap_or(16)
}

fn tell(profile: &CommandProfile, column: &str, out: &Path) {
    let unit = Unit::of_column(column).map_or("", Unit::symbol);
    let (low, high) = profile.range();
    let (count, end_s) = (profile.points().len(), profile.end_s());
    say!("profile    {}: {count} values of {column}, {end_s:.1} s", out.display());
    say!("values     {} to {} {unit}", six_digits(low), six_digits(high));
}

/// Prints the excited frequencies. Steps excite mainly the slowest dynamics, and a few levels have
/// no band.
fn print_band(excitation: &Excitation, (low_hz, high_hz): (f64, f64)) {
    let hold_s = six_digits(excitation.hold_s);
    if matches!(excitation.shape, Waveform::Stairs(_)) || low_hz >= high_hz {
        say!(
            "excites    up to {high_hz:.4} Hz, what is slow the most: for an extruder that has come \
             to rest {hold_s} s after a step"
        );
    } else {
        say!("excites    {low_hz:.4} to {high_hz:.4} Hz with half of its power density or more");
    }
    if excitation.hold_s < DEFAULT_PERIOD_S {
        say!(
            "hint       each level holds for {hold_s} s: set io_rate_hz of the cell to {:.0} or more, \
             so that none is left out",
            (1.0 / excitation.hold_s).ceil()
        );
    }
}
