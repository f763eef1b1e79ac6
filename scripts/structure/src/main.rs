//! `structure [FOLDER] [--list WHAT]`: the figures of a crate, or one list whole.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use structure::tree::Tree;
use structure::{circles, constants, items, lines, tuples, uses, words};

const USAGE: &str =
    "usage: structure [FOLDER] [--list rooms|circles|tuples|constants|types|words|lines]";

fn main() -> ExitCode {
    let mut folder = PathBuf::from(".");
    let mut list = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--list" {
            list = arguments.next();
        } else if argument.starts_with('-') {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        } else {
            folder = PathBuf::from(argument);
        }
    }
    let src = folder.join("src");
    let done = Tree::read(&src.join("lib.rs")).and_then(|tree| match list.as_deref() {
        None => table(&tree),
        Some(what) => one_list(&tree, what, &src),
    });
    match done {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn table(tree: &Tree) -> Result<String, String> {
    let lines = lines::of_files(tree)?;
    let rooms = uses::between_rooms(tree);
    let two_way =
        rooms.keys().filter(|(a, b)| a < b && rooms.contains_key(&(b.clone(), a.clone()))).count();
    let circles = circles::circles(&uses::between_files(tree));
    let constants = constants::numeric(tree);
    let sourced = constants.iter().filter(|constant| constant.sourced).count();
    let places = words::replaced(tree);
    let (texts, names): (Vec<_>, Vec<_>) = places.iter().partition(|place| place.in_text);
    let rows = [
        ("files", lines.len().to_string()),
        ("lines of code", lines.values().sum::<usize>().to_string()),
        (
            "files of more than 300 lines of code",
            lines.values().filter(|n| **n > 300).count().to_string(),
        ),
        ("rooms", tree.modules[0].children.len().to_string()),
        ("pairs of rooms that use each other", two_way.to_string()),
        ("circles of files", circles.len().to_string()),
        ("files in the largest circle", circles.first().map_or(0, Vec::len).to_string()),
        (
            "public functions that take tuples of numbers",
            tuples::taking_numbers(tree).len().to_string(),
        ),
        ("public type names that occur twice", items::repeated_types(tree).len().to_string()),
        ("numeric constants", constants.len().to_string()),
        ("numeric constants without a source", (constants.len() - sourced).to_string()),
        ("names of constants that occur twice", constants::repeated(&constants).len().to_string()),
        ("replaced words in names", names.len().to_string()),
        ("replaced words in texts", texts.len().to_string()),
    ];
    let rows = rows.map(|(what, figure)| format!("{what:<46} {figure:>7}\n"));
    Ok(rows.concat())
}

fn one_list(tree: &Tree, what: &str, src: &Path) -> Result<String, String> {
    let rows: Vec<String> = match what {
        "rooms" => uses::between_rooms(tree)
            .iter()
            .map(|((from, to), file)| format!("{from} → {to}  ({})", uses::short(file, src)))
            .collect(),
        "circles" => circles::circles(&uses::between_files(tree))
            .iter()
            .map(|circle| {
                let files: Vec<_> = circle.iter().map(|file| uses::short(file, src)).collect();
                files.join(" ")
            })
            .collect(),
        "tuples" => tuples::taking_numbers(tree)
            .iter()
            .map(|taking| {
                let module = tree.name(taking.module);
                format!("{module}::{}  {}", taking.function, taking.parameter)
            })
            .collect(),
        "constants" => {
            let constants = constants::numeric(tree);
            let files: BTreeSet<_> = constants.iter().map(|constant| &constant.file).collect();
            let count =
                |file: &PathBuf| constants.iter().filter(|c| &c.file == file && !c.sourced).count();
            files
                .iter()
                .map(|file| (count(file), uses::short(file, src)))
                .filter(|(count, _)| *count > 0)
                .map(|(count, file)| format!("{file} {count}"))
                .collect()
        }
        "types" => items::repeated_types(tree)
            .iter()
            .map(|(name, modules)| {
                let modules: Vec<_> = modules.iter().map(|id| tree.name(*id)).collect();
                format!("{name}: {}", modules.join(", "))
            })
            .collect(),
        "words" => words::replaced(tree)
            .iter()
            .map(|place| {
                let file = uses::short(&place.file, src);
                format!("{file}:{}: {} in {}", place.line, place.word, place.within)
            })
            .collect(),
        "uses" => uses::between_modules(tree)
            .iter()
            .map(|used| {
                let item = used.to.item.as_deref().unwrap_or_default();
                format!("{} → {}::{item}", tree.name(used.from), tree.name(used.to.module))
            })
            .collect(),
        "lines" => lines::of_files(tree)?
            .iter()
            .map(|(file, count)| format!("{count:>6} {}", uses::short(file, src)))
            .collect(),
        _ => return Err(USAGE.to_owned()),
    };
    Ok(rows.iter().flat_map(|row| [row.as_str(), "\n"]).collect())
}
