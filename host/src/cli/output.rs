//! Standard output of a verb: text lines, exactly one JSON object with `--json`, or one JSON object a line with
//! `--json-lines`.

use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

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

/// Endings that an output file may have; the ending sets the format of the file.
#[derive(Clone, Copy, Debug)]
pub struct Endings(pub &'static [&'static str]);

impl Endings {
    /// Parser of the path of an output file, for clap.
    pub fn parser(self) -> impl Fn(&str) -> Result<PathBuf, String> + Clone + Send + Sync {
        move |text| self.checked(text)
    }

    /// The path, if it has one of the endings.
    ///
    /// # Errors
    /// Another ending; the message states the allowed ones and a name that would be right.
    pub fn checked(self, text: &str) -> Result<PathBuf, String> {
        let path = PathBuf::from(text);
        let ending = crate::file::ending(&path);
        if self.0.contains(&ending.as_str()) {
            return Ok(path);
        }
        let listed = match self.0 {
            [one] => format!(".{one}"),
            [others @ .., last] => {
                let others: Vec<String> = others.iter().map(|ending| format!(".{ending}")).collect();
                format!("{} or .{last}", others.join(", "))
            }
            [] => String::new(),
        };
        let right = path.with_extension(self.0.first().copied().unwrap_or_default());
        Err(format!(
            "the ending of the file sets its format: {listed} is needed, such as {}",
            right.display()
        ))
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
    /// True with `--json`.
    pub(super) fn is_json(self) -> bool {
        self.json
    }

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

/// Output format of a verb that goes on: text, one JSON object at the end, or one JSON object a line.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct StreamedOutput {
    #[command(flatten)]
    output: Output,
    /// Print one JSON object a line: every change of verdict or advice when it happens, and the summary at the end.
    #[arg(long, conflicts_with = "json")]
    json_lines: bool,
}

impl StreamedOutput {
    /// True with `--json` or `--json-lines`.
    pub(super) fn is_json(self) -> bool {
        self.output.is_json() || self.json_lines
    }

    /// Prints one event, such as a change of the verdict: the JSON of `object` with `--json-lines`, nothing with
    /// `--json`, else `text`.
    pub fn event(self, object: &impl Serialize, text: impl Display) -> Result<(), Error> {
        if self.json_lines {
            print(&serde_json::to_string(object).map_err(Error::other)?)
        } else {
            self.output.line(text)
        }
    }

    /// Prints one event that has no text of its own: the JSON of `object` with `--json-lines`, else nothing.
    pub(super) fn object(self, object: &impl Serialize) -> Result<(), Error> {
        if self.json_lines {
            print(&serde_json::to_string(object).map_err(Error::other)?)
        } else {
            Ok(())
        }
    }

    /// Prints a line of text on standard error with `--json`, whose only object comes at the end; nothing otherwise.
    pub(super) fn apart(self, text: impl Display) {
        if self.output.is_json() {
            eprintln!("{text}");
        }
    }

    /// Prints a line of text that has no JSON; prints nothing with `--json` or `--json-lines`.
    pub fn line(self, text: impl Display) -> Result<(), Error> {
        if self.json_lines {
            Ok(())
        } else {
            self.output.line(text)
        }
    }

    /// Prints the last line of a verb that goes on: with `--json-lines` an object with `summary` and, if a file had to
    /// be interpreted, `understood`; else as [`Output::answer_with`].
    pub(super) fn end(
        self,
        understood: &[Understood],
        object: &impl Serialize,
        summary: &(impl Serialize + Display),
    ) -> Result<(), Error> {
        if self.json_lines {
            self.json_lines_end(understood, summary)
        } else {
            self.output.answer_with(understood, object, summary)
        }
    }

    fn json_lines_end(self, understood: &[Understood], summary: &impl Serialize) -> Result<(), Error> {
        let object = LastLine { summary, understood };
        print(&serde_json::to_string(&object).map_err(Error::other)?)
    }
}

/// Last line of the output with `--json-lines`.
#[derive(Serialize)]
struct LastLine<'a, T> {
    summary: &'a T,
    #[serde(skip_serializing_if = "<[Understood]>::is_empty")]
    understood: &'a [Understood],
}

/// The result of a verb, and how its files were understood, where they had to be interpreted.
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
