//! The case file: structure, tool, material and cut of one machine and job.
//!
//! Sections may be missing where a verb does not need them; unknown keys are an error. x is the feed
//! direction, y the normal, z the tool axis; angles in degrees, lengths in mm where a machinist says mm, SI
//! otherwise.

mod check;
mod deviation;
mod effects;
mod error;
mod file;
mod limits;
mod parameter_value;
mod posture;

use std::collections::BTreeMap;
use std::path::PathBuf;

pub use deviation::{Deviation, Parameter};
pub use error::CaseError;
pub use limits::MachineLimits;
pub use posture::Posture;

use crate::effects::{EffectName, EffectSpec};
use crate::milling::{Cut, Material, Tool};
use crate::structure::Structure;

/// One machine and one job.
#[derive(Clone, Debug)]
pub struct Case {
    /// Path of the case file.
    pub path: PathBuf,
    /// Name of the case; the file name without extension if the file gives none.
    pub name: String,
    /// The machine. Its values are finite and of the right shape; whether the matrices are definite is judged
    /// where they are used.
    pub structure: Option<Structure>,
    /// The tool.
    pub tool: Option<Tool>,
    /// The workpiece material.
    pub material: Option<Material>,
    /// The cut.
    pub cut: Option<Cut>,
    /// Limits of spindle speed and power.
    pub limits: Option<MachineLimits>,
    /// Posture of the robot at which the structure was measured.
    pub posture: Posture,
    /// Standard deviations of parameters (keys `…_std`).
    pub deviations: Vec<Deviation>,
    /// Extensions of the model by name, as they stand in the file. Names, keys and values are those of the
    /// [`EffectSpec`]s; whether the structure has the direction is checked where the effect is used.
    pub extensions: BTreeMap<String, toml::Table>,
}

impl Case {
    /// The structure.
    ///
    /// # Errors
    /// The case has none.
    pub fn structure(&self) -> Result<&Structure, CaseError> {
        self.section(&self.structure, "structure", "the machine must be known")
    }

    /// The tool.
    ///
    /// # Errors
    /// The case has none.
    pub fn tool(&self) -> Result<&Tool, CaseError> {
        self.section(&self.tool, "tool", "teeth and edge angle must be known")
    }

    /// The material.
    ///
    /// # Errors
    /// The case has none.
    pub fn material(&self) -> Result<&Material, CaseError> {
        self.section(&self.material, "material", "the force coefficients must be known")
    }

    /// The cut.
    ///
    /// # Errors
    /// The case has none.
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

    /// True if the case has this effect as an extension.
    pub fn has(&self, effect: EffectName) -> bool {
        self.extensions.contains_key(effect.name())
    }

    /// The specifications of its extensions, in the order of their names.
    pub fn effects(&self) -> impl Iterator<Item = &'static EffectSpec> + '_ {
        let known = self.extensions.keys().filter_map(|name| name.parse().ok());
        known.map(EffectName::spec)
    }

    /// True where the depth of cut follows the axial vibration: edge and feed terms of eq. 3.7 act then.
    pub fn axial_depth_modulation(&self) -> bool {
        self.extensions
            .get(EffectName::AxialDepthModulation.name())
            .and_then(|table| table.get("on"))
            .and_then(toml::Value::as_bool)
            .unwrap_or(false)
    }

    /// Refuses the extensions for which `reason` has a reason.
    ///
    /// # Errors
    /// The first such extension, with its reason.
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
