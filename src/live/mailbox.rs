//! A slot for one item: a newer item replaces one that nobody has taken.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A slot for one item; the newest replaces older ones.
#[derive(Debug)]
pub struct Mailbox<T> {
    state: Mutex<State<T>>,
    filled: Condvar,
}

#[derive(Debug)]
struct State<T> {
    slot: Option<T>,
    closed: bool,
    superseded: u64,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        let state = State { slot: None, closed: false, superseded: 0 };
        Self { state: Mutex::new(state), filled: Condvar::new() }
    }
}

impl<T> Mailbox<T> {
    /// Puts an item into the slot; an item that is still there is dropped and counted. Returns
    /// whether anyone can still take it.
    pub fn put(&self, thing: T) -> bool {
        let mut state = self.lock();
        if state.closed {
            return false;
        }
        if state.slot.replace(thing).is_some() {
            state.superseded += 1;
        }
        self.filled.notify_one();
        true
    }

    /// Waits for an item; `None` once the slot is closed and empty.
    pub fn take(&self) -> Option<T> {
        let mut state = self.lock();
        loop {
            if let Some(thing) = state.slot.take() {
                return Some(thing);
            }
            if state.closed {
                return None;
            }
            state = self.filled.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Closes the slot: no more items go in.
    pub fn close(&self) {
        self.lock().closed = true;
        self.filled.notify_all();
    }

    /// Number of items that were dropped for newer ones.
    pub fn superseded(&self) -> u64 {
        self.lock().superseded
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_wins_and_the_others_are_counted() {
        let mailbox = Mailbox::default();
        for k in 0..5 {
            assert!(mailbox.put(k));
        }
        assert_eq!(mailbox.take(), Some(4));
        assert_eq!(mailbox.superseded(), 4);
        mailbox.put(7);
        mailbox.close();
        assert!(!mailbox.put(8));
        assert_eq!(mailbox.take(), Some(7));
        assert_eq!(mailbox.take(), None);
    }
}
