//! The file in which the orbits of a branch and of its curves are recorded while they are computed: `FILE.part.jsonl`.
//!
//! The first line names the command by a hash of the case file and the options. Each further line is one orbit, appended
//! and synced to the disk. The finished file loses `.part` in its name. A process that is killed leaves at most one
//! incomplete line at the end, which is dropped when the computation goes on.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::super::Error;
use crate::file;
use crate::orbit::curve::{CurveJournal, CurveRecord};
use crate::orbit::{BranchJournal, BranchRecord};

/// End of the name of an unfinished file.
const PART: &str = ".part.jsonl";

/// First line of the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Head {
    /// Verb of the command.
    quietcut: String,
    /// Version of the command.
    version: String,
    /// Hash of case and options, in hexadecimal digits.
    hash: String,
    /// Hash of the bytes of the case file.
    case: String,
    /// Options that decide the result, with their values.
    options: Vec<(String, String)>,
}

impl Head {
    /// Head for the bytes of a case file and options.
    pub(super) fn new(case: &[u8], options: Vec<(String, String)>) -> Self {
        let version = env!("CARGO_PKG_VERSION");
        let case = hash(case);
        let words: Vec<String> = options
            .iter()
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        let whole = format!("{version}\n{case}\n{}", words.join("\n"));
        Self {
            quietcut: "bifurcation".into(),
            version: version.into(),
            hash: hash(whole.as_bytes()),
            case,
            options,
        }
    }

    /// How the command that wrote `recorded` differs from this one, in words.
    fn difference(&self, recorded: &Self) -> String {
        if recorded.version != self.version {
            return format!(
                "it is of quietcut {}, this is {}; numbers may differ",
                recorded.version, self.version
            );
        }
        if recorded.case != self.case {
            return "the case file is another one or has been changed".into();
        }
        let value = |head: &Self, name: &str| {
            let found = head.options.iter().find(|(other, _)| other == name);
            found.map_or_else(|| "not given".to_owned(), |(_, value)| value.clone())
        };
        let names = recorded.options.iter().chain(&self.options).map(|(name, _)| name);
        let mut different = names.filter(|name| value(self, name) != value(recorded, name));
        different.next().map_or_else(
            || {
                format!(
                    "its hash is {}, that of this command {}",
                    recorded.hash, self.hash
                )
            },
            |name| {
                format!(
                    "{name} was {} there and is {} here",
                    value(recorded, name),
                    value(self, name)
                )
            },
        )
    }
}

/// Line of the file after the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Line {
    /// Orbit of the branch.
    Branch(BranchRecord),
    /// Orbit of a curve on one side of its start.
    Curve(usize, usize, CurveRecord),
    /// Period-doubled orbit from the flip of this index among the bifurcations of the branch.
    Doubled(usize, BranchRecord),
}

/// Orbits recorded so far, and the file to which the next ones are appended.
#[derive(Debug, Default)]
pub(super) struct Records {
    path: Option<PathBuf>,
    file: Option<File>,
    lines: Vec<Line>,
    /// Number of the present curve, in the order in which curves are followed.
    curve: usize,
    failure: Option<String>,
}

