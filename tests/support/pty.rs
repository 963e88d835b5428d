//! A pseudo-terminal whose other end is a socket: a serial device for the `quietcut` command.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::command::alone;
use quietcut::device::pseudo_terminal::PseudoTerminal;

/// Longest wait of the threads before they check whether to stop: a choice.
const TURN: Duration = Duration::from_millis(20);

/// Serial device that exists until this value is dropped.
pub struct Pty {
    path: String,
    wanted: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Pty {
    /// Creates a serial device that forwards bytes to and from this socket.
    pub fn to_socket(socket: UnixStream) -> Self {
        let alone = alone();
        let terminal = PseudoTerminal::new().expect("a pseudo-terminal");
        let path = terminal.path().to_owned();
        let wanted = Arc::new(AtomicBool::new(true));
        drop(alone);
        socket.set_read_timeout(Some(TURN)).expect("a limit on reading");
        let second = terminal
            .try_clone()
            .expect("a second handle of the pseudo-terminal");
        let threads = vec![
            std::thread::spawn({
                let (terminal, socket, wanted) = (second, socket.try_clone(), wanted.clone());
                let socket = socket.expect("a second handle of the socket");
                move || to_socket(terminal, socket, &wanted)
            }),
            std::thread::spawn({
                let wanted = wanted.clone();
                move || from_socket(terminal, socket, &wanted)
            }),
        ];
        Self {
            path,
            wanted,
            threads,
        }
    }

    /// Path of the serial device.
    pub fn path(&self) -> &str {
        &self.path
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        self.wanted.store(false, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A panic of the thread has already been printed.
            let _ = thread.join();
        }
    }
}

/// Forwards bytes from the terminal to the socket until one end is closed or `wanted` is false.
fn to_socket(mut terminal: PseudoTerminal, mut socket: UnixStream, wanted: &AtomicBool) {
    let mut bytes = [0; 4096];
    while wanted.load(Ordering::Relaxed) {
        let Ok(count) = terminal.receive(&mut bytes, TURN) else {
            return;
        };
        if socket.write_all(&bytes[..count]).is_err() {
            return;
        }
    }
}

/// Forwards bytes from the socket to the terminal; a full terminal blocks the sender.
fn from_socket(mut terminal: PseudoTerminal, mut socket: UnixStream, wanted: &AtomicBool) {
    let mut bytes = [0; 4096];
    while wanted.load(Ordering::Relaxed) {
        let count = match socket.read(&mut bytes) {
            Ok(0) => return,
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => continue,
            Err(_) => return,
        };
        let mut rest = &bytes[..count];
        while !rest.is_empty() && wanted.load(Ordering::Relaxed) {
            let Ok(count) = terminal.send(rest, TURN) else {
                return;
            };
            rest = &rest[count..];
        }
    }
}
