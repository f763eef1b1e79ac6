//! The help of the program: commands under headings.

use std::fmt::Write as _;

use clap::Command;
use clap::builder::styling::Styles;

/// Gives the program a help that lists the commands of groups, too.
pub fn with_groups(command: Command) -> Command {
    let list = list(&command);
    command.disable_help_subcommand(true).help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}\n{{options}}{{after-help}}"
    ))
}

/// The commands, those of daily use first, then each group.
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
    daily.iter().for_each(|one| text.push_str(&line("", one)));
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

/// Names of all commands, with those of their groups.
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
