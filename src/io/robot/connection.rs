//! Keeps a connection to the robot: connect, `HELLO`, listen, and again.

use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};

use super::RobotEvent;
use super::incoming::{Incoming, Lost};
use super::outgoing::{Outgoing, write_line};
use crate::control::RobotLimits;
use crate::link::{PcLine, RobotLine};
use crate::time::{Span, Stamp};

/// Nobody listens to the events any more.
struct Deaf;

/// How a session ended.
struct Ended {
    why: Lost,
    /// The robot had answered `HELLO`.
    was_up: bool,
    /// It had also sent a `STATE`.
    was_good: bool,
}

/// Connects again and again until the link is closed or nobody listens.
pub(super) fn keep_up(out: &Outgoing, events: &Sender<RobotEvent>, quitting: &Receiver<()>) {
    let timing = out.config.timing;
    let mut delay = timing.first_delay;
    let mut told = None;
    while !out.closing() {
        let Ok(ended) = session(out, events) else { return };
        let broken = out.lost();
        if out.closing() {
            return;
        }
        let reason = broken.map_or_else(|| ended.why.to_string(), |broken| broken.to_string());
        if ended.was_up || told.as_ref() != Some(&reason) {
            let down = RobotEvent::Down { at: out.clock.now(), reason: reason.clone() };
            if events.send(down).is_err() {
                return;
            }
            told = Some(reason);
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

fn session(out: &Outgoing, events: &Sender<RobotEvent>) -> Result<Ended, Deaf> {
    let ended = |why| Ok(Ended { why, was_up: false, was_good: false });
    let stream = match connect(out) {
        Ok(stream) => stream,
        Err(why) => return ended(why),
    };
    let (mut incoming, robot, at) = match greet(out, &stream) {
        Ok(greeted) => greeted,
        Err(why) => return ended(why),
    };
    out.opened(stream, robot.clone());
    events.send(RobotEvent::Up { at, robot }).map_err(|_| Deaf)?;
    // A close that came while the robot was being greeted found nothing to
    // shut.
    if out.closing() {
        out.close();
    }
    listen(out, events, &mut incoming, at)
}

fn connect(out: &Outgoing) -> Result<TcpStream, Lost> {
    let address = &out.config.address;
    let fail = |reason: String| Lost::Connect { address: address.clone(), reason };
    let mut reason = "the name has no address".to_owned();
    for candidate in address.to_socket_addrs().map_err(|e| fail(e.to_string()))? {
        match TcpStream::connect_timeout(&candidate, out.config.timing.connect) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(out.config.timing.write))?;
                return Ok(stream);
            }
            Err(error) => reason = error.to_string(),
        }
    }
    Err(fail(reason))
}

fn greet(out: &Outgoing, stream: &TcpStream) -> Result<(Incoming, RobotLimits, Stamp), Lost> {
    let mut stream = stream.try_clone()?;
    write_line(&mut stream, PcLine::Hello)?;
    let mut incoming = Incoming::new(stream, out.clock);
    let deadline = out.clock.now() + span(out.config.timing.hello);
    loop {
        match incoming.next(deadline)? {
            Some((at, RobotLine::Hello(robot))) => return Ok((incoming, robot, at)),
            Some(_) => {}
            None => return Err(Lost::NoHello),
        }
    }
}

fn listen(
    out: &Outgoing,
    events: &Sender<RobotEvent>,
    incoming: &mut Incoming,
    up_at: Stamp,
) -> Result<Ended, Deaf> {
    let silence = out.config.timing.silence;
    let (mut heard, mut was_good) = (up_at, false);
    let why = loop {
        let event = match incoming.next(heard + span(silence)) {
            Ok(Some((at, RobotLine::State(state)))) => {
                (heard, was_good) = (at, true);
                out.seen(state);
                RobotEvent::State { at, state }
            }
            Ok(Some((at, RobotLine::Err { seq, code, text }))) => {
                RobotEvent::Refused { at, seq, code, text }
            }
            Ok(Some((_, RobotLine::Hello(_)))) => continue,
            Ok(None) => break Lost::Silence(silence),
            Err(why) => break why,
        };
        events.send(event).map_err(|_| Deaf)?;
    };
    Ok(Ended { why, was_up: true, was_good })
}

fn span(duration: Duration) -> Span {
    Span::from_ns(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
}
