//! The thread that reads an attached camera.

use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TryRecvError, TrySendError, bounded};

use crate::core::Frame;
use crate::drivers::camera::fault;
use crate::run::ports::SourceError;

/// Longest wait for the thread to end with its source.
const MAX_SHUTDOWN: Duration = Duration::from_secs(1);

/// A source of images; each call waits for the next one.
pub(super) trait Capture {
    /// The next image, with number 0 and its time of arrival.
    fn capture(&mut self) -> Result<Frame, String>;
}

pub(super) type Opener = dyn Fn() -> Result<Box<dyn Capture>, String> + Send + Sync;

pub(super) enum News {
    Frame(Frame),
    Failed(String),
}

/// The thread that reads a camera. It ends when its `stay` is dropped, at the latest after the
/// next image.
pub(super) struct Worker {
    pub(super) news: Receiver<News>,
    stay: Sender<()>,
    thread: JoinHandle<()>,
}

impl Worker {
    pub(super) fn start(
        name: &str,
        opener: &Arc<Opener>,
        delay: Duration,
    ) -> Result<Self, SourceError> {
        let (slot, news) = bounded(1);
        let (stay, stop) = bounded(0);
        let (opener, old) = (Arc::clone(opener), news.clone());
        let thread = thread::Builder::new()
            .name("camera".to_owned())
            .spawn(move || {
                if matches!(stop.recv_timeout(delay), Err(RecvTimeoutError::Timeout)) {
                    read_until_stopped(opener.as_ref(), &stop, &slot, &old);
                }
            })
            .map_err(|error| fault(name, format!("cannot start a thread: {error}")))?;
        Ok(Self { news, stay, thread })
    }

    /// Leaves the thread running; it may be blocked in a driver.
    pub(super) fn abandon(self) {
        drop(self.stay);
    }

    pub(super) fn stop(self) {
        drop(self.stay);
        loop {
            match self.news.recv_timeout(MAX_SHUTDOWN) {
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) => return,
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        // A panic of the thread has already been reported as a lost camera.
        drop(self.thread.join());
    }
}

fn read_until_stopped(
    opener: &Opener,
    stop: &Receiver<()>,
    slot: &Sender<News>,
    old: &Receiver<News>,
) {
    let mut camera = match opener() {
        Ok(camera) => camera,
        Err(why) => return put(slot, old, News::Failed(why)),
    };
    while matches!(stop.try_recv(), Err(TryRecvError::Empty)) {
        match camera.capture() {
            Ok(frame) => put(slot, old, News::Frame(frame)),
            Err(why) => return put(slot, old, News::Failed(why)),
        }
    }
}

/// Puts news into the slot; older news in the slot is dropped.
pub(super) fn put(slot: &Sender<News>, old: &Receiver<News>, news: News) {
    let mut news = news;
    while let Err(TrySendError::Full(back)) = slot.try_send(news) {
        drop(old.try_recv());
        news = back;
    }
}
