//! Lines of code: neither blank nor a comment, outside tests.

use std::collections::BTreeMap;
use std::path::PathBuf;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::spanned::Spanned;

use crate::tree::{Tree, attributes, is_for_tests};

/// Lines of code of each file of the tree. A line counts if a token of the
/// code stands in it; the text of a doc comment is no code.
///
/// # Errors
///
/// Names a file that cannot be read again.
pub fn of_files(tree: &Tree) -> Result<BTreeMap<PathBuf, usize>, String> {
    let mut files = BTreeMap::new();
    for module in &tree.modules {
        if files.contains_key(&module.file) {
            continue;
        }
        let text = std::fs::read_to_string(&module.file)
            .map_err(|e| format!("{}: {e}", module.file.display()))?;
        files.insert(module.file.clone(), of_text(&text)?);
    }
    Ok(files)
}

/// Lines of code of a text.
///
/// # Errors
///
/// Says where the text is not Rust.
pub fn of_text(text: &str) -> Result<usize, String> {
    let syntax = syn::parse_file(text).map_err(|e| e.to_string())?;
    let mut code = vec![false; text.lines().count() + 1];
    for item in &syntax.items {
        mark_item(item, &mut code);
    }
    Ok(code.iter().filter(|counts| **counts).count())
}

fn mark_item(item: &syn::Item, code: &mut [bool]) {
    if is_for_tests(attributes(item)) {
        return;
    }
    if let syn::Item::Mod(module) = item
        && let Some((_, items)) = &module.content
    {
        let span = module.span();
        mark(span.start().line, span.start().line, code);
        mark(span.end().line, span.end().line, code);
        for item in items {
            mark_item(item, code);
        }
        return;
    }
    mark_tokens(item.to_token_stream(), code);
}

fn mark_tokens(tokens: TokenStream, code: &mut [bool]) {
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Group(group) => {
                let (open, close) = (group.span_open(), group.span_close());
                mark(open.start().line, open.end().line, code);
                mark(close.start().line, close.end().line, code);
                mark_tokens(group.stream(), code);
            }
            // A doc comment reaches here as `#[doc = "…"]`.
            TokenTree::Punct(hash) if hash.as_char() == '#' => {
                while matches!(tokens.peek(), Some(TokenTree::Punct(not)) if not.as_char() == '!') {
                    tokens.next();
                }
                let is_doc = matches!(tokens.peek(), Some(TokenTree::Group(group))
                    if group.stream().into_iter().next().is_some_and(|first| first.to_string() == "doc"));
                if is_doc {
                    tokens.next();
                } else {
                    mark(hash.span().start().line, hash.span().start().line, code);
                }
            }
            other => {
                let span = other.span();
                mark(span.start().line, span.end().line, code);
            }
        }
    }
}

fn mark(from: usize, to: usize, code: &mut [bool]) {
    for line in from..=to {
        if let Some(counts) = code.get_mut(line) {
            *counts = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blank_lines_comments_and_tests_do_not_count() {
        let text = "//! Head.\n\n/// Says.\nfn one() {\n    // why\n    two();\n}\n\n#[cfg(test)]\nmod tests {\n    fn three() {}\n}\n";
        assert_eq!(of_text(text), Ok(3));
    }
}
