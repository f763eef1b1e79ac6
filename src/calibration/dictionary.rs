//! Dictionaries of `ArUco` markers: the white cells of each marker. The codes are those of
//! OpenCV's dictionaries of the same names.

use std::sync::OnceLock;

/// Markers of one size: as many cells along a row as along a column, within a black border of one
/// cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dictionary {
    /// 4x4 cells.
    Four,
    /// 5x5 cells.
    Five,
    /// 6x6 cells.
    Six,
    /// 7x7 cells.
    Seven,
}

/// Codes as hexadecimal numbers, row by row from the upper left cell, 1 for white.
const TEXTS: [&str; 4] = [
    include_str!("dictionary/4x4.txt"),
    include_str!("dictionary/5x5.txt"),
    include_str!("dictionary/6x6.txt"),
    include_str!("dictionary/7x7.txt"),
];

impl Dictionary {
    /// All dictionaries.
    pub const ALL: [Self; 4] = [Self::Four, Self::Five, Self::Six, Self::Seven];
    /// Markers of each dictionary. By definition of OpenCV's `DICT_4X4_1000` and the like.
    pub const MARKERS: usize = 1000;

    /// The dictionary of a name such as `4x4`, or OpenCV's `DICT_4X4_50`: OpenCV's smaller
    /// dictionaries are the first markers of the same list.
    pub fn named(text: &str) -> Option<Self> {
        let lower = text.trim().to_lowercase();
        let name = lower.strip_prefix("dict_").unwrap_or(&lower);
        let (cells, count) = name.split_once('_').map_or((name, None), |(a, b)| (a, Some(b)));
        let is_known = count.is_none_or(|count| ["50", "100", "250", "1000"].contains(&count));
        Self::ALL.into_iter().find(|known| known.name() == cells && is_known)
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        ["4x4", "5x5", "6x6", "7x7"][self as usize]
    }

    /// Cells of the code along each side.
    pub fn side(self) -> usize {
        4 + self as usize
    }

    /// Cells that may be misread, few enough for false detections to be rare.
    pub fn max_errors(self) -> u32 {
        self as u32
    }

    /// The codes by number; the upper left cell is the highest bit.
    pub fn codes(self) -> &'static [u64] {
        static CODES: [OnceLock<Vec<u64>>; 4] = [const { OnceLock::new() }; 4];
        CODES[self as usize].get_or_init(|| {
            let words = TEXTS[self as usize].split_whitespace();
            words.map(|word| u64::from_str_radix(word, 16).unwrap_or_default()).collect()
        })
    }

    /// Whether a cell of a marker's code is white.
    pub fn is_white(self, marker: usize, column: usize, row: usize) -> bool {
        let cell = row * self.side() + column;
        let last = self.side() * self.side() - 1;
        self.codes().get(marker).is_some_and(|code| (code >> (last - cell)) & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_codes_are_there_and_no_two_are_alike() {
        for dictionary in Dictionary::ALL {
            let mut codes = dictionary.codes().to_vec();
            let cells = dictionary.side() * dictionary.side();
            assert!(codes.iter().all(|&code| code > 0 && code >> cells == 0));
            codes.sort_unstable();
            codes.dedup();
            assert_eq!(codes.len(), Dictionary::MARKERS, "{}", dictionary.name());
        }
    }

    #[test]
    fn the_first_marker_of_4x4_is_the_known_one() {
        let rows: Vec<String> = (0..4)
            .map(|row| {
                let cell =
                    |column| if Dictionary::Four.is_white(0, column, row) { '1' } else { '0' };
                (0..4).map(cell).collect()
            })
            .collect();
        assert_eq!(rows, ["1011", "0101", "0011", "0010"]);
    }

    #[test]
    fn both_forms_of_a_name_are_known() {
        assert_eq!(Dictionary::named("4x4"), Some(Dictionary::Four));
        assert_eq!(Dictionary::named("DICT_6X6_250"), Some(Dictionary::Six));
        assert_eq!(Dictionary::named("5X5_1000"), Some(Dictionary::Five));
        for unknown in ["8x8", "4x4_60", "aruco", ""] {
            assert_eq!(Dictionary::named(unknown), None, "{unknown}");
        }
    }
}
