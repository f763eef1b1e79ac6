//! A board for printing, at its true size, as PDF or SVG.

use std::fmt::Write as _;

use pdf_writer::{Content, Name, Pdf, Rect, Ref, Str};

use crate::calibration::board::Board;
use crate::core::GridSize;

/// Points of a PDF in a millimetre. By definition a point is 1/72 inch (ISO 32000-1, 8.3.2.3).
const POINTS: f64 = 72.0 / 25.4;
/// White between the squares and the paper's edge \[mm\]: printers need some, and the detection of
/// boards needs a bright margin around the outer squares.
const MARGIN_MM: f64 = 8.0;
/// Height below the squares for scale bar and text \[mm\].
const FOOT_MM: f64 = 24.0;
/// Length of the scale bar, and of a shorter one for small paper \[mm\].
const BAR_MM: [f64; 2] = [100.0, 50.0];
/// Width of a line \[mm\].
const LINE_MM: f64 = 0.3;
/// Size of the letters \[mm\].
const LETTERS_MM: f64 = 3.4;

/// Paper in landscape format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paper {
    /// Long side \[mm\].
    pub width_mm: f64,
    /// Short side \[mm\].
    pub height_mm: f64,
}

impl Paper {
    /// Common paper sizes.
    pub const KNOWN: [(&'static str, Self); 6] = [
        ("a4", Self { width_mm: 297.0, height_mm: 210.0 }),
        ("a3", Self { width_mm: 420.0, height_mm: 297.0 }),
        ("a2", Self { width_mm: 594.0, height_mm: 420.0 }),
        ("a1", Self { width_mm: 841.0, height_mm: 594.0 }),
        ("a0", Self { width_mm: 1189.0, height_mm: 841.0 }),
        ("letter", Self { width_mm: 279.4, height_mm: 215.9 }),
    ];
}

/// A board that does not fit on its paper.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the board with its margin and its bar needs {:.0} x {:.0} mm, the paper \
     has {width_mm} x {height_mm} mm: take smaller squares, fewer of them, or larger paper",
    need_mm.ceil(), need_high_mm.ceil(), width_mm = paper.width_mm, height_mm = paper.height_mm
)]
pub struct TooLarge {
    /// Required width \[mm\].
    pub need_mm: f64,
    /// Required height \[mm\].
    pub need_high_mm: f64,
    /// The paper.
    pub paper: Paper,
}

/// The drawing: black rectangles and lines of text, from the paper's upper left corner \[mm\].
#[derive(Debug, Clone, PartialEq)]
pub struct BoardSheet {
    paper: Paper,
    title: String,
    /// x, y, width and height of each rectangle.
    black: Vec<[f64; 4]>,
    /// Middle, baseline and text of each line.
    words: Vec<(f64, f64, String)>,
}

impl BoardSheet {
    /// Places a board in the middle of the paper, with a scale bar to check its printed size.
    #[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
    pub fn of(board: &Board, paper: Paper) -> Result<Self, TooLarge> {
        let GridSize { columns, rows } = board.corners();
        let side = board.square().get();
        let (width, height) = ((columns + 1) as f64 * side, (rows + 1) as f64 * side);
        let need_mm = width.max(BAR_MM[1]) + 2.0 * MARGIN_MM;
        let need_high_mm = height + 2.0 * MARGIN_MM + FOOT_MM;
        if need_mm > paper.width_mm || need_high_mm > paper.height_mm {
            return Err(TooLarge { need_mm, need_high_mm, paper });
        }
        let left = (paper.width_mm - width) / 2.0;
        let top = MARGIN_MM + (paper.height_mm - need_high_mm) / 2.0;
        let mut black: Vec<[f64; 4]> = (0..(columns + 1) * (rows + 1))
            .map(|i| (i % (columns + 1), i / (columns + 1)))
            .filter(|(column, row)| (column + row) % 2 == 0)
            .map(|(column, row)| [left + column as f64 * side, top + row as f64 * side, side, side])
            .collect();
        black.extend(markers(board, (left, top)));
        let middle = paper.width_mm / 2.0;
        let has_room = paper.width_mm >= BAR_MM[0] + 2.0 * MARGIN_MM;
        let bar = if has_room { BAR_MM[0] } else { BAR_MM[1] };
        let base = top + height + 14.0;
        black.extend(ruler(middle - bar / 2.0, base, bar));
        let (ten, side, options) = (shown(10.0 * side), shown(side), options(board));
        let check = format!(
            "Print at 100 %. This bar is {bar} mm long; ten squares are {ten} mm. Measure both."
        );
        let command = format!("truebead: --board {columns}x{rows} --square-mm {side}{options}");
        let words = vec![(middle, base + 5.0, check), (middle, base + 9.5, command)];
        let kind = if board.is_plain() { "Checkerboard" } else { "ChArUco board" };
        let title = format!("{kind}, {columns}x{rows} inner corners, squares of {side} mm");
        Ok(Self { paper, title, black, words })
    }

