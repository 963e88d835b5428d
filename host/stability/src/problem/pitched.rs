//! The linear milling problem of a tool with equal or unequal pitch.

use super::linear::{CubicTerms, Problem};
use crate::error::StabilityError;
use quietcut_model::case::Case;

/// Linear delay equation of a cut whose teeth may have unequal pitch:
///
///   ẋ = A x + B F,   u = C x,   F = Σ_j w K α(φ_j)(u − u(t − τ_j)) − β u,
///
/// with the delay τ_j of each cutting tooth j: the time since the preceding tooth had the same immersion angle. With
/// unequal pitch the period of the equation is the revolution, otherwise the tooth period.
#[derive(Clone, Debug, PartialEq)]
pub struct Pitched {
    /// Problem with the mean pitch. If the period is the revolution, the mean tooth period of this problem only sets
    /// the number of time steps.
    pub(crate) problem: Problem,
    /// Angles between the teeth as in [`Tool::pitch_deg`](quietcut_model::milling::Tool), rad; `None` for equal pitch
    /// with the tooth period as period.
    pub(crate) pitch_rad: Option<Vec<f64>>,
}

impl Pitched {
    /// Builds the linear delay problem of a case whose teeth may have unequal pitch.
    ///
    /// # Errors
    /// As [`Problem::new`], but variable pitch is accepted.
    pub fn new(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
        let problem = Problem::with_mean_pitch(case, cubic)?;
        let tool = case.tool()?;
        let pitch_rad = tool
            .has_variable_pitch()
            .then(|| tool.pitch_deg.iter().map(|pitch| pitch.to_radians()).collect());
        Ok(Self { problem, pitch_rad })
    }

    /// The same delay problem with the mean pitch; it shares structure, cutting process and number of teeth.
    pub fn with_mean_pitch(&self) -> &Problem {
        &self.problem
    }

    /// The same delay problem with the revolution as its period, for equal pitch too.
    #[must_use]
    pub(crate) fn over_revolution(mut self) -> Self {
        let problem = &self.problem;
        self.pitch_rad
            .get_or_insert_with(|| vec![problem.process.engagement.pitch; problem.teeth]);
        self
    }

    /// True if the period of the equation is the revolution: for unequal pitch and, after `over_revolution`, for equal
    /// pitch too.
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
