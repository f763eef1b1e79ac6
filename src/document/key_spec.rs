//! The description of a key of a file, and the record of a reader that runs without a file.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// One key of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct KeySpec {
    /// The table in which it stands, such as `extruder.pressure`.
    pub table: String,
    /// Its name.
    pub key: &'static str,
    /// What it holds.
    pub kind: KeyKind,
    /// Whether it must be there, in the tables that a purpose needs.
    pub is_required: bool,
    /// The default as it is written; `None` without one.
    pub default: Option<String>,
    /// Answers that it depends on: each with its key.
    pub when: Vec<(String, String)>,
}

/// What a key holds.
#[derive(Debug, Clone, PartialEq)]
pub enum KeyKind {
    /// A number within a range.
    Number(RangeInclusive<f64>),
    /// A number whose range other keys of the file give.
    NumberWithin(&'static str),
    /// A whole number within a range.
    Integer(RangeInclusive<u64>),
    /// Numbers in brackets, each within a range; the accepted counts, empty for any.
    Numbers(Vec<usize>, RangeInclusive<f64>),
    /// A text.
    Text,
    /// Texts in brackets.
    Texts,
    /// One of these words.
    Choice(Vec<String>),
}

/// A question whose answer decides which keys there are.
pub(super) type Question = (String, &'static str);
/// Questions with the number of the answer.
pub(super) type Answers = BTreeMap<Question, usize>;

/// Records what one run of a reader requests.
pub(super) struct Describer {
    pub(super) answers: Answers,
    pub(super) found: RefCell<Vec<KeySpec>>,
    /// The questions that this run met, each with its answers in words.
    pub(super) met: RefCell<BTreeMap<Question, Vec<String>>>,
    numbers: RefCell<u32>,
}

impl Describer {
    /// For a run with these answers.
    pub(super) fn new(answers: Answers) -> Self {
        let (found, met, numbers) = Default::default();
        Self { answers, found, met, numbers }
    }

    /// The answer of this run to a question, by its number.
    pub(super) fn answer(&self, table: &str, key: &'static str, words: Vec<String>) -> usize {
        let question = (table.to_owned(), key);
        let answer = self.answers.get(&question).copied().unwrap_or(0);
        self.met.borrow_mut().insert(question, words);
        answer
    }

    pub(super) fn note(
        &self,
        table: &str,
        key: &'static str,
        kind: KeyKind,
        is_required: bool,
        default: Option<String>,
    ) {
        let (table, when) = (table.to_owned(), Vec::new());
        self.found.borrow_mut().push(KeySpec { table, key, kind, is_required, default, when });
    }

    /// A number within a range, larger than the one before in the same range.
    pub(super) fn number(&self, range: &RangeInclusive<f64>) -> f64 {
        let mut count = self.numbers.borrow_mut();
        *count += 1;
        let fraction = 0.3 + 1e-4 * f64::from(*count);
        range.start() + fraction * (range.end() - range.start())
    }
}
