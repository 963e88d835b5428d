//! `monitor` on a pseudo-terminal: what it draws, and that the terminal is as before after each end.
#![allow(clippy::unwrap_used)]

use std::fs::OpenOptions;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use quietcut::device::pseudo_terminal::PseudoTerminal;
use quietcut_tests::command::{alone, binary, folder};

/// Longest wait for the terminal: a choice that ends a test on a busy machine too.
const PATIENCE: Duration = Duration::from_secs(30);

/// Sequences with which a program enters and leaves the second screen of a terminal.
const ENTER: &str = "\u{1b}[?1049h";
const LEAVE: &str = "\u{1b}[?1049l";

struct Terminal {
    terminal: PseudoTerminal,
    command: Child,
    shown: String,
}

impl Terminal {
    /// Starts `monitor simulated` with more arguments on a terminal of 40 rows and 120 columns.
    fn monitor(arguments: &[&str]) -> Self {
        let _alone = alone();
        let terminal = PseudoTerminal::new().unwrap();
        let path = terminal.path().to_owned();
        let size = ["-F", &path, "sane", "rows", "40", "cols", "120"];
        assert!(Command::new("stty").args(size).status().unwrap().success());
        let end = || Stdio::from(OpenOptions::new().read(true).write(true).open(&path).unwrap());
        let command = Command::new(binary())
            .args(["monitor", "simulated"])
            .args(arguments)
            .current_dir(folder().path())
            .env("TERM", "xterm")
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .unwrap();
        Self {
            terminal,
            command,
            shown: String::new(),
        }
    }

    fn receive(&mut self) {
        let mut bytes = [0; 4096];
        let count = self
            .terminal
            .receive(&mut bytes, Duration::from_millis(20))
            .unwrap();
        self.shown += &String::from_utf8_lossy(&bytes[..count]);
    }

    #[track_caller]
    fn wait_for(&mut self, text: &str) {
        let began = Instant::now();
        while !self.shown.contains(text) {
            assert!(began.elapsed() < PATIENCE, "{text} is not in {:?}", self.shown);
            self.receive();
        }
    }

    fn settings(&self) -> String {
        let output = Command::new("stty")
            .args(["-F", self.terminal.path(), "-a"])
            .output();
        String::from_utf8(output.unwrap().stdout).unwrap()
    }

    fn signal(&self, name: &str) {
        let id = self.command.id().to_string();
        let sent = Command::new("sh")
            .args(["-c", "kill -\"$0\" \"$1\"", name, &id])
            .status();
        assert!(sent.unwrap().success());
    }

    /// Waits for the end; returns its status.
    fn end(&mut self) -> Option<i32> {
        let began = Instant::now();
        loop {
            if let Some(status) = self.command.try_wait().unwrap() {
                self.receive();
                return status.code();
            }
            assert!(began.elapsed() < PATIENCE, "{:?}", self.shown);
            self.receive();
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // A command that has ended already needs no end.
        let _ = self.command.kill();
        let _ = self.command.wait();
    }
}

#[test]
fn a_key_and_a_termination_leave_the_terminal_as_it_was() {
    for end in ["q", "TERM"] {
        let mut terminal = Terminal::monitor(&[]);
        terminal.wait_for(ENTER);
        terminal.wait_for("rev/min");
        assert!(terminal.settings().contains("-icanon"), "{end}");
        match end {
            "q" => assert_eq!(terminal.terminal.send(b"q", PATIENCE).unwrap(), 1),
            signal => terminal.signal(signal),
        }
        assert_eq!(terminal.end(), Some(0), "{end}: {:?}", terminal.shown);
        let settings = terminal.settings();
        assert!(
            settings.contains(" icanon") && settings.contains(" echo "),
            "{end}: {settings}"
        );
        let after = terminal.shown.rsplit(LEAVE).next().unwrap();
        assert!(
            after.contains("blocks"),
            "{end}: the summary is not after the picture: {after:?}"
        );
    }
}

/// With every detail logged, the messages wait until the picture has ended; the history shows them meanwhile.
#[test]
fn messages_do_not_write_into_the_picture() {
    let mut terminal = Terminal::monitor(&["-vv"]);
    terminal.wait_for("rev/min");
    terminal.signal("TERM");
    assert_eq!(terminal.end(), Some(0), "{:?}", terminal.shown);
    let picture = terminal.shown.split(ENTER).nth(1).unwrap();
    let picture = picture.split(LEAVE).next().unwrap();
    // A picture places each row: a line feed is one of a message.
    assert!(!picture.contains('\n'), "{picture:?}");
}
