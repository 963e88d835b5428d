//! The structure of a case at one spindle speed.

use super::Case;
use crate::structure::{Form, ModesAtSpeed, PairingError, SpeedDependence};

/// Reason why the structures of two cases cannot be interpolated over the spindle speed.
#[derive(Debug, thiserror::Error)]
pub enum AtSpeedError {
    /// One of the cases has no modes.
    #[error("{path}: structure.kind = \"modes\" is needed, since modes are interpolated over the speed")]
    NoModes {
        /// Path of the case file.
        path: String,
    },
    /// One of the cases does not state the speed of its structure.
    #[error(
        "{path}: rpm is missing under [structure]: the spindle speed at which the structure holds, 0 at standstill"
    )]
    NoSpeed {
        /// Path of the case file.
        path: String,
    },
    /// The structures have other directions.
    #[error("{path}: the directions of the structure are {found}, and those of the first case {expected}")]
    Directions {
        /// Path of the case file.
        path: String,
        /// Its directions.
        found: String,
        /// Those of the first case.
        expected: String,
    },
    /// Two structures hold at the same speed.
    #[error(
        "{path}: its structure holds at {rpm} rev/min, as one of {other} does; one structure for each speed is needed"
    )]
    SameSpeed {
        /// Path of the later case file.
        path: String,
        /// The speed, rev/min.
        rpm: f64,
        /// Path of the earlier case file.
        other: String,
    },
    /// The modes cannot be paired.
    #[error("{path}: {cause}")]
    Pairing {
        /// Path of the case file.
        path: String,
        /// The fault.
        cause: PairingError,
    },
}

impl Case {
    /// The case with the structure that it has at the spindle speed `rpm`, rev/min, and no dependence on the speed. A case
    /// whose structure does not depend on the speed stays as it is.
    #[must_use]
    pub fn at_speed(&self, rpm: f64) -> Self {
        let mut case = self.clone();
        let dependence = case.speed_dependence.take();
        if let (Some(dependence), Some(structure)) = (dependence, &mut case.structure)
            && let Form::Modes(modes) = &mut structure.form
        {
            *modes = dependence.at(modes, rpm);
            case.structure_rpm = Some(rpm);
        }
        case
    }

    /// The case whose structure is interpolated over the spindle speed between its own and those of `others`, cases of the
    /// same machine at other speeds. Of the others only the structure is used. Each case brings the structures of all its
    /// speeds.
    ///
    /// # Errors
    /// See [`AtSpeedError`].
    pub fn with_structures_of(mut self, others: &[Self]) -> Result<Self, AtSpeedError> {
        let (base, mut further) = modes_at_speeds(&self)?;
        let own = std::iter::once(&base).chain(&further);
        let mut known: Vec<(f64, String)> = own.map(|at| (at.rpm, self.path.display().to_string())).collect();
        let directions = |case: &Self| {
            let structure = case.structure.as_ref();
            let names = structure.iter().flat_map(|structure| &structure.directions);
            names.map(ToString::to_string).collect::<Vec<_>>().join(", ")
        };
        for other in others {
            let (found, expected) = (directions(other), directions(&self));
            if found != expected {
                return Err(AtSpeedError::Directions {
                    path: other.path.display().to_string(),
                    found,
                    expected,
                });
            }
            let (first, rest) = modes_at_speeds(other)?;
            for at in std::iter::once(first).chain(rest) {
                if let Some((_, earlier)) = known.iter().find(|(rpm, _)| *rpm == at.rpm) {
                    return Err(AtSpeedError::SameSpeed {
                        path: other.path.display().to_string(),
                        rpm: at.rpm,
                        other: earlier.clone(),
                    });
                }
                known.push((at.rpm, other.path.display().to_string()));
                further.push(at);
            }
        }
        let dependence = SpeedDependence::new(base, further).map_err(|cause| AtSpeedError::Pairing {
            path: self.path.display().to_string(),
            cause,
        })?;
        self.speed_dependence = Some(dependence);
        Ok(self)
    }
}

/// Modes of the first structure of a case, and those of its further speeds.
fn modes_at_speeds(case: &Case) -> Result<(ModesAtSpeed, Vec<ModesAtSpeed>), AtSpeedError> {
    let path = || case.path.display().to_string();
    let Some(Form::Modes(modes)) = case.structure.as_ref().map(|structure| &structure.form) else {
        return Err(AtSpeedError::NoModes { path: path() });
    };
    let rpm = case
        .structure_rpm
        .ok_or_else(|| AtSpeedError::NoSpeed { path: path() })?;
    let first = ModesAtSpeed {
        rpm,
        modes: modes.clone(),
    };
    let dependence = case.speed_dependence.as_ref();
    let further = dependence.map_or_else(Vec::new, |dependence| dependence.further().cloned().collect());
    Ok((first, further))
}
