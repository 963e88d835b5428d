//! The linear milling problem: a structure and a cutting process.

use crate::error::StabilityError;
use crate::process::extension;
use crate::process::treatment::{self, Treated};
use quietcut_model::case::Case;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Process;
use quietcut_model::structure::FirstOrder;

/// ẋ = A x + B F, u = C x, F = w K α(φ)(u − u_τ) − (β_e + β_f)(φ) u (eqs 3.7, 7.1), about the forced motion.
///
/// Everything in feed, normal and axial direction. The delay τ is the tooth period.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// The structure, turned into the feed direction.
    pub structure: FirstOrder,
    /// The cutting process.
    pub process: Process,
    /// Number of teeth.
    pub teeth: usize,
}

/// How cubic terms of a structure are treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CubicTerms {
    /// A case that has them is refused: limits then depend on the forced motion.
    Refuse,
    /// They are left out: the limits for vanishing feed.
    LeaveOut,
    /// Whoever asks knows them, and whatever else acts about a forced orbit: this is the linear part.
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
    /// The problem that a case poses.
    ///
    /// # Errors
    /// A section is missing, the structure is indefinite, or the case has what the equation above has not:
    /// variable pitch, cubic terms and other smooth ones (see `cubic`), extensions that it cannot treat.
    pub fn new(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
        Self::of(case, cubic, cutting(case, cubic.treated())?)
    }

    /// As [`new`](Self::new), but unequal pitches are replaced by their mean.
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
            structure: extension::structure(case)?.turned(case.cut()?.feed_direction_deg),
            process,
            teeth,
        })
    }

    /// Tooth period, s.
    pub fn tooth_period_s(&self, rpm: f64) -> f64 {
        60.0 / (rpm * self.teeth as f64)
    }

    /// The largest decay rate −Re λ of the structure, 1/s; 0 where nothing decays.
    pub(crate) fn fastest_decay(&self) -> f64 {
        self.structure
            .poles()
            .iter()
            .map(|pole| -pole.re)
            .fold(0.0, f64::max)
    }
}

/// The cutting process of a case and its number of teeth, whatever the structure.
///
/// # Errors
/// A section is missing, or there is variable pitch, an extension that is not treated, or runout with
/// axial-depth-modulation.
pub(crate) fn cutting(case: &Case, treated: Treated) -> Result<(Process, usize), StabilityError> {
    if case.tool()?.has_variable_pitch() {
        return Err(StabilityError::NotCovered {
            path: case.path.clone(),
            what: "tool.pitch_deg: teeth at unequal distances have several delays; equal pitch is needed here",
        });
    }
    cutting_with_mean_pitch(case, treated)
}

/// The same, with unequal pitches replaced by their mean.
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
