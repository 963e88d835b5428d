//! The written case diagnosed once more on the records that it was found with.

use std::fmt;
use std::path::Path;

use quietcut::case::Case;
use quietcut::diagnose::answer::Outcome;
use quietcut::diagnose::{Options, diagnose};

use crate::puzzle::Puzzle;

/// What a diagnosis said of the case that it wrote, and what the diagnosis of this case says.
pub(crate) struct WrittenCase {
    label: String,
    /// Prediction errors on held-out segments and on whole records: promised, and kept.
    promised: [f64; 2],
    kept: [f64; 2],
    /// Causes that the written case is said to lack.
    pub(crate) further: Vec<&'static str>,
}

impl WrittenCase {
    /// `None` if the diagnosis of the puzzle writes no case.
    pub(crate) fn of(puzzle: &Puzzle) -> Option<Self> {
        let options = Options { seed: puzzle.seed };
        let first = diagnose(&puzzle.case, &puzzle.recordings, &options).ok()?;
        let text = first.extended_case(&puzzle.case_text)?;
        let written = Case::parse(Path::new("extended.toml"), &text).unwrap();
        let again = diagnose(&written, &puzzle.recordings, &options).unwrap();
        let promised = first.extended.unwrap();
        Some(Self {
            label: format!("{} {}: {:?}", puzzle.family.name(), puzzle.seed, first.names()),
            promised: [promised.nrmse_heldout, promised.nrmse_whole],
            kept: [again.baseline.nrmse_heldout, again.baseline.nrmse_whole],
            further: match again.outcome {
                Outcome::Cause | Outcome::Confounded => again.names(),
                _ => Vec::new(),
            },
        })
    }

    /// Largest relative difference between what was promised and what is kept.
    pub(crate) fn broken(&self) -> f64 {
        let pairs = self.promised.iter().zip(&self.kept);
        pairs
            .map(|(promised, kept)| (kept / promised - 1.0).abs())
            .fold(0.0, f64::max)
    }
}

impl fmt::Display for WrittenCase {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "{}; promised {:.6} and {:.6}, kept {:.6} and {:.6}, further causes {:?}",
            self.label, self.promised[0], self.promised[1], self.kept[0], self.kept[1], self.further
        )
    }
}
