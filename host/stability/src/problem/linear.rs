//! The linear milling problem: structure and cutting process.

use crate::error::StabilityError;
use crate::process::extension;
use crate::process::treatment::{self, Treated};
use quietcut_model::case::Case;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Process;
use quietcut_model::structure::FirstOrder;

/// Linear delay equation of a cut with equal pitch, about the forced motion:
///
///   ẋ = A x + B F,   u = C x,   F = w K α(φ)(u − u_τ) − (β_e + β_f)(φ) u   (eqs 3.7, 7.1).
///
/// All vectors are in feed, normal and axial direction. The delay τ is the tooth period, and u_τ the displacement one
/// tooth period earlier. Symbols and the sign of α are those of the crate's front page.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Structure in first-order form (matrices A, B and C), rotated into the feed direction.
    pub structure: FirstOrder,
    /// The cutting process.
    pub process: Process,
    /// Number of teeth.
    pub teeth: usize,
}

/// Treatment of cubic stiffness and damping of a structure, and of extensions with other nonlinear terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CubicTerms {
    /// Cases with cubic or other nonlinear terms are refused, since their limits depend on the forced motion.
    Refuse,
    /// Cubic and other smooth nonlinear terms of the structure are omitted: the limits are those for vanishing feed.
    /// Other nonlinear extensions are refused.
    LeaveOut,
    /// Cubic terms and all nonlinear extensions that can be linearized about a forced orbit are left to the caller; the
    /// result is the linear part.
    Kept,
}

impl CubicTerms {
    fn treated(self) -> Treated {
        match self {
            Self::Refuse => Treated::Linear,
            Self::LeaveOut => Treated::WithoutSmooth,
            Self::Kept => Treated::AboutOrbit,
        }
    }
}

impl Problem {
    /// Builds the linear problem of a case.
    ///
    /// # Errors
    /// A section is missing, the structure has no first-order form, or the case has a feature that the equation does
    /// not cover: variable pitch, nonlinear terms that `cubic` refuses, runout together with axial-depth modulation, or
    /// an extension that cannot be treated.
    pub fn new(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
        Self::of(case, cubic, cutting(case, cubic.treated())?)
    }

    /// Builds the linear delay problem like [`new`](Self::new), but replaces unequal pitches of the teeth by their
    /// mean.
    pub(crate) fn with_mean_pitch(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
        Self::of(case, cubic, cutting_with_mean_pitch(case, cubic.treated())?)
    }

    fn of(
        case: &Case,
        cubic: CubicTerms,
        (process, teeth): (Process, usize),
    ) -> Result<Self, StabilityError> {
        let structure = case.structure()?;
        if structure.is_nonlinear() && cubic == CubicTerms::Refuse {
            return Err(StabilityError::NotCovered {
                path: case.path.clone(),
                what: "structure.cubic_stiffness, structure.cubic_damping: with cubic terms the limit depends on the \
                       forced motion; ask for the linear part (--linear) or leave them out",
            });
        }
        Ok(Self {
            structure: extension::structure(case)?.rotated(case.cut()?.feed_direction_deg),
            process,
            teeth,
        })
    }

    /// Tooth period τ at a spindle speed in rev/min, s.
    pub fn tooth_period_s(&self, rpm: f64) -> f64 {
        60.0 / (rpm * self.teeth as f64)
    }

    /// Largest decay rate −Re λ over the poles λ of the structure, 1/s; 0 if no pole decays.
    pub(crate) fn fastest_decay(&self) -> f64 {
        self.structure
            .poles()
            .iter()
            .map(|pole| -pole.re)
            .fold(0.0, f64::max)
    }
}

/// Cutting process and number of teeth of a case; the structure is not used.
///
/// # Errors
/// A section is missing, an extension is wrong, or the case has variable pitch, an untreated extension, or runout
/// together with axial-depth modulation.
pub(crate) fn cutting(case: &Case, treated: Treated) -> Result<(Process, usize), StabilityError> {
    if case.tool()?.has_variable_pitch() {
        return Err(StabilityError::NotCovered {
            path: case.path.clone(),
            what: "tool.pitch_deg: teeth at unequal distances have several delays; equal pitch is needed here",
        });
    }
    cutting_with_mean_pitch(case, treated)
}

/// Cutting process and number of teeth of a case; unequal pitches of the teeth are replaced by their mean.
fn cutting_with_mean_pitch(case: &Case, treated: Treated) -> Result<(Process, usize), StabilityError> {
    let (tool, cut) = (case.tool()?, case.cut()?);
    treatment::refuse_others(case, treated)?;
    let material = extension::material(case)?;
    let not_covered = |what| StabilityError::NotCovered {
        path: case.path.clone(),
        what,
    };
    let modulated = case.axial_depth_modulation();
    if modulated && (tool.runout.is_some_and(|runout| runout.offset_um > 0.0) || case.has(EffectName::Runout))
    {
        return Err(not_covered(
            "tool.runout_um: with axial-depth-modulation the feed force would differ from tooth to tooth; \
             leave out one of them",
        ));
    }
    Ok((Process::new(tool, &material, cut, modulated), tool.teeth))
}
