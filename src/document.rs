//! A TOML file read strictly, key by key: every violation is collected with its line, instead of
//! ending at the first.

pub mod csv;
pub mod describe;
mod file_text;
mod key_spec;
mod keys;
mod problem;
mod renamed;
mod scalar;
mod table;
mod value;

use toml::Spanned;
use toml::de::DeTable;

use self::file_text::FileText;

pub use self::problem::{Problem, Problems};
pub use self::table::Table;

/// Syntax errors that are reported: one causes many. A choice.
const MAX_SYNTAX_ERRORS: usize = 3;

/// A parsed file and what was found wrong with it so far.
pub struct Document<'a> {
    text: FileText<'a>,
    root: Spanned<DeTable<'a>>,
}

impl<'a> Document<'a> {
    /// Parses a file's text; what is not TOML is a violation like others.
    /// `for_run` makes the tables that only a run needs mandatory.
    pub fn parse(file: &'a str, text: &'a str, for_run: bool) -> Self {
        let (root, errors) = DeTable::parse_recoverable(text);
        let text = FileText::new(file, text, for_run);
        let more = errors.len().saturating_sub(MAX_SYNTAX_ERRORS);
        for error in errors.into_iter().take(MAX_SYNTAX_ERRORS) {
            let line = error.span().map(|span| text.line_of(span.start));
            text.report(line, "", format!("not TOML: {}", error.message()), "");
        }
        if more > 0 {
            text.report(None, "", format!("not TOML: and {more} more, likely of the same"), "");
        }
        Self { text, root }
    }

    /// The file's outermost table.
    pub fn root(&self) -> Table<'_> {
        Table::root(&self.text, self.root.get_ref())
    }

    /// The value that was read if nothing was wrong, else everything that was.
    pub fn finish<T>(self, value: Option<T>) -> Result<T, Problems> {
        self.text.finish(value)
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
