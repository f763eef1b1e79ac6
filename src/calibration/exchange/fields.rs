//! The keys of another program's calibration, read with all violations collected. Unknown keys
//! are ignored.

use std::cell::RefCell;
use std::ops::RangeInclusive;

use super::yaml::{Node, Value};
use crate::calibration::file::{MAX_SIDE_PX, whole_side};
use crate::document::Problem;
use crate::numeric::number::to_f64;

/// Names of one key in lower case and without `_`.
pub type Names = &'static [&'static str];

/// A matrix, row by row, or a plain list of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// Its key in the file.
    pub key: String,
    /// Line where it begins.
    pub line: usize,
    /// Its numbers, all finite.
    pub data: Vec<f64>,
}

/// The outermost keys of a file.
pub struct YamlFields<'a> {
    items: &'a [(String, Node)],
    problems: RefCell<Vec<Problem>>,
}

impl<'a> YamlFields<'a> {
    /// The keys of a document's root; reports a root that is no mapping.
    pub fn of(root: &'a Node) -> Self {
        let items = mapping(root);
        let fields = Self { items: items.unwrap_or(&[]), problems: RefCell::default() };
        if items.is_none_or(<[_]>::is_empty) {
            let expected = "a mapping with the keys of ROS's camera_info or OpenCV's calibration";
            fields.problem(Some(root.line), "", root.shown(), expected);
        }
        fields
    }

    /// Number of violations so far.
    pub fn count_problems(&self) -> usize {
        self.problems.borrow().len()
    }

    /// All violations.
    pub fn into_problems(self) -> Vec<Problem> {
        self.problems.into_inner()
    }

    /// Whether the file has a key of one of these names.
    pub fn has(&self, names: Names) -> bool {
        self.all(names).next().is_some()
    }

    /// Whether the mapping at one of these names has this key.
    pub fn has_within(&self, names: Names, key: &str) -> bool {
        self.all(names).any(|(_, node)| get(mapping(node).unwrap_or(&[]), key).is_some())
    }

