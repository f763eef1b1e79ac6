//! An attached camera, by its number or through a `GStreamer` pipeline.
//!
//! A separate thread reads it, because a driver may block for any time. Only the newest image is
//! kept; older ones are dropped. If no image comes before the deadline, the thread is abandoned
//! and the camera is opened again, with a growing delay, until it has failed too often in a row.

mod worker;

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::RecvTimeoutError;

use super::fault;
use crate::bridge::{VideoInput, VideoReader};
use crate::core::{Channel, Frame, Span, Stamp};
use crate::io::clock::RunClock;
use crate::run::ports::{FrameSource, Grab, SourceError};
use worker::{Capture, News, Opener, Worker};

/// Timeout of a camera, and how often it is opened again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// Longest wait for an image.
    pub deadline: Span,
    /// Failures in a row after which the source ends.
    pub attempts: u32,
}

/// Longest wait while a device opens and starts its stream: longer than for an image.
const OPEN_WAIT: Duration = Duration::from_secs(10);
const FIRST_DELAY: Duration = Duration::from_millis(100);
const LONGEST_DELAY: Duration = Duration::from_secs(2);

/// A live camera.
pub struct Live {
    name: String,
    opener: Arc<Opener>,
    patience: Patience,
    worker: Option<Worker>,
    first: Option<Frame>,
    started: Option<Stamp>,
    next: u64,
    failures: u32,
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Live")
            .field("name", &self.name)
            .field("next", &self.next)
            .finish_non_exhaustive()
    }
}

impl Live {
    /// Opens a camera and waits for its first image; fails if none comes. `name` is the source in
    /// the cell file. A frame's `captured_at` is the time at which the driver delivered the image,
    /// before it was decoded.
    pub fn open(
        input: VideoInput,
        name: &str,
        channel: Channel,
        patience: Patience,
        clock: RunClock,
    ) -> Result<Self, SourceError> {
        let opener = move || -> Result<Box<dyn Capture>, String> {
            let reader = VideoReader::open(&input).map_err(|error| error.to_string())?;
            Ok(Box::new(Device { reader, channel, clock }))
        };
        Self::with_opener(name, Arc::new(opener), patience)
    }

    fn with_opener(
        name: &str,
        opener: Arc<Opener>,
        patience: Patience,
    ) -> Result<Self, SourceError> {
        let worker = Worker::start(name, &opener, Duration::ZERO)?;
        let first = match worker.news.recv_timeout(OPEN_WAIT) {
            Ok(News::Frame(frame)) => frame,
            Ok(News::Failed(why)) => return Err(fault(name, why)),
            Err(_) => {
                let what = format!("no image within {} s of opening it", OPEN_WAIT.as_secs());
                return Err(fault(name, what));
            }
        };
        Ok(Self {
            name: name.to_owned(),
            opener,
            patience,
            worker: Some(worker),
            first: Some(first),
            started: None,
            next: 0,
            failures: 0,
        })
    }

    /// Waits for the next frame or error of the camera, and opens it again if it was lost.
    fn news(&mut self) -> Result<News, SourceError> {
        if let Some(frame) = self.first.take() {
            return Ok(News::Frame(frame));
        }
        let mut wait = self.patience.deadline.wait();
        let worker = if let Some(worker) = self.worker.take() {
            worker
        } else {
            let delay = delay_after(self.failures);
            wait += delay + OPEN_WAIT;
            Worker::start(&self.name, &self.opener, delay)?
        };
        let news = worker.news.recv_timeout(wait).unwrap_or_else(|error| {
            News::Failed(match error {
                RecvTimeoutError::Timeout => format!("no image for {:.1} s", wait.as_secs_f64()),
                RecvTimeoutError::Disconnected => "its thread has ended".to_owned(),
            })
        });
        if matches!(news, News::Frame(_)) {
            self.worker = Some(worker);
        } else {
            worker.abandon();
        }
        Ok(news)
    }
}

impl FrameSource for Live {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        let news = self.news()?;
        let seq = self.next;
        self.next += 1;
        Ok(Some(match news {
            News::Frame(mut frame) => {
                self.failures = 0;
                frame.seq = seq;
                let started = *self.started.get_or_insert(frame.captured_at);
                let time_s = Some((frame.captured_at - started).secs());
                Grab::Frame { frame, time_s }
            }
            News::Failed(why) => {
                self.failures += 1;
                let attempts = self.patience.attempts;
                if self.failures > attempts {
                    let what = format!("{why}; gave up after opening it anew {attempts} times");
                    return Err(fault(&self.name, what));
                }
                let reason = format!(
                    "{}: {why}; opening it anew ({} of {attempts})",
                    self.name, self.failures
                );
                Grab::Unreadable { seq, time_s: None, reason }
            }
        }))
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        if let Some(worker) = self.worker.take() {
            worker.stop();
        }
    }
}

struct Device {
    reader: VideoReader,
    channel: Channel,
    clock: RunClock,
}

