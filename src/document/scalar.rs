//! One value of a TOML file: as a number, and as it stands there.

use toml::de::DeValue;

pub(super) fn as_number(value: &DeValue<'_>) -> Option<f64> {
    let number = match value {
        DeValue::Float(float) => float.as_str().parse().ok()?,
        #[expect(clippy::cast_precision_loss, reason = "no key takes a number beyond 2^53")]
        DeValue::Integer(_) => as_signed(value)? as f64,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

fn as_signed(value: &DeValue<'_>) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

pub(super) fn as_integer(value: &DeValue<'_>) -> Option<u64> {
    as_signed(value).and_then(|number| u64::try_from(number).ok())
}

/// A value as it stands in the file, short enough for a message.
pub(super) fn as_written(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("\"{text}\""),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(truth) => truth.to_string(),
        DeValue::Datetime(datetime) => datetime.to_string(),
        DeValue::Array(array) => {
            let items: Vec<String> = array.iter().map(|item| as_written(item.get_ref())).collect();
            format!("[{}]", items.join(", "))
        }
        DeValue::Table(_) => "a table".to_string(),
    }
}
