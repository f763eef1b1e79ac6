//! The machine's own thread: lines in, `STATE` out, one PC at a time.

use std::net::TcpStream;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};

use super::peer::{Input, Peer};
use crate::core::{Span, Stamp};
use crate::io::clock::RunClock;
use crate::link::LineFault;
use crate::simulators::machine::{Answer, LinkMachine, Notice, RefusedLine};

pub(super) struct Host<M> {
    machine: M,
    clock: RunClock,
    inputs: Sender<Input>,
    period: Span,
    notice: Notice,
    peer: Option<Peer>,
    connections: u64,
}

impl<M: LinkMachine> Host<M> {
    pub(super) fn new(
        machine: M,
        clock: RunClock,
        inputs: Sender<Input>,
        period: Span,
        notice: Notice,
    ) -> Self {
        Self { machine, clock, inputs, period, notice, peer: None, connections: 0 }
    }

    pub(super) fn run(mut self, received: &Receiver<Input>) {
        let mut next_state = self.now() + self.period;
        loop {
            let left = (next_state - self.now()).ns();
            let wait = Duration::from_nanos(u64::try_from(left).unwrap_or(0));
            match received.recv_timeout(wait) {
                Ok(Input::Connection(stream)) => self.connected(stream),
                Ok(Input::Bytes(id, bytes)) => self.received(id, &bytes),
                Ok(Input::Disconnected(id)) => self.disconnected(id),
                Ok(Input::Quit) | Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = self.now();
            if now >= next_state {
                if let Some(state) = self.machine.tick(now) {
                    self.say(&state);
                }
                // After a delay, missed states are not sent in a burst.
                next_state = (next_state + self.period).max(now);
            }
            self.report_changes();
        }
    }

    fn now(&self) -> Stamp {
        self.clock.now()
    }

    fn tell(&mut self, text: &str) {
        let now = self.now();
        (self.notice)(now, text);
    }

    fn connected(&mut self, stream: TcpStream) {
        self.connections += 1;
        let peer = match Peer::new::<M>(stream, self.connections, self.inputs.clone()) {
            Ok(peer) => peer,
            Err(error) => return self.tell(&format!("a PC called and was lost: {error}")),
        };
        let instead = if self.peer.is_some() { ", in place of the one before" } else { "" };
        let text = format!("PC connected from {}{instead}", peer.address);
        self.peer = Some(peer);
        self.machine.connected(self.clock.now());
        self.tell(&text);
    }

    fn disconnected(&mut self, id: u64) {
        if self.peer.as_ref().is_some_and(|peer| peer.id == id) {
            self.disconnect("connection lost");
        }
    }

    fn disconnect(&mut self, why: &str) {
        self.peer = None;
        self.machine.disconnected(self.clock.now());
        self.tell(&format!("{why}; {} runs out", M::SETPOINT_WORDS));
    }

    fn received(&mut self, id: u64, bytes: &[u8]) {
        let Some(peer) = self.peer.as_mut().filter(|peer| peer.id == id) else { return };
        for piece in peer.splitter.push(bytes) {
            self.line(piece);
        }
    }

    /// Handles a line; lines after the one that ended the connection are ignored.
    fn line(&mut self, piece: Result<String, LineFault>) {
        let Some(peer) = self.peer.as_mut() else { return };
        let taken = match piece {
            Ok(text) => {
                let taken = self.machine.take(self.clock.now(), &text);
                taken.map_err(|error| error.to_string())
            }
            Err(fault) => Err(fault.to_string()),
        };
        let (answer, end) = match taken {
            Ok(taken) => {
                peer.bad.good();
                (taken.answer, taken.bye.then_some("the PC said BYE"))
            }
            Err(why) => {
                let end = peer.bad.bad().then_some("three lines in a row make no sense");
                (Some(self.machine.bad_line(&why)), end)
            }
        };
        if let Some(answer) = answer {
            self.answer(&answer);
        }
        self.report_changes();
        if let Some(why) = end {
            self.disconnect(why);
        }
    }

    fn answer(&mut self, answer: &Answer) {
        if let Some(RefusedLine { seq, why }) = &answer.refused {
            let line = if *seq == 0 { "a line".to_owned() } else { format!("line {seq}") };
            self.tell(&format!("{line} refused: {}, {}", why.code, why.text));
        }
        self.say(&answer.line);
    }

    fn say(&mut self, line: &str) {
        let Some(peer) = self.peer.as_mut() else { return };
        if let Err(error) = peer.say(line) {
            self.disconnect(&format!("the PC takes no bytes: {error}"));
        }
    }

    fn report_changes(&mut self) {
        if let Some(news) = self.machine.changes(self.clock.now()) {
            self.tell(&news);
        }
    }
}
