//! Common parts of both links: splitting bytes into lines and lines into fields, sequence numbers,
//! validity, and refusals.

mod device_line;
mod fields;
mod limits;
mod pc_hello;
mod refusal;
mod sequence;
mod split;

pub use device_line::{DeviceLine, LineBody};
pub use fields::{Decimals, LineError, LineFields, one_word, printing};
pub use limits::{MAX_BAD_LINES, MAX_LINE, MAX_VALID_MS, MIN_VALID_MS, VERSION};
pub use pc_hello::{BYE_LINE, hello_line, read_hello};
pub use refusal::{ErrCode, LineRefusal};
pub use sequence::{DeviceClock, Sequence, Validity};
pub use split::{BadLines, LineFault, LineSplitter};
