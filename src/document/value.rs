//! What the keys of a table hold: numbers within their ranges, texts, words.

use std::ops::RangeInclusive;

use toml::Spanned;
use toml::de::DeValue;

use super::key_spec::KeyKind;
use super::scalar::{as_integer, as_number, as_written};
use super::table::Table;

impl<'a> Table<'a> {
    /// A number within a range; `None` where the key is absent or wrong.
    pub fn optional_number(&self, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
        if self.describe(key, || KeyKind::Number(range.clone()), false, None) {
            return self.described_number(&range);
        }
        let value = self.get(key)?.get_ref();
        let number = as_number(value);
        match number {
            Some(number) if range.contains(&number) => Some(number),
            _ => {
                self.report(key, as_written(value), expected_number(&range));
                None
            }
        }
    }

    /// A number that must be there.
    pub fn number(&self, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
        if self.describe(key, || KeyKind::Number(range.clone()), true, None) {
            return self.described_number(&range);
        }
        if !self.stands(key) {
            self.report_absent(key, expected_number(&range));
        }
        self.optional_number(key, range)
    }

    /// A number with a default.
    pub fn number_or(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        default: f64,
    ) -> Option<f64> {
        if self.describe(key, || KeyKind::Number(range.clone()), false, Some(default.to_string())) {
            return Some(default);
        }
        if self.stands(key) { self.optional_number(key, range) } else { Some(default) }
    }

    /// A number that must be there, within a range that other keys of the file give, in
    /// words.
    pub fn number_within(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        given_by: &'static str,
    ) -> Option<f64> {
        if self.describe(key, || KeyKind::NumberWithin(given_by), true, None) {
            return self.described_number(&range);
        }
        self.number(key, range)
    }

    /// A whole number within a range; `None` where the key is absent or wrong.
    pub fn optional_integer(&self, key: &'static str, range: RangeInclusive<u64>) -> Option<u64> {
        if self.describe(key, || KeyKind::Integer(range.clone()), false, None) {
            return Some(*range.start());
        }
        let value = self.get(key)?.get_ref();
        match as_integer(value) {
            Some(number) if range.contains(&number) => Some(number),
            _ => {
                let expected = format!("a whole number from {} to {}", range.start(), range.end());
                self.report(key, as_written(value), expected);
                None
            }
        }
    }

    /// A whole number with a default.
    pub fn integer_or(
        &self,
        key: &'static str,
        range: RangeInclusive<u64>,
        default: u64,
    ) -> Option<u64> {
        let written = Some(default.to_string());
        if self.describe(key, || KeyKind::Integer(range.clone()), false, written) {
            return Some(default);
        }
        if self.stands(key) { self.optional_integer(key, range) } else { Some(default) }
    }

    /// A row of `N` numbers, each within the range; it must be there.
    pub fn numbers<const N: usize>(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
    ) -> Option<[f64; N]> {
        self.row(key, &[N], range)?.try_into().ok()
    }

    /// A row of numbers that must be there, as long as one of these counts.
    pub fn row(
        &self,
        key: &'static str,
        counts: &[usize],
        range: RangeInclusive<f64>,
    ) -> Option<Vec<f64>> {
        if self.describe(key, || KeyKind::Numbers(counts.to_vec(), range.clone()), true, None) {
            let count = counts.first().copied().unwrap_or(1);
            return (0..count).map(|_| self.described_number(&range)).collect();
        }
        let lengths = match counts {
            [first, _, .., last] if counts.windows(2).all(|pair| pair[0] + 1 == pair[1]) => {
                format!("{first} to {last}")
            }
            _ => counts.iter().map(usize::to_string).collect::<Vec<_>>().join(" or "),
        };
        let expected = format!("{lengths} numbers in brackets, each {}", expected_number(&range));
        self.array(key, expected, &range, |count| counts.contains(&count))
    }

    /// One number or more in brackets, each within the range; they must be there.
    pub fn list(&self, key: &'static str, range: RangeInclusive<f64>) -> Option<Vec<f64>> {
        if self.describe(key, || KeyKind::Numbers(Vec::new(), range.clone()), true, None) {
            return (0..2).map(|_| self.described_number(&range)).collect();
        }
        let expected = format!("one number or more in brackets, each {}", expected_number(&range));
        self.array(key, expected, &range, |count| count > 0)
    }

    /// Any number of numbers in brackets, each within the range.
    fn array(
        &self,
        key: &'static str,
        expected: String,
        range: &RangeInclusive<f64>,
        may_be: impl Fn(usize) -> bool,
    ) -> Option<Vec<f64>> {
        let Some(value) = self.get(key) else {
            self.report_absent(key, expected);
            return None;
        };
        let numbers: Option<Vec<f64>> = value.get_ref().as_array().and_then(|array| {
            array.iter().map(|v| as_number(v.get_ref()).filter(|n| range.contains(n))).collect()
        });
        let found = numbers.filter(|numbers| may_be(numbers.len()));
        if found.is_none() {
            self.report(key, as_written(value.get_ref()), expected);
        }
        found
    }

