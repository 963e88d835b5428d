//! Messages on standard error. They are held back while a picture is on the terminal, which they would write into.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Number of bytes that are held back at most: a choice. Later messages are counted only.
const MOST: usize = 65_536;

/// Messages that are held back; `None` while they are printed at once.
static HELD: Mutex<Option<Held>> = Mutex::new(None);

/// True once a thread has panicked.
static FAULT: AtomicBool = AtomicBool::new(false);

#[derive(Default)]
struct Held {
    text: Vec<u8>,
    /// Number of bytes of the text that were taken for the picture.
    taken: usize,
    /// Number of messages beyond [`MOST`].
    dropped: usize,
}

fn held() -> MutexGuard<'static, Option<Held>> {
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Standard error, or the messages that are held back.
pub(crate) struct Messages;

impl Write for Messages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut *held() {
            None => io::stderr().write(bytes),
            Some(held) => {
                if held.text.len() < MOST {
                    held.text.extend_from_slice(bytes);
                } else {
                    held.dropped += 1;
                }
                Ok(bytes.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Prints the message of a panic, and notes that there was one.
pub(crate) fn print_fault(message: &str) {
    FAULT.store(true, Ordering::Relaxed);
    // Nobody reads the message of a closed standard error.
    let _ = writeln!(Messages, "{message}");
}

/// True once a thread has panicked: a picture on the terminal is then no longer right.
pub(crate) fn has_fault() -> bool {
    FAULT.load(Ordering::Relaxed)
}

/// Messages are held back until this value is dropped, which prints them.
pub(crate) struct Hold(());

impl Hold {
    /// Begins to hold messages back.
    pub(crate) fn begin() -> Self {
        *held() = Some(Held::default());
        Self(())
    }

    /// Whole lines that have come since the last call, without colours.
    pub(crate) fn take_lines(&self) -> Vec<String> {
        let mut held = held();
        let Some(held) = held.as_mut() else {
            return Vec::new();
        };
        let new = held.text.get(held.taken..).unwrap_or_default();
        let whole = new
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |end| end + 1);
        let text = String::from_utf8_lossy(new.get(..whole).unwrap_or_default());
        let lines = text.lines().map(without_colours).collect();
        held.taken += whole;
        lines
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        let Some(held) = held().take() else {
            return;
        };
        // Nobody reads the messages of a closed standard error.
        let _ = io::stderr().write_all(&held.text);
        if held.dropped > 0 {
            let _ = writeln!(io::stderr(), "{} more messages", held.dropped);
        }
    }
}

/// The line without the sequences that colour it on a terminal: ESC [ … m.
fn without_colours(line: &str) -> String {
    let mut parts = line.split("\u{1b}[");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text += part.split_once('m').map_or("", |(_, rest)| rest);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_messages_are_taken_once_by_whole_lines_without_colours() {
        let hold = Hold::begin();
        write!(Messages, "\u{1b}[33m WARN\u{1b}[0m the line is noisy\nhalf").unwrap();
        assert_eq!(hold.take_lines(), [" WARN the line is noisy"]);
        assert!(hold.take_lines().is_empty());
        writeln!(Messages, " a line").unwrap();
        assert_eq!(hold.take_lines(), ["half a line"]);
        write!(Messages, "{}", "x".repeat(2 * MOST)).unwrap();
        write!(Messages, "dropped").unwrap();
        assert_eq!(held().as_ref().unwrap().dropped, 1);
        // The test does not print what it has held.
        *held() = None;
    }
}
