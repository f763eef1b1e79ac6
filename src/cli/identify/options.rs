//! How the options are written.

use clap::Args;

use super::{Forms, Wanted};
use crate::cli::arguments::WrongArguments;
use crate::core::quantity::{Quantity, Unit};
use crate::identify::fit::{DeadTime, MOST_POLES, Structure};
use crate::identify::series::Series;
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;

/// Which columns are meant, and what they hold.
#[derive(Debug, Args)]
pub struct Columns {
    /// Column of what goes in, such as the speed of the screw; without input and output
    /// the columns are listed
    #[arg(long, value_name = "COLUMN")]
    pub input: Option<String>,
    /// Column of what comes out, such as the flow
    #[arg(long, value_name = "COLUMN")]
    pub output: Option<String>,
    /// Column of time
    /// [default: the one whose name begins with time]
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Unit of a column where its name does not tell it, or tells a wrong one, such as
    /// nozzle=bar or time=ms; may be repeated
    #[arg(long, value_name = "COLUMN=UNIT", value_parser = parse_told)]
    pub unit: Vec<Told>,
    /// Longest gap in time that is bridged by a straight line [s]
    /// [default: five steps]
    #[arg(long, value_name = "S", value_parser = parse_gap, allow_negative_numbers = true)]
    pub max_gap_s: Option<f64>,
    /// Leave out what was logged before this moment [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub from_s: Option<f64>,
    /// Leave out what was logged after this moment [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub to_s: Option<f64>,
}

/// A column's unit that was told.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    column: String,
    unit: String,
}

/// Seconds that a unit of time is long.
const TIMES: [(&str, f64); 3] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

impl Columns {
    /// What a column of the input or the output holds.
    pub fn quantity(&self, column: &str) -> Result<Quantity, WrongArguments> {
        let told = match self.told(column) {
            None => None,
            Some(word) => Some(Unit::of_word(word).ok_or_else(|| {
                WrongArguments::new(format!("--unit {column}={word}: expected one of {}", units()))
            })?),
        };
        Quantity::of_column(column, told).ok_or_else(|| {
            WrongArguments::new(format!(
                "the name {column} does not end with a unit (one of {}); tell it with --unit \
                 {column}=UNIT",
                units()
            ))
        })
    }

    /// The column of time among these, and how many seconds its unit has.
    pub fn time(&self, known: &[String]) -> Result<(String, f64), WrongArguments> {
        let list = known.join(", ");
        let mut candidates =
            known.iter().filter(|name| name.to_ascii_lowercase().starts_with("time"));
        let column = match (&self.time, candidates.next(), candidates.next()) {
            (Some(told), ..) => told,
            (None, Some(only), None) => only,
            (None, None, _) => {
                let what = format!("no column begins with time; name it with --time ({list})");
                return Err(WrongArguments::new(what));
            }
            (None, Some(_), Some(_)) => {
                let what =
                    format!("several columns begin with time; name one with --time ({list})");
                return Err(WrongArguments::new(what));
            }
        };
        let word = self.told(column).or_else(|| column.rsplit_once('_').map(|(_, end)| end));
        let unit = TIMES.iter().find(|unit| Some(unit.0) == word).ok_or_else(|| {
            WrongArguments::new(format!(
                "the unit of {column} is not told; add --unit {column}=s, {column}=ms or {column}=us"
            ))
        })?;
        Ok((column.clone(), unit.1))
    }

    /// The unit of a column as it was told.
    pub fn told(&self, column: &str) -> Option<&str> {
        self.unit.iter().find(|told| told.column == column).map(|told| told.unit.as_str())
    }

    fn span(&self) -> (f64, f64) {
        (self.from_s.unwrap_or(f64::NEG_INFINITY), self.to_s.unwrap_or(f64::INFINITY))
    }

    /// Keeps of columns of a table what was asked for; returns the first row
    /// that is kept. Rows without a value of the output are left out.
    pub fn cut(&self, time_s: &mut Vec<f64>, input: &mut Vec<f64>, output: &mut Vec<f64>) -> usize {
        let (from_s, to_s) = self.span();
        time_s.truncate(output.len());
        let first = time_s.iter().position(|time| *time >= from_s).unwrap_or(time_s.len());
        let end = time_s.iter().rposition(|time| *time <= to_s).map_or(first, |last| last + 1);
        for column in [time_s, input, output] {
            column.truncate(end.max(first));
            column.drain(..first);
        }
        first
    }

    /// Keeps of a column of a recording what was asked for.
    pub fn cut_series(&self, column: &Series) -> Series {
        let (from_s, to_s) = self.span();
        column.within(from_s, to_s)
    }

    /// A column that a unit was told of and that is not there.
    pub fn stray(&self, known: &[String]) -> Option<&str> {
        self.unit
            .iter()
            .map(|told| told.column.as_str())
            .find(|told| !known.iter().any(|name| name == told))
    }
}

