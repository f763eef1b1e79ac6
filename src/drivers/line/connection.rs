//! Keeps a connection: connect, `HELLO`, listen, reconnect.

use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError};

use super::dialect::{Dialect, EventOf, Heard, LinkEvent};
use super::incoming::{Incoming, Lost, Why};
use super::outgoing::{Outgoing, write_line};
use crate::core::{Span, Stamp};
use crate::link::PcLine;

/// The receiver of the events is gone.
struct NobodyListens;

fn listens(listens: bool) -> Result<(), NobodyListens> {
    if listens { Ok(()) } else { Err(NobodyListens) }
}

/// How a session ended.
struct Ended {
    why: Lost,
    /// Whether the other side had answered `HELLO`.
    was_up: bool,
    /// Whether it had also sent a `STATE`.
    was_good: bool,
}

/// Connects again and again until the link is closed or the receiver of the events is gone.
pub(super) fn keep_up<D: Dialect>(
    out: &Outgoing<D>,
    report: &dyn Fn(EventOf<D>) -> bool,
    quitting: &Receiver<()>,
) {
    let timing = out.timing;
    let mut delay = timing.first_delay;
    let mut reported = None;
    while !out.closing() {
        let Ok(ended) = session(out, report) else { return };
        let broken = out.lost();
        if out.closing() {
            return;
        }
        let reason = broken.unwrap_or_else(|| ended.why.to_string());
        if ended.was_up || reported.as_ref() != Some(&reason) {
            let down = LinkEvent::Down { at: out.clock.now(), reason: reason.clone() };
            if !report(down) {
                return;
            }
            reported = Some(reason);
        }
        if ended.was_good {
            delay = timing.first_delay;
        }
        match quitting.recv_timeout(delay) {
            Err(RecvTimeoutError::Timeout) => delay = (delay * 2).min(timing.longest_delay),
            _ => return,
        }
    }
}

fn session<D: Dialect>(
    out: &Outgoing<D>,
    report: &dyn Fn(EventOf<D>) -> bool,
) -> Result<Ended, NobodyListens> {
    let ended = |why| Ok(Ended { why: Lost::of::<D>(why), was_up: false, was_good: false });
    let stream = match connect(out) {
        Ok(stream) => stream,
        Err(why) => return ended(why),
    };
    let (mut incoming, hello, at) = match greet(out, &stream) {
        Ok(greeted) => greeted,
        Err(why) => return ended(why),
    };
    out.opened(stream, hello.clone());
    listens(report(LinkEvent::Up { at, hello }))?;
    // If the link was closed before `HELLO` was answered, there was no connection to shut down
    // yet.
    if out.closing() {
        out.close();
    }
    listen(out, report, &mut incoming, at)
}

fn connect<D: Dialect>(out: &Outgoing<D>) -> Result<TcpStream, Why> {
    let address = &out.address;
    let fail = |reason: String| Why::Connect { address: address.clone(), reason };
    let mut reason = "the name has no address".to_owned();
    for candidate in address.to_socket_addrs().map_err(|e| fail(e.to_string()))? {
        match TcpStream::connect_timeout(&candidate, out.timing.connect) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(out.timing.write))?;
                return Ok(stream);
            }
            Err(error) => reason = error.to_string(),
        }
    }
    Err(fail(reason))
}

fn greet<D: Dialect>(
    out: &Outgoing<D>,
    stream: &TcpStream,
) -> Result<(Incoming<D>, D::Hello, Stamp), Why> {
    let mut stream = stream.try_clone()?;
    write_line(&mut stream, &PcLine::Hello.format())?;
    let mut incoming = Incoming::new(stream, out.clock);
    let deadline = out.clock.now() + span(out.timing.hello);
    loop {
        match incoming.next(deadline)? {
            Some((at, Heard::Hello(hello))) => return Ok((incoming, hello, at)),
            Some(_) => {}
            None => return Err(Why::NoHello),
        }
    }
}

fn listen<D: Dialect>(
    out: &Outgoing<D>,
    report: &dyn Fn(EventOf<D>) -> bool,
    incoming: &mut Incoming<D>,
    up_at: Stamp,
) -> Result<Ended, NobodyListens> {
    let silence = out.timing.silence;
    let (mut last_state_at, mut was_good) = (up_at, false);
    let why = loop {
        let event = match incoming.next(last_state_at + span(silence)) {
            Ok(Some((at, Heard::State(state)))) => {
                (last_state_at, was_good) = (at, true);
                out.seen(state);
                LinkEvent::State { at, state }
            }
            Ok(Some((at, Heard::Err { seq, code, text }))) => {
                LinkEvent::Refused { at, seq, code, text }
            }
            Ok(Some((_, Heard::Hello(_)))) => continue,
            Ok(None) => break Why::Silence(silence),
            Err(why) => break why,
        };
        listens(report(event))?;
    };
    Ok(Ended { why: Lost::of::<D>(why), was_up: true, was_good })
}

fn span(duration: Duration) -> Span {
    Span::from_ns(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
}
