//! Tables of trial cuts: CSV with spindle speed, axial depth, outcome, and the chatter frequency of cuts where it was
//! measured.
//!
//! Two heads are usual: `rpm [rev/min],depth [mm],outcome` and `rpm,depth_mm,chatter_hz,verdict`. Columns may stand in
//! any order and mix both heads. Lines that start with `#` are remarks.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::file::{FileError, read_text};

/// Observed outcome of a trial cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The vibration decayed.
    Stable,
    /// Chatter: the vibration of the trial cut grew, or stayed large.
    Chatter,
    /// Marginal: the outcome of the trial cut is neither clearly stable nor clearly chatter.
    Marginal,
}

/// Trial cut: spindle speed, axial depth, observed outcome, and the chatter frequency if it was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TrialCut {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Observed outcome.
    pub outcome: Outcome,
    /// Measured chatter frequency of the trial cut, Hz; `None` if the outcome is not chatter, or if it was not
    /// measured. JSON output never contains this field.
    #[serde(skip)]
    pub chatter_hz: Option<f64>,
}

/// Reason why a table of trial cuts cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CutTableError {
    /// The file of the table of cuts does not exist, cannot be read or is no UTF-8 text.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line is wrong.
    #[error(
        "{}, line {line}: {what}; the columns rpm [rev/min], depth [mm] and outcome, or rpm, depth_mm, chatter_hz and verdict, are read",
        path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of the first wrong line, from 1.
        line: u64,
        /// Fault in this line; if several rows are wrong, also the faults in the next ones, up to five in all.
        what: String,
    },
}

/// Words for the outcome of a trial cut in a table of cuts. `unstable` and a kind of stability loss (`hopf`,
/// `period-doubling`) also mean chatter.
const OUTCOMES: [(&str, Outcome); 6] = [
    ("stable", Outcome::Stable),
    ("chatter", Outcome::Chatter),
    ("unstable", Outcome::Chatter),
    ("hopf", Outcome::Chatter),
    ("period-doubling", Outcome::Chatter),
    ("marginal", Outcome::Marginal),
];

/// Titles of the columns of a table of cuts, two for each: spindle speed, axial depth, outcome, chatter frequency.
const TITLES: [[&str; 2]; 4] = [
    ["rpm [rev/min]", "rpm"],
    ["depth [mm]", "depth_mm"],
    ["outcome", "verdict"],
    ["chatter [Hz]", "chatter_hz"],
];

/// Largest number of wrong rows that a message names. A choice: more fill a terminal.
const FAULTS_NAMED: usize = 5;

/// Reads a table of trial cuts; a table without rows gives an empty list.
///
/// # Errors
/// The file cannot be read, lacks the column of speed, depth or outcome, has a column twice or an unknown one; a row
/// has more or fewer values than there are columns; a speed, depth or frequency is no positive finite number; or an
/// outcome is an unknown word.
pub fn read(path: &Path) -> Result<Vec<TrialCut>, CutTableError> {
    parse(path, &read_text(path)?)
}

/// Reads the text of a table of trial cuts; `path` names the file in error messages.
///
/// # Errors
/// The errors of [`read`], except that the file cannot be read.
pub fn parse(path: &Path, text: &str) -> Result<Vec<TrialCut>, CutTableError> {
    let wrong = |line: u64, what: String| CutTableError::Line {
        path: path.into(),
        line: line.max(1),
        what,
    };
    let text = text.trim_start_matches('\u{feff}');
    let line_of = |row: &csv::StringRecord| row.position().map_or(1, |position| line_of(text, position));
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .flexible(true)
        .from_reader(text.as_bytes());
    let head = reader
        .headers()
        .map_err(|error| wrong(error.position().map_or(1, csv::Position::line), error.to_string()))?
        .clone();
    let places = Places::new(&head).map_err(|what| wrong(line_of(&head), what))?;
    let mut cuts = Vec::new();
    // All wrong rows are collected for one message: a user mends them in one go.
    let mut faults: Vec<(u64, String)> = Vec::new();
    for row in reader.into_records() {
        let row =
            row.map_err(|error| wrong(error.position().map_or(1, csv::Position::line), error.to_string()))?;
        match places.cut(&head, &row) {
            Ok(cut) => cuts.push(cut),
            Err(what) => faults.push((line_of(&row), what)),
        }
    }
    let Some((line, first)) = faults.first() else {
        return Ok(cuts);
    };
    let others: String = faults[1..]
        .iter()
        .take(FAULTS_NAMED - 1)
        .map(|(line, what)| format!("; line {line}: {what}"))
        .collect();
    let more = faults.len().saturating_sub(FAULTS_NAMED);
    let more = if more > 0 {
        format!("; and {more} more lines")
    } else {
        String::new()
    };
    Err(wrong(*line, format!("{first}{others}{more}")))
}

/// Number of the line in the file, from 1, that holds a row of a table of cuts. The position that the CSV parser gives
/// is before the remarks and empty lines ahead of the row, so these are counted.
fn line_of(text: &str, position: &csv::Position) -> u64 {
    let at = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = text.get(at..).unwrap_or_default();
    let passed = rest
        .lines()
        .take_while(|line| line.trim().is_empty() || line.starts_with('#'));
    position.line() + passed.count() as u64
}

