//! Lines from a device, a robot or an extruder, to the PC. Every device sends its limits, its
//! state and its refusals; only the fields differ.

use super::fields::{LineError, LineFields, printing};
use super::limits::{MAX_LINE, VERSION};
use super::refusal::{ErrCode, LineRefusal};

const KEYWORDS: [&str; 3] = ["HELLO", "STATE", "ERR"];

/// The fields on a device's line after its keyword, or after the version for `HELLO`.
pub trait LineBody: Sized {
    /// Reads the fields.
    fn read(fields: &mut LineFields<'_>) -> Result<Self, LineError>;

    /// The fields as text, separated by one space.
    fn write(&self) -> String;
}

/// A line from a device: `H` are the fields of `HELLO`, `S` those of `STATE`.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceLine<H, S> {
    /// Answer to the PC's `HELLO`.
    Hello(H),
    /// State of the device, sent periodically.
    State(S),
    /// A refused line.
    Err {
        /// Number of the refused line; 0 if it has no readable number.
        seq: u64,
        /// Reason as a code.
        code: ErrCode,
        /// Reason in words, for the operator.
        text: String,
    },
}

impl<H: LineBody, S: LineBody> DeviceLine<H, S> {
    /// Reads a line without its LF.
    pub fn parse(text: &str) -> Result<Self, LineError> {
        let mut fields = LineFields::open(text, &KEYWORDS, "HELLO, STATE or ERR")?;
        match fields.keyword() {
            "HELLO" => {
                fields.version()?;
                let hello = H::read(&mut fields)?;
                fields.end(Self::Hello(hello))
            }
            "STATE" => {
                let state = S::read(&mut fields)?;
                fields.end(Self::State(state))
            }
            _ => parse_err(fields).map(|(seq, refusal)| Self::refused(seq, refusal)),
        }
    }

    /// The line with its LF, at most [`MAX_LINE`] bytes. Numbers keep six decimals, a name becomes
    /// one word, a text that is too long is cut.
    pub fn format(&self) -> String {
        match self {
            Self::Hello(hello) => format!("HELLO {VERSION} {}\n", hello.write()),
            Self::State(state) => format!("STATE {}\n", state.write()),
            Self::Err { seq, code, text } => format_err(*seq, *code, text),
        }
    }

    /// The answer to a refused line with this number.
    pub fn refused(seq: u64, refusal: LineRefusal) -> Self {
        let LineRefusal { code, text } = refusal;
        Self::Err { seq, code, text }
    }

    /// The answer to bytes that are not a line.
    pub fn bad_line(why: &str) -> Self {
        Self::refused(0, LineRefusal::new(ErrCode::Form, why))
    }
}

/// Reads the fields of an `ERR` line.
fn parse_err(mut fields: LineFields<'_>) -> Result<(u64, LineRefusal), LineError> {
    let seq = fields.whole("seq")?;
    let word = fields.word("code")?;
    let code = ErrCode::ALL.into_iter().find(|code| code.word() == word);
    let expected = "STALE, RANGE, SEQUENCE, MODE or FORM";
    let code = code.ok_or_else(|| fields.field_error("code", expected, word))?;
    Ok((seq, LineRefusal { code, text: fields.text() }))
}

/// An `ERR` line with its LF; a text that is too long is cut.
fn format_err(seq: u64, code: ErrCode, text: &str) -> String {
    let head = format!("ERR {seq} {code} ");
    let text = printing(text, MAX_LINE - 1 - head.len());
    format!("{head}{text}\n")
}
