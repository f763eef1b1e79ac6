//! Lines from a device, a robot or an extruder, to the PC. Every device says what
//! it is, what it does and what it refuses; only the bodies differ.

use super::fields::{LineError, LineFields, printing};
use super::limits::{MAX_LINE, VERSION};
use super::refusal::{ErrCode, LineRefusal};

const KEYWORDS: [&str; 3] = ["HELLO", "STATE", "ERR"];

/// What stands on a line of a device behind its keyword, and for `HELLO` behind
/// the version.
pub trait LineBody: Sized {
    /// Reads its fields.
    fn read(fields: &mut LineFields<'_>) -> Result<Self, LineError>;

    /// Its fields, separated by one space.
    fn write(&self) -> String;
}

/// A line from a device that says `H` of itself and `S` of what it does.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceLine<H, S> {
    /// Answer to the PC's `HELLO`.
    Hello(H),
    /// What the device does, at regular times.
    State(S),
    /// A refused line.
    Err {
        /// Number of the refused line; 0 where it had none that could be read.
        seq: u64,
        /// Why.
        code: ErrCode,
        /// Why, for the operator.
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

    /// The line with its LF, at most [`MAX_LINE`] bytes. Numbers keep six
    /// decimals, a name becomes one word, a text is cut where it is too long.
    pub fn format(&self) -> String {
        match self {
            Self::Hello(hello) => format!("HELLO {VERSION} {}\n", hello.write()),
            Self::State(state) => format!("STATE {}\n", state.write()),
            Self::Err { seq, code, text } => format_err(*seq, *code, text),
        }
    }

    /// The answer to the line with this number, which is refused.
    pub fn refused(seq: u64, refusal: LineRefusal) -> Self {
        let LineRefusal { code, text } = refusal;
        Self::Err { seq, code, text }
    }

    /// The answer to bytes that make no line.
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

/// An `ERR` line with its LF; its text is cut where it is too long.
fn format_err(seq: u64, code: ErrCode, text: &str) -> String {
    let head = format!("ERR {seq} {code} ");
    let text = printing(text, MAX_LINE - 1 - head.len());
    format!("{head}{text}\n")
}
