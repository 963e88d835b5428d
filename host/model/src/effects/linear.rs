//! A linear parameter that differs from the case: VALUE is a relative change, a key an absolute value.
//!
//! Of matrices all of M, C or K is scaled, or with a direction its diagonal entry alone; an absolute value is that
//! diagonal entry. Of modes all are changed as those of a structure whose M, C or K is scaled: stiffness 1 + r makes
//! ω grow by √(1 + r), ζ and the residues shrink by it; mass makes all three shrink; damping scales ζ.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::{Effect, EffectError, Kind, Parameters};
use crate::structure::{Direction, Form, Mode, Structure};

pub(super) const MASS: Kind = Kind {
    name: "mass",
    keys: "mass_kg or relative_change, and direction",
    build: |parameters| build(Which::Mass, parameters),
};

pub(super) const STIFFNESS: Kind = Kind {
    name: "stiffness",
    keys: "stiffness_n_per_m, frequency_hz (of a single mode) or relative_change, and direction",
    build: |parameters| build(Which::Stiffness, parameters),
};

pub(super) const DAMPING: Kind = Kind {
    name: "damping",
    keys: "damping_ns_per_m, damping_ratio (of a single mode) or relative_change, and direction",
    build: |parameters| build(Which::Damping, parameters),
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Which {
    Mass,
    Stiffness,
    Damping,
}

#[derive(Clone, Copy, Debug)]
enum Change {
    Relative(f64),
    /// An entry of the matrix.
    Entry(f64),
    /// Frequency or damping ratio of the only mode.
    OfMode(f64),
}

#[derive(Clone, Copy, Debug)]
struct Linear {
    which: Which,
    change: Change,
    direction: Option<Direction>,
}

fn build(which: Which, parameters: &mut Parameters) -> Result<Arc<dyn Effect>, EffectError> {
    let direction = parameters.direction("direction")?;
    let (entry, of_mode) = match which {
        Which::Mass => ("mass_kg", None),
        Which::Stiffness => ("stiffness_n_per_m", Some("frequency_hz")),
        Which::Damping => ("damping_ns_per_m", Some("damping_ratio")),
    };
    let change = if let Some(value) = parameters.positive(entry)? {
        Change::Entry(value)
    } else if let Some(value) = of_mode.map(|key| parameters.positive(key)).transpose()?.flatten() {
        Change::OfMode(value)
    } else {
        let above = "a relative change above −1";
        let named = parameters.number("relative_change", |r| r > -1.0, above)?;
        let bare = parameters.number("", |r| r > -1.0, above)?;
        Change::Relative(named.or(bare).ok_or(EffectError::Missing {
            name: parameters.effect().into(),
            key: entry,
        })?)
    };
    Ok(Arc::new(Linear {
        which,
        change,
        direction,
    }))
}

impl Linear {
    fn refused(&self, what: &str) -> EffectError {
        EffectError::Structure {
            name: self.name(),
            what: what.into(),
        }
    }

    fn of_matrix(&self, matrix: &mut DMatrix<f64>, directions: &[Direction]) -> Result<(), EffectError> {
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
            (Change::Entry(value), Some(index)) => matrix[(index, index)] = value,
            (Change::Entry(_), None) => {
                return Err(self.refused("an absolute value needs a direction (direction = \"x\")"));
            }
            (Change::OfMode(_), _) => {
                return Err(self.refused("frequency and damping ratio are for structures of modes"));
            }
        }
        Ok(())
    }

    fn of_modes(&self, modes: &mut [Mode]) -> Result<(), EffectError> {
        if self.direction.is_some() {
            return Err(self.refused("modes are changed as a whole: leave the direction out"));
        }
        match self.change {
            Change::Relative(change) => {
                let root = (1.0 + change).sqrt();
                for mode in modes.iter_mut() {
                    let residue = match self.which {
                        Which::Mass => {
                            mode.frequency_hz /= root;
                            mode.damping_ratio /= root;
                            1.0 / root
                        }
                        Which::Stiffness => {
                            mode.frequency_hz *= root;
                            mode.damping_ratio /= root;
                            1.0 / root
                        }
                        Which::Damping => {
                            mode.damping_ratio *= 1.0 + change;
                            1.0
                        }
                    };
                    for right in &mut mode.right {
                        *right *= residue;
                    }
                }
            }
            Change::OfMode(value) => {
                let [mode] = modes else {
                    return Err(self.refused("the structure has several modes: say a relative change"));
                };
                match self.which {
                    Which::Stiffness => mode.frequency_hz = value,
                    _ => mode.damping_ratio = value,
                }
            }
            Change::Entry(_) => {
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

impl Effect for Linear {
    fn name(&self) -> &'static str {
        match self.which {
            Which::Mass => MASS.name,
            Which::Stiffness => STIFFNESS.name,
            Which::Damping => DAMPING.name,
        }
    }

    fn alter_structure(&self, structure: &mut Structure) -> Result<(), EffectError> {
        match &mut structure.form {
            Form::Matrices(matrices) => {
                let matrix = match self.which {
                    Which::Mass => &mut matrices.mass,
                    Which::Stiffness => &mut matrices.stiffness,
                    Which::Damping => &mut matrices.damping,
                };
                self.of_matrix(matrix, &structure.directions)
            }
            Form::Modes(modes) => self.of_modes(modes),
            Form::Joints(_) => Err(EffectError::Structure {
                name: self.name(),
                what:
                    "the structure is given by joints: change their stiffness, damping or masses in the case"
                        .into(),
            }),
        }
    }
}