    /// As SVG, with millimetres as units.
    pub fn svg(&self) -> String {
        let Paper { width_mm, height_mm } = self.paper;
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
             <svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_mm}mm\" height=\"{height_mm}mm\" \
             viewBox=\"0 0 {width_mm} {height_mm}\">\n  <title>{}</title>\n  \
             <rect width=\"{width_mm}\" height=\"{height_mm}\" fill=\"#fff\"/>\n  \
             <path fill=\"#000\" shape-rendering=\"crispEdges\" d=\"",
            self.title
        );
        for black in &self.black {
            let [x, y, width, height] = black.map(shown);
            let _ = write!(text, "M{x} {y}h{width}v{height}h-{width}z");
        }
        text.push_str("\"/>\n");
        for (x, y, words) in &self.words {
            let (x, y) = (shown(*x), shown(*y));
            let _ = writeln!(
                text,
                "  <text x=\"{x}\" y=\"{y}\" font-family=\"sans-serif\" font-size=\"{LETTERS_MM}\" \
                 text-anchor=\"middle\">{words}</text>"
            );
        }
        text.push_str("</svg>\n");
        text
    }

    /// As a PDF with one page.
    pub fn pdf(&self) -> Vec<u8> {
        let [catalog, pages, page, font, content] = [1, 2, 3, 4, 5].map(Ref::new);
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        let mut leaf = pdf.page(page);
        let (width, height) = (points(self.paper.width_mm), points(self.paper.height_mm));
        leaf.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(content);
        leaf.resources().fonts().pair(Name(b"F1"), font);
        drop(leaf);
        pdf.type1_font(font).base_font(Name(b"Helvetica"));
        pdf.stream(content, &self.content());
        pdf.finish()
    }

    /// The content of the PDF page; PDF coordinates start at the lower left corner.
    fn content(&self) -> Vec<u8> {
        let up = |y: f64| points(self.paper.height_mm - y);
        let mut content = Content::new();
        for [x, y, width, height] in &self.black {
            content.rect(points(*x), up(y + height), points(*width), points(*height));
        }
        content.fill_nonzero();
        for (x, y, words) in &self.words {
            content.begin_text();
            content.set_font(Name(b"F1"), points(LETTERS_MM));
            content.next_line(points(x - 0.5 * helvetica_mm(words)), up(*y));
            content.show(Str(words.as_bytes()));
            content.end_text();
        }
        content.finish().into_vec()
    }
}

/// The black cells of all markers. Neighbouring cells of a row are joined, so that no thin line
/// shows between them.
#[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
fn markers(board: &Board, (left, top): (f64, f64)) -> Vec<[f64; 4]> {
    let Some(marks) = board.markers() else { return Vec::new() };
    let GridSize { columns, rows } = board.corners();
    let square = board.square().get();
    let cell = marks.side.get() / (marks.dictionary.side() + 2) as f64;
    let mut black: Vec<[f64; 4]> = Vec::new();
    for (column, row) in (0..=rows).flat_map(|row| (0..=columns).map(move |column| (column, row))) {
        let x = left + (column as f64 + board.marker_margin()) * square;
        let y = top + (row as f64 + board.marker_margin()) * square;
        let mut last = None;
        for (across, down) in board.black_cells(column, row) {
            let is_next = last.is_some_and(|(before, row)| (before + 1, row) == (across, down));
            match black.last_mut().filter(|_| is_next) {
                Some(run) => run[2] += cell,
                None => black.push([x + across as f64 * cell, y + down as f64 * cell, cell, cell]),
            }
            last = Some((across, down));
        }
    }
    black
}

/// The options that describe a board's markers.
fn options(board: &Board) -> String {
    board.markers().map_or_else(String::new, |marks| {
        format!(" --marker-mm {} --dictionary {}", shown(marks.side.get()), marks.dictionary.name())
    })
}

/// A scale bar with a mark every centimetre; the marks at its ends are longer.
fn ruler(left: f64, base: f64, length: f64) -> Vec<[f64; 4]> {
    let marks = [BAR_MM[0], BAR_MM[1]]
        .iter()
        .position(|&bar| bar == length)
        .map_or(10_u32, |short| if short == 0 { 10 } else { 5 });
    let mut black = vec![[left, base - LINE_MM, length, LINE_MM]];
    for mark in 0..=marks {
        let at = left + length * f64::from(mark) / f64::from(marks);
        let tall = if mark == 0 || mark == marks { 6.0 } else { 3.0 };
        // The distance between the outer sides of the outer marks is the length of the bar.
        let x = match mark {
            0 => at,
            _ if mark == marks => at - LINE_MM,
            _ => at - LINE_MM / 2.0,
        };
        black.push([x, base - tall, LINE_MM, tall]);
    }
    black
}