impl Capture for Device {
    fn capture(&mut self) -> Result<Frame, String> {
        if !self.reader.grab().map_err(|error| error.to_string())? {
            return Err("it gives no more images".to_owned());
        }
        let captured_at = self.clock.now();
        let frame = self.reader.retrieve(self.channel, 0, captured_at);
        frame
            .map_err(|error| error.to_string())?
            .ok_or_else(|| "it gave an image that cannot be decoded".to_owned())
    }
}

fn delay_after(failures: u32) -> Duration {
    let doubled = 2_u32.saturating_pow(failures.saturating_sub(1));
    FIRST_DELAY.saturating_mul(doubled).min(LONGEST_DELAY)
}

#[cfg(test)]
mod tests {
    use super::worker::put;
    use super::*;
    use crate::core::{Pixels, Size};
    use crossbeam_channel::{Receiver, Sender, bounded};
    use std::sync::atomic::{AtomicU64, Ordering};

    /// Gives images when the test asks: one for each message.
    struct Scripted(Receiver<Result<u64, &'static str>>);

    impl Capture for Scripted {
        fn capture(&mut self) -> Result<Frame, String> {
            let at = self.0.recv().map_err(|_| "unplugged".to_owned())??;
            Ok(Frame::new(0, Stamp::from_ns(at), Size::new(1, 1), Pixels::Grey8(vec![0])).unwrap())
        }
    }

    const PATIENCE: Patience = Patience { deadline: Span::from_millis(200), attempts: 2 };

    type Script = Sender<Result<u64, &'static str>>;

    fn scripted(patience: Patience) -> (Script, Arc<AtomicU64>, Result<Live, SourceError>) {
        let (script, cues) = bounded(10);
        script.send(Ok(1_000)).unwrap();
        let opened = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&opened);
        let opener = move || -> Result<Box<dyn Capture>, String> {
            count.fetch_add(1, Ordering::SeqCst);
            Ok(Box::new(Scripted(cues.clone())))
        };
        (script, opened, Live::with_opener("camera:0", Arc::new(opener), patience))
    }

    #[test]
    fn frames_are_numbered_and_timed_from_the_first() {
        let (script, _, live) = scripted(PATIENCE);
        let mut live = live.unwrap();
        let Ok(Some(Grab::Frame { frame, time_s })) = live.next_frame() else { panic!() };
        assert_eq!((frame.seq, time_s), (0, Some(0.0)));
        script.send(Ok(2_000_001_000)).unwrap();
        let Ok(Some(Grab::Frame { frame, time_s })) = live.next_frame() else { panic!() };
        assert_eq!((frame.seq, time_s), (1, Some(2.0)));
    }

    #[test]
    fn only_the_newest_picture_waits() {
        let (slot, news) = bounded(1);
        for at in 1..=3 {
            let pixels = Pixels::Grey8(vec![0]);
            let frame = Frame::new(0, Stamp::from_ns(at), Size::new(1, 1), pixels).unwrap();
            put(&slot, &news, News::Frame(frame));
        }
        assert!(matches!(news.try_recv(), Ok(News::Frame(f)) if f.captured_at.ns() == 3));
        assert!(news.try_recv().is_err());
    }

    #[test]
    fn a_lost_camera_is_opened_anew_and_a_dead_one_ends_the_source() {
        let (script, opened, live) = scripted(PATIENCE);
        let mut live = live.unwrap();
        assert!(matches!(live.next_frame(), Ok(Some(Grab::Frame { .. }))));
        script.send(Err("cable pulled")).unwrap();
        let lost = live.next_frame().unwrap().unwrap();
        assert!(
            matches!(lost, Grab::Unreadable { seq: 1, reason, .. } if reason.contains("cable pulled"))
        );
        script.send(Ok(5_000)).unwrap();
        assert!(matches!(live.next_frame(), Ok(Some(Grab::Frame { .. }))));
        assert_eq!(opened.load(Ordering::SeqCst), 2);
        drop(script);
        for _ in 0..PATIENCE.attempts {
            assert!(matches!(live.next_frame(), Ok(Some(Grab::Unreadable { .. }))));
        }
        let end = live.next_frame().unwrap_err().to_string();
        assert_eq!(end, "camera camera:0: unplugged; gave up after opening it anew 2 times");
    }

    #[test]
    fn a_silent_camera_does_not_hold_the_caller() {
        let (_script, _, live) = scripted(PATIENCE);
        let mut live = live.unwrap();
        assert!(matches!(live.next_frame(), Ok(Some(Grab::Frame { .. }))));
        let silent = live.next_frame().unwrap().unwrap();
        assert!(
            matches!(silent, Grab::Unreadable { reason, .. } if reason.contains("no image for 0.2 s"))
        );
    }

    #[test]
    fn a_camera_that_is_not_there_is_said_at_once() {
        let input = VideoInput::Camera(97);
        let error = Live::open(input, "camera:97", Channel::Grey, PATIENCE, RunClock::start());
        assert!(error.unwrap_err().to_string().contains("there is no such camera"));
    }
}