/// Where the columns stand.
struct Places {
    rpm: usize,
    depth_mm: usize,
    outcome: usize,
    chatter_hz: Option<usize>,
}

impl Places {
    fn new(head: &csv::StringRecord) -> Result<Self, String> {
        let places = TITLES.map(|titles| head.iter().position(|title| titles.contains(&title)));
        let known = |title: &&str| TITLES.iter().flatten().any(|known| known == title);
        if let Some(stranger) = head.iter().find(|title| !known(title)) {
            return Err(format!("\"{stranger}\" is no column of a table of cuts"));
        }
        let [Some(rpm), Some(depth_mm), Some(outcome), chatter_hz] = places else {
            let missing = TITLES.iter().zip(places).find(|(_, place)| place.is_none());
            let [title, other] = missing.map_or(["", ""], |(titles, _)| *titles);
            return Err(format!("there is no column \"{title}\" or \"{other}\""));
        };
        if head.len() != places.iter().flatten().count() {
            return Err("a column is there twice".into());
        }
        Ok(Self {
            rpm,
            depth_mm,
            outcome,
            chatter_hz,
        })
    }

    fn cut(&self, head: &csv::StringRecord, row: &csv::StringRecord) -> Result<TrialCut, String> {
        if row.len() != head.len() {
            return Err(format!(
                "{} values, but the header has {} columns",
                row.len(),
                head.len()
            ));
        }
        let positive = |column: usize| match row[column].parse::<f64>() {
            Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
            _ => Err(format!(
                "{} = {}: a number above 0 is needed",
                &head[column], &row[column]
            )),
        };
        let word = &row[self.outcome];
        let Some((_, outcome)) = OUTCOMES.iter().find(|(known, _)| *known == word) else {
            return Err(format!(
                "{} \"{word}\": one of {} is needed",
                &head[self.outcome],
                OUTCOMES.map(|(word, _)| word).join(", ")
            ));
        };
        let measured = self.chatter_hz.filter(|&column| !row[column].is_empty());
        let chatter_hz = measured.map(positive).transpose()?;
        Ok(TrialCut {
            rpm: positive(self.rpm)?,
            depth_mm: positive(self.depth_mm)?,
            outcome: *outcome,
            chatter_hz: chatter_hz.filter(|_| *outcome == Outcome::Chatter),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<TrialCut>, String> {
        parse(Path::new("cuts.csv"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn both_heads_say_the_same() {
        let cut = |depth_mm, outcome, chatter_hz| TrialCut {
            rpm: 900.0,
            depth_mm,
            outcome,
            chatter_hz,
        };
        assert_eq!(
            read(
                "rpm,depth_mm,chatter_hz,verdict\n900, 1.5,,stable\n# louder\n900,1.7,17.4,hopf\n900,1.6,17,marginal\n"
            ),
            Ok(vec![
                cut(1.5, Outcome::Stable, None),
                cut(1.7, Outcome::Chatter, Some(17.4)),
                cut(1.6, Outcome::Marginal, None),
            ])
        );
        assert_eq!(
            read("\u{feff}rpm [rev/min], depth [mm], outcome\n900,1.5,stable\n\n900,1.7,chatter\n"),
            Ok(vec![
                cut(1.5, Outcome::Stable, None),
                cut(1.7, Outcome::Chatter, None)
            ])
        );
        assert_eq!(
            read("verdict,rpm,depth [mm],chatter_hz\nhopf,900,1.7,17.4\n"),
            Ok(vec![cut(1.7, Outcome::Chatter, Some(17.4))])
        );
        assert_eq!(read("rpm,depth_mm,chatter_hz,verdict\n"), Ok(Vec::new()));
    }

    #[test]
    fn what_is_wrong_is_named_with_line_and_value() {
        let head = "rpm,depth_mm,chatter_hz,verdict\n";
        for (text, words) in [
            (String::new(), "line 1: there is no column \"rpm [rev/min]\""),
            ("rpm,depth,outcome\n".into(), "line 1: \"depth\" is no column"),
            (
                "rpm,rpm [rev/min],depth_mm,verdict\n".into(),
                "line 1: a column is there twice",
            ),
            (
                format!("{head}900,1.5,,quiet\n"),
                "line 2: verdict \"quiet\": one of stable, chatter",
            ),
            (
                format!("{head}900,1.5,,stable\n900,-1,,stable\n"),
                "line 3: depth_mm = -1",
            ),
            (
                format!("{head}# remark\n\n900,nan,,stable\n"),
                "line 4: depth_mm = nan",
            ),
            (format!("{head}900,2,low,hopf\n"), "line 2: chatter_hz = low"),
            (format!("{head}900,2\n"), "line 2: 2 values"),
            (
                format!("{head}900,2,,loud\n900,2,,stable\n900,2,,ok\n"),
                "marginal is needed; line 4: verdict \"ok\"",
            ),
            (
                "rpm,depth_mm,verdict\r\n900,1,stable\r\n900,-1,stable\r\n".into(),
                "line 3: depth_mm = -1",
            ),
        ] {
            let said = read(&text).unwrap_err();
            assert!(
                said.contains("cuts.csv") && said.contains(words),
                "{words}: {said}"
            );
        }
    }
}
