//! A milling problem whose teeth may stand at unequal angles.

use super::linear::{CubicTerms, Problem};
use crate::error::StabilityError;
use quietcut_model::case::Case;

/// ẋ = A x + B F, u = C x, F = Σ_j w K α(φ_j)(u − u(t − τ_j)) − β u, with the delay τ_j of each tooth j that cuts.
///
/// Where the pitches differ the period of the equation is the revolution, else the tooth period.
#[derive(Clone, Debug, PartialEq)]
pub struct Pitched {
    /// The problem; where pitches differ, with their mean: only structure and process are then what they say.
    pub(crate) problem: Problem,
    /// Angles between the teeth as in [`Tool::pitch_deg`](quietcut_model::milling::Tool), rad; `None` where they are equal.
    pub(crate) pitch_rad: Option<Vec<f64>>,
}

impl Pitched {
    /// The problem that a case poses.
    ///
    /// # Errors
    /// As [`Problem::new`], but for variable pitch, which is taken as it is.
    pub fn new(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
        let problem = Problem::with_mean_pitch(case, cubic)?;
        let tool = case.tool()?;
        let pitch_rad = tool
            .has_variable_pitch()
            .then(|| tool.pitch_deg.iter().map(|pitch| pitch.to_radians()).collect());
        Ok(Self { problem, pitch_rad })
    }

    /// The problem with unequal pitches replaced by their mean: its structure, process and number of teeth are those of this one.
    pub fn with_mean_pitch(&self) -> &Problem {
        &self.problem
    }

    /// The same with the revolution as its period, also where the pitches are equal.
    #[must_use]
    pub(crate) fn over_revolution(mut self) -> Self {
        let problem = &self.problem;
        self.pitch_rad
            .get_or_insert_with(|| vec![problem.process.engagement.pitch; problem.teeth]);
        self
    }

    /// True where teeth stand at unequal angles: there are then several delays.
    pub fn has_variable_pitch(&self) -> bool {
        self.pitch_rad.is_some()
    }
}

impl From<Problem> for Pitched {
    fn from(problem: Problem) -> Self {
        Self {
            problem,
            pitch_rad: None,
        }
    }
}