fn units() -> String {
    Unit::all().map(Unit::word).collect::<Vec<_>>().join(", ")
}

fn parse_told(text: &str) -> Result<Told, String> {
    let (column, unit) =
        text.split_once('=').ok_or("write the column and its unit, such as nozzle=bar")?;
    Ok(Told { column: column.trim().to_owned(), unit: unit.trim().to_owned() })
}

/// One word for a form, or for those that are compared.
pub fn parse_forms(text: &str) -> Result<Forms, String> {
    let forms = match text {
        "compare" => vec![
            Structure::FirstOrder { zero: false },
            Structure::FirstOrder { zero: true },
            Structure::SecondOrderOscillating { zero: false },
            Structure::SecondOrderOscillating { zero: true },
            Structure::Transfer { poles: 3, zeros: 2 },
        ],
        "fopdt" => vec![Structure::FirstOrder { zero: false }],
        "fopdt-zero" => vec![Structure::FirstOrder { zero: true }],
        "sopdt" => vec![Structure::SecondOrderOscillating { zero: false }],
        "sopdt-zero" => vec![Structure::SecondOrderOscillating { zero: true }],
        "sopdt-real" => vec![Structure::SecondOrderReal { zero: false }],
        "sopdt-real-zero" => vec![Structure::SecondOrderReal { zero: true }],
        counts => vec![parse_counts(counts)?],
    };
    Ok(Forms(forms))
}

fn parse_counts(text: &str) -> Result<Structure, String> {
    let (poles, zeros) = pair::<usize>(text).ok_or(
        "expected compare, fopdt, fopdt-zero, sopdt, sopdt-zero, sopdt-real, sopdt-real-zero, or \
         numbers of poles and zeros such as 2,1",
    )?;
    if poles == 0 || poles > MOST_POLES || zeros > poles {
        return Err(format!("expected 1 to {MOST_POLES} poles, and no more zeros than poles"));
    }
    Ok(Structure::Transfer { poles, zeros })
}

fn pair<T: std::str::FromStr>(text: &str) -> Option<(T, T)> {
    let (a, b) = text.split_once(',')?;
    Some((a.trim().parse().ok()?, b.trim().parse().ok()?))
}

/// A dead time, a range of them, or `estimate`.
pub fn parse_dead_time(text: &str) -> Result<Wanted, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|s| (0.0..=1e4).contains(s));
    if text == "estimate" {
        return Ok(Wanted(None));
    }
    let wanted = match text.split_once("..") {
        Some((from, to)) => number(from)
            .zip(number(to))
            .filter(|(from, to)| from < to)
            .map(|(least_s, most_s)| DeadTime::Estimated { least_s, most_s }),
        None => number(text).map(DeadTime::Given),
    };
    wanted.map(|wanted| Wanted(Some(wanted))).ok_or_else(|| {
        "expected 0 to 10000 s, a range of them such as 0..3, or estimate".to_owned()
    })
}

/// A gap that is bridged.
fn parse_gap(text: &str) -> Result<f64, String> {
    let gap = text.trim().parse::<f64>().ok().filter(|s| (0.0..=1e4).contains(s));
    gap.ok_or_else(|| "expected 0 to 10000 s".to_owned())
}

/// K,T.
pub fn parse_hampel(text: &str) -> Result<Hampel, String> {
    let wrong = "expected samples to either side and standard deviations, such as 5,3";
    let (half_width, threshold) = text.split_once(',').ok_or(wrong)?;
    let half_width = half_width.trim().parse().map_err(|_| wrong)?;
    let threshold = threshold.trim().parse().map_err(|_| wrong)?;
    Hampel::new(half_width, threshold).map_err(|error| error.to_string())
}

/// W,P.
pub fn parse_smooth(text: &str) -> Result<SavGol, String> {
    let (window, degree) =
        pair(text).ok_or("expected samples and a degree of polynomials, such as 11,3")?;
    SavGol::new(window, degree).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn forms_and_dead_times_are_read() {
        assert_eq!(parse_forms("compare").unwrap().0.len(), 5);
        let counts = Structure::Transfer { poles: 2, zeros: 1 };
        assert_eq!(parse_forms("2,1").unwrap().0, [counts]);
        for wrong in ["1,2", "5,0", "0,0", "second"] {
            assert!(parse_forms(wrong).is_err(), "{wrong}");
        }
        assert_eq!(parse_dead_time("0.4").unwrap().0, Some(DeadTime::Given(0.4)));
        let range = DeadTime::Estimated { least_s: 0.0, most_s: 3.0 };
        assert_eq!(parse_dead_time("0..3").unwrap().0, Some(range));
        assert!(parse_dead_time("3..1").is_err() && parse_dead_time("-1").is_err());
        assert!(parse_hampel("5,3").is_ok() && parse_hampel("0,3").is_err());
        assert!(parse_smooth("11,3").is_ok() && parse_smooth("10,3").is_err());
    }
}
