//! Numeric constants, and whether they say where they come from.

use std::collections::BTreeMap;
use std::path::PathBuf;

use syn::visit::Visit;

use crate::tree::{Tree, is_for_tests};

/// One numeric constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Constant {
    /// The file in which it stands.
    pub file: PathBuf,
    /// Its name.
    pub name: String,
    /// Whether its comment cites a source or its value is a formula of others.
    pub sourced: bool,
}

/// All constants whose type is a number or an array of numbers.
pub fn numeric(tree: &Tree) -> Vec<Constant> {
    let mut found = Vec::new();
    for module in &tree.modules {
        let mut visitor = Constants { file: module.file.clone(), found: Vec::new() };
        for item in module.items.values().chain(&module.unnamed) {
            visitor.visit_item(item);
        }
        found.extend(visitor.found);
    }
    found
}

/// How many constants of each name there are, of those with more than one.
pub fn repeated(constants: &[Constant]) -> BTreeMap<&str, usize> {
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    for constant in constants {
        *names.entry(&constant.name).or_default() += 1;
    }
    names.retain(|_, count| *count > 1);
    names
}

struct Constants {
    file: PathBuf,
    found: Vec<Constant>,
}

impl Constants {
    fn look(
        &mut self,
        name: &syn::Ident,
        ty: &syn::Type,
        value: &syn::Expr,
        docs: &[syn::Attribute],
    ) {
        if !is_numeric(ty) || name == "_" {
            return;
        }
        let sourced = cites(&text_of(docs)) || is_formula(value);
        self.found.push(Constant { file: self.file.clone(), name: name.to_string(), sourced });
    }
}

impl<'a> Visit<'a> for Constants {
    fn visit_item_const(&mut self, item: &'a syn::ItemConst) {
        self.look(&item.ident, &item.ty, &item.expr, &item.attrs);
    }

    fn visit_impl_item_const(&mut self, item: &'a syn::ImplItemConst) {
        self.look(&item.ident, &item.ty, &item.expr, &item.attrs);
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if !is_for_tests(&item.attrs) {
            syn::visit::visit_impl_item_fn(self, item);
        }
    }
}

fn is_numeric(ty: &syn::Type) -> bool {
    match ty {
        syn::Type::Array(array) => is_numeric(&array.elem),
        syn::Type::Reference(reference) => is_numeric(&reference.elem),
        syn::Type::Slice(slice) => is_numeric(&slice.elem),
        syn::Type::Path(path) => path.path.segments.last().is_some_and(|last| {
            let name = last.ident.to_string();
            let primitive = ["f64", "f32", "usize", "isize"].contains(&name.as_str())
                || name.len() > 1
                    && name.starts_with(['u', 'i'])
                    && name[1..].parse::<u8>().is_ok();
            primitive || ["Span", "Duration", "Mm", "MmPerS"].contains(&name.as_str())
        }),
        _ => false,
    }
}

fn text_of(docs: &[syn::Attribute]) -> String {
    let mut text = String::new();
    for attribute in docs.iter().filter(|attribute| attribute.path().is_ident("doc")) {
        if let syn::Meta::NameValue(pair) = &attribute.meta
            && let syn::Expr::Lit(literal) = &pair.value
            && let syn::Lit::Str(line) = &literal.lit
        {
            text.push_str(&line.value());
            text.push(' ');
        }
    }
    text
}

/// Whether a comment names a source: a year of publication, an equation, a
/// section, a standard, or the derivation beside it ("Derived:", "Measured:",
/// "Sweep:").
fn cites(text: &str) -> bool {
    const MARKS: [&str; 13] = [
        "eq.",
        "Eq.",
        "§",
        "ISO ",
        "IEC ",
        "IEEE",
        "RFC",
        "Derived:",
        "Measured:",
        "Sweep:",
        "contract",
        "papers.md",
        "By definition",
    ];
    let year = text.split(|c: char| !c.is_ascii_digit()).any(|word| {
        word.len() == 4 && word.parse::<u32>().is_ok_and(|year| (1850..=2030).contains(&year))
    });
    year || MARKS.iter().any(|mark| text.contains(mark))
}

/// Whether a value is made of other constants, and so says itself where it
/// comes from: nothing but names in it, or names and a few literals.
fn is_formula(value: &syn::Expr) -> bool {
    struct Names(usize);
    impl<'a> Visit<'a> for Names {
        fn visit_expr_path(&mut self, path: &'a syn::ExprPath) {
            let last = path.path.segments.last().map(|part| part.ident.to_string());
            let constant = last.is_some_and(|name| {
                name.len() > 1
                    && name
                        .chars()
                        .all(|c| c.is_ascii_uppercase() || c == '_' || c.is_ascii_digit())
            });
            if constant {
                self.0 += 1;
            }
        }
    }
    let mut names = Names(0);
    names.visit_expr(value);
    names.0 > 0
}
