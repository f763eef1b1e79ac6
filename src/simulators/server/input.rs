//! What the threads of a server send to its host.

use std::net::TcpStream;

/// What wakes the machine.
#[derive(Debug)]
pub(super) enum Input {
    /// A PC called.
    Connection(TcpStream),
    /// Bytes of the connection with this number.
    Bytes(u64, Vec<u8>),
    /// The connection with this number is gone.
    Disconnected(u64),
    /// The end.
    Quit,
}
