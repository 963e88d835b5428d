//! The linear milling problem: a structure and a cutting process.

use std::path::PathBuf;

use super::extension::{self, Treated};
use quietcut_frf::FrfError;
use quietcut_model::ModelError;
use quietcut_model::case::{Case, CaseError};
use quietcut_model::milling::Process;
use quietcut_model::structure::{FirstOrder, StructureError};

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

/// Why stability cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The case lacks a section, or has an extension that linear stability cannot treat.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The structure is none.
    #[error("{}: {cause}", path.display())]
    Structure {
        /// The case file.
        path: PathBuf,
        /// What is wrong with it.
        cause: StructureError,
    },
    /// An extension that the case cannot have.
    #[error("{}: {cause}", path.display())]
    Extension {
        /// The case file.
        path: PathBuf,
        /// What is wrong.
        cause: Box<ModelError>,
    },
    /// The method does not cover the case.
    #[error("{}: {what}", path.display())]
    NotCovered {
        /// The case file.
        path: PathBuf,
        /// What is not covered, and what can be done instead.
        what: &'static str,
    },
    /// Receptances are infinite.
    #[error(
        "a mode of {frequency_hz:.4} Hz has no damping: its receptance is infinite there; damping is needed, or a method \
         that does not go through receptances"
    )]
    Undamped {
        /// Frequency of the mode, Hz.
        frequency_hz: f64,
    },
    /// Nothing can couple.
    #[error(
        "mode coupling is not defined here: {found}; two modes that move the tool in feed and normal direction are needed"
    )]
    NoModeCoupling {
        /// What there is.
        found: &'static str,
    },
    /// A table of frequency response functions cannot be used.
    #[error(transparent)]
    Frf(#[from] FrfError),
    /// A table ends before the loop has become small.
    #[error(
        "depths from {deepest_mm:.3} mm on cannot be judged, and {depth_mm} mm was asked for: the frequency response \
         functions end at {last_hz} Hz, where the gain of the loop then reaches 1; measure to higher frequencies, or ask \
         for less depth"
    )]
    EndsEarly {
        /// The depth asked for, mm.
        depth_mm: f64,
        /// The largest depth that can be judged, mm.
        deepest_mm: f64,
        /// Last frequency of the table, Hz.
        last_hz: f64,
    },
    /// What was asked depends on frequencies that a table does not have.
    #[error(
        "at {rpm} rev/min and {depth_mm:.4} mm the cut vibrates at {frequency_hz:.3} Hz, but the frequency response \
         functions were measured from {first_hz} to {last_hz} Hz only; measure there too, or ask for less depth"
    )]
    NotMeasured {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Frequency of the vibration, Hz.
        frequency_hz: f64,
        /// First frequency of the table, Hz.
        first_hz: f64,
        /// Last frequency of the table, Hz.
        last_hz: f64,
    },
    /// Deviations so large that much of what they describe does not exist.
    #[error(
        "{}: with its deviations (keys that end in _std) {percent:.0} % of the machines are impossible: a damping ratio \
         or a frequency below 0, or indefinite matrices; smaller deviations are needed",
        path.display()
    )]
    Deviations {
        /// The case file.
        path: PathBuf,
        /// How many machines of a hundred.
        percent: f64,
    },
    /// A speed or depth that no cut has.
    #[error("{quantity} {value}: {expected} is needed")]
    Argument {
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The numbers left the range in which they mean something.
    #[error("at {rpm} rev/min and {depth_mm} mm the computation broke down: {what}")]
    BrokeDown {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Where.
        what: &'static str,
    },
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
    pub(super) fn with_mean_pitch(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
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
    pub(super) fn fastest_decay(&self) -> f64 {
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
pub(super) fn cutting(case: &Case, treated: Treated) -> Result<(Process, usize), StabilityError> {
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
    extension::refuse_others(case, treated)?;
    let material = extension::material(case)?;
    let not_covered = |what| StabilityError::NotCovered {
        path: case.path.clone(),
        what,
    };
    let modulated = case.axial_depth_modulation();
    if modulated
        && (tool.runout.is_some_and(|runout| runout.offset_um > 0.0)
            || case.extensions.contains_key("runout"))
    {
        return Err(not_covered(
            "tool.runout_um: with axial-depth-modulation the feed force would differ from tooth to tooth; \
             leave out one of them",
        ));
    }
    Ok((Process::new(tool, &material, cut, modulated), tool.teeth))
}
