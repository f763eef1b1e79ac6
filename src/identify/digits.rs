//! Rounded numbers for messages.

/// A value to six significant digits, without trailing rounding errors.
pub fn six_digits(value: f64) -> String {
    rounded(value, 5)
}

/// A value to three significant digits, for approximate values.
pub fn three_digits(value: f64) -> String {
    rounded(value, 2)
}

fn rounded(value: f64, places: usize) -> String {
    let size = value.abs();
    if size == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let rounded = format!("{value:.places$e}");
    let Ok(rounded) = rounded.parse::<f64>() else { return rounded };
    if (1e-4..1e7).contains(&size) { rounded.to_string() } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_arithmetic_leaves_is_not_read() {
        for (value, expected) in [
            (59.999_999_999_999_99, "60"),
            (0.1 + 0.2, "0.3"),
            (-35.25, "-35.25"),
            (123_456.7, "123457"),
            (1e300, "1e300"),
            (-1.23e-7, "-1.23e-7"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(six_digits(value), expected);
        }
        assert_eq!(three_digits(138.464), "138");
    }
}
