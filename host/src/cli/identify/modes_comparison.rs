//! `quietcut identify --method modes --compare`: modes of two tests or cases, and their changes.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Error;
use super::figure::Figure;
use crate::identify::modes::{ComparedMode, ModePair, pairs};
use crate::report::digits::significant;

/// Modes before and after, in pairs.
#[derive(Debug, Serialize)]
pub(super) struct ModesComparison {
    before: PathBuf,
    modes: Vec<ModeChange>,
    /// True if a frequency or a damping ratio changes by more than its interval, or a mode comes or goes; `null` if no mode has intervals in both
    /// files, and none comes or goes.
    has_changed: Option<bool>,
}

/// A mode in both files, or in one of them.
#[derive(Debug, Serialize)]
struct ModeChange {
    frequency_hz: Change,
    damping_ratio: Change,
    /// Modal assurance criterion between both shapes; `null` with fewer than two common directions.
    mac: Option<f64>,
    /// True if a change excludes 0 in its 90 % interval, or if one file lacks the mode; `null` without intervals in both files.
    has_changed: Option<bool>,
}

/// A quantity before and after, `null` where the file lacks the mode, and the difference, `null` without intervals in both files.
#[derive(Debug, Serialize)]
struct Change {
    before: Option<Known>,
    after: Option<Known>,
    change: Option<Figure>,
}

/// A value with its 90 % interval, `null` if the file states none.
#[derive(Clone, Copy, Debug, Serialize)]
struct Known {
    value: f64,
    ci90: Option<[f64; 2]>,
    #[serde(skip)]
    std: Option<f64>,
}

impl Known {
    fn new(value: f64, std: Option<f64>) -> Self {
        Self {
            value,
            ci90: std.map(|std| Figure::new(value, std).ci90),
            std,
        }
    }
}

impl Change {
    fn new(before: Option<Known>, after: Option<Known>) -> Self {
        // The errors of the two tests are independent: their variances add.
        let change = before.zip(after).and_then(|(before, after)| {
            let std = before.std?.hypot(after.std?);
            Some(Figure::new(after.value - before.value, std))
        });
        Self {
            before,
            after,
            change,
        }
    }

    /// True if the interval of the change excludes 0, or if one file lacks the mode; `None` without an interval.
    fn exceeds(&self) -> Option<bool> {
        if self.before.is_none() || self.after.is_none() {
            return Some(true);
        }
        self.change
            .map(|change| change.ci90[0] > 0.0 || change.ci90[1] < 0.0)
    }

    fn text(&self, factor: f64, digits: usize, unit: &str) -> String {
        let of = |known: Option<Known>| {
            known.map_or("–".into(), |known| significant(factor * known.value, digits))
        };
        let change = self.change.map_or_else(String::new, |figure| {
            format!(
                " ({}{} ± {})",
                if figure.value < 0.0 { "−" } else { "+" },
                significant(factor * figure.value.abs(), 2),
                significant(factor * 0.5 * (figure.ci90[1] - figure.ci90[0]), 2)
            )
        });
        format!("{} → {} {unit}{change}", of(self.before), of(self.after))
    }
}

impl ModeChange {
    fn new(pair: ModePair, before: &[ComparedMode], after: &[ComparedMode]) -> Self {
        let change = |of: fn(&ComparedMode) -> Known| {
            Change::new(
                pair.before.map(|index| of(&before[index])),
                pair.after.map(|index| of(&after[index])),
            )
        };
        let frequency_hz = change(|mode| Known::new(mode.frequency_hz, mode.frequency_std_hz));
        let damping_ratio = change(|mode| Known::new(mode.damping_ratio, mode.damping_ratio_std));
        Self {
            has_changed: any([frequency_hz.exceeds(), damping_ratio.exceeds()].into_iter()),
            frequency_hz,
            damping_ratio,
            mac: pair.assurance,
        }
    }

    fn line(&self) -> String {
        let conclusion = match (
            self.frequency_hz.before,
            self.frequency_hz.after,
            self.has_changed,
        ) {
            (None, ..) => "only after",
            (_, None, _) => "only before",
            (.., Some(true)) => "changed by more than the 90 % intervals",
            (.., Some(false)) => "no change beyond the 90 % intervals",
            (.., None) => "without intervals in both files",
        };
        let mac = self.mac.map_or_else(String::new, |mac| format!(", MAC {mac:.2}"));
        format!(
            "mode {}; damping ratio {}{mac}: {conclusion}",
            self.frequency_hz.text(1.0, 6, "Hz"),
            self.damping_ratio.text(100.0, 4, "%"),
        )
    }
}

/// True if one is true, false if none is true and one is false, `None` if all are `None`.
fn any(known: impl Iterator<Item = Option<bool>>) -> Option<bool> {
    known
        .flatten()
        .fold(None, |any, next| Some(any.unwrap_or(false) || next))
}

impl ModesComparison {
    /// Pairs the modes of the file `path` with those of now.
    ///
    /// # Errors
    /// One of the two has no modes, or no direction is common to both.
    pub(super) fn new(path: &Path, before: &[ComparedMode], after: &[ComparedMode]) -> Result<Self, Error> {
        let has_common = before.iter().any(|old| {
            after.iter().any(|new| {
                let in_old = |axis| old.shape.iter().any(|(known, _)| known == axis);
                new.shape.iter().any(|(axis, _)| in_old(axis))
            })
        });
        if !has_common {
            return Err(Error::input(format!(
                "--compare {}: {} modes before and {} after have no direction in common; compare tests of the same directions",
                path.display(),
                before.len(),
                after.len()
            )));
        }
        let modes: Vec<ModeChange> = pairs(before, after)
            .into_iter()
            .map(|pair| ModeChange::new(pair, before, after))
            .collect();
        Ok(Self {
            before: path.into(),
            has_changed: any(modes.iter().map(|mode| mode.has_changed)),
            modes,
        })
    }

    /// Lines of the text output: one for each mode, and the conclusion.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!("changes since {}:", self.before.display())];
        lines.extend(self.modes.iter().map(ModeChange::line));
        lines.push(
            match self.has_changed {
                Some(true) => "The modes changed by more than the intervals of the tests: make a new chart.",
                Some(false) => "No mode changes by more than the intervals of the tests: the chart still holds as far as they tell.",
                None => "Without intervals in both files nothing tells a change from the errors of the tests.",
            }
            .into(),
        );
        lines
    }
}
