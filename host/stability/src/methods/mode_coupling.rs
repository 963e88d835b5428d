//! The mode-coupling criterion (Gasparetto 1998, 2001), for comparison.

use crate::error::StabilityError;
use crate::frequency::averaged::AveragedLoop;
use crate::frequency::limits::{hertz, limits, speed_line};
use crate::frequency::problem::FrequencyProblem;
use crate::frequency::root;
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;

/// Mode coupling by the eigenvalues of the equations of motion, with the cut as a constant stiffness.
///
/// F = w K_tc α₀ u: averaged coefficients, and no vibration one tooth period ago. α₀ is not symmetric, so that two modes
/// may feed each other: eigenvalues of M⁻¹(K − w K_tc α₀) become complex. Gasparetto states it for two degrees of freedom without damping;
/// here it has the damping and all modes of the structure, and is solved along the frequency, which measured receptances
/// allow too. Limits do not depend on the speed.
///
/// It neglects regeneration, which in most cuts limits the depth first, and it is blind to flips.
#[derive(Clone, Debug)]
pub struct ModeCoupling {
    problem: FrequencyProblem,
}

impl ModeCoupling {
    /// The criterion for a problem.
    ///
    /// # Errors
    /// The tool does not move in both directions in which the chip thickness is cut, or there is one mode only: nothing
    /// can couple.
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
        AveragedLoop::check_reach(&self.problem, depth_mm)?;
        root::averaged_point(&self.problem, rpm, depth_mm, |problem| {
            AveragedLoop::new(problem, None)
        })
    }

    fn line(&self, rpm: f64, depth_mm: f64, _samples: usize) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, depth_mm)?;
        let open_loop = AveragedLoop::new(&self.problem, None);
        let found = limits(&open_loop, depth_mm * 1e-3).ok_or(StabilityError::BrokeDown {
            rpm,
            depth_mm,
            what: "receptances are not finite",
        })?;
        speed_line(&open_loop, rpm, depth_mm, &found, &[], hertz)
    }
}
