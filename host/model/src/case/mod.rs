//! The case file: structure, tool, material, cut and further sections of one machine and job.
//!
//! A section may be missing if a command does not need it; an unknown key is an error. x, y and z are the machine's
//! axes, z that of the tool. Angles are in degrees, lengths of tool and cut in mm, all other quantities in SI units
//! unless the key names another unit.

mod at_speed;
mod check;
mod deviation;
mod effects;
mod error;
mod file;
mod limits;
mod parameter_covariance;
mod parameter_name;
mod parameter_value;
mod posture;
mod provenance;
mod sections;

use std::collections::BTreeMap;
use std::path::PathBuf;

pub use at_speed::AtSpeedError;
pub use deviation::{Deviation, Parameter};
pub use error::CaseError;
pub use limits::MachineLimits;
pub use parameter_covariance::ParameterCovariance;
pub use posture::Posture;
pub use provenance::AT_STANDSTILL;

pub use crate::criteria::SPEED_MAX_RPM;

use crate::effects::{EffectName, EffectSpec};
use crate::milling::{Cut, Material, Tool};
use crate::structure::{SpeedDependence, Structure};

/// One machine and one job.
#[derive(Clone, Debug)]
pub struct Case {
    /// Path of the case file.
    pub path: PathBuf,
    /// Name of the case: key `name`, otherwise the file name without extension.
    pub name: String,
    /// Structure of the machine; `None` if the case has no section `[structure]`. Its values are finite and its
    /// matrices and mode shapes have consistent sizes. [`Structure::check`] tests whether the matrices are definite.
    pub structure: Option<Structure>,
    /// Spindle speed at which the structure holds, rev/min, 0 at standstill; `None` if the case does not state it.
    pub structure_rpm: Option<f64>,
    /// Dependence of the structure on the spindle speed; `None` if one structure holds at all speeds.
    pub speed_dependence: Option<SpeedDependence>,
    /// The tool.
    pub tool: Option<Tool>,
    /// The workpiece material.
    pub material: Option<Material>,
    /// The cut.
    pub cut: Option<Cut>,
    /// Limits of spindle speed and power of the machine; `None` if the case does not give them.
    pub limits: Option<MachineLimits>,
    /// Posture of the robot to which the structure belongs.
    pub posture: Posture,
    /// Standard deviations above 0 of parameters of the case (keys `…_std`); not those of extensions.
    pub deviations: Vec<Deviation>,
    /// Joint covariance of further parameters (section `[uncertainty]`), none of which is among the
    /// [`deviations`](Self::deviations); `None` if the case has no such section.
    pub covariance: Option<ParameterCovariance>,
    /// Assumptions under which the case was identified (section `[provenance]`), one sentence each; see
    /// [`assumptions`](Self::assumptions).
    pub assumed: Vec<String>,
    /// Receptances that were not measured and are zero in the structure, such as `hxy` (section `[provenance]`).
    pub zero_receptances: Vec<String>,
    /// Tables `[extension.NAME]` by name. Their names, keys and values agree with the [`EffectSpec`]s; whether the
    /// structure has the direction of an effect is checked when the effect is applied.
    pub extensions: BTreeMap<String, toml::Table>,
}

impl Case {
    /// The section `[structure]` of the case.
    ///
    /// # Errors
    /// The case has no section `[structure]`.
    pub fn structure(&self) -> Result<&Structure, CaseError> {
        self.section(&self.structure, "structure", "the machine must be known")
    }

    /// The section `[tool]` of the case.
    ///
    /// # Errors
    /// The case has no section `[tool]`.
    pub fn tool(&self) -> Result<&Tool, CaseError> {
        self.section(&self.tool, "tool", "teeth and edge angle must be known")
    }

    /// The section `[material]` of the case.
    ///
    /// # Errors
    /// The case has no section `[material]`.
    pub fn material(&self) -> Result<&Material, CaseError> {
        self.section(&self.material, "material", "the force coefficients must be known")
    }

    /// The section `[cut]` of the case.
    ///
    /// # Errors
    /// The case has no section `[cut]`.
    pub fn cut(&self) -> Result<&Cut, CaseError> {
        self.section(&self.cut, "cut", "start angle, exit angle and feed must be known")
    }

    fn section<'a, T>(
        &self,
        section: &'a Option<T>,
        name: &'static str,
        what_for: &'static str,
    ) -> Result<&'a T, CaseError> {
        section.as_ref().ok_or_else(|| CaseError::MissingSection {
            path: self.path.clone(),
            section: name,
            what_for,
        })
    }

    /// True if the case has [`deviations`](Self::deviations) or a [`covariance`](Self::covariance).
    pub fn is_uncertain(&self) -> bool {
        !self.deviations.is_empty() || self.covariance.is_some()
    }

    /// True if the case has this effect as an extension.
    pub fn has(&self, effect: EffectName) -> bool {
        self.extensions.contains_key(effect.name())
    }

    /// The specifications of the effects that the case has as extensions, by name in alphabetical order.
    pub fn effects(&self) -> impl Iterator<Item = &'static EffectSpec> + '_ {
        let known = self.extensions.keys().filter_map(|name| name.parse().ok());
        known.map(EffectName::spec)
    }

    /// True if the axial depth of cut follows the axial vibration: the edge and feed terms of thesis eq. 3.7 then act.
    pub fn axial_depth_modulation(&self) -> bool {
        self.extensions
            .get(EffectName::AxialDepthModulation.name())
            .and_then(|table| table.get("on"))
            .and_then(toml::Value::as_bool)
            .unwrap_or(false)
    }

    /// Refuses the case if `reason` returns a reason against one of its extensions.
    ///
    /// # Errors
    /// The first extension with a reason against it, and that reason.
    pub fn refuse_extensions(
        &self,
        reason: impl Fn(&EffectSpec) -> Option<&'static str>,
    ) -> Result<(), CaseError> {
        let refused = self
            .effects()
            .find_map(|spec| reason(spec).map(|reason| (spec, reason)));
        match refused {
            None => Ok(()),
            Some((spec, reason)) => Err(CaseError::Extension {
                path: self.path.clone(),
                name: spec.name.into(),
                reason: reason.into(),
            }),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;

#[cfg(test)]
mod parameter_covariance_tests;
