//! Mass, stiffness or damping that differs from the case, by a relative change r or by an absolute value.
//!
//! In a structure given by matrices, the whole matrix M, C or K is scaled by 1 + r; with a direction, only the diagonal
//! entry of that direction is scaled or replaced. In a structure given by modes, r changes all modes as scaling M, C or
//! K would at light damping: stiffness multiplies ω by √(1 + r) and divides ζ and the residues by it; mass divides all
//! three by √(1 + r); damping multiplies ζ by 1 + r. An absolute value replaces the frequency or damping ratio of the
//! only mode. A structure given by joints is refused.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::{Effect, EffectError, EffectName, Parameter, Prior, Values};
use crate::structure::{Direction, Form, Mode, Structure};

/// Parameter for the relative change r of mass, stiffness or damping. It is above −1, so that no matrix or entry
/// vanishes or changes its sign.
pub(super) const RELATIVE_CHANGE: Parameter = Parameter::number(
    "relative_change",
    "",
    "relative change of the matrix, or of its entry",
)
.within(Prior::open(-1.0, f64::INFINITY, "a relative change above −1"))
.linear()
.main();

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Matrix {
    Mass,
    Stiffness,
    Damping,
}

#[derive(Clone, Copy, Debug)]
enum Change {
    Relative(f64),
    /// New value of one diagonal entry of the mass, stiffness or damping matrix, in SI units.
    DiagonalEntry(f64),
    /// New natural frequency, Hz, or new damping ratio of the only mode of a structure.
    ModeValue(f64),
}

#[derive(Clone, Copy, Debug)]
struct LinearChange {
    matrix: Matrix,
    change: Change,
    direction: Option<Direction>,
}

pub(super) fn build(matrix: Matrix, values: &mut Values) -> Result<Arc<dyn Effect>, EffectError> {
    let direction = values.direction()?;
    let (entry, of_mode) = match matrix {
        Matrix::Mass => ("mass_kg", None),
        Matrix::Stiffness => ("stiffness_n_per_m", Some("frequency_hz")),
        Matrix::Damping => ("damping_ns_per_m", Some("damping_ratio")),
    };
    let change = if let Some(value) = values.number(entry)? {
        Change::DiagonalEntry(value)
    } else if let Some(value) = of_mode.map(|key| values.number(key)).transpose()?.flatten() {
        Change::ModeValue(value)
    } else {
        let named = values.number("relative_change")?;
        let bare = values.number("")?;
        Change::Relative(named.or(bare).ok_or_else(|| values.missing(entry))?)
    };
    Ok(Arc::new(LinearChange {
        matrix,
        change,
        direction,
    }))
}

impl LinearChange {
    fn refused(&self, what: &str) -> EffectError {
        EffectError::Structure {
            name: self.name(),
            what: what.into(),
        }
    }

    fn change_matrix(&self, matrix: &mut DMatrix<f64>, directions: &[Direction]) -> Result<(), EffectError> {
        let index = match self.direction {
            Some(direction) => Some(
                directions
                    .iter()
                    .position(|known| *known == direction)
                    .ok_or_else(|| self.refused(&format!("the structure has no direction {direction}")))?,
            ),
            None if directions.len() == 1 => Some(0),
            None => None,
        };
        match (self.change, index) {
            (Change::Relative(change), Some(index)) => matrix[(index, index)] *= 1.0 + change,
            (Change::Relative(change), None) => *matrix *= 1.0 + change,
            (Change::DiagonalEntry(value), Some(index)) => matrix[(index, index)] = value,
            (Change::DiagonalEntry(_), None) => {
                return Err(self.refused("an absolute value needs a direction (direction = \"x\")"));
            }
            (Change::ModeValue(_), _) => {
                return Err(self.refused("frequency and damping ratio are for structures of modes"));
            }
        }
        Ok(())
    }

    fn change_modes(&self, modes: &mut [Mode]) -> Result<(), EffectError> {
        if self.direction.is_some() {
            return Err(self.refused("modes are changed as a whole: leave the direction out"));
        }
        match self.change {
            Change::Relative(change) => {
                let root = (1.0 + change).sqrt();
                for mode in modes.iter_mut() {
                    let residue = match self.matrix {
                        Matrix::Mass => {
                            mode.frequency_hz /= root;
                            mode.damping_ratio /= root;
                            1.0 / root
                        }
                        Matrix::Stiffness => {
                            mode.frequency_hz *= root;
                            mode.damping_ratio /= root;
                            1.0 / root
                        }
                        Matrix::Damping => {
                            mode.damping_ratio *= 1.0 + change;
                            1.0
                        }
                    };
                    for right in &mut mode.right {
                        *right *= residue;
                    }
                }
            }
            Change::ModeValue(value) => {
                let [mode] = modes else {
                    return Err(self.refused("the structure has several modes: say a relative change"));
                };
                match self.matrix {
                    Matrix::Stiffness => mode.frequency_hz = value,
                    _ => mode.damping_ratio = value,
                }
            }
            Change::DiagonalEntry(_) => {
                return Err(
                    self.refused("modes have frequencies and damping ratios, not masses and stiffnesses")
                );
            }
        }
        match modes.iter().find(|mode| mode.damping_ratio >= 1.0) {
            Some(mode) => Err(self.refused(&format!(
                "the damping ratio becomes {}; below 1 is needed",
                mode.damping_ratio
            ))),
            None => Ok(()),
        }
    }
}

impl Effect for LinearChange {
    fn id(&self) -> EffectName {
        match self.matrix {
            Matrix::Mass => EffectName::Mass,
            Matrix::Stiffness => EffectName::Stiffness,
            Matrix::Damping => EffectName::Damping,
        }
    }

    fn alter_structure(&self, structure: &mut Structure) -> Result<(), EffectError> {
        match &mut structure.form {
            Form::Matrices(matrices) => {
                let matrix = match self.matrix {
                    Matrix::Mass => &mut matrices.mass,
                    Matrix::Stiffness => &mut matrices.stiffness,
                    Matrix::Damping => &mut matrices.damping,
                };
                self.change_matrix(matrix, &structure.directions)
            }
            Form::Modes(modes) => self.change_modes(modes),
            Form::Joints(_) => Err(EffectError::Structure {
                name: self.name(),
                what:
                    "the structure is given by joints: change their stiffness, damping or masses in the case"
                        .into(),
            }),
        }
    }
}