/// Approximate width of a text in Helvetica \[mm\]: 0.56 of the letter size per letter, 0.30 for
/// spaces and thin letters.
fn helvetica_mm(words: &str) -> f64 {
    let wide = |letter: char| if " .,;:-ilI|tfrj".contains(letter) { 0.30 } else { 0.56 };
    LETTERS_MM * words.chars().map(wide).sum::<f64>()
}

#[expect(clippy::cast_possible_truncation, reason = "PDF numbers have single precision")]
fn points(mm: f64) -> f32 {
    (mm * POINTS) as f32
}

/// Rounded to 0.1 µm.
fn shown(mm: f64) -> f64 {
    (mm * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::board::Markers;
    use crate::calibration::dictionary::Dictionary;
    use crate::core::Mm;

    fn board(square: f64) -> Board {
        Board::new(9, 6, Mm::new(square).unwrap()).unwrap()
    }

    const A4: Paper = Paper::KNOWN[0].1;

    #[test]
    fn squares_and_bar_have_their_size() {
        let sheet = BoardSheet::of(&board(20.0), A4).unwrap();
        let squares: Vec<_> = sheet.black.iter().filter(|r| r[2] == 20.0 && r[3] == 20.0).collect();
        assert_eq!(squares.len(), 35);
        let bar = sheet.black.iter().find(|r| r[2] == 100.0).unwrap();
        let marks = sheet.black.iter().filter(|r| r[2] == LINE_MM);
        let (first, last) =
            marks.fold((f64::MAX, 0.0_f64), |(a, b), r| (a.min(r[0]), b.max(r[0] + r[2])));
        assert!((last - first - 100.0).abs() < 1e-9 && (first - bar[0]).abs() < 1e-9);
        for [x, y, width, height] in &sheet.black {
            assert!(*x >= MARGIN_MM && x + width <= 297.0 - MARGIN_MM);
            assert!(*y >= MARGIN_MM && y + height <= 210.0 - MARGIN_MM);
        }
    }

    #[test]
    fn both_formats_say_what_the_board_is() {
        let sheet = BoardSheet::of(&board(12.5), A4).unwrap();
        let svg = sheet.svg();
        assert!(svg.contains("width=\"297mm\"") && svg.contains("h12.5v12.5h-12.5z"), "{svg}");
        assert!(svg.contains("--board 9x6 --square-mm 12.5"));
        let pdf = sheet.pdf();
        assert!(pdf.starts_with(b"%PDF-1.7") && pdf.ends_with(b"%%EOF"));
        let text = String::from_utf8_lossy(&pdf);
        // Width of A4 paper in landscape format, in points.
        assert!(text.contains("841.8"), "{text}");
        assert!(text.contains("--square-mm 12.5"));
    }

    #[test]
    fn markers_are_drawn_in_the_white_squares() {
        let marks = Markers { side: Mm::constant(12.0), dictionary: Dictionary::Four };
        let sheet = BoardSheet::of(&board(20.0).with_marks(marks).unwrap(), A4).unwrap();
        // The second square of the first row, 20 mm from the left side of the squares,
        // has the first marker: its second row of cells is black, white, black, white,
        // white, black.
        let (left, top) = (sheet.black[0][0] + 20.0 + 4.0, sheet.black[0][1] + 4.0 + 2.0);
        let in_row =
            |r: &&[f64; 4]| (r[1] - top).abs() < 1e-9 && (r[0] - left) < 12.0 && r[2] < 20.0;
        let runs: Vec<[f64; 2]> =
            sheet.black.iter().filter(in_row).map(|r| [r[0] - left, r[2]]).collect();
        let expected = [[0.0, 2.0], [4.0, 2.0], [10.0, 2.0]];
        assert_eq!(runs.len(), 3, "{runs:?}");
        for (run, expected) in runs.iter().zip(expected) {
            assert!((run[0] - expected[0]).abs() + (run[1] - expected[1]).abs() < 1e-9, "{runs:?}");
        }
        assert!(sheet.svg().contains("--square-mm 20 --marker-mm 12 --dictionary 4x4"));
    }

    #[test]
    fn a_board_that_does_not_fit_says_what_it_needs() {
        let said = BoardSheet::of(&board(30.0), A4).unwrap_err().to_string();
        assert!(said.contains("needs 316 x 250 mm, the paper has 297 x 210 mm"), "{said}");
    }
}
