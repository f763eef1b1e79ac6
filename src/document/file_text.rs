//! The text that a document was parsed from, and the violations in it so far.

use std::cell::RefCell;

use super::problem::{Problem, Problems};

/// A file's name and text, which give a violation its line, and the list that
/// every table of the file adds to.
pub(super) struct FileText<'a> {
    file: &'a str,
    text: &'a str,
    for_run: bool,
    problems: RefCell<Vec<Problem>>,
}

impl<'a> FileText<'a> {
    /// A text in which nothing is wrong yet.
    pub(super) fn new(file: &'a str, text: &'a str, for_run: bool) -> Self {
        Self { file, text, for_run, problems: RefCell::default() }
    }

    /// Whether the tables that only a run needs are mandatory.
    pub(super) fn for_run(&self) -> bool {
        self.for_run
    }

    /// The line of a byte, counted from 1.
    pub(super) fn line_of(&self, offset: usize) -> usize {
        let end = offset.min(self.text.len());
        self.text.as_bytes().iter().take(end).filter(|&&byte| byte == b'\n').count() + 1
    }

    /// Adds a violation.
    pub(super) fn report(
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

    /// The value that was read if nothing was wrong, else everything that was.
    pub(super) fn finish<T>(self, value: Option<T>) -> Result<T, Problems> {
        let mut list = self.problems.into_inner();
        // Violations that follow from a syntax error are dropped.
        if list.iter().any(|problem| problem.expected.is_empty()) {
            list.retain(|problem| problem.expected.is_empty());
        }
        list.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
        match value {
            Some(value) if list.is_empty() => Ok(value),
            _ => Err(Problems { file: self.file.to_string(), list }),
        }
    }
}
