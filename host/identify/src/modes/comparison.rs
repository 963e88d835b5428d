//! Comparison of two sets of modes, such as those of two tests or of a test and a case.

use num_complex::Complex64;
use std::f64::consts::TAU;

use super::model::ModalModel;
use super::shape::assurance;
use crate::criteria::{SAME_MODE_FREQUENCY, SAME_MODE_SHAPE};
use quietcut_model::case::{Case, Parameter};
use quietcut_model::structure::{Direction, Form, StructureError};

/// A mode with the shape along which it moves, for a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedMode {
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the natural frequency, Hz; `None` if it is not stated.
    pub frequency_std_hz: Option<f64>,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Standard deviation of the damping ratio; `None` if it is not stated.
    pub damping_ratio_std: Option<f64>,
    /// Shape by direction: the right one, or of a test with more driven than measured directions the left one, which is the same of a
    /// reciprocal structure. Directions in which the shape is zero by statement are left out.
    pub shape: Vec<(Direction, Complex64)>,
}

/// A pair of modes of two sets with their modal assurance criterion, or a mode without a partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModePair {
    /// Index of the mode in the first set; `None` if only the second has it.
    pub before: Option<usize>,
    /// Index of the mode in the second set; `None` if only the first has it.
    pub after: Option<usize>,
    /// Modal assurance criterion over the common directions; `None` without a partner, and with fewer than two common directions, where it
    /// is 1 by construction.
    pub assurance: Option<f64>,
}

impl ComparedMode {
    /// The modes of an identified model.
    pub fn of_model(model: &ModalModel) -> Vec<Self> {
        let is_right = model.responses.len() >= model.forces.len();
        let directions = if is_right { &model.responses } else { &model.forces };
        let of = |found: &super::IdentifiedMode| {
            let shape = if is_right {
                &found.mode.right
            } else {
                &found.mode.left
            };
            Self {
                frequency_hz: found.mode.frequency_hz,
                frequency_std_hz: Some(found.frequency_std_hz),
                damping_ratio: found.mode.damping_ratio,
                damping_ratio_std: Some(found.damping_ratio_std),
                shape: measured(
                    !model.not_measured().is_empty(),
                    directions.iter().copied().zip(shape.iter().copied()),
                ),
            }
        };
        model.modes.iter().map(of).collect()
    }

    /// The oscillatory modes of the structure of a case; a pole that is repeated, as of a round tool, is one. The shape is the largest column of
    /// the residue matrix. Standard deviations are those that the case states of its modes.
    ///
    /// # Errors
    /// The structure has no first-order form.
    pub fn of_case(case: &Case) -> Result<Vec<Self>, StructureError> {
        let Some(structure) = &case.structure else {
            return Ok(Vec::new());
        };
        let first_order = structure.first_order()?;
        let axes = [Direction::X, Direction::Y, Direction::Z].into_iter();
        let axes: Vec<(usize, Direction)> = axes
            .enumerate()
            .filter(|(_, direction)| {
                matches!(structure.form, Form::Joints(_)) || structure.directions.contains(direction)
            })
            .collect();
        let parts = first_order.modal_parts();
        let modes = parts.iter().map(|part| {
            let residue = part.residue(&first_order);
            let column = (0..3)
                .max_by(|&a, &b| residue.column(a).norm().total_cmp(&residue.column(b).norm()))
                .unwrap_or_default();
            let (frequency_hz, damping_ratio) = (part.omega() / TAU, part.damping_ratio());
            let index = match &structure.form {
                Form::Modes(modes) => modes
                    .iter()
                    .position(|mode| (mode.pole() - part.pole).norm() < 1e-6 * part.omega()),
                _ => None,
            };
            let std = |parameter: fn(usize) -> Parameter| stated(case, parameter(index?));
            Self {
                frequency_hz,
                frequency_std_hz: std(Parameter::Frequency),
                damping_ratio,
                damping_ratio_std: std(Parameter::DampingRatio),
                shape: measured(
                    !case.zero_receptances.is_empty(),
                    axes.iter()
                        .map(|&(row, direction)| (direction, residue[(row, column)])),
                ),
            }
        });
        Ok(modes.collect())
    }

