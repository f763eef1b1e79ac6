//! A cursor over a TOML file that takes what it is asked for and collects
//! every violation on the way, with its line, instead of ending at the first.

mod problem;

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub use self::problem::{Problem, Problems};

/// A parsed file and what was found wrong with it so far.
pub struct Document<'a> {
    file: &'a str,
    text: &'a str,
    root: Spanned<DeTable<'a>>,
    problems: RefCell<Vec<Problem>>,
    for_run: bool,
}

impl<'a> Document<'a> {
    /// Parses a file's text; what is not TOML is a violation like others.
    /// `for_run` makes the tables that only a run needs mandatory.
    pub fn parse(file: &'a str, text: &'a str, for_run: bool) -> Self {
        let (root, errors) = DeTable::parse_recoverable(text);
        let document = Self { file, text, root, problems: RefCell::default(), for_run };
        for error in errors {
            let line = error.span().map(|span| document.line_of(span.start));
            document.report(line, "", format!("not TOML: {}", error.message()), "");
        }
        document
    }

    /// The file's outermost table.
    pub fn root(&self) -> Table<'_> {
        Table {
            document: self,
            path: String::new(),
            items: Some(self.root.get_ref()),
            line: None,
            strict: true,
            asked: RefCell::default(),
            passed_over: Cell::new(false),
        }
    }

    /// The value that was read if nothing was wrong, else everything that was.
    pub fn finish<T>(self, value: Option<T>) -> Result<T, Problems> {
        let mut list = self.problems.into_inner();
        // What follows from a slip of syntax is no news.
        if list.iter().any(|problem| problem.expected.is_empty()) {
            list.retain(|problem| problem.expected.is_empty());
        }
        list.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
        match value {
            Some(value) if list.is_empty() => Ok(value),
            _ => Err(Problems { file: self.file.to_string(), list }),
        }
    }

    fn line_of(&self, offset: usize) -> usize {
        let end = offset.min(self.text.len());
        self.text.as_bytes().iter().take(end).filter(|&&byte| byte == b'\n').count() + 1
    }

    fn report(
        &self,
        line: Option<usize>,
        key: &str,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) {
        self.problems.borrow_mut().push(Problem {
            line,
            key: key.to_string(),
            found: found.into(),
            expected: expected.into(),
        });
    }
}

/// One table of a document. Keys that nobody asked for are violations, which
/// are reported when the table is dropped.
pub struct Table<'a> {
    document: &'a Document<'a>,
    path: String,
    items: Option<&'a DeTable<'a>>,
    line: Option<usize>,
    strict: bool,
    asked: RefCell<BTreeSet<&'static str>>,
    passed_over: Cell<bool>,
}

impl<'a> Table<'a> {
    /// Lets unknown keys of this table pass: which there may be hangs on one
    /// that is wrong.
    pub fn pass_over(&self) {
        self.passed_over.set(true);
    }

    fn child(&self, key: &'static str, items: Option<&'a DeTable<'a>>, strict: bool) -> Table<'a> {
        let value = self.get(key);
        Table {
            document: self.document,
            path: self.key_path(key),
            items,
            line: value.map(|value| self.document.line_of(value.span().start)),
            strict,
            asked: RefCell::default(),
            passed_over: Cell::new(false),
        }
    }

    /// Reports the absence of a key, unless the table may be incomplete.
    pub fn absent(&self, key: &'static str, expected: impl Into<String>) {
        if self.strict {
            self.report(key, "nothing", expected);
        }
    }

    fn key_path(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_string() } else { format!("{}.{key}", self.path) }
    }

    fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.asked.borrow_mut().insert(key);
        self.items?.get(key)
    }

    /// Reports a violation at a key of this table.
    pub fn report(&self, key: &'static str, found: impl Into<String>, expected: impl Into<String>) {
        let line = self.get(key).map_or(self.line, |v| Some(self.document.line_of(v.span().start)));
        self.document.report(line, &self.key_path(key), found, expected);
    }

    /// Whether the key stands in the file.
    pub fn has(&self, key: &'static str) -> bool {
        self.get(key).is_some()
    }

    /// A table within this one; `None` where there is none.
    pub fn table(&self, key: &'static str) -> Option<Table<'a>> {
        match self.get(key)?.get_ref() {
            DeValue::Table(items) => Some(self.child(key, Some(items), true)),
            other => {
                self.report(key, shown(other), format!("a table [{}]", self.key_path(key)));
                None
            }
        }
    }

    /// A table within this one, empty where there is none.
    pub fn table_or_empty(&self, key: &'static str) -> Option<Table<'a>> {
        if self.has(key) { self.table(key) } else { Some(self.child(key, None, true)) }
    }

    /// A table that only a run needs: there it must be and must be complete,
    /// elsewhere it may be absent or lack keys.
    pub fn run_table(&self, key: &'static str) -> Option<Table<'a>> {
        if self.document.for_run {
            return self.required_table(key);
        }
        let mut table = self.table(key)?;
        table.strict = false;
        Some(table)
    }

    /// A table that only a run reads, and that it may lack: complete in a run
    /// where it stands at all.
    pub fn optional_run_table(&self, key: &'static str) -> Option<Table<'a>> {
        let mut table = self.table(key)?;
        table.strict = self.document.for_run;
        Some(table)
    }

    /// A table that must be there.
    pub fn required_table(&self, key: &'static str) -> Option<Table<'a>> {
        if !self.has(key) {
            self.report(key, "nothing", format!("a table [{}]", self.key_path(key)));
        }
        self.table(key)
    }

    /// A number within a range; `None` where the key is absent or wrong.
    pub fn optional_number(&self, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
        let value = self.get(key)?.get_ref();
        let number = as_number(value);
        match number {
            Some(number) if range.contains(&number) => Some(number),
            _ => {
                self.report(key, shown(value), expected_number(&range));
                None
            }
        }
    }

    /// A number that must be there.
    pub fn number(&self, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
        if !self.has(key) {
            self.absent(key, expected_number(&range));
        }
        self.optional_number(key, range)
    }

    /// A number with a value that stands for its absence.
    pub fn number_or(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        default: f64,
    ) -> Option<f64> {
        if self.has(key) { self.optional_number(key, range) } else { Some(default) }
    }

    /// A whole number within a range; `None` where the key is absent or wrong.
    pub fn optional_integer(&self, key: &'static str, range: RangeInclusive<u64>) -> Option<u64> {
        let value = self.get(key)?.get_ref();
        match as_integer(value) {
            Some(number) if range.contains(&number) => Some(number),
            _ => {
                let expected = format!("a whole number from {} to {}", range.start(), range.end());
                self.report(key, shown(value), expected);
                None
            }
        }
    }

    /// A whole number with a value that stands for its absence.
    pub fn integer_or(
        &self,
        key: &'static str,
        range: RangeInclusive<u64>,
        default: u64,
    ) -> Option<u64> {
        if self.has(key) { self.optional_integer(key, range) } else { Some(default) }
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
        let lengths = match counts {
            [first, _, .., last] if counts.windows(2).all(|pair| pair[0] + 1 == pair[1]) => {
                format!("{first} to {last}")
            }
            _ => counts.iter().map(usize::to_string).collect::<Vec<_>>().join(" or "),
        };
        let expected = format!("{lengths} numbers in brackets, each {}", expected_number(&range));
        let Some(value) = self.get(key) else {
            self.absent(key, expected);
            return None;
        };
        let numbers: Option<Vec<f64>> = value.get_ref().as_array().and_then(|array| {
            array.iter().map(|v| as_number(v.get_ref()).filter(|n| range.contains(n))).collect()
        });
        let row = numbers.filter(|numbers| counts.contains(&numbers.len()));
        if row.is_none() {
            self.report(key, shown(value.get_ref()), expected);
        }
        row
    }

    /// The same where the key may be absent.
    pub fn optional_numbers<const N: usize>(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
    ) -> Option<[f64; N]> {
        if self.has(key) { self.numbers(key, range) } else { None }
    }

    /// A text that is not empty; `None` where the key is absent or wrong.
    pub fn optional_text(&self, key: &'static str) -> Option<&'a str> {
        let value = self.get(key)?.get_ref();
        match value.as_str() {
            Some(text) if !text.is_empty() => Some(text),
            _ => {
                self.report(key, shown(value), "a text in quotes");
                None
            }
        }
    }

    /// A text that must be there.
    pub fn text(&self, key: &'static str) -> Option<&'a str> {
        if !self.has(key) {
            self.absent(key, "a text in quotes");
        }
        self.optional_text(key)
    }

    /// A row of texts that must be there, none of them empty.
    pub fn texts(&self, key: &'static str) -> Option<Vec<String>> {
        let expected = "texts in brackets, each in quotes";
        let Some(value) = self.get(key) else {
            self.absent(key, expected);
            return None;
        };
        let texts = value.get_ref().as_array().and_then(|array| {
            let text = |item: &Spanned<DeValue<'a>>| item.get_ref().as_str().map(str::to_owned);
            array.iter().map(|item| text(item).filter(|text| !text.is_empty())).collect()
        });
        if texts.is_none() {
            self.report(key, shown(value.get_ref()), expected);
        }
        texts
    }

    /// One of several words, or the first where the key is absent.
    pub fn choice<T: Copy>(&self, key: &'static str, words: &[(&str, T)]) -> Option<T> {
        let Some(value) = self.get(key) else { return words.first().map(|word| word.1) };
        let found =
            words.iter().find(|word| value.get_ref().as_str() == Some(word.0)).map(|word| word.1);
        if found.is_none() {
            let names: Vec<String> = words.iter().map(|word| format!("\"{}\"", word.0)).collect();
            self.report(key, shown(value.get_ref()), names.join(" or "));
        }
        found
    }

    /// One of several words; the key must be there.
    pub fn required_choice<T: Copy>(&self, key: &'static str, words: &[(&str, T)]) -> Option<T> {
        if self.has(key) {
            return self.choice(key, words);
        }
        let names: Vec<String> = words.iter().map(|word| format!("\"{}\"", word.0)).collect();
        self.absent(key, names.join(" or "));
        None
    }
}

impl Drop for Table<'_> {
    fn drop(&mut self) {
        if self.passed_over.get() {
            return;
        }
        let asked = self.asked.borrow();
        for key in self.items.into_iter().flat_map(|items| items.keys()) {
            let name = key.get_ref().as_ref();
            if asked.contains(name) {
                continue;
            }
            let line = self.document.line_of(key.span().start);
            let near = asked.iter().find(|known| alike(known, name));
            let expected = match near {
                Some(known) => format!("\"{known}\"?"),
                None if asked.is_empty() => "nothing here".to_string(),
                None => format!("one of {}", asked.iter().copied().collect::<Vec<_>>().join(", ")),
            };
            self.document.report(Some(line), &self.key_path(name), "an unknown key", expected);
        }
    }
}

/// Whether an unknown key looks like a known one that was mistyped: same
/// beginning, or the same letters but for one or two.
fn alike(known: &str, found: &str) -> bool {
    let shared = known.bytes().zip(found.bytes()).take_while(|(a, b)| a == b).count();
    let tail = known.bytes().rev().zip(found.bytes().rev()).take_while(|(a, b)| a == b).count();
    let longest = known.len().max(found.len());
    shared + tail + 2 >= longest || (shared >= 6 && shared * 2 >= longest)
}

fn expected_number(range: &RangeInclusive<f64>) -> String {
    format!("a number from {} to {}", range.start(), range.end())
}

fn as_number(value: &DeValue<'_>) -> Option<f64> {
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

fn as_integer(value: &DeValue<'_>) -> Option<u64> {
    as_signed(value).and_then(|number| u64::try_from(number).ok())
}

/// A value as it stands in the file, short enough for a message.
fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("\"{text}\""),
        DeValue::Integer(integer) => integer.to_string(),
        DeValue::Float(float) => float.to_string(),
        DeValue::Boolean(truth) => truth.to_string(),
        DeValue::Datetime(datetime) => datetime.to_string(),
        DeValue::Array(array) => {
            let items: Vec<String> = array.iter().map(|item| shown(item.get_ref())).collect();
            format!("[{}]", items.join(", "))
        }
        DeValue::Table(_) => "a table".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_violation_is_reported_at_once_with_its_line() {
        let text = "[limits]\nmin_speed_mm_per_s = -3\nmax_sped_mm_per_s = 150.0\n\
                    [gauge]\nroi_px = [1, 2, 3]\n";
        let document = Document::parse("cell.toml", text, true);
        {
            let root = document.root();
            let limits = root.table("limits").unwrap();
            assert_eq!(limits.number("min_speed_mm_per_s", 0.0..=1e4), None);
            assert_eq!(limits.number("max_speed_mm_per_s", 0.0..=1e4), None);
            let gauge = root.table("gauge").unwrap();
            assert_eq!(gauge.numbers::<4>("roi_px", 0.0..=1e5), None);
        }
        let problems = document.finish(Some(())).unwrap_err();
        let lines: Vec<String> = problems.list.iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "line 1: limits.max_speed_mm_per_s: found nothing, expected a number from 0 to 10000",
                "line 2: limits.min_speed_mm_per_s: found -3, expected a number from 0 to 10000",
                "line 3: limits.max_sped_mm_per_s: found an unknown key, expected \"max_speed_mm_per_s\"?",
                "line 5: gauge.roi_px: found [1, 2, 3], expected 4 numbers in brackets, each a number from 0 to 100000",
            ]
        );
    }

    #[test]
    fn what_is_not_toml_names_its_line() {
        let document = Document::parse("cell.toml", "a = 1\nb = = 2\n", true);
        assert_eq!(document.root().number("a", 0.0..=2.0), Some(1.0));
        let problems = document.finish(Some(())).unwrap_err();
        assert_eq!(problems.list[0].line, Some(2));
    }

    #[test]
    fn infinities_and_nan_are_refused() {
        let document = Document::parse("cell.toml", "a = inf\nb = nan\n", true);
        let root = document.root();
        assert_eq!(root.number("a", f64::MIN..=f64::MAX), None);
        assert_eq!(root.number("b", f64::MIN..=f64::MAX), None);
    }
}
