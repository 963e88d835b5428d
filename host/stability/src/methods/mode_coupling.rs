//! The mode-coupling criterion (Gasparetto 1998, 2001), for comparison.

use crate::error::{NOT_FINITE, StabilityError};
use crate::frequency::averaged::AveragedLoop;
use crate::frequency::limits::{hertz, limits, speed_line};
use crate::frequency::problem::FrequencyProblem;
use crate::frequency::root;
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;

/// Mode-coupling criterion: eigenvalues of the equations of motion with the cut as a constant stiffness.
///
/// F = w K_tc α₀ u, with averaged directional coefficients α₀ and without the displacement one tooth period ago. α₀ is
/// not symmetric, so that two modes can exchange energy: eigenvalues of M⁻¹(K − w K_tc α₀) become complex. Gasparetto
/// states the criterion for two degrees of freedom without damping. This implementation includes damping and all modes,
/// and solves along the frequency axis, so that measured receptances can be used. Limits do not depend on the spindle
/// speed.
///
/// The criterion neglects regeneration, which limits the depth first in most cuts, and does not see flips.
#[derive(Clone, Debug)]
pub struct ModeCoupling {
    problem: FrequencyProblem,
}

impl ModeCoupling {
    /// Sets up the mode-coupling criterion for a problem given by its receptances.
    ///
    /// # Errors
    /// The structure has fewer than two modes (peaks of a table of receptances), or does not move in both feed and
    /// normal direction, so that modes cannot couple.
    pub fn new(problem: FrequencyProblem) -> Result<Self, StabilityError> {
        let [feed, normal, _] = problem.moves();
        let has_modes = problem.resonances().len() >= 2;
        if feed && normal && has_modes {
            return Ok(Self { problem });
        }
        Err(StabilityError::NoModeCoupling {
            found: if has_modes {
                "the tool moves in one of the directions feed and normal only"
            } else {
                "there is one mode only"
            },
        })
    }
}

impl Method for ModeCoupling {
    fn name(&self) -> &'static str {
        "mode-coupling"
    }

    fn blind_to(&self) -> Option<&'static str> {
        Some("regeneration and flips: mode coupling alone, no delay, averaged coefficients")
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        root::averaged_point(&self.problem, rpm, depth_mm, |problem| {
            AveragedLoop::new(problem, None)
        })
    }

    fn line(&self, rpm: f64, depth_mm: f64, _samples: usize) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        let open_loop = AveragedLoop::new(&self.problem, None);
        let found = limits(&open_loop, depth_mm * 1e-3);
        let found = found.map_err(|cause| cause.at(rpm, depth_mm, NOT_FINITE))?;
        speed_line(&open_loop, rpm, depth_mm, &found, &[], hertz)
    }
}
