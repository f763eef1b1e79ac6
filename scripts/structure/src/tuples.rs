//! Functions that take tuples of numbers, where names would say more.

use syn::visit::Visit;

use crate::items::is_public;
use crate::tree::{ModuleId, Tree, is_for_tests};

/// A public function with such a parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taking {
    /// The module in which it stands.
    pub module: ModuleId,
    /// Its name.
    pub function: String,
    /// The parameter's type.
    pub parameter: String,
}

/// Public functions of which a parameter holds a tuple of two or more numbers
/// or units. A function of a trait is as public as the trait.
pub fn taking_numbers(tree: &Tree) -> Vec<Taking> {
    let mut found = Vec::new();
    for (id, module) in tree.modules.iter().enumerate() {
        let mut visitor = Functions { module: id, found: Vec::new() };
        for item in module.items.values().chain(&module.unnamed) {
            visitor.visit_item(item);
        }
        found.extend(visitor.found);
    }
    found
}

struct Functions {
    module: ModuleId,
    found: Vec<Taking>,
}

impl Functions {
    fn look(&mut self, signature: &syn::Signature) {
        for input in &signature.inputs {
            let syn::FnArg::Typed(parameter) = input else { continue };
            let mut tuples = Tuples(None);
            tuples.visit_type(&parameter.ty);
            if let Some(parameter) = tuples.0 {
                let function = signature.ident.to_string();
                self.found.push(Taking { module: self.module, function, parameter });
                return;
            }
        }
    }
}

impl<'a> Visit<'a> for Functions {
    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        if is_public(&item.vis) {
            self.look(&item.sig);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if is_public(&item.vis) && !is_for_tests(&item.attrs) {
            self.look(&item.sig);
        }
    }

    fn visit_item_trait(&mut self, item: &'a syn::ItemTrait) {
        if is_public(&item.vis) {
            for part in &item.items {
                if let syn::TraitItem::Fn(function) = part {
                    self.look(&function.sig);
                }
            }
        }
    }
}

struct Tuples(Option<String>);

impl<'a> Visit<'a> for Tuples {
    fn visit_type_tuple(&mut self, tuple: &'a syn::TypeTuple) {
        let numbers = tuple.elems.iter().filter(|part| is_number(part)).count();
        if numbers >= 2 {
            let text = quote::ToTokens::to_token_stream(tuple).to_string();
            self.0.get_or_insert(text);
        }
        syn::visit::visit_type_tuple(self, tuple);
    }
}

/// Primitive numbers, and the types of `units` and `time`.
const NUMBERS: [&str; 15] = [
    "f64", "f32", "usize", "isize", "u8", "u16", "u32", "u64", "u128", "i8", "i16", "i32", "i64",
    "Stamp", "Span",
];

fn is_number(part: &syn::Type) -> bool {
    let part = match part {
        syn::Type::Reference(reference) => &*reference.elem,
        part => part,
    };
    let syn::Type::Path(path) = part else { return false };
    let Some(last) = path.path.segments.last() else { return false };
    let name = last.ident.to_string();
    NUMBERS.contains(&name.as_str()) || is_unit(&name)
}

/// Types of `units`: `Mm`, `MmPerS`, `Rpm`, and the like.
fn is_unit(name: &str) -> bool {
    name.starts_with("Mm") || ["Rpm", "KPa", "Pa", "Px", "Kelvin", "Celsius"].contains(&name)
}
