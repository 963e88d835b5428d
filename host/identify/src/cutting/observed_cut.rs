//! Trial cuts with their verdict: a table `rpm,depth_mm,chatter_hz,verdict`.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use quietcut_recording::file::{self, FileError};

/// A trial cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservedCut {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Whether it chattered.
    pub chatters: bool,
    /// The chatter frequency, Hz; `None` for a stable cut or if it was not measured.
    pub chatter_hz: Option<f64>,
}

/// Why a table of cuts cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CutTableError {
    /// The file is not there or cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line is wrong.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What was found, and what would be right.
        what: String,
    },
    /// There are no cuts.
    #[error(
        "{}: there are no cuts; a header rpm,depth_mm,chatter_hz,verdict and a row for each cut are needed",
        path.display()
    )]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    rpm: f64,
    depth_mm: f64,
    chatter_hz: Option<f64>,
    verdict: String,
}

/// Verdicts that say that a cut chattered.
const CHATTER: [&str; 4] = ["chatter", "unstable", "hopf", "period-doubling"];

/// Reads a table of cuts. `verdict` is `stable`, or `chatter`, `hopf`, `period-doubling`; `chatter_hz` may be empty.
///
/// # Errors
/// See [`CutTableError`].
pub fn read(path: &Path) -> Result<Vec<ObservedCut>, CutTableError> {
    parse(path, &file::read_text(path)?)
}

fn parse(path: &Path, text: &str) -> Result<Vec<ObservedCut>, CutTableError> {
    let wrong = |line: u64, what: String| CutTableError::Line {
        path: path.into(),
        line,
        what,
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let mut cuts = Vec::new();
    for row in reader.deserialize::<Row>() {
        let row = row.map_err(|error| {
            let line = error.position().map_or(1, csv::Position::line);
            wrong(
                line,
                format!("{error}; rpm,depth_mm,chatter_hz,verdict are needed"),
            )
        })?;
        let line = 2 + cuts.len() as u64;
        let positive = |key: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(value)
            } else {
                Err(wrong(
                    line,
                    format!("{key} = {value}: a number above 0 is needed"),
                ))
            }
        };
        let chatters = CHATTER.contains(&row.verdict.as_str());
        if !chatters && row.verdict != "stable" {
            let what = format!(
                "verdict \"{}\": stable or one of {} is needed",
                row.verdict,
                CHATTER.join(", ")
            );
            return Err(wrong(line, what));
        }
        let chatter_hz = row.chatter_hz.map(|hz| positive("chatter_hz", hz)).transpose()?;
        cuts.push(ObservedCut {
            rpm: positive("rpm", row.rpm)?,
            depth_mm: positive("depth_mm", row.depth_mm)?,
            chatters,
            chatter_hz: chatter_hz.filter(|_| chatters),
        });
    }
    if cuts.is_empty() {
        return Err(CutTableError::Empty { path: path.into() });
    }
    Ok(cuts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_and_a_wrong_one_is_refused_with_its_line() {
        let read = |text: &str| parse(Path::new("cuts.csv"), text);
        let header = "rpm,depth_mm,chatter_hz,verdict\n";
        let cuts = read(&format!("{header}900, 1.5,,stable\n900,1.7,17.4,hopf\n")).unwrap();
        assert_eq!((cuts[0].chatters, cuts[0].chatter_hz), (false, None));
        assert_eq!((cuts[1].chatters, cuts[1].chatter_hz), (true, Some(17.4)));
        for (rows, said) in [
            ("900,1.5,,quiet\n", "line 2: verdict \"quiet\""),
            ("900,1.5,,stable\n900,-1,,stable\n", "line 3: depth_mm = -1"),
            ("900,deep,,stable\n", "line 2"),
            ("", "there are no cuts"),
        ] {
            let error = read(&format!("{header}{rows}")).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
