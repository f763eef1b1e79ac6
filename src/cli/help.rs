//! The help of the program: commands under headings.

use std::fmt::Write as _;

use clap::Command;
use clap::builder::styling::Styles;

/// Gives the program a help that lists the commands of groups, too.
pub fn with_groups(command: Command) -> Command {
    let list = list(&command);
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}\n{{options}}{{after-help}}"
    ))
}

/// The commands, the ones for daily use first, then each group.
fn list(command: &Command) -> String {
    let styles = Styles::styled();
    let head = |name: &str| {
        let style = styles.get_header();
        format!("{style}{name}:{style:#}\n")
    };
    let width = names(command).iter().map(String::len).max().unwrap_or(0);
    let line = |prefix: &str, one: &Command| {
        let style = styles.get_literal();
        let name = format!("{prefix}{}", one.get_name());
        let about = one.get_about().map(ToString::to_string).unwrap_or_default();
        format!("  {style}{name:<width$}{style:#}  {about}\n")
    };
    let mut text = head("Daily commands");
    let (groups, daily): (Vec<&Command>, Vec<&Command>) =
        command.get_subcommands().partition(|one| is_group(one));
    for one in daily {
        text.push_str(&line("", one));
    }
    for group in groups {
        let about = group.get_about().map(ToString::to_string).unwrap_or_default();
        let _ = write!(text, "\n{}", head(&about));
        let prefix = format!("{} ", group.get_name());
        group.get_subcommands().for_each(|one| text.push_str(&line(&prefix, one)));
    }
    let style = styles.get_header();
    let _ = write!(text, "\n{style}Options:{style:#}");
    text
}

/// Names of all commands, including those of groups.
fn names(command: &Command) -> Vec<String> {
    let mut names = Vec::new();
    for one in command.get_subcommands() {
        if is_group(one) {
            let of = one.get_subcommands();
            names.extend(of.map(|sub| format!("{} {}", one.get_name(), sub.get_name())));
        } else {
            names.push(one.get_name().to_owned());
        }
    }
    names
}

fn is_group(command: &Command) -> bool {
    command.has_subcommands()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    /// Largest number of lines of a help.
    const MAX_LINES: usize = 60;

    /// The output of `--help` after a command.
    fn printed(path: &[String]) -> String {
        let words = path.iter().map(String::as_str).chain(["--help"]);
        let asked = with_groups(Cli::command()).try_get_matches_from(words);
        asked.err().map(|help| help.to_string()).unwrap_or_default()
    }

    fn check(command: &Command, path: &[String]) {
        let help = printed(path);
        let lines = help.lines().count();
        assert!((1..=MAX_LINES).contains(&lines), "{path:?}: {lines} lines\n{help}");
        let is_program = path.len() == 1;
        assert!(is_program || help.contains("Example"), "{path:?} has no example");
        for one in command.get_subcommands() {
            check(one, &[path, &[one.get_name().to_owned()]].concat());
        }
    }

    #[test]
    fn every_help_is_short_and_has_an_example() {
        check(&Cli::command(), &["truebead".to_owned()]);
    }

    #[test]
    fn the_help_lists_daily_commands_first_and_then_the_groups() {
        let help = with_groups(Cli::command()).render_help().to_string();
        let names = ["demo", "calibrate", "replay", "camera board", "extruder models"];
        let at = names.map(|name| help.find(&format!("\n  {name} ")));
        assert!(at.is_sorted() && at[0].is_some(), "{at:?}\n{help}");
    }
}
