//! The real `quietcut` command, as a user runs it.

use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Longest run of the command in a test: a choice that ends a hanging command even on a busy machine.
const LONGEST: Duration = Duration::from_secs(300);

/// The folder of the case files.
pub fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases")
}

/// Path of the command built in the same target folder and profile as the running test.
pub fn binary() -> PathBuf {
    let test = std::env::current_exe().expect("a test knows its own path");
    let folder = test
        .parent()
        .and_then(Path::parent)
        .expect("tests lie in target/PROFILE/deps");
    let binary = folder.join("quietcut");
    assert!(
        binary.exists(),
        "{} is missing: cargo build --release -p quietcut",
        binary.display()
    );
    binary
}

/// Temporary folder of a test, deleted on drop.
pub fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

/// Result of a run of the command.
#[derive(Debug)]
pub struct Outcome {
    /// Exit status; `None` if a signal ended the command.
    pub status: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Outcome {
    /// Parses standard output, which must be one JSON object.
    pub fn json(&self) -> serde_json::Value {
        assert_eq!(self.status, Some(0), "{self:?}");
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// Asserts an input error: exit status 2, empty standard output, and one message that contains all `words`.
    #[track_caller]
    pub fn refused(&self, words: &[&str]) {
        assert_eq!(self.status, Some(2), "{self:?}");
        assert_eq!(self.stdout, "", "{self:?}");
        for word in words {
            assert!(self.stderr.contains(word), "`{word}` is not in {self:?}");
        }
        assert!(!self.stderr.contains("fault in quietcut"), "{self:?}");
    }
}

/// Running command.
#[derive(Debug)]
pub struct Running {
    child: Child,
}

impl Running {
    /// Closes the reading end of standard output, as `head` does.
    pub fn stop_reading(&mut self) {
        drop(self.child.stdout.take());
    }

    /// Reads the next line of standard output, without its end; empty once the command has ended.
    pub fn next_line(&mut self) -> String {
        let stdout = self.child.stdout.as_mut().expect("standard output is read");
        let mut line = Vec::new();
        let mut byte = [0];
        // One byte at a time, so that nothing after the line is taken.
        while stdout.read(&mut byte).is_ok_and(|count| count == 1) && byte != *b"\n" {
            line.extend(byte);
        }
        String::from_utf8(line).expect("the command writes UTF-8")
    }

    /// Sends the signal of Ctrl-C.
    pub fn interrupt(&self) {
        let id = self.child.id().to_string();
        let sent = Command::new("sh").args(["-c", "kill -INT \"$0\"", &id]).status();
        assert!(sent.expect("a shell").success(), "the command has ended already");
    }

    /// Whether the command has installed its handler of Ctrl-C, from the mask of caught signals that Linux shows.
    pub fn catches_interrupt(&self) -> bool {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
        // Signal n is bit n − 1; SIGINT is 2.
        mask.is_some_and(|mask| mask & 0b10 != 0)
    }

    /// Waits for the end of the command; a hanging command is killed and fails the test.
    pub fn finish(mut self) -> Outcome {
        let drain = |stream: Option<Box<dyn Read + Send>>| {
            std::thread::spawn(move || {
                let mut text = String::new();
                if let Some(mut stream) = stream {
                    stream
                        .read_to_string(&mut text)
                        .expect("the command writes UTF-8");
                }
                text
            })
        };
        let stdout = drain(self.child.stdout.take().map(|stream| Box::new(stream) as _));
        let stderr = drain(self.child.stderr.take().map(|stream| Box::new(stream) as _));
        let began = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("the command can be waited for") {
                break status;
            }
            if began.elapsed() > LONGEST {
                self.child.kill().expect("the command can be killed");
                self.child.wait().expect("the command can be waited for");
                panic!(
                    "the command did not end in {LONGEST:?}: {}",
                    stderr.join().unwrap_or_default()
                );
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        Outcome {
            status: status.code(),
            stdout: stdout.join().expect("standard output was read"),
            stderr: stderr.join().expect("standard error was read"),
        }
    }
}

impl Drop for Running {
    /// Ends a command that a failed test has left behind.
    fn drop(&mut self) {
        if self.child.try_wait().is_ok_and(|status| status.is_none()) && self.child.kill().is_ok() {
            // The outcome of a killed command is of no use.
            let _ = self.child.wait();
        }
    }
}

/// Lock that prevents the start of child processes, so that no child inherits the files that a test opens meanwhile.
pub fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts the command with `arguments` in `folder`.
pub fn start<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Running {
    start_on(folder, arguments, Stdio::piped())
}

/// Starts the command with `arguments` in `folder`, with `stderr` as its standard error.
pub fn start_on<S: AsRef<OsStr>>(folder: &Path, arguments: &[S], stderr: impl Into<Stdio>) -> Running {
    let _alone = alone();
    let child = Command::new(binary())
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(stderr)
        .spawn()
        .expect("the command can be started");
    Running { child }
}

/// Runs the command with `arguments` in `folder` to its end.
pub fn quietcut<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Outcome {
    start(folder, arguments).finish()
}

/// Options of the verb `working-point` for the cut of the virtual tests: 2 mm deep, down-milling at half immersion.
pub const WORKING_POINT: &str = "--depth-mm 2 --start 90 --exit 180 --feed 0.15";

/// The arguments of the command in `line`, separated by white space.
pub fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// Runs the command with the arguments in `line`, separated by white space, in `folder`; it must succeed.
#[track_caller]
pub fn done(folder: &Path, line: &str) -> Outcome {
    let outcome = quietcut(folder, &words(line));
    assert_eq!(outcome.status, Some(0), "{line}: {outcome:?}");
    outcome
}

/// The verbs that the help lists.
pub fn verbs() -> Vec<String> {
    let help = quietcut(folder().path(), &["help"]);
    help.stdout
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|verb| !verb.starts_with('-') && *verb != "help")
        .map(str::to_owned)
        .collect()
}
