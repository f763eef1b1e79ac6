//! A network camera that gives an image for each HTTP request.

use crossbeam_channel::{Receiver, RecvTimeoutError};
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
    /// How long requests may fail in a row before the source ends.
    pub max_outage: Span,
}

/// Time between requests to a camera that does not answer (`docs/src/reference/cell/camera.md`,
/// § `[camera]`): it is seen again soon, and one that starts is not kept busy.
const RETRY_PERIOD: Span = Span::from_millis(100);

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
    stop: Receiver<()>,
    due: Stamp,
    started: Option<Stamp>,
    next: u64,
    /// When the first of the latest failed requests was made.
    failing_since: Option<Stamp>,
    /// The last reason for waiting that was reported.
    waiting_for: Option<String>,
}

impl Snapshot {
    /// Prepares the requests; the first one is made with the first frame. A message to `stop`, or
    /// the end of its sender, ends the source. Fails if the address is not `http://`, or if rate or
    /// timeout are not positive. A frame's `captured_at` is halfway between the request and the
    /// beginning of the answer.
    pub fn open(
        url: &str,
        channel: Channel,
        settings: SnapshotSettings,
        clock: RunClock,
        stop: Receiver<()>,
    ) -> Result<Self, SourceError> {
        super::check_rate(url, Some(settings.rate_hz))?;
        if !url.starts_with("http://") {
            return Err(fault(url, "only http:// addresses are asked for snapshots"));
        }
        if settings.timeout <= Span::ZERO {
            return Err(fault(url, "the longest wait for an answer must be above 0"));
        }
        let timeout = settings.timeout.wait();
        // A camera is in the cell's own network, not behind a proxy.
        let config = Agent::config_builder().timeout_global(Some(timeout)).proxy(None).build();
        Ok(Self {
            agent: config.new_agent(),
            url: url.to_owned(),
            channel,
            settings,
            clock,
            stop,
            due: clock.now(),
            started: None,
            next: 0,
            failing_since: None,
            waiting_for: None,
        })
    }

    /// Waits until the next request is due; returns false when the source was stopped. Requests
    /// that were missed because of a slow camera are skipped.
    fn wait_until_due(&mut self) -> bool {
        let wait = (self.due - self.clock.now()).wait();
        if self.stop.recv_timeout(wait) != Err(RecvTimeoutError::Timeout) {
            return false;
        }
        let period = Span::from_secs(1.0 / self.settings.rate_hz);
        self.due = (self.due + period).max(self.clock.now());
        true
    }

    fn request(&self) -> Result<(Vec<u8>, Stamp), ureq::Error> {
        let asked = self.clock.now();
        let mut answer = self.agent.get(&self.url).call()?;
        let captured_at = asked + Span::from_ns((self.clock.now() - asked).ns() / 2);
        let bytes = answer.body_mut().with_config().limit(LONGEST_ANSWER).read_to_vec()?;
        Ok((bytes, captured_at))
    }

    fn next_number(&mut self) -> u64 {
        let seq = self.next;
        self.next += 1;
        seq
    }

    fn answered(&mut self, bytes: &[u8], captured_at: Stamp) -> Grab {
        self.failing_since = None;
        let seq = self.next_number();
        let started = *self.started.get_or_insert(captured_at);
        let time_s = Some((captured_at - started).secs());
        match image_file::decode(bytes, self.channel, seq, captured_at) {
            Ok(frame) => Grab::Frame { frame, time_s },
            Err(error) => {
                Grab::Unreadable { seq, time_s, reason: format!("{}: {error}", self.url) }
            }
        }
    }

    /// After a failed request: a camera that has never answered is waited for, which is reported
    /// where the reason is new; one that has answered ends the source when it fails for too long.
    fn failed(&mut self, asked_at: Stamp, error: &str) -> Result<Option<Grab>, SourceError> {
        let now = self.clock.now();
        self.due = self.due.max(now + RETRY_PERIOD);
        if self.started.is_none() {
            let reason = format!("{}: {error}", self.url);
            let is_new = self.waiting_for.replace(reason.clone()).as_ref() != Some(&reason);
            return Ok(is_new.then_some(Grab::Waiting { reason }));
        }
        let outage = now - *self.failing_since.get_or_insert(asked_at);
        if outage > self.settings.max_outage {
            let s = outage.secs();
            let what = format!("{error}, for {s:.1} s; is it switched on and reachable?");
            return Err(fault(&self.url, what));
        }
        let reason = format!("{}: {error}; it is asked again", self.url);
        Ok(Some(Grab::Unreadable { seq: self.next_number(), time_s: None, reason }))
    }
}

impl FrameSource for Snapshot {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        while self.wait_until_due() {
            let asked_at = self.clock.now();
            let grab = match self.request() {
                Ok((bytes, captured_at)) => Some(self.answered(&bytes, captured_at)),
                Err(error) => self.failed(asked_at, &error.to_string())?,
            };
            if grab.is_some() {
                return Ok(grab);
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Frame, Pixels, Size};
    use crossbeam_channel::{bounded, never};
    use std::io::{Read, Write};
    use std::net::TcpListener;
    use std::thread;
    use std::time::Duration;