impl Records {
    /// Records for an output file, in a new file beside it.
    ///
    /// # Errors
    /// There is an unfinished file of this name already, or it cannot be made.
    pub(super) fn beside(out: &Path, head: &Head) -> Result<Self, Error> {
        let path = out.with_extension("part.jsonl");
        let mut options = OpenOptions::new();
        let file = match options.append(true).create_new(true).open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                return Err(unfinished(&path, head));
            }
            Err(cause) => return Err(file::FileError::Write { path, cause }.into()),
        };
        let mut records = Self {
            path: Some(path),
            file: Some(file),
            ..Self::default()
        };
        let text = serde_json::to_string(head).map_err(Error::other)?;
        if records.append(&text) {
            Ok(records)
        } else {
            Err(records.failed())
        }
    }

    /// Records of an interrupted or finished run, to which the next ones are appended.
    ///
    /// # Errors
    /// The file cannot be read or written, is no file of records, or is of another command.
    pub(super) fn resumed(path: &Path, head: &Head) -> Result<Self, Error> {
        let text = file::read_text(path)?;
        let whole = text.rfind('\n').map_or(0, |at| at + 1);
        let recorded = head_of(path, &text[..whole])?;
        if recorded.hash != head.hash {
            return Err(Error::input(format!(
                "{}: the records are of another command: {}; give the same case and options, or begin anew without --resume",
                path.display(),
                head.difference(&recorded)
            )));
        }
        let lines = text[..whole].lines().enumerate().skip(1);
        let lines = lines.map(|(index, line)| {
            serde_json::from_str(line).map_err(|error| {
                Error::input(format!(
                    "{}: line {} is no recorded orbit: {error}; delete it and all lines after it, and resume again",
                    path.display(),
                    index + 1
                ))
            })
        });
        let lines = lines.collect::<Result<Vec<Line>, Error>>()?;
        let cannot = |cause| file::FileError::Write {
            path: path.into(),
            cause,
        };
        let file = OpenOptions::new().append(true).open(path).map_err(cannot)?;
        file.set_len(whole as u64).map_err(cannot)?;
        Ok(Self {
            path: Some(path.into()),
            file: Some(file),
            lines,
            ..Self::default()
        })
    }

    /// Begins the next curve.
    pub(super) fn next_curve(&mut self) {
        self.curve += 1;
    }

    /// Error of the file, if it has failed.
    pub(super) fn failed(&self) -> Error {
        let path = self.path.as_deref().unwrap_or(Path::new(""));
        let failure = self
            .failure
            .as_deref()
            .unwrap_or("the recorded orbits do not fit this command");
        Error::other(format!("{}: {failure}", path.display()))
    }

    /// Gives the finished file its final name, which is returned; `None` if nothing is recorded.
    ///
    /// # Errors
    /// The file cannot be renamed.
    pub(super) fn finish(self) -> Result<Option<PathBuf>, Error> {
        let Some(path) = self.path else { return Ok(None) };
        let name = path.to_string_lossy();
        let Some(stem) = name.strip_suffix(PART) else {
            return Ok(Some(path));
        };
        let last = PathBuf::from(format!("{stem}.jsonl"));
        match std::fs::rename(&path, &last) {
            Ok(()) => Ok(Some(last)),
            Err(cause) => Err(file::FileError::Write { path: last, cause }.into()),
        }
    }

    /// Removes a new file in which no orbit is recorded.
    pub(super) fn discard(self) {
        if let Some(path) = self.path.filter(|_| self.lines.is_empty()) {
            // A file that cannot be removed stays; the command ends with the error that is the reason.
            let _ = std::fs::remove_file(path);
        }
    }

    fn append(&mut self, line: &str) -> bool {
        let Some(file) = &mut self.file else { return true };
        // One call writes the whole line, so that an interrupt does not split it.
        let written = file
            .write_all(format!("{line}\n").as_bytes())
            .and_then(|()| file.sync_data());
        if let Err(error) = written {
            self.failure = Some(format!("cannot write it: {error}"));
        }
        self.failure.is_none()
    }

    fn keep(&mut self, line: Line) -> bool {
        if self.file.is_none() {
            return true;
        }
        match serde_json::to_string(&line) {
            Ok(text) => self.append(&text),
            Err(error) => {
                self.failure = Some(error.to_string());
                false
            }
        }
    }
}

impl BranchJournal for Records {
    fn recorded(&mut self) -> Vec<BranchRecord> {
        let of_branch = self.lines.iter().filter_map(|line| match line {
            Line::Branch(record) => Some(record.clone()),
            Line::Curve(..) | Line::Doubled(..) => None,
        });
        of_branch.collect()
    }

    fn record(&mut self, record: &BranchRecord) -> bool {
        self.keep(Line::Branch(record.clone()))
    }
}

/// Records of the doubled orbits from one flip.
pub(super) struct DoubledRecords<'a> {
    pub(super) records: &'a mut Records,
    /// Index of the flip among the bifurcations of the branch.
    pub(super) event: usize,
}

