//! Numbers as text that every YAML reader takes for the same number.

/// The shortest digits that are read back as the same number. With a point and a
/// signed exponent: readers of YAML 1.1 take `1e-5` for a text.
pub fn number(value: f64) -> String {
    let text = format!("{value:?}");
    let Some((digits, power)) = text.split_once('e') else { return text };
    let point = if digits.contains('.') { "" } else { ".0" };
    let sign = if power.starts_with('-') { "" } else { "+" };
    format!("{digits}{point}e{sign}{power}")
}

/// Numbers with commas between them.
pub fn row(values: &[f64]) -> String {
    values.iter().map(|&value| number(value)).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_a_point_and_a_signed_exponent() {
        let texts = [1.0, -1e-5, 2.5e-7, 1e300, 0.1, -0.0].map(number);
        assert_eq!(texts, ["1.0", "-1.0e-5", "2.5e-7", "1.0e+300", "0.1", "-0.0"]);
        for value in [1.0 / 3.0, 5e-324, f64::MAX, -1e-5, 123_456_789.123_456_78] {
            assert_eq!(number(value).parse(), Ok(value));
        }
    }
}
