//! Changed names of commands; the table will be removed before version 1.0.

use clap::error::{ContextKind, ContextValue};

/// Former commands with their current names.
const COMMANDS: [(&str, &str); 12] = [
    ("board", "camera board"),
    ("verify", "camera verify"),
    ("convert", "camera convert"),
    ("offset", "camera offset"),
    ("excite", "extruder excite"),
    ("identify", "extruder identify"),
    ("models", "extruder models"),
    ("robot-sim", "sim robot"),
    ("extruder-sim", "sim extruder"),
    ("reproduce", "lab reproduce"),
    ("accuracy", "lab accuracy"),
    ("render", "lab render"),
];

/// Options of `extruder identify` that are commands now.
const OPTIONS: [(&str, &str); 2] =
    [("--starts", "extruder starts"), ("--noise", "extruder noise --column")];

/// The message for a changed name; `None` for other errors.
pub fn refusal(error: &clap::Error) -> Option<String> {
    let found = |kind| match error.get(kind) {
        Some(ContextValue::String(name)) => Some(name.as_str()),
        _ => None,
    };
    let new = |table: &[(&str, &'static str)], old: &str| {
        table.iter().find(|(name, _)| *name == old).map(|(_, new)| *new)
    };
    if let Some(old) = found(ContextKind::InvalidSubcommand) {
        let new = new(&COMMANDS, old)?;
        return Some(format!("`truebead {old}` is `truebead {new}` now"));
    }
    let old = found(ContextKind::InvalidArg)?;
    Some(format!("{old} is a command now: `truebead {}`", new(&OPTIONS, old)?))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    fn parsed(line: &str) -> clap::Error {
        let words = ["truebead"].into_iter().chain(line.split_whitespace());
        Cli::command().try_get_matches_from(words).unwrap_err()
    }

    #[test]
    fn an_old_name_is_refused_with_the_new_one() {
        for (old, new) in COMMANDS {
            let said = refusal(&parsed(&format!("{old} --option"))).unwrap();
            assert_eq!(said, format!("`truebead {old}` is `truebead {new}` now"));
            let error = parsed(&format!("{new} --no-such-option"));
            assert_eq!(error.kind(), clap::error::ErrorKind::UnknownArgument, "{new}");
        }
        let starts = refusal(&parsed("extruder identify log.csv --starts")).unwrap();
        assert!(starts.contains("`truebead extruder starts`"), "{starts}");
    }

    #[test]
    fn another_mistake_keeps_its_message() {
        assert_eq!(refusal(&parsed("simulated")), None);
        assert_eq!(refusal(&parsed("run --fast")), None);
    }
}
