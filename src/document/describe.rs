//! Which keys a file may have, found by reading a file that is not there: a reader asks
//! for its keys, and what it asks for is noted down.
//!
//! A choice, a key that a reader looks for and an optional table lead to other keys, so the
//! reader runs once for every answer that it has not been given yet.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::RangeInclusive;

use super::file_text::FileText;
use super::table::Table;

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
    /// The value that stands for its absence, as it is written; none where there is none.
    pub default: Option<String>,
    /// The answers that led to it, where others do not: key, and what was chosen.
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
    /// Numbers in brackets, each within a range; the counts that are allowed, none for any.
    Numbers(Vec<usize>, RangeInclusive<f64>),
    /// A text.
    Text,
    /// Texts in brackets.
    Texts,
    /// One of these words.
    Choice(Vec<String>),
}

/// A question whose answer decides which keys there are.
type Question = (String, &'static str);
/// Questions with the number of the answer.
type Answers = BTreeMap<Question, usize>;

/// Notes down what one run of a reader asks for.
pub(super) struct Describer {
    answers: Answers,
    found: RefCell<Vec<KeySpec>>,
    /// The questions that this run met, each with its answers in words.
    met: RefCell<BTreeMap<Question, Vec<String>>>,
    numbers: RefCell<u32>,
}

/// Every key that a reader may ask for, in the order of reading.
pub fn describe(read: impl Fn(&Table<'_>)) -> Vec<KeySpec> {
    let mut specs: Vec<KeySpec> = Vec::new();
    let mut known = BTreeSet::new();
    let mut queue = VecDeque::from([Answers::new()]);
    while let Some(answers) = queue.pop_front() {
        let describer = Describer {
            answers,
            found: RefCell::default(),
            met: RefCell::default(),
            numbers: RefCell::default(),
        };
        let text = FileText::new("", "", true);
        read(&Table::described(&text, &describer));
        let Describer { answers, found, met, .. } = describer;
        let met = met.into_inner();
        for spec in found.into_inner() {
            if !specs.iter().any(|known| (&known.table, known.key) == (&spec.table, spec.key)) {
                let when = answers.iter().filter_map(|(question, answer)| {
                    let words = met.get(question)?.get(*answer)?.clone();
                    Some((path(&question.0, question.1), words))
                });
                specs.push(KeySpec { when: when.collect(), ..spec });
            }
        }
        for (question, words) in met {
            if known.insert(question.clone()) {
                queue.extend((1..words.len()).map(|answer| {
                    let mut answers = answers.clone();
                    answers.insert(question.clone(), answer);
                    answers
                }));
            }
        }
    }
    specs
}

fn path(table: &str, key: &str) -> String {
    if table.is_empty() { key.to_owned() } else { format!("{table}.{key}") }
}

impl Describer {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_branch_of_a_reader_is_found_with_what_leads_to_it() {
        let specs = describe(|root| {
            let Some(pump) = root.required_table("pump") else { return };
            let kind = pump.required_choice("kind", &[("screw", 0), ("piston", 1)]);
            pump.number_or("rate_hz", 1.0..=50.0, 20.0);
            if kind == Some(1) {
                pump.number("stroke_mm", 1.0..=900.0);
                if pump.has("file") {
                    pump.text("file");
                }
            }
        });
        let keys: Vec<_> = specs.iter().map(|spec| (spec.key, spec.is_required)).collect();
        let expected = [("kind", true), ("rate_hz", false), ("stroke_mm", true), ("file", true)];
        assert_eq!(keys, expected);
        assert_eq!(specs[1].default.as_deref(), Some("20"));
        assert!(specs[1].when.is_empty());
        assert_eq!(specs[2].when, [("pump.kind".to_owned(), "piston".to_owned())]);
        let file = [("pump.file", "given"), ("pump.kind", "piston")];
        let file = file.map(|(key, word)| (key.to_owned(), word.to_owned()));
        assert_eq!(specs[3].when, file);
    }
}
