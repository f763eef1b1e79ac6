//! Splits a line of G-code into words.

use super::error::GcodeError;

/// A letter and its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Word {
    /// The letter, in capitals.
    pub letter: char,
    /// The number.
    pub number: f64,
}

/// The words of a line without comments. Lines that begin with `%` or `/`, checksums and line numbers
/// are ignored.
pub fn words(line: usize, text: &str) -> Result<Vec<Word>, GcodeError> {
    let plain = uncomment(line, text)?;
    let plain = plain.trim();
    let plain = plain.split('*').next().unwrap_or_default();
    if plain.starts_with(['%', '/']) {
        return Ok(Vec::new());
    }
    let mut all = Vec::new();
    let mut rest = plain.trim_start();
    while let Some(letter) = rest.chars().next() {
        let number = rest.get(letter.len_utf8()..).unwrap_or_default().trim_start();
        let length = number
            .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '+' | '-')))
            .unwrap_or(number.len());
        let (digits, after) = number.split_at(length);
        let value = digits.parse::<f64>().ok().filter(|value| value.is_finite());
        let (true, Some(value)) = (letter.is_ascii_alphabetic(), value) else {
            let found = rest.split_whitespace().next().unwrap_or_default().to_owned();
            return Err(GcodeError::Word { line, found });
        };
        let letter = letter.to_ascii_uppercase();
        if letter != 'N' {
            all.push(Word { letter, number: value });
        }
        rest = after.trim_start();
    }
    Ok(all)
}

fn uncomment(line: usize, text: &str) -> Result<String, GcodeError> {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text.split(';').next().unwrap_or_default();
    while let Some((before, after)) = rest.split_once('(') {
        plain.push_str(before);
        let (_, after) = after.split_once(')').ok_or(GcodeError::Comment(line))?;
        rest = after;
    }
    plain.push_str(rest);
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_need_no_spaces_and_comments_are_ignored() {
        let found = words(1, "n10 g1x-1.5 Y+2(over (there)F.5 ; X9").unwrap();
        let expected = [('G', 1.0), ('X', -1.5), ('Y', 2.0), ('F', 0.5)];
        assert_eq!(found, expected.map(|(letter, number)| Word { letter, number }));
        assert_eq!(words(1, "% G1 X2").unwrap(), []);
        assert_eq!(words(1, "G1 X2*71").unwrap().len(), 2);
    }

    #[test]
    fn what_is_not_a_word_is_an_error() {
        let error = words(7, "G1 X").unwrap_err();
        assert_eq!(error, GcodeError::Word { line: 7, found: "X".to_owned() });
        assert_eq!(words(3, "G1 (open").unwrap_err(), GcodeError::Comment(3));
        assert!(words(1, "G1 X1.2.3").is_err());
    }
}
