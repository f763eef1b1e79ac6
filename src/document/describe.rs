//! The keys that a file may have, from a run of its reader without a file: every key that the
//! reader requests is recorded.
//!
//! Other keys may depend on a choice, on whether a key is present and on an optional table, so the
//! reader runs again for every answer, and for every two together.

use std::collections::{BTreeSet, VecDeque};

use super::file_text::FileText;
use super::key_spec::{Answers, Describer};
use super::table::Table;

pub use super::key_spec::{KeyKind, KeySpec};

/// Answers other than the first that are tried together: a key may depend on two others.
const MAX_JOINT_ANSWERS: usize = 2;

/// Every key that a reader may ask for, in the order of reading.
pub fn describe(read: impl Fn(&Table<'_>)) -> Vec<KeySpec> {
    let mut specs: Vec<KeySpec> = Vec::new();
    let (mut known, mut tried) = (BTreeSet::new(), BTreeSet::new());
    let mut queue = VecDeque::from([Answers::new()]);
    while let Some(answers) = queue.pop_front() {
        let describer = Describer::new(answers);
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
            let is_new = known.insert(question.clone());
            if answers.contains_key(&question) || !is_new && answers.len() >= MAX_JOINT_ANSWERS {
                continue;
            }
            for answer in 1..words.len() {
                let mut next = answers.clone();
                next.insert(question.clone(), answer);
                if tried.insert(next.clone()) {
                    queue.push_back(next);
                }
            }
        }
    }
    specs
}

fn path(table: &str, key: &str) -> String {
    if table.is_empty() { key.to_owned() } else { format!("{table}.{key}") }
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
