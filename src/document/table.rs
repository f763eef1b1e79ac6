//! One table of a file: which keys it has, which it may have, and the tables
//! below it.

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::file_text::FileText;
use super::key_spec::Describer;
use super::keys::{resembles, shared_ends};
use super::renamed::present_name;
use super::scalar::as_written;

/// One table of a document. Keys that were not requested are violations, which are reported when
/// the table is dropped.
pub struct Table<'a> {
    text: &'a FileText<'a>,
    path: String,
    items: Option<&'a DeTable<'a>>,
    line: Option<usize>,
    strict: bool,
    asked: RefCell<BTreeSet<&'static str>>,
    unknown_keys_allowed: Cell<bool>,
    /// Records the requests of a run without a file.
    describer: Option<&'a Describer>,
}

impl<'a> Table<'a> {
    /// The outermost table of a document.
    pub(super) fn root(text: &'a FileText<'a>, items: &'a DeTable<'a>) -> Self {
        Table {
            text,
            path: String::new(),
            items: Some(items),
            line: None,
            strict: true,
            asked: RefCell::default(),
            unknown_keys_allowed: Cell::new(false),
            describer: None,
        }
    }

    /// The outermost table of a run without a file.
    pub(super) fn described(text: &'a FileText<'a>, describer: &'a Describer) -> Self {
        Table {
            text,
            path: String::new(),
            items: None,
            line: None,
            strict: true,
            asked: RefCell::default(),
            unknown_keys_allowed: Cell::new(false),
            describer: Some(describer),
        }
    }

    /// The recorder of a run without a file; `None` where a file is read.
    pub(super) const fn describer(&self) -> Option<&'a Describer> {
        self.describer
    }

    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Whether the key stands in the file; not recorded as a question.
    pub(super) fn stands(&self, key: &'static str) -> bool {
        self.get(key).is_some()
    }

    /// Accepts unknown keys of this table, as which ones are valid depends on a key that is wrong.
    pub fn allow_unknown_keys(&self) {
        self.unknown_keys_allowed.set(true);
    }

    fn child(&self, key: &'static str, items: Option<&'a DeTable<'a>>, strict: bool) -> Table<'a> {
        let value = self.get(key);
        Table {
            text: self.text,
            path: self.key_path(key),
            items,
            line: value.map(|value| self.text.line_of(value.span().start)),
            strict,
            asked: RefCell::default(),
            unknown_keys_allowed: Cell::new(false),
            describer: self.describer,
        }
    }

    /// Reports the absence of a key, unless the table may be incomplete.
    pub fn report_absent(&self, key: &'static str, expected: impl Into<String>) {
        if self.strict {
            self.report(key, "nothing", expected);
        }
    }

    fn key_path(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_string() } else { format!("{}.{key}", self.path) }
    }

    pub(super) fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.asked.borrow_mut().insert(key);
        self.items?.get(key)
    }

    /// Reports a violation at a key of this table.
    pub fn report(&self, key: &'static str, found: impl Into<String>, expected: impl Into<String>) {
        let line = self.get(key).map_or(self.line, |v| Some(self.text.line_of(v.span().start)));
        self.text.report(line, &self.key_path(key), found, expected);
    }

    /// Whether the key stands in the file.
    pub fn has(&self, key: &'static str) -> bool {
        match self.describer {
            Some(describer) => {
                let words = ["not given", "given"].map(str::to_owned);
                describer.answer(&self.path, key, words.to_vec()) == 1
            }
            None => self.stands(key),
        }
    }

    /// A table within this one; `None` where there is none.
    pub fn table(&self, key: &'static str) -> Option<Table<'a>> {
        if let Some(describer) = self.describer {
            let words = ["given", "not given"].map(str::to_owned);
            let stands = describer.answer(&self.path, key, words.to_vec()) == 0;
            return stands.then(|| self.child(key, None, true));
        }
        match self.get(key)?.get_ref() {
            DeValue::Table(items) => Some(self.child(key, Some(items), true)),
            other => {
                self.report(key, as_written(other), format!("a table [{}]", self.key_path(key)));
                None
            }
        }
    }

    /// A table within this one, empty where there is none.
    pub fn table_or_empty(&self, key: &'static str) -> Option<Table<'a>> {
        if self.stands(key) { self.table(key) } else { Some(self.child(key, None, true)) }
    }

    /// A table that only a run needs: required and complete for a run; otherwise it may be absent
    /// or lack keys.
    pub fn run_table(&self, key: &'static str) -> Option<Table<'a>> {
        if self.text.for_run() {
            return self.required_table(key);
        }
        let mut table = self.table(key)?;
        table.strict = false;
        Some(table)
    }

    /// An optional table that only a run reads: where it is present, it must be complete for a run.
    pub fn optional_run_table(&self, key: &'static str) -> Option<Table<'a>> {
        let mut table = self.table(key)?;
        table.strict = self.text.for_run();
        Some(table)
    }

    /// A table that must be there.
    pub fn required_table(&self, key: &'static str) -> Option<Table<'a>> {
        if self.describer.is_some() {
            return Some(self.child(key, None, true));
        }
        if !self.stands(key) {
            self.report(key, "nothing", format!("a table [{}]", self.key_path(key)));
        }
        self.table(key)
    }
}

impl Drop for Table<'_> {
    fn drop(&mut self) {
        let asked = self.asked.borrow();
        for key in self.items.into_iter().flat_map(|items| items.keys()) {
            let name = key.get_ref().as_ref();
            if asked.contains(name) {
                continue;
            }
            let line = self.text.line_of(key.span().start);
            if let Some(present) = present_name(name, |key| asked.contains(key)) {
                let expected = format!("\"{present}\"");
                self.text.report(Some(line), &self.key_path(name), "a former name", expected);
                continue;
            }
            if self.unknown_keys_allowed.get() {
                continue;
            }
            let likely = asked.iter().filter(|known| resembles(known, name));
            let near = likely.max_by_key(|known| shared_ends(known, name).iter().sum::<usize>());
            let expected = match near {
                Some(known) => format!("\"{known}\"?"),
                None if asked.is_empty() => "nothing here".to_string(),
                None => format!("one of {}", asked.iter().copied().collect::<Vec<_>>().join(", ")),
            };
            self.text.report(Some(line), &self.key_path(name), "an unknown key", expected);
        }
    }
}
