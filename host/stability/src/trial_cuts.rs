//! Cuts that were tried, and how often a chart calls them right.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::StabilityError;
use crate::limits::method::Method;
use crate::limits::speed_line::SpeedLine;
use quietcut_recording::file::{FileError, read_text};

/// Steps in depth at which multipliers are followed.
const SAMPLES: usize = 60;

/// What came of a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// Vibrations died away.
    Stable,
    /// They grew, or stayed large.
    Chatter,
    /// It could not be told.
    Marginal,
}

/// A cut that was tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TestCut {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// What came of it.
    pub outcome: Outcome,
}

/// How a method calls cuts that were tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Calls {
    /// Cuts in all.
    pub cuts: usize,
    /// Cuts that were called wrong: the two below.
    pub wrong: usize,
    /// Called stable, and chattered.
    pub missed_chatter: usize,
    /// Called unstable, and were stable.
    pub false_alarms: usize,
    /// Cuts that could not be told, or at depths where two stable orbits exist: they are not counted as wrong.
    pub undecided: usize,
}

/// Why a file of cuts cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TestCutsError {
    /// The file.
    #[error(transparent)]
    File(#[from] FileError),
    /// Something in it.
    #[error(
        "{}, line {line}: {found}; `rpm [rev/min],depth [mm],outcome` is needed with outcomes stable, chatter and marginal",
        path.display()
    )]
    Wrong {
        /// The file.
        path: PathBuf,
        /// Where, from 1.
        line: usize,
        /// What stands there.
        found: String,
    },
}

/// The columns of a file of cuts.
const HEADER: [&str; 3] = ["rpm [rev/min]", "depth [mm]", "outcome"];

/// Cuts from a CSV file: `rpm [rev/min],depth [mm],outcome`.
///
/// # Errors
/// The file cannot be read, has other columns, or a speed, depth or outcome that cannot be.
pub fn read(path: &Path) -> Result<Vec<TestCut>, TestCutsError> {
    let text = read_text(path)?;
    let wrong = |line: usize, found: String| TestCutsError::Wrong {
        path: path.into(),
        line,
        found,
    };
    let mut lines = text.lines().enumerate();
    match lines.next() {
        Some((_, header)) if header.split(',').map(str::trim).eq(HEADER) => {}
        header => return Err(wrong(1, format!("`{}`", header.map_or("", |(_, line)| line)))),
    }
    lines
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(index, line)| cut(line).ok_or_else(|| wrong(index + 1, format!("`{line}`"))))
        .collect()
}

fn cut(line: &str) -> Option<TestCut> {
    let [rpm, depth_mm, outcome] = line.split(',').map(str::trim).collect::<Vec<_>>()[..] else {
        return None;
    };
    let positive = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    Some(TestCut {
        rpm: positive(rpm)?,
        depth_mm: positive(depth_mm)?,
        outcome: match outcome {
            "stable" => Outcome::Stable,
            "chatter" => Outcome::Chatter,
            "marginal" => Outcome::Marginal,
            _ => return None,
        },
    })
}

/// The text of a file of cuts.
pub fn text(cuts: &[TestCut]) -> String {
    let lines = cuts.iter().map(|cut| {
        let outcome = match cut.outcome {
            Outcome::Stable => "stable",
            Outcome::Chatter => "chatter",
            Outcome::Marginal => "marginal",
        };
        format!("{},{},{outcome}\n", cut.rpm, cut.depth_mm)
    });
    std::iter::once(format!("{}\n", HEADER.join(",")))
        .chain(lines)
        .collect()
}

impl Calls {
    /// What the limits by a method say of these cuts, each at its own speed.
    ///
    /// # Errors
    /// Those of [`Method::lines`].
    pub fn new<M: Method + ?Sized>(method: &M, cuts: &[TestCut]) -> Result<Self, StabilityError> {
        Ok(Self::of(&calls(method, cuts)?))
    }