    /// Entries of both shapes in the common directions.
    fn common(&self, other: &Self) -> (Vec<Complex64>, Vec<Complex64>) {
        let common = self.shape.iter().filter_map(|(direction, a)| {
            let (_, b) = other.shape.iter().find(|(known, _)| known == direction)?;
            Some((*a, *b))
        });
        common.unzip()
    }
}

/// The entries of a shape, without those that are zero if some receptances are zero by statement.
fn measured(
    is_stated: bool,
    shape: impl Iterator<Item = (Direction, Complex64)>,
) -> Vec<(Direction, Complex64)> {
    let shape: Vec<(Direction, Complex64)> = shape.collect();
    let largest = shape.iter().map(|(_, entry)| entry.norm()).fold(0.0, f64::max);
    // Residues of a case come from projectors, whose zeros are rounded.
    let is_measured = |(_, entry): &(Direction, Complex64)| !is_stated || entry.norm() > 1e-9 * largest;
    shape.into_iter().filter(is_measured).collect()
}

/// Standard deviation that a case states of a parameter.
fn stated(case: &Case, parameter: Parameter) -> Option<f64> {
    let of_key = case.deviations.iter().find(|known| known.parameter == parameter);
    let of_covariance = || {
        let known = case.covariance.as_ref()?;
        let at = known.parameters.iter().position(|known| *known == parameter)?;
        Some(known.covariance[(at, at)].sqrt())
    };
    of_key
        .map(|known| known.std)
        .or_else(of_covariance)
        .filter(|std| *std > 0.0)
}

/// Pairs of modes of two sets with a common direction, in the order of frequency: those nearest in frequency whose
/// shapes agree, by a modal assurance criterion of 0.8 or more where two common directions define it, and whose
/// frequencies differ by less than a factor of 1.2. Modes without a partner stand alone.
pub fn pairs(before: &[ComparedMode], after: &[ComparedMode]) -> Vec<ModePair> {
    let mut possible: Vec<(f64, ModePair)> = Vec::new();
    for (i, old) in before.iter().enumerate() {
        for (j, new) in after.iter().enumerate() {
            let distance = (new.frequency_hz / old.frequency_hz).ln().abs();
            let (a, b) = old.common(new);
            let assurance = (a.len() > 1).then(|| assurance(&a, &b));
            let is_near = !a.is_empty() && distance < SAME_MODE_FREQUENCY.ln();
            if is_near && assurance.is_none_or(|mac| mac >= SAME_MODE_SHAPE) {
                let pair = ModePair {
                    before: Some(i),
                    after: Some(j),
                    assurance,
                };
                possible.push((distance, pair));
            }
        }
    }
    possible.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pairs: Vec<ModePair> = Vec::new();
    for (_, pair) in possible {
        let is_taken = |known: &ModePair| known.before == pair.before || known.after == pair.after;
        if !pairs.iter().any(is_taken) {
            pairs.push(pair);
        }
    }
    let alone = |before, after| ModePair {
        before,
        after,
        assurance: None,
    };
    for i in (0..before.len()).map(Some) {
        if !pairs.iter().any(|pair| pair.before == i) {
            pairs.push(alone(i, None));
        }
    }
    for j in (0..after.len()).map(Some) {
        if !pairs.iter().any(|pair| pair.after == j) {
            pairs.push(alone(None, j));
        }
    }
    let hertz = |pair: &ModePair| {
        let new = pair.after.map(|j| after[j].frequency_hz);
        new.or(pair.before.map(|i| before[i].frequency_hz))
            .unwrap_or_default()
    };
    pairs.sort_by(|a, b| hertz(a).total_cmp(&hertz(b)));
    pairs
}

#[cfg(test)]
mod tests;
