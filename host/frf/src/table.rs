//! A table of frequency response functions: receptances between the directions x, y and z over frequency.

use std::path::{Path, PathBuf};

use nalgebra::Matrix3;
use num_complex::Complex64;

use super::FrfError;
use super::criteria::UNRELATED;
use quietcut_model::structure::Direction;

/// One receptance H_ij(f): displacement in direction i per force in direction j, m/N.
#[derive(Clone, Debug, PartialEq)]
pub struct Frf {
    /// Direction of the displacement: x, y or z.
    pub response: Direction,
    /// Direction of the force: x, y or z.
    pub force: Direction,
    /// Receptance at each line of the table, m/N; sign convention e^{+iωt}.
    pub receptance: Vec<Complex64>,
    /// Coherence γ² at each line of the table, from 0 to 1; `None` if it is not known.
    pub coherence: Option<Vec<f64>>,
    /// Estimate of the largest relative error |ΔH|/|H| at each line by aliasing, content above half the sample rate that
    /// folds into the record; `None` if it is not known, or negligible.
    pub folding: Option<Vec<f64>>,
}

/// Table of receptances at common frequencies.
///
/// Frequencies ascend and are not negative. The table has at least one frequency line and one receptance, and no
/// receptance twice.
#[derive(Clone, Debug, PartialEq)]
pub struct FrfTable {
    path: PathBuf,
    frequency_hz: Vec<f64>,
    entries: Vec<Frf>,
}

impl Frf {
    /// Name of the receptance from its directions, as in a column header: `xy` is displacement in x due to force in y.
    pub fn name(&self) -> String {
        format!("{}{}", self.response, self.force)
    }

    /// Index of the line with the largest |H|; 0 without any line. Where the coherence is known, only lines with a
    /// coherence of at least 0.5 count, if there are any: divided by ω², the noise of an accelerometer may be larger at
    /// the first lines than a resonance.
    pub fn peak_line(&self) -> usize {
        let largest = |of: &dyn Fn(usize) -> bool| {
            (0..self.receptance.len())
                .filter(|line| of(*line))
                .max_by(|&a, &b| self.receptance[a].norm().total_cmp(&self.receptance[b].norm()))
        };
        largest(&|line| self.is_related(line))
            .or_else(|| largest(&|_| true))
            .unwrap_or(0)
    }

    /// True if the coherence at a line is at least [`UNRELATED`], or is not known.
    pub(crate) fn is_related(&self, line: usize) -> bool {
        let coherence = self.coherence.as_ref().and_then(|coherence| coherence.get(line));
        coherence.is_none_or(|coherence| *coherence >= UNRELATED)
    }
}

impl FrfTable {
    /// Creates a table from frequencies and receptances; `path` is its file or a name for its origin, used in messages.
    ///
    /// # Errors
    /// There is no frequency or no receptance; frequencies are negative, not finite or do not ascend; a receptance is
    /// not finite, has another length than the frequencies, is of a rotation or is given twice; a coherence has another
    /// length or lies outside 0 to 1; an error by aliasing has another length or is negative.
    pub fn new(path: &Path, frequency_hz: Vec<f64>, entries: Vec<Frf>) -> Result<Self, FrfError> {
        let table = Self {
            path: path.into(),
            frequency_hz,
            entries,
        };
        match table.fault() {
            None => Ok(table),
            Some(what) => Err(FrfError::Content {
                path: path.into(),
                what,
            }),
        }
    }

