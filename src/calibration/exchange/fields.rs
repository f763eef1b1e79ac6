//! A cursor over the keys of a calibration of others, which collects everything
//! that is wrong. Keys that nobody asks for are theirs, and are passed over.

use std::cell::RefCell;
use std::ops::RangeInclusive;

use super::yaml::{Node, Value};
use crate::calibration::file::MAX_SIDE_PX;
use crate::document::Problem;

/// Names that one thing goes by, in small letters and without `_`.
pub type Names = &'static [&'static str];

/// A matrix, row by row, or a plain row of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// Its key in the file.
    pub key: String,
    /// Where it begins.
    pub line: usize,
    /// Its numbers, all of them finite.
    pub data: Vec<f64>,
}

/// The outermost keys of a file.
pub struct YamlFields<'a> {
    items: &'a [(String, Node)],
    problems: RefCell<Vec<Problem>>,
}

impl<'a> YamlFields<'a> {
    /// What is no mapping has no keys, which is reported.
    pub fn of(root: &'a Node) -> Self {
        let items = mapping(root);
        let fields = Self { items: items.unwrap_or(&[]), problems: RefCell::default() };
        if items.is_none_or(<[_]>::is_empty) {
            let expected = "a mapping with the keys of ROS's camera_info or OpenCV's calibration";
            fields.problem(Some(root.line), "", root.shown(), expected);
        }
        fields
    }

    /// How much was found wrong so far.
    pub fn count_problems(&self) -> usize {
        self.problems.borrow().len()
    }

    /// Everything that was found wrong.
    pub fn into_problems(self) -> Vec<Problem> {
        self.problems.into_inner()
    }

    /// Whether one of the names stands in the file.
    pub fn has(&self, names: Names) -> bool {
        self.all(names).next().is_some()
    }

    /// Whether the mapping of one of the names has this key.
    pub fn has_within(&self, names: Names, key: &str) -> bool {
        self.all(names).any(|(_, node)| get(mapping(node).unwrap_or(&[]), key).is_some())
    }

    fn all(&self, names: Names) -> impl Iterator<Item = &'a (String, Node)> {
        self.items.iter().filter(|(key, _)| names.contains(&normal(key).as_str()))
    }

    /// The value of one of the names; two of them would be two values.
    fn find(&self, names: Names) -> Option<&'a (String, Node)> {
        let mut all = self.all(names);
        let first = all.next()?;
        for (key, node) in all {
            let found = format!("a second name of {}", first.0);
            self.problem(Some(node.line), key, found, "one of them");
        }
        Some(first)
    }

    /// The same where it must be there; `name` is the usual one.
    fn required(&self, names: Names, name: &str, expected: &str) -> Option<&'a (String, Node)> {
        if !self.has(names) && !self.items.is_empty() {
            self.problem(None, name, "nothing", expected);
        }
        self.find(names)
    }

    /// Reports that what stands there is not what is expected.
    pub fn report(&self, names: Names, name: &str, expected: &str) {
        if let Some((key, node)) = self.required(names, name, expected) {
            self.problem(Some(node.line), key, node.shown(), expected);
        }
    }

    /// Adds to what is wrong.
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

    /// A text; `None` where there is none.
    pub fn text(&self, names: Names) -> Option<String> {
        match &self.find(names)?.1.value {
            Value::Plain(text) | Value::Quoted(text) => Some(text.clone()),
            _ => None,
        }
    }

    /// One side of the picture \[px\].
    pub fn side(&self, names: Names, name: &str) -> Option<u32> {
        let expected = format!("a whole number from 1 to {MAX_SIDE_PX}");
        let (key, node) = self.required(names, name, &expected)?;
        let side = number(node).and_then(as_side);
        if side.is_none() {
            self.problem(Some(node.line), key, node.shown(), expected);
        }
        side
    }

    /// Both sides of the picture in one row \[px\].
    pub fn size(&self, names: Names, name: &str) -> Option<[u32; 2]> {
        let matrix = self.matrix(names, name)?;
        let sides: Option<Vec<u32>> = matrix.data.iter().map(|&side| as_side(side)).collect();
        let size = sides.and_then(|sides| sides.try_into().ok());
        if size.is_none() {
            let expected = format!("width and height, whole numbers from 1 to {MAX_SIDE_PX}");
            self.problem(Some(matrix.line), &matrix.key, format!("{:?}", matrix.data), expected);
        }
        size
    }

    /// A number within a range; `None` where it is absent or wrong.
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

    /// Reports a whole number that is there, but not one of those that are sound.
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

    /// The numbers of a matrix that must be there.
    pub fn matrix(&self, names: Names, name: &str) -> Option<Matrix> {
        let (key, node) = self.required(names, name, "rows, cols and data")?;
        let Some(items) = mapping(node) else { return self.row(key, node) };
        let sides = [get(items, "rows"), get(items, "cols")];
        let data = get(items, "data");
        for (part, node_of) in [("rows", sides[0]), ("cols", sides[1]), ("data", data)] {
            if node_of.is_none() {
                self.problem(
                    Some(node.line),
                    &format!("{key}.{part}"),
                    "nothing",
                    "it beside the others",
                );
            }
        }
        for (part, side) in [("rows", sides[0]), ("cols", sides[1])] {
            if let Some(side) = side.filter(|side| number(side).is_none()) {
                self.problem(
                    Some(side.line),
                    &format!("{key}.{part}"),
                    side.shown(),
                    "a whole number",
                );
            }
        }
        let [rows, cols] = sides.map(|side| side.and_then(number));
        let matrix = self.row(&format!("{key}.data"), data?)?;
        let count = rows? * cols?;
        if f64::from(u32::try_from(matrix.data.len()).unwrap_or(u32::MAX)) != count {
            let found = format!("{} numbers", matrix.data.len());
            let expected = format!("rows x cols = {count}");
            self.problem(Some(matrix.line), &matrix.key, found, expected);
            return None;
        }
        Some(Matrix { key: key.clone(), ..matrix })
    }

    /// A row of numbers, or of rows of them.
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

    /// A matrix that may be absent, of one size; `None` where it is wrong, too.
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

    /// Whether a matrix has one of these counts of numbers, which is reported.
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

/// Capitals and `_` differ from version to version.
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

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "checked to be a whole number in range"
)]
fn as_side(side: f64) -> Option<u32> {
    ((1.0..=MAX_SIDE_PX).contains(&side) && side.fract() == 0.0).then_some(side as u32)
}

/// Counts in words, such as `4, 5 or 8`.
fn listed(counts: &[usize]) -> String {
    let words: Vec<String> = counts.iter().map(usize::to_string).collect();
    match words.split_last() {
        Some((last, first)) if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => words.concat(),
    }
}
