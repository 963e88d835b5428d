//! The common interface of all stability methods.

use rayon::prelude::*;
use serde::Serialize;

use super::cell::Cell;
use super::point::CutStability;
use super::speed_line::SpeedLine;
use crate::error::StabilityError;

/// Stability method together with its problem: a case, or a case with a table of receptances.
///
/// Cases for which a method is not defined are refused when the method or its problem is constructed, with the reason.
pub trait Method: Sync {
    /// Name in results and captions.
    fn name(&self) -> &'static str;

    /// Effects that the method neglects, as text after "blind to"; `None` if the method covers all of linear stability.
    fn blind_to(&self) -> Option<&'static str> {
        None
    }

    /// Settings beside the case on which results depend, such as a number of steps; `None` if there are none.
    fn settings(&self) -> Option<String> {
        None
    }

    /// True if the limits at one spindle speed take seconds to compute. The command `lobes` then adds no speeds between
    /// the requested ones.
    fn takes_seconds(&self) -> bool {
        false
    }

    /// Dominant Floquet multiplier at a spindle speed (rev/min) and an axial depth (mm), with its error.
    ///
    /// The error is the numerical error with respect to the delay equation (linearized about the forced orbit if limits
    /// depend on it), if the method converges to its solution. For a method of order p in its step it is estimated from
    /// the changes with half and a quarter of the step (Richardson), times a safety factor. With equivalent stiffness
    /// and damping of friction, backlash or hysteresis it is the distance from the multiplier that a small disturbance
    /// of the orbit has. Effects that the method neglects are not included.
    ///
    /// # Errors
    /// Speed not positive, depth negative, one of them not finite, or a computation that breaks down, for example
    /// because it leaves the range of numbers or of measured frequencies.
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError>;

    /// All crossings of the unit circle by Floquet multipliers at a spindle speed (rev/min), from axial depth 0 to
    /// `depth_mm`, sampled at `samples` equal steps and finer where needed. Methods that do not scan the depth ignore
    /// `samples`.
    ///
    /// # Errors
    /// As [`point()`](Self::point).
    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError>;

    /// Dominant multiplier of cuts at one spindle speed (rev/min) and many depths (mm), in any order, each with its
    /// error.
    ///
    /// # Errors
    /// As [`point()`](Self::point).
    fn cells(&self, rpm: f64, depths_mm: &[f64]) -> Result<Vec<Cell>, StabilityError> {
        depths_mm
            .iter()
            .map(|&depth_mm| self.point(rpm, depth_mm).map(|point| Cell::from(&point)))
            .collect()
    }

    /// Limits at many spindle speeds (rev/min) up to an axial depth (mm), in the given order; independent of the number
    /// of threads.
    ///
    /// A method that can use intermediate results for several speeds overrides this.
    ///
    /// # Errors
    /// As [`line()`](Self::line), for the first speed that fails.
    fn lines(
        &self,
        speeds_rpm: &[f64],
        depth_mm: f64,
        samples: usize,
    ) -> Result<Vec<SpeedLine>, StabilityError> {
        each_line(self, speeds_rpm, depth_mm, samples, || ())
    }

    /// The parts of [`lines()`](Self::lines) that hold the first limits, where that takes less time: depths beyond the
    /// first limit of a speed may be missing.
    ///
    /// # Errors
    /// As [`line()`](Self::line), for the first speed that fails.
    fn up_to_first_limits(
        &self,
        speeds_rpm: &[f64],
        depth_mm: f64,
        samples: usize,
    ) -> Result<Vec<SpeedLine>, StabilityError> {
        self.lines(speeds_rpm, depth_mm, samples)
    }
}

/// Limits of a method at each spindle speed (rev/min) on its own, in the given order; calls `after_each` after each speed.
///
/// # Errors
/// As [`Method::line`], for the first speed that fails.
pub(super) fn each_line<M: Method + ?Sized>(
    method: &M,
    speeds_rpm: &[f64],
    depth_mm: f64,
    samples: usize,
    after_each: impl Fn() + Sync,
) -> Result<Vec<SpeedLine>, StabilityError> {
    let lines: Vec<Result<SpeedLine, StabilityError>> = speeds_rpm
        .par_iter()
        .map(|&rpm| {
            let line = method.line(rpm, depth_mm, samples);
            after_each();
            line
        })
        .collect();
    lines.into_iter().collect()
}

/// Label of a stability result: method, its settings and the effects that it neglects.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Label {
    /// [`Method::name`].
    pub method: &'static str,
    /// [`Method::settings`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settings: Option<String>,
    /// [`Method::blind_to`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blind_to: Option<&'static str>,
}

impl Label {
    /// Label of a method.
    pub fn of<M: Method + ?Sized>(method: &M) -> Self {
        Self {
            method: method.name(),
            settings: method.settings(),
            blind_to: method.blind_to(),
        }
    }
}

/// Formats the label for captions.
impl std::fmt::Display for Label {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.method)?;
        if let Some(settings) = &self.settings {
            write!(f, ", {settings}")?;
        }
        match self.blind_to {
            Some(what) => write!(f, " (blind to {what})"),
            None => Ok(()),
        }
    }
}
