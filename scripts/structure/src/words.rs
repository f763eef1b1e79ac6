//! Words of a private dialect in names and in what the program prints.

use std::collections::BTreeMap;
use std::path::PathBuf;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;

use crate::tree::Tree;

/// Words that the project's glossary replaces.
pub const REPLACED: [&str; 35] = [
    "foretell",
    "foretold",
    "foretells",
    "foretelling",
    "surprise",
    "surprises",
    "unrest",
    "distrust",
    "distrusts",
    "distrusted",
    "scribe",
    "eye",
    "obedience",
    "obeys",
    "storey",
    "storeys",
    "hats",
    "hat",
    "wish",
    "wishes",
    "wished",
    "farewell",
    "trail",
    "trails",
    "colour",
    "colours",
    "coloured",
    "doubt",
    "doubts",
    "doubted",
    "doubtful",
    "law",
    "laws",
    "told",
    "untold",
];

/// One place where such a word stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: PathBuf,
    /// The line in it, from 1.
    pub line: usize,
    /// The word.
    pub word: &'static str,
    /// The name or the text in which it stands.
    pub within: String,
    /// Whether it is a text, not a name.
    pub in_text: bool,
}

/// Places of replaced words in names and in texts of the code, comments apart.
pub fn replaced(tree: &Tree) -> Vec<Place> {
    let mut places = Vec::new();
    for module in &tree.modules {
        let mut own = Vec::new();
        for item in module.items.values().chain(&module.unnamed) {
            look(item.to_token_stream(), &mut own);
        }
        if let Some(name) = module.path.last() {
            note(name, 1, false, &mut own);
        }
        for mut place in own {
            place.file.clone_from(&module.file);
            places.push(place);
        }
    }
    places
}

/// How often each word occurs.
pub fn counted(places: &[Place]) -> BTreeMap<&'static str, usize> {
    let mut counts = BTreeMap::new();
    for place in places {
        *counts.entry(place.word).or_default() += 1;
    }
    counts
}

fn look(tokens: TokenStream, places: &mut Vec<Place>) {
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Ident(name) => {
                note(&name.to_string(), name.span().start().line, false, places);
            }
            TokenTree::Literal(text) => {
                let written = text.to_string();
                if written.contains('"') {
                    note(&written, text.span().start().line, true, places);
                }
            }
            TokenTree::Punct(hash) if hash.as_char() == '#' => {
                // A doc comment is neither a name nor a message.
                if matches!(tokens.peek(), Some(TokenTree::Group(group))
                    if group.stream().to_string().starts_with("doc "))
                {
                    tokens.next();
                }
            }
            TokenTree::Group(group) => look(group.stream(), places),
            TokenTree::Punct(_) => {}
        }
    }
}

fn note(text: &str, line: usize, in_text: bool, places: &mut Vec<Place>) {
    for part in parts(text) {
        if let Some(word) = REPLACED.iter().find(|word| **word == part) {
            let within = text.to_owned();
            places.push(Place { file: PathBuf::new(), line, word, within, in_text });
        }
    }
}

/// The words of a name or a text, in small letters.
pub fn parts(text: &str) -> Vec<String> {
    let mut parts = Vec::new();
    let mut part = String::new();
    let mut before = ' ';
    for letter in text.chars() {
        let begins = letter.is_uppercase() && !before.is_uppercase();
        if (begins || !letter.is_alphabetic()) && !part.is_empty() {
            parts.push(std::mem::take(&mut part));
        }
        if letter.is_alphabetic() {
            part.extend(letter.to_lowercase());
        }
        before = letter;
    }
    if !part.is_empty() {
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_texts_are_cut_into_words() {
        assert_eq!(parts("PressureLaw"), ["pressure", "law"]);
        assert_eq!(parts("told_at_s"), ["told", "at", "s"]);
        assert_eq!(parts("\"the law of\""), ["the", "law", "of"]);
        assert_eq!(parts("lawful"), ["lawful"]);
    }
}
