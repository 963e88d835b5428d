//! The page of `monitor --web`, with the simulated device of this process behind it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use quietcut::device::{Pace, Setup, SimulatedDevice, VirtualCell};
use quietcut::simulate::SensedCut;
use serde_json::Value;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

use crate::command::{Running, alone, start};

/// Longest wait for an answer of the page: a choice that ends a test on a busy machine too.
const PATIENCE: Duration = Duration::from_secs(20);

/// A simulated device that plays the cuts which the test sends, in real time.
pub struct Machine {
    device: SimulatedDevice,
    cuts: Sender<SensedCut>,
    /// Start of the clock of the device.
    pub began: Instant,
}

impl Machine {
    /// Starts the device; its spindle stands still.
    pub fn start() -> Self {
        let alone = alone();
        let (cuts, receive) = channel();
        let setup = Setup {
            state: None,
            teeth: 2,
            pace: Pace::RealTime,
        };
        let began = Instant::now();
        let device = SimulatedDevice::start(setup, receive).expect("a simulated device");
        drop(alone);
        Self { device, cuts, began }
    }

    /// Plays a cut 2 mm deep at 1045 rev/min, which chatters with the period of two teeth.
    pub fn chatter(&self) {
        let cell = VirtualCell::new().expect("the case of the cell");
        let cut = cell.cut(1045.0, 2.0, 8.0, 1).expect("a cut");
        self.cuts.send(cut).expect("the device runs");
    }

    /// Path of the serial port.
    pub fn path(&self) -> &str {
        self.device.path()
    }
}

/// A running `monitor --web`.
pub struct Page {
    /// The command.
    pub command: Running,
    /// Address of the page.
    pub url: String,
}

impl Page {
    /// Starts the command in `folder` on `port` with more options; returns when it has said the address of the page.
    pub fn open(folder: &Path, port: &str, options: &[&str]) -> Self {
        let arguments = [&["monitor", port, "--json-lines"], options].concat();
        let mut command = start(folder, &arguments);
        let line = command.next_line();
        let said: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"));
        let url = said["url"].as_str().expect("an address").to_owned();
        Self { command, url }
    }

    /// Address and port for a connection of this computer, such as `127.0.0.1:8080`.
    pub fn host(&self) -> String {
        let port = self.url.split([':', '/']).nth(4).expect("a port");
        format!("127.0.0.1:{port}")
    }

    /// What follows the address, with the token if there is one.
    pub fn query(&self) -> &str {
        self.url.split_once("/?").map_or("", |(_, query)| query)
    }

    /// Sends a request with these lines at its head; returns the whole answer.
    pub fn ask(&self, lines: &[&str]) -> String {
        let mut stream = TcpStream::connect(self.host()).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a limit");
        let head = lines.join("\r\n") + "\r\n\r\n";
        stream.write_all(head.as_bytes()).expect("a request is sent");
        let mut answer = Vec::new();
        // A server that refuses a request may close the connection before all of it is read.
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// Opens a socket to the page.
    pub fn socket(&self) -> Socket {
        let url = format!("ws://{}/live?{}", self.host(), self.query());
        let (socket, _) = tungstenite::connect(url).expect("a socket");
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(PATIENCE)).expect("a limit");
        }
        Socket(socket)
    }
}

/// Socket of a page.
pub struct Socket(pub WebSocket<MaybeTlsStream<TcpStream>>);

impl Socket {
    /// Next text of this topic.
    #[track_caller]
    pub fn next(&mut self, topic: &str) -> Value {
        loop {
            if let Message::Text(text) = self.0.read().expect("the socket is open") {
                let frame: Value = serde_json::from_str(&text).expect("JSON");
                if frame["topic"] == topic {
                    return frame;
                }
            }
        }
    }

    /// Next state of verdict and connection for which `is_wanted` is true.
    #[track_caller]
    pub fn head(&mut self, is_wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let head = self.next("head");
            if is_wanted(&head) {
                return head;
            }
        }
    }

    /// Code and reason with which the server closes the socket.
    pub fn closed(&mut self) -> (u16, String) {
        loop {
            match self.0.read() {
                Ok(Message::Close(Some(frame))) => return (frame.code.into(), frame.reason.to_string()),
                Ok(_) => {}
                Err(error) => return (0, error.to_string()),
            }
        }
    }
}
