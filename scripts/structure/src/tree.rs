//! The modules of a crate, read from its files.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::Visit;

/// Index of a module in a [`Tree`].
pub type ModuleId = usize;

/// One name that a `use` brings into a module.
#[derive(Debug, Clone)]
pub struct Import {
    /// The name under which it is known in the module; `*` for a glob.
    pub name: String,
    /// The path as it is written, without the glob's star.
    pub path: Vec<String>,
    /// Whether the module hands it on.
    pub public: bool,
}

/// One module.
#[derive(Debug, Default)]
pub struct Module {
    /// Path from the crate's root, which is empty itself.
    pub path: Vec<String>,
    /// The file in which it stands.
    pub file: PathBuf,
    /// The module around it.
    pub parent: Option<ModuleId>,
    /// Modules in it.
    pub children: BTreeMap<String, ModuleId>,
    /// Items that it defines, other than modules and imports.
    pub items: BTreeMap<String, syn::Item>,
    /// Items without a name of their own, and items of a name that it has twice.
    pub unnamed: Vec<syn::Item>,
    /// What `use` brings into it, also within functions.
    pub imports: Vec<Import>,
}

/// What a path leads to.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Target {
    /// The module in which the item is defined.
    pub module: ModuleId,
    /// The item; none if the path leads to the module itself.
    pub item: Option<String>,
}

/// The modules of a crate.
#[derive(Debug)]
pub struct Tree {
    /// All modules; the first one is the root.
    pub modules: Vec<Module>,
}

impl Tree {
    /// Reads a crate from the file of its root module.
    ///
    /// # Errors
    ///
    /// Names the file that cannot be read, is not Rust, or is missing.
    pub fn read(root: &Path) -> Result<Self, String> {
        let mut tree = Self { modules: Vec::new() };
        let folder = root.parent().unwrap_or(Path::new("."));
        tree.read_file(root, folder, &[], None)?;
        Ok(tree)
    }

    fn read_file(
        &mut self,
        file: &Path,
        folder: &Path,
        path: &[String],
        parent: Option<ModuleId>,
    ) -> Result<ModuleId, String> {
        let text = fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
        let syntax = syn::parse_file(&text).map_err(|e| format!("{}: {e}", file.display()))?;
        self.add(syntax.items, file, folder, path, parent)
    }

    fn add(
        &mut self,
        items: Vec<syn::Item>,
        file: &Path,
        folder: &Path,
        path: &[String],
        parent: Option<ModuleId>,
    ) -> Result<ModuleId, String> {
        let id = self.modules.len();
        self.modules.push(Module {
            path: path.to_owned(),
            file: file.to_path_buf(),
            parent,
            ..Module::default()
        });
        for item in items {
            if is_for_tests(attributes(&item)) {
                continue;
            }
            self.modules[id].imports.extend(imports_in(&item));
            match item {
                syn::Item::Use(_) => {}
                syn::Item::Mod(module) => {
                    let name = module.ident.to_string();
                    let mut inner = path.to_owned();
                    inner.push(name.clone());
                    let below = folder.join(&name);
                    let child = if let Some((_, items)) = module.content {
                        self.add(items, file, &below, &inner, Some(id))?
                    } else {
                        let flat = folder.join(format!("{name}.rs"));
                        let nested = below.join("mod.rs");
                        let file = if flat.is_file() { flat } else { nested };
                        self.read_file(&file, &below, &inner, Some(id))?
                    };
                    self.modules[id].children.insert(name, child);
                }
                item => {
                    let module = &mut self.modules[id];
                    match name_of(&item) {
                        Some(name) if !module.items.contains_key(&name) => {
                            module.items.insert(name, item);
                        }
                        _ => module.unnamed.push(item),
                    }
                }
            }
        }
        Ok(id)
    }

    /// What a path that is written in a module leads to; none if it leads out
    /// of the crate or to a local name.
    pub fn resolve(&self, module: ModuleId, path: &[String]) -> Option<Target> {
        self.resolve_within(module, path, 0)
    }

    fn resolve_within(&self, module: ModuleId, path: &[String], depth: usize) -> Option<Target> {
        const DEEPEST: usize = 24;
        if depth > DEEPEST {
            return None;
        }
        let (first, rest) = path.split_first()?;
        let start = match first.as_str() {
            "crate" => 0,
            "self" => module,
            "super" => self.modules[module].parent?,
            name => {
                let target = self.lookup(module, name, depth)?;
                return self.follow(target, rest, depth);
            }
        };
        self.follow(Target { module: start, item: None }, rest, depth)
    }

