//! Ends a command by signals: the first SIGINT or SIGTERM asks for an orderly end, a second one
//! ends it immediately.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, Sender, unbounded};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// A request to end the command.
#[derive(Debug, Clone)]
pub struct StopSignal {
    requested: Arc<AtomicBool>,
    signals: Receiver<()>,
}

impl StopSignal {
    /// Starts to listen for signals.
    pub fn install() -> io::Result<Self> {
        let (sender, receiver) = unbounded();
        let requested = Arc::new(AtomicBool::new(false));
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        let shared = Arc::clone(&requested);
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || wait(&mut signals, &shared, &sender))?;
        Ok(Self { requested, signals: receiver })
    }

    /// Whether a signal has arrived.
    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// Receives a message when a signal arrives.
    pub fn signals(&self) -> &Receiver<()> {
        &self.signals
    }
}

fn wait(signals: &mut Signals, requested: &AtomicBool, sender: &Sender<()>) {
    for signal in signals.forever() {
        if requested.swap(true, Ordering::Relaxed) {
            // The user insists; a shell would report 128 + the signal.
            std::process::exit(128 + signal);
        }
        // A closed standard error is no reason to fail.
        let _ = writeln!(io::stderr(), "ending in order; once more ends at once");
        if sender.send(()).is_err() {
            return;
        }
    }
}
