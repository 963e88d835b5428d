//! A pseudo-terminal whose other end is a socket: a serial device for the `quietcut` command.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

/// How long the threads wait before they look whether they are still wanted.
const TURN: Duration = Duration::from_millis(20);

/// A serial device that lasts as long as this.
pub struct Pty {
    path: String,
    /// Kept open: without a second end the first one reads an error until somebody opens it.
    _device: TTYPort,
    wanted: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Pty {
    /// A serial device that passes bytes to and from this socket.
    pub fn to_socket(socket: UnixStream) -> Self {
        let (mut master, device) = TTYPort::pair().expect("a pseudo-terminal");
        let path = device.name().expect("the name of the pseudo-terminal");
        master.set_timeout(TURN).expect("a limit on reading");
        socket.set_read_timeout(Some(TURN)).expect("a limit on reading");
        let wanted = Arc::new(AtomicBool::new(true));
        let to_socket = pass(
            master
                .try_clone_native()
                .expect("a second handle of the pseudo-terminal"),
            socket.try_clone().expect("a second handle of the socket"),
            wanted.clone(),
        );
        let from_socket = pass(socket, master, wanted.clone());
        Self {
            path,
            _device: device,
            wanted,
            threads: vec![to_socket, from_socket],
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

/// Passes bytes until one end is closed or nobody wants them any more.
fn pass(
    mut from: impl Read + Send + 'static,
    mut to: impl Write + Send + 'static,
    wanted: Arc<AtomicBool>,
) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        while wanted.load(Ordering::Relaxed) {
            let count = match from.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => count,
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => continue,
                Err(_) => return,
            };
            let mut rest = &bytes[..count];
            while !rest.is_empty() {
                match to.write(rest) {
                    Ok(count) => rest = &rest[count..],
                    // Nobody reads at the other end: the sender is held back.
                    Err(error) if error.kind() == ErrorKind::TimedOut && wanted.load(Ordering::Relaxed) => {}
                    Err(_) => return,
                }
            }
        }
    })
}
