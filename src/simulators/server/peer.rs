//! One connection of a server.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::thread::Builder;
use std::time::Duration;

use crossbeam_channel::Sender;

use crate::link::{BadLines, LineSplitter};
use crate::simulators::machine::LinkMachine;

/// Events for the thread of a machine.
#[derive(Debug)]
pub(super) enum Input {
    /// A new connection.
    Connection(TcpStream),
    /// Bytes of the connection with this number.
    Bytes(u64, Vec<u8>),
    /// The connection with this number is lost.
    Disconnected(u64),
    /// The server is stopped.
    Quit,
}

/// Timeout of a write to the PC, after which it is disconnected: a PC that follows the link reads
/// without delay.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);

/// The PC at the other end.
pub(super) struct Peer {
    pub(super) id: u64,
    pub(super) address: SocketAddr,
    pub(super) splitter: LineSplitter,
    pub(super) bad: BadLines,
    stream: TcpStream,
}

impl Peer {
    /// Starts to read; bytes and the disconnection arrive in `inputs` under `id`.
    pub(super) fn new<M: LinkMachine>(
        stream: TcpStream,
        id: u64,
        inputs: Sender<Input>,
    ) -> std::io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        let address = stream.peer_addr()?;
        let reading = stream.try_clone()?;
        let thread = Builder::new().name(format!("{}-read", M::NAME));
        thread.spawn(move || read_all(reading, id, &inputs))?;
        let (splitter, bad) = (LineSplitter::new(), BadLines::default());
        Ok(Self { id, address, splitter, bad, stream })
    }

    /// Writes a whole line; after an error the PC must be disconnected.
    pub(super) fn say(&mut self, line: &str) -> std::io::Result<()> {
        self.stream.write_all(line.as_bytes())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // Ends the reading thread; shutting down a lost connection fails.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

fn read_all(mut stream: TcpStream, id: u64, inputs: &Sender<Input>) {
    let mut bytes = [0; 4096];
    loop {
        let input = match stream.read(&mut bytes) {
            Ok(count) if count > 0 => Input::Bytes(id, bytes[..count].to_vec()),
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            _ => Input::Disconnected(id),
        };
        let last = matches!(input, Input::Disconnected(_));
        if inputs.send(input).is_err() || last {
            return;
        }
    }
}