    fn follow(&self, mut target: Target, rest: &[String], depth: usize) -> Option<Target> {
        for name in rest {
            if target.item.is_some() {
                break;
            }
            target = match name.as_str() {
                "self" => target,
                "super" => Target { module: self.modules[target.module].parent?, item: None },
                name => self.lookup(target.module, name, depth)?,
            };
        }
        Some(target)
    }

    /// What a single name means in a module.
    fn lookup(&self, module: ModuleId, name: &str, depth: usize) -> Option<Target> {
        let here = &self.modules[module];
        if here.items.contains_key(name) {
            return Some(Target { module, item: Some(name.to_owned()) });
        }
        if let Some(child) = here.children.get(name) {
            return Some(Target { module: *child, item: None });
        }
        let named = here.imports.iter().filter(|import| import.name == name);
        // `use rand;` within a module of that name would lead back to itself.
        let named = named.filter(|import| import.path.len() > 1);
        let globs = here.imports.iter().filter(|import| import.name == "*");
        for import in named {
            if let Some(target) = self.resolve_within(module, &import.path, depth + 1) {
                return Some(target);
            }
        }
        for glob in globs {
            let from = self.resolve_within(module, &glob.path, depth + 1);
            let Some(Target { module: from, item: None }) = from else { continue };
            if from == module {
                continue;
            }
            if let Some(target) = self.lookup(from, name, depth + 1) {
                return Some(target);
            }
        }
        None
    }

    /// A module's path as it is written, `crate` for the root.
    pub fn name(&self, module: ModuleId) -> String {
        let path = &self.modules[module].path;
        if path.is_empty() { "crate".to_owned() } else { path.join("::") }
    }

    /// The room of a module: the first part of its path.
    pub fn room(&self, module: ModuleId) -> &str {
        self.modules[module].path.first().map_or("crate", String::as_str)
    }
}

/// Whether an item is built for tests alone.
pub fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || attribute.path().is_ident("cfg")
                && matches!(&attribute.meta, syn::Meta::List(list)
                    if list.tokens.to_string().split_whitespace().next() == Some("test"))
    })
}

/// The attributes of an item.
pub fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Enum(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Macro(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Static(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        syn::Item::Trait(item) => &item.attrs,
        syn::Item::Type(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn name_of(item: &syn::Item) -> Option<String> {
    let name = match item {
        syn::Item::Const(item) => &item.ident,
        syn::Item::Enum(item) => &item.ident,
        syn::Item::Fn(item) => &item.sig.ident,
        syn::Item::Macro(item) => item.ident.as_ref()?,
        syn::Item::Static(item) => &item.ident,
        syn::Item::Struct(item) => &item.ident,
        syn::Item::Trait(item) => &item.ident,
        syn::Item::Type(item) => &item.ident,
        _ => return None,
    };
    (name != "_").then(|| name.to_string())
}

/// All imports within an item, those in the bodies of functions with it.
fn imports_in(item: &syn::Item) -> Vec<Import> {
    struct Imports(Vec<Import>);
    impl<'a> Visit<'a> for Imports {
        fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
            let public = !matches!(item.vis, syn::Visibility::Inherited);
            flatten(&item.tree, &mut Vec::new(), public, &mut self.0);
        }
        // A module has imports of its own.
        fn visit_item_mod(&mut self, _: &'a syn::ItemMod) {}
    }
    let mut imports = Imports(Vec::new());
    imports.visit_item(item);
    imports.0
}

fn flatten(tree: &syn::UseTree, path: &mut Vec<String>, public: bool, out: &mut Vec<Import>) {
    match tree {
        syn::UseTree::Path(part) => {
            path.push(part.ident.to_string());
            flatten(&part.tree, path, public, out);
            path.pop();
        }
        syn::UseTree::Name(name) => {
            let name = name.ident.to_string();
            let mut whole = path.clone();
            let known_as = if name == "self" {
                path.last().cloned().unwrap_or_default()
            } else {
                whole.push(name.clone());
                name
            };
            out.push(Import { name: known_as, path: whole, public });
        }
        syn::UseTree::Rename(rename) => {
            let mut whole = path.clone();
            if rename.ident != "self" {
                whole.push(rename.ident.to_string());
            }
            out.push(Import { name: rename.rename.to_string(), path: whole, public });
        }
        syn::UseTree::Glob(_) => {
            out.push(Import { name: "*".to_owned(), path: path.clone(), public });
        }
        syn::UseTree::Group(group) => {
            for tree in &group.items {
                flatten(tree, path, public, out);
            }
        }
    }
}
