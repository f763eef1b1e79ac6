//! A network camera that gives an image for each HTTP request.

use std::time::Duration;

use crossbeam_channel::never;
use ureq::Agent;

use super::fault;
use crate::core::{Channel, Span, Stamp};
use crate::io::clock::RunClock;
use crate::io::image_file;
use crate::run::ports::{FrameSource, Grab, SourceError};

/// How images are requested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnapshotSettings {
    /// Rate of the requests \[Hz\]; a camera that answers more slowly gives fewer images.
    pub rate_hz: f64,
    /// Longest wait for a complete answer.
    pub timeout: Span,
    /// Failed requests in a row after which the source ends.
    pub attempts: u32,
}

/// Longest answer that is read \[bytes\]; no image is longer.
const LONGEST_ANSWER: u64 = 256 << 20;

/// A camera behind an `http://` address.
#[derive(Debug)]
pub struct Snapshot {
    agent: Agent,
    url: String,
    channel: Channel,
    settings: SnapshotSettings,
    clock: RunClock,
    due: Stamp,
    started: Option<Stamp>,
    next: u64,
    failures: u32,
}

impl Snapshot {
    /// Prepares the requests; the first one is made with the first frame. Fails if the address is
    /// not `http://`, or if rate or timeout are not positive. A frame's `captured_at` is halfway
    /// between the request and the beginning of the answer.
    pub fn open(
        url: &str,
        channel: Channel,
        settings: SnapshotSettings,
        clock: RunClock,
    ) -> Result<Self, SourceError> {
        super::check_rate(url, Some(settings.rate_hz))?;
        if !url.starts_with("http://") {
            return Err(fault(url, "only http:// addresses are asked for snapshots"));
        }
        if settings.timeout <= Span::ZERO {
            return Err(fault(url, "the longest wait for an answer must be above 0"));
        }
        let timeout = Duration::from_nanos(settings.timeout.ns().unsigned_abs());
        // A camera is in the cell's own network, not behind a proxy.
        let config = Agent::config_builder().timeout_global(Some(timeout)).proxy(None).build();
        Ok(Self {
            agent: config.new_agent(),
            url: url.to_owned(),
            channel,
            settings,
            clock,
            due: clock.now(),
            started: None,
            next: 0,
            failures: 0,
        })
    }

    /// Waits until the next request is due. Requests that were missed because of a slow camera are
    /// skipped.
    fn wait_until_due(&mut self) {
        let wait = self.due - self.clock.now();
        if wait > Span::ZERO {
            let wait = Duration::from_nanos(wait.ns().unsigned_abs());
            let _ = never::<()>().recv_timeout(wait);
        }
        let period = Span::from_secs(1.0 / self.settings.rate_hz);
        self.due = (self.due + period).max(self.clock.now());
    }

    fn request(&self) -> Result<(Vec<u8>, Stamp), ureq::Error> {
        let asked = self.clock.now();
        let mut answer = self.agent.get(&self.url).call()?;
        let captured_at = asked + Span::from_ns((self.clock.now() - asked).ns() / 2);
        let bytes = answer.body_mut().with_config().limit(LONGEST_ANSWER).read_to_vec()?;
        Ok((bytes, captured_at))
    }
}

impl FrameSource for Snapshot {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        self.wait_until_due();
        let seq = self.next;
        self.next += 1;
        let (bytes, captured_at) = match self.request() {
            Ok(answer) => answer,
            Err(error) => {
                self.failures += 1;
                let (failures, attempts) = (self.failures, self.settings.attempts);
                if failures >= attempts {
                    let what = format!(
                        "{error}, as {attempts} requests in a row; is it switched on and reachable?"
                    );
                    return Err(fault(&self.url, what));
                }
                let reason = format!("{}: {error} (request {failures} of {attempts})", self.url);
                return Ok(Some(Grab::Unreadable { seq, time_s: None, reason }));
            }
        };
        self.failures = 0;
        let started = *self.started.get_or_insert(captured_at);
        let time_s = Some((captured_at - started).secs());
        Ok(Some(match image_file::decode(&bytes, self.channel, seq, captured_at) {
            Ok(frame) => Grab::Frame { frame, time_s },
            Err(error) => {
                Grab::Unreadable { seq, time_s, reason: format!("{}: {error}", self.url) }
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Frame, Pixels, Size};
    use std::io::{Read, Write};
    use std::net::TcpListener;
    use std::thread;

    const SETTINGS: SnapshotSettings =
        SnapshotSettings { rate_hz: 1000.0, timeout: Span::from_millis(2000), attempts: 2 };

    /// A server that gives one of these answers per connection, then closes.
    fn camera(answers: Vec<Vec<u8>>) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}/snapshot.png", listener.local_addr().unwrap());
        thread::spawn(move || {
            for answer in answers {
                let (mut stream, _) = listener.accept().unwrap();
                let _ = stream.read(&mut [0; 4096]).unwrap();
                stream.write_all(&answer).unwrap();
            }
        });
        url
    }

    fn ok(body: &[u8]) -> Vec<u8> {
        let head = format!(
            "HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Length: {}\r\n\r\n",
            body.len()
        );
        [head.as_bytes(), body].concat()
    }

    fn open(url: &str) -> Result<Snapshot, SourceError> {
        Snapshot::open(url, Channel::Grey, SETTINGS, RunClock::start())
    }

    #[test]
    fn pictures_come_through_and_a_bad_one_is_a_row() {
        let frame =
            Frame::new(0, Stamp::START, Size::new(2, 2), Pixels::Grey16(vec![1, 2, 3, 4000]))
                .unwrap();
        let png = image_file::encode_png(&frame).unwrap();
        let busy = b"HTTP/1.1 503 Busy\r\nConnection: close\r\nContent-Length: 0\r\n\r\n".to_vec();
        let mut source = open(&camera(vec![ok(&png), ok(b"<html>"), busy, ok(&png)])).unwrap();
        let mut turn = || source.next_frame().unwrap().unwrap();
        let Grab::Frame { frame: first, time_s } = turn() else { panic!() };
        assert_eq!((first.pixels(), time_s), (frame.pixels(), Some(0.0)));
        assert!(matches!(turn(), Grab::Unreadable { seq: 1, time_s: Some(_), .. }));
        assert!(
            matches!(turn(), Grab::Unreadable { seq: 2, reason, .. } if reason.contains("503"))
        );
        assert!(matches!(turn(), Grab::Frame { frame, .. } if frame.seq == 3));
    }

    #[test]
    fn a_camera_that_is_gone_ends_the_source_after_its_attempts() {
        let mut source = open(&camera(vec![])).unwrap();
        assert!(matches!(source.next_frame(), Ok(Some(Grab::Unreadable { .. }))));
        let end = source.next_frame().unwrap_err().to_string();
        assert!(end.contains("2 requests in a row"), "{end}");
    }

    #[test]
    fn what_cannot_be_asked_is_refused() {
        assert!(open("https://camera/x.jpg").is_err());
        let still = SnapshotSettings { rate_hz: 0.0, ..SETTINGS };
        assert!(Snapshot::open("http://camera/", Channel::Grey, still, RunClock::start()).is_err());
    }
}
