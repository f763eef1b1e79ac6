//! How a person or a system ends a command: the first SIGINT or SIGTERM asks
//! for an orderly end, a second one ends it at once.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, Sender, unbounded};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// Tells that the command is to end.
#[derive(Debug, Clone)]
pub struct StopSignal {
    asked: Arc<AtomicBool>,
    told: Receiver<()>,
}

impl StopSignal {
    /// Begins to listen for signals.
    pub fn install() -> io::Result<Self> {
        let (tell, told) = unbounded();
        let asked = Arc::new(AtomicBool::new(false));
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        let heard = Arc::clone(&asked);
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || wait(&mut signals, &heard, &tell))?;
        Ok(Self { asked, told })
    }

    /// Whether a signal has come.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Gives a message when a signal comes.
    pub fn told(&self) -> &Receiver<()> {
        &self.told
    }
}

fn wait(signals: &mut Signals, heard: &AtomicBool, tell: &Sender<()>) {
    for signal in signals.forever() {
        if heard.swap(true, Ordering::Relaxed) {
            // The person insists; 128 + the signal is what a shell would say.
            std::process::exit(128 + signal);
        }
        // Where standard error is gone there is nobody to tell.
        let _ = writeln!(io::stderr(), "ending in order; once more ends at once");
        if tell.send(()).is_err() {
            return;
        }
    }
}
