//! Standard output: lines for people, or exactly one JSON object.

use std::fmt::Display;
use std::io::{self, Write};

use serde::Serialize;

use super::Error;

/// How a verb answers; part of the arguments of every verb.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Output {
    /// Print exactly one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

impl Output {
    /// One line for people; nothing with `--json`.
    pub fn line(self, text: impl Display) -> Result<(), Error> {
        if self.json { Ok(()) } else { print(&text) }
    }

    /// The answer of the verb, once: the object with `--json`, else the text.
    pub fn answer(self, object: &impl Serialize, text: impl Display) -> Result<(), Error> {
        if self.json {
            print(&serde_json::to_string(object).map_err(Error::other)?)
        } else {
            print(&text)
        }
    }
}

fn print(text: &dyn Display) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    writeln!(stdout, "{text}")
        .and_then(|()| stdout.flush())
        .map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => Error::ReaderGone,
            _ => Error::other(format!("standard output: {error}")),
        })
}
