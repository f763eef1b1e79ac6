//! YAML as a tree whose nodes know their lines. Scalars stay text, so that a number is parsed
//! once, where it is used.
//!
//! The tree is built from the events of `saphyr-parser`. A document model such as `saphyr`'s
//! would resolve aliases and overwrite repeated keys silently, where here both are refused with
//! their lines, and it does not limit the depth.

use saphyr_parser::{Event, Parser, ScalarStyle, ScanError};

use crate::document::Problem;

/// Largest depth of nesting; calibrations are nested three deep. A choice against stack
/// overflow.
const MAX_DEPTH: usize = 32;

/// One node of the tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Line in the file, from 1.
    pub line: usize,
    /// Its content.
    pub value: Value,
}

/// Content of a node.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A text without quotes, such as a number.
    Plain(String),
    /// A text in quotes, or a block of lines.
    Quoted(String),
    /// A list.
    Sequence(Vec<Node>),
    /// Keys with their values, in the order of the file.
    Mapping(Vec<(String, Node)>),
}

/// The first document of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct YamlDocument {
    /// Its outermost node.
    pub root: Node,
    /// Whether another one follows.
    pub more: bool,
}

impl Node {
    /// The value as it is in the file, shortened for a message.
    pub fn shown(&self) -> String {
        match &self.value {
            Value::Plain(text) if text.is_empty() => "nothing".to_owned(),
            Value::Plain(text) => shortened(text),
            Value::Quoted(text) => format!("\"{}\"", shortened(text)),
            Value::Sequence(items) => format!("a row of {}", items.len()),
            Value::Mapping(_) => "a mapping".to_owned(),
        }
    }
}

fn shortened(text: &str) -> String {
    const LONGEST: usize = 40;
    let on_one_line = |c: char| if c.is_control() { ' ' } else { c };
    let mut shown: String = text.chars().take(LONGEST).map(on_one_line).collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push('…');
    }
    shown
}

/// A sequence or mapping whose end has not been read.
enum Open {
    Sequence(usize, Vec<Node>),
    /// With the key whose value comes next, and its line.
    Mapping(usize, Vec<(String, Node)>, Option<String>),
}

/// Reads the first document that is not empty. Repeated keys and aliases are refused.
pub fn parse(text: &str) -> Result<YamlDocument, Problem> {
    // OpenCV before version 5 begins with `%YAML:1.0`, which is no directive of YAML. It is
    // replaced by a comment, so that line numbers stay.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mended = text.strip_prefix("%YAML:").map(|rest| format!("#YAML:{rest}"));
    let mut parser = Parser::new_from_str(mended.as_deref().unwrap_or(text));
    let mut open: Vec<Open> = Vec::new();
    while let Some(event) = parser.next_event() {
        let (event, span) = event.map_err(|error| not_yaml(&error))?;
        let line = span.start.line();
        let value = match event {
            Event::SequenceStart(..) => {
                open.push(Open::Sequence(line, Vec::new()));
                check_depth(&open, line)?;
                continue;
            }
            Event::MappingStart(..) => {
                open.push(Open::Mapping(line, Vec::new(), None));
                check_depth(&open, line)?;
                continue;
            }
            Event::Scalar(text, ScalarStyle::Plain, ..) => Value::Plain(text.into_owned()),
            Event::Scalar(text, ..) => Value::Quoted(text.into_owned()),
            Event::Alias(_) => {
                return Err(wrong(line, "an alias (*)", "the value itself"));
            }
            Event::SequenceEnd | Event::MappingEnd => {
                let Some(closed) = open.pop() else { continue };
                let node = closed.into_node();
                match put(&mut open, node)? {
                    Some(root) => return Ok(YamlDocument { root, more: follows(parser) }),
                    None => continue,
                }
            }
            _ => continue,
        };
        let is_empty = open.is_empty() && value == Value::Plain(String::new());
        match put(&mut open, Node { line, value })? {
            Some(root) if !is_empty => return Ok(YamlDocument { root, more: follows(parser) }),
            _ => {}
        }
    }
    Ok(YamlDocument { root: Node { line: 1, value: Value::Plain(String::new()) }, more: false })
}