    /// Description of the first fault in the values of the table; `None` for a valid table.
    fn fault(&self) -> Option<String> {
        if self.frequency_hz.is_empty() || self.entries.is_empty() {
            return Some(
                "there is nothing in it; at least one frequency and one receptance are needed".into(),
            );
        }
        if !self.frequency_hz.iter().all(|f| f.is_finite() && *f >= 0.0) {
            return Some("a frequency is negative or no number; 0 Hz or more is needed".into());
        }
        if let Some(pair) = self.frequency_hz.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Some(format!(
                "{} Hz comes after {} Hz; frequencies must ascend",
                pair[1], pair[0]
            ));
        }
        for (index, entry) in self.entries.iter().enumerate() {
            let name = entry.name();
            if entry.response.axis().is_none() || entry.force.axis().is_none() {
                return Some(format!(
                    "h{name} has a rotation; directions x, y and z are needed"
                ));
            }
            if self.entries[..index].iter().any(|other| other.name() == name) {
                return Some(format!("h{name} is given twice"));
            }
            let lines = self.frequency_hz.len();
            let coherence = entry.coherence.as_deref().unwrap_or_default();
            let folding = entry.folding.as_deref().unwrap_or_default();
            let is_whole = (entry.coherence.is_none() || coherence.len() == lines)
                && (entry.folding.is_none() || folding.len() == lines);
            if entry.receptance.len() != lines || !is_whole {
                return Some(format!(
                    "h{name} does not have one value for each of {lines} frequencies"
                ));
            }
            if let Some(line) = entry.receptance.iter().position(|h| !h.is_finite()) {
                return Some(format!(
                    "h{name} at {} Hz (line {} of {lines}) is {}, no finite number; leave that frequency out or measure it again",
                    self.frequency_hz[line],
                    line + 1,
                    entry.receptance[line]
                ));
            }
            if let Some(wrong) = folding
                .iter()
                .find(|share| !(share.is_finite() && **share >= 0.0))
            {
                return Some(format!(
                    "folding_{name} is {wrong}; a share of the receptance, 0 or more, is needed"
                ));
            }
            if let Some(wrong) = coherence.iter().find(|c| !(0.0..=1.0).contains(*c)) {
                return Some(format!(
                    "coherence_{name} is {wrong}; a number from 0 to 1 is needed"
                ));
            }
        }
        None
    }

    /// File that the table was read from, or the origin of its values; used in messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Frequencies of the lines of the table, Hz, ascending.
    pub fn frequency_hz(&self) -> &[f64] {
        &self.frequency_hz
    }

    /// The receptances of the table, in the order in which they were given.
    pub fn entries(&self) -> &[Frf] {
        &self.entries
    }

    /// Receptance of displacement in direction `response` due to force in direction `force`; `None` if the table lacks
    /// it.
    pub fn entry(&self, response: Direction, force: Direction) -> Option<&Frf> {
        self.entries
            .iter()
            .find(|entry| entry.response == response && entry.force == force)
    }

    /// Names (such as `xy`) of the receptances in x, y and z that the table lacks, in the order xx, xy, …, zz.
    pub fn missing(&self) -> Vec<String> {
        const AXES: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];
        AXES.iter()
            .flat_map(|&response| AXES.iter().map(move |&force| (response, force)))
            .filter(|&(response, force)| self.entry(response, force).is_none())
            .map(|(response, force)| format!("{response}{force}"))
            .collect()
    }

    /// Errors |ΔH| by aliasing at one line, m/N, rows displacement, columns force in x, y, z; 0 where none is stated.
    ///
    /// `None` beyond the last line.
    pub fn folding(&self, index: usize) -> Option<Matrix3<f64>> {
        let mut matrix = Matrix3::zeros();
        for entry in &self.entries {
            if let (Some(i), Some(j)) = (entry.response.axis(), entry.force.axis()) {
                let share = entry.folding.as_ref().and_then(|folding| folding.get(index));
                matrix[(i, j)] = share.copied().unwrap_or(0.0) * entry.receptance.get(index)?.norm();
            }
        }
        (index < self.frequency_hz.len()).then_some(matrix)
    }

    /// Receptance matrix H at one line, m/N, rows displacement, columns force in x, y, z; entries that the table lacks
    /// are zero.
    ///
    /// `None` beyond the last line.
    pub fn line(&self, index: usize) -> Option<Matrix3<Complex64>> {
        let mut matrix = Matrix3::zeros();
        for entry in &self.entries {
            if let (Some(i), Some(j)) = (entry.response.axis(), entry.force.axis()) {
                matrix[(i, j)] = *entry.receptance.get(index)?;
            }
        }
        (index < self.frequency_hz.len()).then_some(matrix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(response: Direction, force: Direction, values: &[f64]) -> Frf {
        Frf {
            response,
            force,
            receptance: values.iter().map(|&value| Complex64::from(value)).collect(),
            coherence: None,
            folding: None,
        }
    }

    #[test]
    fn the_peak_is_a_line_that_the_force_excites() {
        let value = |size: f64| Complex64::new(0.0, -size);
        let mut entry = Frf {
            response: Direction::X,
            force: Direction::X,
            receptance: vec![value(9.0), value(1.0), value(3.0), value(2.0)],
            coherence: Some(vec![0.2, 0.9, 0.98, 0.9]),
            folding: None,
        };
        assert_eq!(entry.peak_line(), 2);
        entry.coherence = Some(vec![0.2; 4]);
        assert_eq!(entry.peak_line(), 0);
        entry.coherence = None;
        assert_eq!(entry.peak_line(), 0);
    }

    #[test]
    fn missing_receptances_are_zero_and_named() {
        use Direction::{X, Y};
        let entries = vec![entry(X, X, &[1.0, 2.0]), entry(X, Y, &[3.0, 4.0])];
        let table = FrfTable::new(Path::new("a.csv"), vec![1.0, 2.0], entries).unwrap();
        assert_eq!(table.missing(), ["xz", "yx", "yy", "yz", "zx", "zy", "zz"]);
        let line = table.line(1).unwrap();
        assert_eq!(
            (line[(0, 0)].re, line[(0, 1)].re, line[(1, 0)].re),
            (2.0, 4.0, 0.0)
        );
        assert!(table.line(2).is_none());
    }

    #[test]
    fn invalid_tables_are_refused() {
        use Direction::{Rx, X};
        let refused = |frequencies: &[f64], entries: Vec<Frf>, said: &str| {
            let error = FrfTable::new(Path::new("a.csv"), frequencies.to_vec(), entries).unwrap_err();
            assert!(error.to_string().contains(said), "{error}");
        };
        let good = || entry(X, X, &[1.0, 2.0]);
        refused(&[], vec![good()], "nothing");
        refused(&[2.0, 1.0], vec![good()], "ascend");
        refused(&[-1.0, 1.0], vec![good()], "negative");
        refused(&[1.0, 2.0], vec![good(), good()], "twice");
        refused(&[1.0, 2.0, 3.0], vec![good()], "each of 3");
        refused(&[1.0, 2.0], vec![entry(Rx, X, &[1.0, 2.0])], "rotation");
        refused(&[1.0, 2.0], vec![entry(X, X, &[1.0, f64::NAN])], "finite");
        let incoherent = Frf {
            coherence: Some(vec![0.5, 1.5]),
            ..good()
        };
        refused(&[1.0, 2.0], vec![incoherent], "1.5");
    }
}