    /// [`Self::numbers`] where the key may be absent.
    pub fn optional_numbers<const N: usize>(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
    ) -> Option<[f64; N]> {
        if self.describe(key, || KeyKind::Numbers(vec![N], range.clone()), false, None) {
            return None;
        }
        if self.stands(key) { self.numbers(key, range) } else { None }
    }

    /// A text that is not empty; `None` where the key is absent or wrong.
    pub fn optional_text(&self, key: &'static str) -> Option<&'a str> {
        if self.describe(key, || KeyKind::Text, false, None) {
            return Some(DESCRIBED_TEXT);
        }
        let value = self.get(key)?.get_ref();
        match value.as_str() {
            Some(text) if !text.is_empty() => Some(text),
            _ => {
                self.report(key, as_written(value), "a text in quotes");
                None
            }
        }
    }

    /// A text that must be there.
    pub fn text(&self, key: &'static str) -> Option<&'a str> {
        if self.describe(key, || KeyKind::Text, true, None) {
            return Some(DESCRIBED_TEXT);
        }
        if !self.stands(key) {
            self.report_absent(key, "a text in quotes");
        }
        self.optional_text(key)
    }

    /// A row of texts that must be there, none of them empty.
    pub fn texts(&self, key: &'static str) -> Option<Vec<String>> {
        if self.describe(key, || KeyKind::Texts, true, None) {
            return Some(vec![DESCRIBED_TEXT.to_owned()]);
        }
        let expected = "texts in brackets, each in quotes";
        let Some(value) = self.get(key) else {
            self.report_absent(key, expected);
            return None;
        };
        let texts = value.get_ref().as_array().and_then(|array| {
            let text = |item: &Spanned<DeValue<'a>>| item.get_ref().as_str().map(str::to_owned);
            array.iter().map(|item| text(item).filter(|text| !text.is_empty())).collect()
        });
        if texts.is_none() {
            self.report(key, as_written(value.get_ref()), expected);
        }
        texts
    }

    /// One of several words, or the first where the key is absent.
    pub fn choice<T: Copy>(&self, key: &'static str, words: &[(&str, T)]) -> Option<T> {
        if self.describer().is_some() {
            return self.described_choice(key, words, false);
        }
        let Some(value) = self.get(key) else { return words.first().map(|word| word.1) };
        let found =
            words.iter().find(|word| value.get_ref().as_str() == Some(word.0)).map(|word| word.1);
        if found.is_none() {
            let names: Vec<String> = words.iter().map(|word| format!("\"{}\"", word.0)).collect();
            self.report(key, as_written(value.get_ref()), names.join(" or "));
        }
        found
    }

    /// One of several words; the key must be there.
    pub fn required_choice<T: Copy>(&self, key: &'static str, words: &[(&str, T)]) -> Option<T> {
        if self.describer().is_some() {
            return self.described_choice(key, words, true);
        }
        if self.stands(key) {
            return self.choice(key, words);
        }
        let names: Vec<String> = words.iter().map(|word| format!("\"{}\"", word.0)).collect();
        self.report_absent(key, names.join(" or "));
        None
    }

    /// Records a key in a run without a file; returns whether it did.
    fn describe(
        &self,
        key: &'static str,
        kind: impl Fn() -> KeyKind,
        is_required: bool,
        default: Option<String>,
    ) -> bool {
        let Some(describer) = self.describer() else { return false };
        describer.note(self.path(), key, kind(), is_required, default);
        true
    }

    fn described_number(&self, range: &RangeInclusive<f64>) -> Option<f64> {
        self.describer().map(|describer| describer.number(range))
    }

    fn described_choice<T: Copy>(
        &self,
        key: &'static str,
        words: &[(&str, T)],
        is_required: bool,
    ) -> Option<T> {
        let names: Vec<String> = words.iter().map(|word| word.0.to_owned()).collect();
        let default = words.first().filter(|_| !is_required).map(|word| word.0.to_owned());
        self.describe(key, || KeyKind::Choice(names.clone()), is_required, default);
        let answer = self.describer()?.answer(self.path(), key, names);
        words.get(answer).map(|word| word.1)
    }
}

/// Text that a run without a file reads; it is also valid as an address.
const DESCRIBED_TEXT: &str = "text:1";

fn expected_number(range: &RangeInclusive<f64>) -> String {
    format!("a number from {} to {}", range.start(), range.end())
}