    const SETTINGS: SnapshotSettings = SnapshotSettings {
        rate_hz: 1000.0,
        timeout: Span::from_millis(2000),
        max_outage: Span::from_millis(350),
    };

    /// A server that gives one of these answers per connection, then closes.
    fn camera(answers: Vec<Vec<u8>>) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = url_of(&listener);
        thread::spawn(move || answer(&listener, answers));
        url
    }

    fn url_of(listener: &TcpListener) -> String {
        format!("http://{}/snapshot.png", listener.local_addr().unwrap())
    }

    fn answer(listener: &TcpListener, answers: Vec<Vec<u8>>) {
        for answer in answers {
            let (mut stream, _) = listener.accept().unwrap();
            let _ = stream.read(&mut [0; 4096]).unwrap();
            stream.write_all(&answer).unwrap();
        }
    }

    /// An image that a camera may answer with.
    fn image() -> Frame {
        let pixels = Pixels::Grey16(vec![1, 2, 3, 4000]);
        Frame::new(0, Stamp::START, Size::new(2, 2), pixels).unwrap()
    }

    /// An address at which nothing listens.
    fn nobody() -> String {
        url_of(&TcpListener::bind("127.0.0.1:0").unwrap())
    }

    fn ok(body: &[u8]) -> Vec<u8> {
        let head = format!(
            "HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Length: {}\r\n\r\n",
            body.len()
        );
        [head.as_bytes(), body].concat()
    }

    fn open(url: &str) -> Result<Snapshot, SourceError> {
        Snapshot::open(url, Channel::Grey, SETTINGS, RunClock::start(), never())
    }

    #[test]
    fn pictures_come_through_and_a_bad_one_is_a_row() {
        let frame = image();
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
    fn a_camera_that_is_gone_is_asked_again_before_the_source_ends() {
        let png = image_file::encode_png(&image()).unwrap();
        let mut source = open(&camera(vec![ok(&png)])).unwrap();
        assert!(matches!(source.next_frame(), Ok(Some(Grab::Frame { .. }))));
        let gone = source.clock.now();
        let mut failed = 0;
        let end = loop {
            match source.next_frame() {
                Ok(Some(Grab::Unreadable { .. })) => failed += 1,
                Ok(other) => panic!("{other:?}"),
                Err(error) => break error.to_string(),
            }
        };
        let lasted = source.clock.now() - gone;
        assert!(lasted > SETTINGS.max_outage, "{lasted:?}");
        assert!((1..=4).contains(&failed), "{failed} requests within 0.35 s");
        assert!(end.contains("switched on"), "{end}");
    }

    #[test]
    fn a_camera_that_comes_back_in_time_goes_on() {
        let png = image_file::encode_png(&image()).unwrap();
        let busy = b"HTTP/1.1 503 Busy\r\nConnection: close\r\nContent-Length: 0\r\n\r\n".to_vec();
        let answers = [vec![ok(&png)], vec![busy; 3], vec![ok(&png)]].concat();
        let mut source = open(&camera(answers)).unwrap();
        let grabs: Vec<Grab> = (0..5).map(|_| source.next_frame().unwrap().unwrap()).collect();
        assert!(matches!(grabs[3], Grab::Unreadable { seq: 3, .. }), "{grabs:?}");
        assert!(matches!(&grabs[4], Grab::Frame { frame, .. } if frame.seq == 4), "{grabs:?}");
        assert_eq!(source.failing_since, None);
    }

    #[test]
    fn a_camera_that_is_off_at_the_start_is_waited_for_and_reported_once() {
        let url = nobody();
        let mut source = open(&url).unwrap();
        let waiting = source.next_frame().unwrap().unwrap();
        assert!(matches!(&waiting, Grab::Waiting { reason } if reason.contains(&url)));
        let address = url.trim_start_matches("http://").trim_end_matches("/snapshot.png");
        let address = address.to_owned();
        let png = image_file::encode_png(&image()).unwrap();
        let switched_on = thread::spawn(move || {
            // Longer than a camera that has answered may be away.
            let _ = never::<()>().recv_timeout(Duration::from_millis(500));
            answer(&TcpListener::bind(address).unwrap(), vec![ok(&png)]);
        });
        let next = source.next_frame().unwrap().unwrap();
        assert!(matches!(&next, Grab::Frame { frame, .. } if frame.seq == 0), "{next:?}");
        switched_on.join().unwrap();
    }

    #[test]
    fn the_wait_for_a_camera_can_be_ended() {
        let (ending, stop) = bounded::<()>(0);
        let clock = RunClock::start();
        let mut source = Snapshot::open(&nobody(), Channel::Grey, SETTINGS, clock, stop).unwrap();
        assert!(matches!(source.next_frame(), Ok(Some(Grab::Waiting { .. }))));
        drop(ending);
        assert_eq!(source.next_frame(), Ok(None));
    }

    #[test]
    fn what_cannot_be_asked_is_refused() {
        assert!(open("https://camera/x.jpg").is_err());
        let still = SnapshotSettings { rate_hz: 0.0, ..SETTINGS };
        let clock = RunClock::start();
        assert!(Snapshot::open("http://camera/", Channel::Grey, still, clock, never()).is_err());
    }
}
