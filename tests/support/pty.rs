//! A pseudo-terminal whose other end is a socket: a serial device for the `quietcut` command.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::command::alone;
use quietcut::device::pseudo_terminal::PseudoTerminal;

/// How long the threads wait before they look whether they are still wanted.
const TURN: Duration = Duration::from_millis(20);

/// A serial device that lasts as long as this.
pub struct Pty {
    path: String,
    wanted: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Pty {
    /// A serial device that passes bytes to and from this socket.
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
            // A thread that failed has said so.
            let _ = thread.join();
        }
    }
}

/// Passes bytes on until one end is closed or nobody wants them any more.
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

/// Passes bytes back; where nobody reads them at the other end the sender is held back.
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
