//! Trial cuts with observed outcomes, and how often a method predicts them correctly.

use rayon::prelude::*;
use serde::Serialize;

use crate::error::StabilityError;
use crate::limits::method::Method;
use crate::limits::speed_line::SpeedLine;

pub use quietcut_recording::cut_table::{Outcome, TrialCut, read};

/// Number of equal steps in axial depth from 0 to the deepest trial cut at a speed, as [`Method::line`] takes it. A
/// choice: half more than the least number of a chart, 40.
const SAMPLES: usize = 60;

/// Numbers of trial cuts whose outcome a stability method predicts wrongly, and of those that decide nothing about the
/// method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Calls {
    /// Number of trial cuts.
    pub cuts: usize,
    /// Number of trial cuts with a wrong prediction: `missed_chatter` plus `false_alarms`.
    pub wrong: usize,
    /// Number of trial cuts that were predicted stable and chattered.
    pub missed_chatter: usize,
    /// Number of trial cuts that were predicted unstable and were stable.
    pub false_alarms: usize,
    /// Number of trial cuts with marginal outcome, or at depths where two stable orbits exist; they do not count as
    /// wrong.
    pub undecided: usize,
}

/// Names of the columns in the first line of the [`text`] of trial cuts.
const HEADER: [&str; 3] = ["rpm [rev/min]", "depth [mm]", "outcome"];

/// Text of a CSV file of trial cuts, without chatter frequencies; [`read`] reads it.
pub fn text(cuts: &[TrialCut]) -> String {
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
    /// Counts of a stability method's predictions, computed at the spindle speed of each trial cut, against the
    /// observed outcomes.
    ///
    /// # Errors
    /// As [`Method::line`].
    pub fn new<M: Method + ?Sized>(method: &M, cuts: &[TrialCut]) -> Result<Self, StabilityError> {
        Ok(Self::of(&calls(method, cuts)?))
    }

    /// Counts wrong predictions and undecided cuts over the results of single trial cuts.
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

/// Result of comparing the prediction for one trial cut with its observed outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// Prediction and outcome agree.
    Right,
    /// The trial cut was predicted stable, and chattered.
    MissedChatter,
    /// The trial cut was predicted unstable, and was stable.
    FalseAlarm,
    /// The outcome of the cut is marginal, or two stable orbits exist at its depth.
    Undecided,
}

impl Call {
    /// True if the outcome of the cut contradicts the prediction.
    pub fn is_wrong(self) -> bool {
        matches!(self, Self::MissedChatter | Self::FalseAlarm)
    }
}

/// Compares the predictions of a stability method with the outcomes of trial cuts, each at its own spindle speed; one
/// result for each cut, in the order of the cuts.
///
/// # Errors
/// As [`Method::line`].
pub fn calls<M: Method + ?Sized>(method: &M, cuts: &[TrialCut]) -> Result<Vec<Call>, StabilityError> {
    let mut speeds_rpm: Vec<f64> = cuts.iter().map(|cut| cut.rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    // At each speed limits are computed only to the depth of its deepest trial cut: at low speeds computing time grows
    // with the depth.
    let deepest_mm = |rpm: f64| {
        let depths = cuts.iter().filter(|cut| cut.rpm == rpm).map(|cut| cut.depth_mm);
        depths.fold(0.0, f64::max)
    };
    let lines: Vec<Result<SpeedLine, StabilityError>> = speeds_rpm
        .par_iter()
        .map(|&rpm| method.line(rpm, deepest_mm(rpm), SAMPLES))
        .collect();
    let lines = lines.into_iter().collect::<Result<Vec<_>, _>>()?;
    Ok(cuts.iter().map(|cut| call(&lines, cut)).collect())
}

/// Compares the prediction for one trial cut with its outcome. One of the `lines` must have the spindle speed of the
/// cut and reach its depth; otherwise the cut counts as predicted unstable.
pub fn call(lines: &[SpeedLine], cut: &TrialCut) -> Call {
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
    fn written_trial_cuts_are_read_again_and_compared() {
        // Chapter 7: the limit is 3.174 mm at 600 rev/min.
        let cut = |depth_mm, outcome| TrialCut {
            rpm: 600.0,
            depth_mm,
            outcome,
            chatter_hz: None,
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
    fn errors_in_a_table_of_trial_cuts_name_the_line() {
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
