//! The simulated robot's own thread: lines in, `STATE` out, one PC at a time.

use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};

use super::peer::Peer;
use super::{Notice, Shared};
use crate::control::RobotMode;
use crate::link::robot_line::mode_word;
use crate::link::{Job, LineFault, PcLine, RobotLine};
use crate::time::{Span, Stamp};

/// What wakes the robot.
#[derive(Debug)]
pub(super) enum Input {
    /// A PC called.
    Connection(TcpStream),
    /// Bytes of the connection with this number.
    Bytes(u64, Vec<u8>),
    /// The connection with this number is gone.
    Gone(u64),
    /// The end.
    Quit,
}

pub(super) struct Robot {
    shared: Arc<Shared>,
    inputs: Sender<Input>,
    job: Job,
    period: Span,
    notice: Notice,
    peer: Option<Peer>,
    connections: u64,
    mode: RobotMode,
}

impl Robot {
    pub(super) fn new(
        shared: Arc<Shared>,
        inputs: Sender<Input>,
        job: Job,
        period: Span,
        notice: Notice,
    ) -> Self {
        let mode = RobotMode::Idle;
        Self { shared, inputs, job, period, notice, peer: None, connections: 0, mode }
    }

    pub(super) fn run(mut self, received: &Receiver<Input>) {
        let mut next_state = self.now() + self.period;
        loop {
            let left = (next_state - self.now()).ns();
            let wait = Duration::from_nanos(u64::try_from(left).unwrap_or(0));
            match received.recv_timeout(wait) {
                Ok(Input::Connection(stream)) => self.connected(stream),
                Ok(Input::Bytes(id, bytes)) => self.heard(id, &bytes),
                Ok(Input::Gone(id)) => self.gone(id),
                Ok(Input::Quit) | Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = self.now();
            if now >= next_state {
                self.tick(now);
                // A machine that was late does not make up for it in a burst.
                next_state = (next_state + self.period).max(now);
            }
            self.watch_mode();
        }
    }

    fn now(&self) -> Stamp {
        self.shared.clock.now()
    }

    fn tell(&mut self, text: &str) {
        let now = self.now();
        (self.notice)(now, text);
    }

    fn tick(&mut self, now: Stamp) {
        let (state, report) = {
            let mut cell = self.shared.cell();
            self.job.advance(now, &mut cell);
            (cell.state(now), cell.report(now).filter(|_| cell.greeted()))
        };
        self.shared.remember(now, state);
        if let Some(report) = report {
            self.say(&report);
        }
    }

    fn connected(&mut self, stream: TcpStream) {
        self.connections += 1;
        let peer = match Peer::new(stream, self.connections, self.inputs.clone()) {
            Ok(peer) => peer,
            Err(error) => return self.tell(&format!("a PC called and was lost: {error}")),
        };
        let instead = if self.peer.is_some() { ", in place of the one before" } else { "" };
        let text = format!("PC connected from {}{instead}", peer.address);
        self.peer = Some(peer);
        {
            let now = self.now();
            let mut cell = self.shared.cell();
            cell.connect(now);
            self.job.connected(cell.mode());
        }
        self.tell(&text);
    }

    fn gone(&mut self, id: u64) {
        if self.peer.as_ref().is_some_and(|peer| peer.id == id) {
            self.let_go("connection lost");
        }
    }

    fn let_go(&mut self, why: &str) {
        self.peer = None;
        self.shared.cell().disconnect(self.now());
        self.tell(&format!("{why}; the last setpoint runs out"));
    }

    fn heard(&mut self, id: u64, bytes: &[u8]) {
        let Some(peer) = self.peer.as_mut().filter(|peer| peer.id == id) else { return };
        for piece in peer.splitter.push(bytes) {
            self.line(piece);
        }
    }

    /// A line, unless it was sent after the one that ended the connection.
    fn line(&mut self, piece: Result<String, LineFault>) {
        let Some(peer) = self.peer.as_mut() else { return };
        let parsed = match piece {
            Ok(text) => PcLine::parse(&text).map_err(|error| error.to_string()),
            Err(fault) => Err(fault.to_string()),
        };
        let (answer, end) = match parsed {
            Ok(line) => {
                peer.bad.good();
                let answer = self.shared.cell().take(self.shared.clock.now(), line);
                (answer, (line == PcLine::Bye).then_some("the PC said BYE"))
            }
            Err(why) => {
                let end = peer.bad.bad().then_some("three lines in a row make no sense");
                (Some(self.shared.cell().bad_line(&why)), end)
            }
        };
        if let Some(answer) = answer {
            self.answer(&answer);
        }
        self.watch_mode();
        if let Some(why) = end {
            self.let_go(why);
        }
    }

    fn answer(&mut self, answer: &RobotLine) {
        if let RobotLine::Err { seq, code, text } = answer {
            let line = if *seq == 0 { "a line".to_owned() } else { format!("line {seq}") };
            self.tell(&format!("{line} refused: {code}, {text}"));
        }
        self.say(answer);
    }

    fn say(&mut self, line: &RobotLine) {
        let Some(peer) = self.peer.as_mut() else { return };
        if let Err(error) = peer.say(line) {
            self.let_go(&format!("the PC takes no bytes: {error}"));
        }
    }

    fn watch_mode(&mut self) {
        let state = self.shared.cell().state(self.now());
        if state.mode == self.mode {
            return;
        }
        let (from, to) = (mode_word(self.mode), mode_word(state.mode));
        self.mode = state.mode;
        let (path, z) = (state.path_mm.get(), state.z_mm.get());
        self.tell(&format!("{from} -> {to} at path {path:.1} mm, z {z:.1} mm"));
    }
}
