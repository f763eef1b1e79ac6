//! Both ends of a link, and waiting for what happens on it.

use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use crossbeam_channel::{Receiver, unbounded};
use truebead::core::{Mm, MmPerS, RobotMode, Span};
use truebead::drivers::line::LinkTiming;
use truebead::drivers::robot::line::{LinkClient, LinkConfig, RobotLineEvent};
use truebead::io::clock::RunClock;
use truebead::link::{PrintJob, RobotParams, RobotStatus};
use truebead::simulators::robot::{RobotOptions, RobotSim};

/// What should happen does so long before; only a failure waits for it.
const PATIENCE: Duration = Duration::from_secs(20);

pub fn speed(value: f64) -> MmPerS {
    MmPerS::constant(value)
}

pub fn listener() -> TcpListener {
    TcpListener::bind("127.0.0.1:0").unwrap()
}

/// A robot that begins an endless bead as soon as a PC is there, `layers`
/// times.
pub fn sim_on(listener: TcpListener, layers: u32) -> RobotSim {
    let options = RobotOptions {
        params: RobotParams { clock_start_ms: 7_000_000, ..RobotParams::default() },
        job: PrintJob::new(layers, Mm::ZERO, Mm::ZERO, Span::ZERO),
        state_period: Span::from_millis(20),
    };
    RobotSim::spawn(listener, RunClock::start(), options, Box::new(|_, _| {})).unwrap()
}

pub fn sim() -> RobotSim {
    sim_on(listener(), 1)
}

pub fn config(address: SocketAddr) -> LinkConfig {
    LinkConfig {
        address: address.to_string(),
        min: speed(60.0),
        max: speed(150.0),
        valid_ms: 1000,
        timing: LinkTiming {
            hello: Duration::from_secs(5),
            first_delay: Duration::from_millis(10),
            longest_delay: Duration::from_millis(50),
            ..LinkTiming::default()
        },
    }
}

/// A client and what it reports.
pub struct Pc {
    pub link: LinkClient,
    pub events: Receiver<RobotLineEvent>,
}

impl Pc {
    pub fn start(config: LinkConfig) -> Self {
        let (sender, events) = unbounded();
        let report = move |event| sender.send(event).is_ok();
        let link = LinkClient::start(config, RunClock::start(), report).unwrap();
        Self { link, events }
    }

    /// The first event from now on that is wanted.
    pub fn until<T>(&self, wanted: impl Fn(&RobotLineEvent) -> Option<T>) -> T {
        loop {
            let event = self.events.recv_timeout(PATIENCE).expect("the event never came");
            if let Some(found) = wanted(&event) {
                return found;
            }
        }
    }

    pub fn until_up(&self) {
        self.until(|event| matches!(event, RobotLineEvent::Up { .. }).then_some(()));
    }

    pub fn until_down(&self) -> String {
        self.until(|event| match event {
            RobotLineEvent::Down { reason, .. } => Some(reason.clone()),
            _ => None,
        })
    }

    pub fn until_state(&self, wanted: impl Fn(&RobotStatus) -> bool) -> RobotStatus {
        self.until(|event| match event {
            RobotLineEvent::State { state, .. } if wanted(state) => Some(*state),
            _ => None,
        })
    }

    pub fn until_mode(&self, mode: RobotMode) -> RobotStatus {
        self.until_state(|state| state.mode == mode)
    }
}

/// One end of a plain connection, spoken line by line.
pub struct Talk {
    stream: TcpStream,
    lines: BufReader<TcpStream>,
}

impl Talk {
    pub fn new(stream: TcpStream) -> Self {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.set_nodelay(true).unwrap();
        Self { lines: BufReader::new(stream.try_clone().unwrap()), stream }
    }

    /// A PC by hand.
    pub fn call(address: SocketAddr) -> Self {
        Self::new(TcpStream::connect(address).unwrap())
    }

    /// A robot by hand, which has answered `HELLO`.
    pub fn answer(listener: &TcpListener, hello: &str) -> Self {
        let mut talk = Self::new(listener.accept().unwrap().0);
        assert_eq!(talk.hear().as_deref(), Some("HELLO 1 truebead"));
        talk.say(hello);
        talk
    }

    pub fn say(&mut self, text: &str) {
        self.stream.write_all(text.as_bytes()).unwrap();
    }

    /// The next line; none at the end of the connection.
    pub fn hear(&mut self) -> Option<String> {
        let mut line = String::new();
        match self.lines.read_line(&mut line) {
            Ok(0) => None,
            Ok(_) => Some(line.trim_end().to_owned()),
            // A side that ends a connection with bytes unread resets it.
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => None,
            Err(error) => panic!("nothing was heard: {error}"),
        }
    }

    /// The next line that begins with this.
    pub fn hear_one(&mut self, begins: &str) -> String {
        loop {
            let line = self.hear().expect("the connection ended");
            if line.starts_with(begins) {
                return line;
            }
        }
    }

    pub fn hear_the_end(&mut self) {
        while self.hear().is_some() {}
    }
}
