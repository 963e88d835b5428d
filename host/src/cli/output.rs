//! Standard output of a verb: text lines, or exactly one JSON object with `--json`.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::Error;
use crate::recording::Understood;

/// Refuses an output file that is one of the input files.
pub(super) fn keep_inputs<'a>(inputs: impl IntoIterator<Item = &'a Path>, out: &Path) -> Result<(), Error> {
    let Ok(target) = out.canonicalize() else {
        return Ok(());
    };
    let same = inputs
        .into_iter()
        .find(|input| input.canonicalize().is_ok_and(|input| input == target));
    match same {
        Some(input) => Err(Error::input(format!(
            "--out {}: this would overwrite the input {}; choose another name",
            out.display(),
            input.display()
        ))),
        None => Ok(()),
    }
}

/// Output format of a verb, text or JSON; part of the arguments of every verb.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Output {
    /// Print exactly one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

impl Output {
    /// Prints one text line; prints nothing with `--json`.
    pub fn line(self, text: impl Display) -> Result<(), Error> {
        if self.json { Ok(()) } else { print(&text) }
    }

    /// Prints the result of the verb: with `--json` the JSON of `object`, otherwise `text`.
    pub fn answer(self, object: &impl Serialize, text: impl Display) -> Result<(), Error> {
        if self.json {
            print(&serde_json::to_string(object).map_err(Error::other)?)
        } else {
            print(&text)
        }
    }

    /// Prints the result of the verb as [`Output::answer`] does. The JSON object also has the key `understood`, if a
    /// file had to be interpreted.
    pub(super) fn answer_with(
        self,
        understood: &[Understood],
        object: &impl Serialize,
        text: impl Display,
    ) -> Result<(), Error> {
        if understood.is_empty() {
            self.answer(object, text)
        } else {
            self.answer(&WithUnderstood { object, understood }, text)
        }
    }
}

/// The result of a verb, and how the files of its recordings were understood.
#[derive(Serialize)]
struct WithUnderstood<'a, T> {
    #[serde(flatten)]
    object: &'a T,
    understood: &'a [Understood],
}

fn print(text: &dyn Display) -> Result<(), Error> {
    super::progress::clear();
    let mut stdout = io::stdout().lock();
    writeln!(stdout, "{text}")
        .and_then(|()| stdout.flush())
        .map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => Error::ReaderGone,
            _ => Error::other(format!("standard output: {error}")),
        })
}
