//! Public types, and names that are used twice.

use std::collections::BTreeMap;

use crate::tree::{ModuleId, Tree};

/// Names of public types that several modules define, with those modules.
pub fn repeated_types(tree: &Tree) -> BTreeMap<String, Vec<ModuleId>> {
    let mut names: BTreeMap<String, Vec<ModuleId>> = BTreeMap::new();
    for (id, module) in tree.modules.iter().enumerate() {
        for (name, item) in &module.items {
            let visibility = match item {
                syn::Item::Enum(item) => &item.vis,
                syn::Item::Struct(item) => &item.vis,
                syn::Item::Trait(item) => &item.vis,
                syn::Item::Type(item) => &item.vis,
                _ => continue,
            };
            if is_public(visibility) {
                names.entry(name.clone()).or_default().push(id);
            }
        }
    }
    names.retain(|_, modules| modules.len() > 1);
    names
}

/// Names of files that stand in several folders.
pub fn repeated_files(tree: &Tree) -> BTreeMap<String, usize> {
    let mut names: BTreeMap<String, std::collections::BTreeSet<&std::path::Path>> = BTreeMap::new();
    for module in &tree.modules {
        if let Some(name) = module.file.file_name() {
            names.entry(name.to_string_lossy().into_owned()).or_default().insert(&module.file);
        }
    }
    names.into_iter().filter(|(_, files)| files.len() > 1).map(|(n, f)| (n, f.len())).collect()
}

/// Whether anything outside the module can see it.
pub fn is_public(visibility: &syn::Visibility) -> bool {
    !matches!(visibility, syn::Visibility::Inherited)
}