    fn all(&self, names: Names) -> impl Iterator<Item = &'a (String, Node)> {
        self.items.iter().filter(|(key, _)| names.contains(&normal(key).as_str()))
    }

    /// The value at one of these names; reports a second one.
    fn find(&self, names: Names) -> Option<&'a (String, Node)> {
        let mut all = self.all(names);
        let first = all.next()?;
        for (key, node) in all {
            let found = format!("a second name of {}", first.0);
            self.problem(Some(node.line), key, found, "one of them");
        }
        Some(first)
    }

    /// The value of a required key, whose absence is reported; `name` is its usual name.
    fn required(&self, names: Names, name: &str, expected: &str) -> Option<&'a (String, Node)> {
        if !self.has(names) && !self.items.is_empty() {
            self.problem(None, name, "nothing", expected);
        }
        self.find(names)
    }

    /// Reports that the value is not what is expected.
    pub fn report(&self, names: Names, name: &str, expected: &str) {
        if let Some((key, node)) = self.required(names, name, expected) {
            self.problem(Some(node.line), key, node.shown(), expected);
        }
    }

    /// Adds a violation.
    pub fn problem(
        &self,
        line: Option<usize>,
        key: &str,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) {
        let (found, expected) = (found.into(), expected.into());
        self.problems.borrow_mut().push(Problem { line, key: key.to_owned(), found, expected });
    }

    /// A text; `None` if absent.
    pub fn text(&self, names: Names) -> Option<String> {
        match &self.find(names)?.1.value {
            Value::Plain(text) | Value::Quoted(text) => Some(text.clone()),
            _ => None,
        }
    }

    /// A side of the image \[px\].
    pub fn side(&self, names: Names, name: &str) -> Option<u32> {
        let expected = format!("a whole number from 1 to {MAX_SIDE_PX}");
        let (key, node) = self.required(names, name, &expected)?;
        let side = number(node).and_then(whole_side);
        if side.is_none() {
            self.problem(Some(node.line), key, node.shown(), expected);
        }
        side
    }

    /// Both sides of the image in one list \[px\].
    pub fn size(&self, names: Names, name: &str) -> Option<[u32; 2]> {
        let matrix = self.matrix(names, name)?;
        let sides: Option<Vec<u32>> = matrix.data.iter().map(|&side| whole_side(side)).collect();
        let size = sides.and_then(|sides| sides.try_into().ok());
        if size.is_none() {
            let expected = format!("width and height, whole numbers from 1 to {MAX_SIDE_PX}");
            self.problem(Some(matrix.line), &matrix.key, format!("{:?}", matrix.data), expected);
        }
        size
    }

    /// A number within a range; `None` if absent or invalid.
    pub fn optional_number(
        &self,
        names: Names,
        name: &str,
        range: RangeInclusive<f64>,
    ) -> Option<f64> {
        let (_, node) = self.find(names)?;
        let found = number(node).filter(|number| range.contains(number));
        if found.is_none() {
            let expected = format!("a number from {} to {}", range.start(), range.end());
            self.problem(Some(node.line), name, node.shown(), expected);
        }
        found
    }

    /// Reports a number that is present but not one of the accepted ones.
    pub fn check_whole(&self, path: &[&str], sound: &[u32], expected: &str) {
        let mut items = self.items;
        let mut found = None;
        for key in path {
            found = get(items, key);
            items = found.and_then(mapping).unwrap_or(&[]);
        }
        let Some(node) = found else { return };
        let is_sound = |number: f64| sound.iter().any(|&sound| f64::from(sound) == number);
        if !number(node).is_some_and(is_sound) {
            self.problem(Some(node.line), &path.join("."), node.shown(), expected);
        }
    }

    /// The numbers of a required matrix.
    pub fn matrix(&self, names: Names, name: &str) -> Option<Matrix> {
        let (key, node) = self.required(names, name, "rows, cols and data")?;
        let Some(items) = mapping(node) else { return self.row(key, node) };
        let parts =
            ["rows", "cols", "data"].map(|part| (format!("{key}.{part}"), get(items, part)));
        for (part, _) in parts.iter().filter(|(_, found)| found.is_none()) {
            self.problem(Some(node.line), part, "nothing", "it beside the others");
        }
        for (part, side) in parts.iter().take(2) {
            if let Some(side) = side.filter(|side| number(side).is_none()) {
                self.problem(Some(side.line), part, side.shown(), "a whole number");
            }
        }
        let [rows, cols, (name, data)] = parts;
        let matrix = self.row(&name, data?)?;
        let count = rows.1.and_then(number)? * cols.1.and_then(number)?;
        if to_f64(matrix.data.len()) != count {
            let found = format!("{} numbers", matrix.data.len());
            let expected = format!("rows x cols = {count}");
            self.problem(Some(matrix.line), &matrix.key, found, expected);
            return None;
        }
        Some(Matrix { key: key.clone(), ..matrix })
    }

    /// A list of numbers, or of lists of numbers.
    fn row(&self, key: &str, node: &Node) -> Option<Matrix> {
        let Value::Sequence(items) = &node.value else {
            self.problem(Some(node.line), key, node.shown(), "numbers in brackets");
            return None;
        };
        let flat = items.iter().flat_map(|item| match &item.value {
            Value::Sequence(inner) => inner.as_slice(),
            _ => std::slice::from_ref(item),
        });
        let mut data = Vec::new();
        let mut is_sound = true;
        for (index, item) in flat.enumerate() {
            if let Some(number) = number(item) {
                data.push(number);
            } else {
                let key = format!("{key}[{index}]");
                self.problem(Some(item.line), &key, item.shown(), "a finite number");
                is_sound = false;
            }
        }
        is_sound.then(|| Matrix { key: key.to_owned(), line: node.line, data })
    }

    /// An optional matrix of one size; `None` if absent or invalid.
    pub fn optional_matrix(
        &self,
        names: Names,
        name: &str,
        [rows, cols]: [usize; 2],
    ) -> Option<Matrix> {
        if !self.has(names) {
            return None;
        }
        let matrix = self.matrix(names, name)?;
        self.has_count(&matrix, &[rows * cols]).then_some(matrix)
    }

    /// Whether a matrix has one of these numbers of elements; reports it otherwise.
    pub fn has_count(&self, matrix: &Matrix, counts: &[usize]) -> bool {
        let found = matrix.data.len();
        if counts.contains(&found) {
            return true;
        }
        let found = format!("{found} numbers");
        self.problem(Some(matrix.line), &matrix.key, found, listed(counts));
        false
    }
}

/// A key without upper case and `_`, which differ from version to version.
fn normal(key: &str) -> String {
    key.chars().filter(|&c| c != '_').flat_map(char::to_lowercase).collect()
}

fn mapping(node: &Node) -> Option<&[(String, Node)]> {
    match &node.value {
        Value::Mapping(items) => Some(items),
        _ => None,
    }
}

fn get<'a>(items: &'a [(String, Node)], key: &str) -> Option<&'a Node> {
    items.iter().find(|(name, _)| normal(name) == normal(key)).map(|(_, node)| node)
}

/// A finite number as YAML and OpenCV write it, such as `1.`, `.5` or `5.3e+02`.
fn number(node: &Node) -> Option<f64> {
    let Value::Plain(text) = &node.value else { return None };
    text.parse::<f64>().ok().filter(|number| number.is_finite())
}

/// Counts in words, such as `4, 5 or 8`.
fn listed(counts: &[usize]) -> String {
    let words: Vec<String> = counts.iter().map(usize::to_string).collect();
    match words.split_last() {
        Some((last, first)) if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => words.concat(),
    }
}
