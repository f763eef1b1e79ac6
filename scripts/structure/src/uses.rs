//! Which file names items of which other file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;

use crate::tree::{ModuleId, Target, Tree};

/// One use of an item by a module.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Use {
    /// The module that names the item.
    pub from: ModuleId,
    /// What it names.
    pub to: Target,
}

/// Every use between modules, each once. A re-export is resolved and is no use
/// of its own; a path that ends at a module is none either.
pub fn between_modules(tree: &Tree) -> BTreeSet<Use> {
    let mut uses = BTreeSet::new();
    for (id, module) in tree.modules.iter().enumerate() {
        let mut note = |path: &[String]| {
            if let Some(to) = tree.resolve(id, path)
                && to.item.is_some()
                && to.module != id
            {
                uses.insert(Use { from: id, to });
            }
        };
        for import in module.imports.iter().filter(|import| !import.public && import.name != "*") {
            note(&import.path);
        }
        for item in module.items.values().chain(&module.unnamed) {
            for path in paths_in(item.to_token_stream()) {
                note(&path);
            }
        }
    }
    uses
}

/// Files that each file uses, other than itself.
pub fn between_files(tree: &Tree) -> BTreeMap<PathBuf, BTreeSet<PathBuf>> {
    let mut files: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
    for module in &tree.modules {
        files.entry(module.file.clone()).or_default();
    }
    for used in between_modules(tree) {
        let (from, to) = (&tree.modules[used.from].file, &tree.modules[used.to.module].file);
        if from != to {
            files.entry(from.clone()).or_default().insert(to.clone());
        }
    }
    files
}

/// Rooms that each room uses, other than itself, with a file that does so.
pub fn between_rooms(tree: &Tree) -> BTreeMap<(String, String), PathBuf> {
    let mut rooms = BTreeMap::new();
    for used in between_modules(tree) {
        let (from, to) = (tree.room(used.from), tree.room(used.to.module));
        if from != to {
            let file = tree.modules[used.from].file.clone();
            rooms.entry((from.to_owned(), to.to_owned())).or_insert(file);
        }
    }
    rooms
}

/// The paths that stand in code: names joined by `::`, in macros too. A single
/// name that an import or the module itself defines is one as well.
pub fn paths_in(tokens: TokenStream) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    let mut path: Vec<String> = Vec::new();
    let mut colons = 0;
    let mut after_dot = false;
    for token in tokens {
        match token {
            TokenTree::Ident(name) => {
                if colons != 2 {
                    finish(&mut path, &mut paths);
                }
                if !(after_dot && path.is_empty()) {
                    path.push(name.to_string());
                }
                colons = 0;
                after_dot = false;
            }
            TokenTree::Punct(mark) if mark.as_char() == ':' => {
                colons += 1;
                after_dot = false;
            }
            TokenTree::Group(group) => {
                finish(&mut path, &mut paths);
                colons = 0;
                after_dot = false;
                paths.extend(paths_in(group.stream()));
            }
            other => {
                finish(&mut path, &mut paths);
                colons = 0;
                after_dot = matches!(&other, TokenTree::Punct(mark) if mark.as_char() == '.');
            }
        }
    }
    finish(&mut path, &mut paths);
    paths
}

fn finish(path: &mut Vec<String>, paths: &mut Vec<Vec<String>>) {
    if path.len() > 1 {
        paths.push(std::mem::take(path));
    } else {
        path.clear();
    }
}

/// A file's name below a folder, for people.
pub fn short(file: &Path, below: &Path) -> String {
    file.strip_prefix(below).unwrap_or(file).display().to_string()
}
