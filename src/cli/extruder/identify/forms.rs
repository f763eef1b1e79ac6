//! Syntax of forms, dead times and filters.

use crate::cli::arguments::parse_within;
use crate::identify::fit::{DeadTime, MAX_POLES, Structure};
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;

/// The forms for one word.
#[derive(Debug, Clone, PartialEq)]
pub struct Forms(pub Vec<Structure>);

/// A known dead time, or the range in which it is estimated; `None` for the default range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadTimeArg(pub Option<DeadTime>);

/// Parses the name of a form, or of a group of forms.
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
    if poles == 0 || poles > MAX_POLES || zeros > poles {
        return Err(format!("expected 1 to {MAX_POLES} poles, and no more zeros than poles"));
    }
    Ok(Structure::Transfer { poles, zeros })
}

fn pair<T: std::str::FromStr>(text: &str) -> Option<(T, T)> {
    let (a, b) = text.split_once(',')?;
    Some((a.trim().parse().ok()?, b.trim().parse().ok()?))
}

/// Parses a dead time, a range of dead times, or `estimate`.
pub fn parse_dead_time(text: &str) -> Result<DeadTimeArg, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|s| (0.0..=1e4).contains(s));
    if text == "estimate" {
        return Ok(DeadTimeArg(None));
    }
    let wanted = match text.split_once("..") {
        Some((from, to)) => number(from)
            .zip(number(to))
            .filter(|(from, to)| from < to)
            .map(|(least_s, most_s)| DeadTime::Estimated { min_s: least_s, max_s: most_s }),
        None => number(text).map(DeadTime::Known),
    };
    wanted.map(|wanted| DeadTimeArg(Some(wanted))).ok_or_else(|| {
        "expected 0 to 10000 s, a range of them such as 0..3, or estimate".to_owned()
    })
}

/// Parses the longest gap that is interpolated \[s\].
pub fn parse_gap(text: &str) -> Result<f64, String> {
    parse_within(text, 0.0..=1e4, "expected 0 to 10000 s")
}

/// Parses K,T: samples to either side and a limit in standard deviations.
pub fn parse_hampel(text: &str) -> Result<Hampel, String> {
    let wrong = "expected samples to either side and standard deviations, such as 5,3";
    let (half_width, threshold) = text.split_once(',').ok_or(wrong)?;
    let half_width = half_width.trim().parse().map_err(|_| wrong)?;
    let threshold = threshold.trim().parse().map_err(|_| wrong)?;
    Hampel::new(half_width, threshold).map_err(|error| error.to_string())
}

/// Parses W,P: window length and polynomial degree.
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
        assert_eq!(parse_dead_time("0.4").unwrap().0, Some(DeadTime::Known(0.4)));
        let range = DeadTime::Estimated { min_s: 0.0, max_s: 3.0 };
        assert_eq!(parse_dead_time("0..3").unwrap().0, Some(range));
        assert!(parse_dead_time("3..1").is_err() && parse_dead_time("-1").is_err());
        assert!(parse_hampel("5,3").is_ok() && parse_hampel("0,3").is_err());
        assert!(parse_smooth("11,3").is_ok() && parse_smooth("10,3").is_err());
    }
}