impl Open {
    fn into_node(self) -> Node {
        match self {
            Self::Sequence(line, items) => Node { line, value: Value::Sequence(items) },
            Self::Mapping(line, items, _) => Node { line, value: Value::Mapping(items) },
        }
    }
}

/// Adds a complete node to the innermost open one; returns it where none is open.
fn put(open: &mut [Open], node: Node) -> Result<Option<Node>, Problem> {
    match open.last_mut() {
        None => return Ok(Some(node)),
        Some(Open::Sequence(_, items)) => items.push(node),
        Some(Open::Mapping(_, items, key)) => match key.take() {
            Some(key) => items.push((key, node)),
            None => *key = Some(key_of(node, items)?),
        },
    }
    Ok(None)
}

fn key_of(node: Node, before: &[(String, Node)]) -> Result<String, Problem> {
    let (Value::Plain(text) | Value::Quoted(text)) = node.value else {
        return Err(wrong(node.line, format!("{} for a key", node.shown()), "a name"));
    };
    match before.iter().find(|(key, _)| *key == text) {
        Some((_, first)) => {
            let what = format!("the key {text} a second time (first in line {})", first.line);
            Err(wrong(node.line, what, "it once"))
        }
        None => Ok(text),
    }
}

/// Whether another document has content. Errors in it are ignored.
fn follows(mut parser: Parser<'_, saphyr_parser::StrInput<'_>>) -> bool {
    let is_content = |event: &Event<'_>| match event {
        Event::Scalar(text, ..) => !text.is_empty(),
        Event::SequenceStart(..) | Event::MappingStart(..) => true,
        _ => false,
    };
    std::iter::from_fn(|| parser.next_event()?.ok()).any(|(event, _)| is_content(&event))
}

fn check_depth(open: &[Open], line: usize) -> Result<(), Problem> {
    if open.len() <= MAX_DEPTH {
        return Ok(());
    }
    Err(wrong(line, format!("rows nested more than {MAX_DEPTH} deep"), "a calibration"))
}

fn not_yaml(error: &ScanError) -> Problem {
    let line = Some(error.marker().line());
    let found = format!("not YAML: {}", error.info());
    Problem { line, key: String::new(), found, expected: String::new() }
}

fn wrong(line: usize, found: impl Into<String>, expected: &str) -> Problem {
    Problem {
        line: Some(line),
        key: String::new(),
        found: found.into(),
        expected: expected.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_count_from_the_top_of_the_file_whatever_its_head() {
        for head in ["%YAML:1.0\n---\n", "\u{feff}%YAML 1.2\n---\n", "# a\n---\n"] {
            let document =
                parse(&format!("{head}a: 1.\nb: !!opencv-matrix\n   c: [ .5,\n     x ]\n"));
            let Value::Mapping(items) = document.unwrap().root.value else { unreachable!() };
            assert_eq!(items[0].1, Node { line: 3, value: Value::Plain("1.".to_owned()) });
            let Value::Mapping(inner) = &items[1].1.value else { unreachable!() };
            let Value::Sequence(row) = &inner[0].1.value else { unreachable!() };
            assert_eq!((row[0].line, row[1].line), (5, 6), "{head}");
        }
    }

    #[test]
    fn the_first_document_counts_and_a_second_one_is_noticed() {
        let more = |text: &str| parse(text).unwrap().more;
        assert!(!more("a: 1\n---\n"));
        assert!(!more("---\na: 1\n...\n"));
        assert!(more("---\n---\na: 1\n---\na: 2\n"));
        let Value::Mapping(items) = parse("---\n---\na: 1\n---\na: 2\n").unwrap().root.value else {
            unreachable!()
        };
        assert_eq!(items[0].1.shown(), "1");
    }

    #[test]
    fn a_key_that_stands_twice_and_an_alias_are_refused() {
        let said = |text: &str| parse(text).unwrap_err().to_string();
        assert_eq!(
            said("a: 1\nb: 2\na: 3\n"),
            "line 3: found the key a a second time (first in line 1), expected it once"
        );
        assert_eq!(
            said("a: &x [1]\nb: *x\n"),
            "line 2: found an alias (*), expected the value itself"
        );
    }
}