    /// The sum of what was said of each cut.
    pub fn of(calls: &[Call]) -> Self {
        let count = |call: Call| calls.iter().filter(|other| **other == call).count();
        let (missed_chatter, false_alarms) = (count(Call::MissedChatter), count(Call::FalseAlarm));
        Self {
            cuts: calls.len(),
            wrong: missed_chatter + false_alarms,
            missed_chatter,
            false_alarms,
            undecided: count(Call::Undecided),
        }
    }
}

/// What a method says of one cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// What came of it.
    Right,
    /// Stable, and it chattered.
    MissedChatter,
    /// Unstable, and it was stable.
    FalseAlarm,
    /// It could not be told, or two stable orbits exist at its depth.
    Undecided,
}

impl Call {
    /// True where what came of the cut is the opposite.
    pub fn is_wrong(self) -> bool {
        matches!(self, Self::MissedChatter | Self::FalseAlarm)
    }
}

/// What the limits by a method say of cuts, in their order, each at its own speed.
///
/// # Errors
/// Those of [`Method::lines`].
pub fn calls<M: Method + ?Sized>(method: &M, cuts: &[TestCut]) -> Result<Vec<Call>, StabilityError> {
    let mut speeds_rpm: Vec<f64> = cuts.iter().map(|cut| cut.rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let deepest_mm = cuts.iter().map(|cut| cut.depth_mm).fold(0.0, f64::max);
    let lines = method.lines(&speeds_rpm, deepest_mm, SAMPLES)?;
    Ok(cuts.iter().map(|cut| call(&lines, cut)).collect())
}

/// What lines say of a cut, of which one must be at its speed and go as deep.
pub fn call(lines: &[SpeedLine], cut: &TestCut) -> Call {
    let line = lines.iter().find(|line| line.rpm == cut.rpm);
    let within = |of: fn(&SpeedLine) -> &Vec<[f64; 2]>| {
        let mut intervals = line.into_iter().flat_map(of);
        intervals.any(|&[from, to]| from <= cut.depth_mm && cut.depth_mm <= to)
    };
    match (cut.outcome, within(|line| &line.stable_mm)) {
        _ if within(|line| &line.bistable_mm) => Call::Undecided,
        (Outcome::Marginal, _) => Call::Undecided,
        (Outcome::Chatter, true) => Call::MissedChatter,
        (Outcome::Stable, false) => Call::FalseAlarm,
        (Outcome::Stable, true) | (Outcome::Chatter, false) => Call::Right,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::collocation::Collocation;
    use crate::problem::linear::{CubicTerms, Problem};
    use quietcut_testkit::case;

    #[test]
    fn what_is_written_is_read_again_and_called() {
        // Chapter 7: the limit is 3.174 mm at 600 rev/min.
        let cut = |depth_mm, outcome| TestCut {
            rpm: 600.0,
            depth_mm,
            outcome,
        };
        let cuts = [
            cut(2.5, Outcome::Stable),
            cut(3.0, Outcome::Chatter),
            cut(3.3, Outcome::Stable),
            cut(3.4, Outcome::Marginal),
            cut(4.0, Outcome::Chatter),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cuts.csv");
        quietcut_recording::file::write(&path, text(&cuts).as_bytes()).unwrap();
        assert_eq!(read(&path).unwrap(), cuts);
        let problem = Problem::new(&case("kuka-kr90-acetal"), CubicTerms::Refuse).unwrap();
        let calls = Calls::new(&Collocation { problem }, &cuts).unwrap();
        let expected = Calls {
            cuts: 5,
            wrong: 2,
            missed_chatter: 1,
            false_alarms: 1,
            undecided: 1,
        };
        assert_eq!(calls, expected);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cuts.csv");
        let header = "rpm [rev/min],depth [mm],outcome\n";
        for (text, line) in [
            ("rpm,depth,outcome\n", 1),
            ("", 1),
            (&format!("{header}600,2,stable\n600,2,loud\n"), 3),
            (&format!("{header}600,-2,stable\n"), 2),
            (&format!("{header}600,2\n"), 2),
        ] {
            quietcut_recording::file::write(&path, text.as_bytes()).unwrap();
            let said = read(&path).unwrap_err().to_string();
            assert!(said.contains(&format!("line {line}:")), "{said}");
        }
    }
}
