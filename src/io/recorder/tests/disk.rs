//! A disk in memory that can be full or stand still.

use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::io::recorder::sink::Sink;

#[derive(Debug, Default)]
struct State {
    bytes: Vec<u8>,
    room: Option<usize>,
    stalled: bool,
    waiting: bool,
    writes: u64,
    published: bool,
}

/// Copies are the same disk.
#[derive(Debug, Clone, Default)]
pub struct Disk(Arc<(Mutex<State>, Condvar)>);

impl Disk {
    pub fn with_room(bytes: usize) -> Self {
        let disk = Self::default();
        disk.state().room = Some(bytes);
        disk
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state());
        self.0.1.notify_all();
    }

    fn wait(&self, until: impl Fn(&State) -> bool) -> MutexGuard<'_, State> {
        self.0.1.wait_while(self.state(), |state| !until(state)).unwrap()
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.state().bytes.clone()
    }

    pub fn published(&self) -> bool {
        self.state().published
    }

    pub fn make_room(&self) {
        self.change(|state| state.room = None);
    }

    pub fn stall(&self) {
        self.change(|state| state.stalled = true);
    }

    pub fn go_on(&self) {
        self.change(|state| state.stalled = false);
    }

    pub fn wait_until_stalled(&self) {
        drop(self.wait(|state| state.waiting));
    }

    pub fn forget_writes(&self) {
        self.change(|state| state.writes = 0);
    }

    /// Waits for a write, successful or not.
    pub fn wait_for_a_write(&self) {
        self.wait(|state| state.writes > 0).writes = 0;
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.change(|state| state.waiting = state.stalled);
        let mut state = self.wait(|state| !state.stalled);
        state.waiting = false;
        let left = state.room.map_or(bytes.len(), |room| room.saturating_sub(state.bytes.len()));
        let count = left.min(bytes.len());
        state.bytes.extend_from_slice(&bytes[..count]);
        if count == bytes.len() || count == 0 {
            state.writes += 1;
        }
        drop(state);
        self.0.1.notify_all();
        if count == 0 {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "the disk is full"));
        }
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Sink for Disk {
    fn cut(&mut self, len: u64) -> io::Result<()> {
        self.change(|state| state.bytes.truncate(usize::try_from(len).unwrap()));
        Ok(())
    }

    fn publish(&mut self) -> io::Result<()> {
        self.change(|state| state.published = true);
        Ok(())
    }

    fn path(&self) -> &Path {
        Path::new("disk.mcap")
    }
}