impl BranchJournal for DoubledRecords<'_> {
    fn recorded(&mut self) -> Vec<BranchRecord> {
        let of_flip = self.records.lines.iter().filter_map(|line| match line {
            Line::Doubled(event, record) if *event == self.event => Some(record.clone()),
            _ => None,
        });
        of_flip.collect()
    }

    fn record(&mut self, record: &BranchRecord) -> bool {
        self.records.keep(Line::Doubled(self.event, record.clone()))
    }
}

impl CurveJournal for Records {
    fn recorded(&mut self, side: usize) -> Vec<CurveRecord> {
        let present = self.curve;
        let of_side = self.lines.iter().filter_map(|line| match line {
            Line::Curve(curve, of, record) if (*curve, *of) == (present, side) => Some(record.clone()),
            _ => None,
        });
        of_side.collect()
    }

    fn record(&mut self, side: usize, record: &CurveRecord) -> Result<(), String> {
        if self.keep(Line::Curve(self.curve, side, record.clone())) {
            Ok(())
        } else {
            Err(self.failure.clone().unwrap_or_default())
        }
    }
}

/// Error for an unfinished file that is in the way of a new one.
fn unfinished(path: &Path, head: &Head) -> Error {
    let shown = path.display();
    let is_own = file::read_text(path)
        .map_err(Error::from)
        .and_then(|text| head_of(path, &text))
        .is_ok_and(|recorded| recorded.hash == head.hash);
    Error::input(if is_own {
        format!(
            "{shown}: the records of an interrupted run of this command; go on with --resume {shown}, or delete the file"
        )
    } else {
        format!(
            "{shown}: the records of an interrupted run of another command; delete or rename the file, or choose another --out"
        )
    })
}

/// Head of the text of a file of records.
fn head_of(path: &Path, text: &str) -> Result<Head, Error> {
    let first = text.lines().next().unwrap_or_default();
    let head: Option<Head> = serde_json::from_str(first).ok();
    head.filter(|head| head.quietcut == "bifurcation").ok_or_else(|| {
        Error::input(format!(
            "{}: line 1 is not the head of records of quietcut bifurcation; --resume needs the FILE.part.jsonl of an interrupted run",
            path.display()
        ))
    })
}

/// FNV-1a hash of 64 bits in hexadecimal digits. It tells commands apart; nobody is expected to forge one.
fn hash(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(case: &str, range: &str) -> Head {
        Head::new(case.as_bytes(), vec![("--range".into(), range.into())])
    }

    #[test]
    fn the_hash_is_that_of_its_definition() {
        // Test vectors of the authors of FNV.
        assert_eq!(hash(b""), "cbf29ce484222325");
        assert_eq!(hash(b"foobar"), "85944171f73967e8");
    }

    #[test]
    fn another_case_or_option_is_named() {
        let own = head("case", "0:12");
        let said = own.difference(&head("case", "0:14"));
        assert_eq!(said, "--range was 0:14 there and is 0:12 here");
        assert!(own.difference(&head("other", "0:12")).contains("case file"));
        assert_ne!(own.hash, head("case", "0:14").hash);
        assert_eq!(own, head("case", "0:12"));
    }

    #[test]
    fn an_incomplete_line_is_dropped_and_a_wrong_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.part.jsonl");
        let own = head("case", "0:12");
        drop(Records::beside(&folder.path().join("a.svg"), &own).unwrap());
        let whole = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, format!("{whole}{{\"branch\":{{\"or")).unwrap();
        let records = Records::resumed(&path, &own).unwrap();
        assert!(records.lines.is_empty());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), whole);
        let last = records.finish().unwrap().unwrap();
        assert_eq!(last, folder.path().join("a.jsonl"));
        std::fs::write(&path, format!("{whole}{{}}\n")).unwrap();
        let said = Records::resumed(&path, &own).unwrap_err().to_string();
        assert!(said.contains("line 2"), "{said}");
        let said = Records::beside(&folder.path().join("a.svg"), &own).unwrap_err();
        assert!(said.to_string().contains("--resume"), "{said}");
    }
}
