//! The one interface of all methods.

use rayon::prelude::*;
use serde::Serialize;

use super::cell::Cell;
use super::point::CutStability;
use super::speed_line::SpeedLine;
use crate::error::StabilityError;

/// A method that computes where a cut is stable. Its value holds the problem, or a table of receptances.
///
/// Whoever makes one refuses a case for which the method is not defined, with the reason.
pub trait Method: Sync {
    /// Its name in answers and captions.
    fn name(&self) -> &'static str;

    /// The effects that the method neglects, in words that follow "blind to"; `None` for a method that covers all of linear stability.
    fn blind_to(&self) -> Option<&'static str> {
        None
    }

    /// Settings that its results depend on beside the case, such as a number of steps; `None` where there are none.
    fn settings(&self) -> Option<String> {
        None
    }

    /// The dominant multiplier at a speed, rev/min, and an axial depth, mm, with its error.
    ///
    /// The error is that of the method's own numerics against the motion of the full linear problem where the method
    /// converges to it: of one that does so with an order p in its step, what changes with half the step, times
    /// 2^p/(2^p − 1) and room. What the method is blind to is no part of it.
    ///
    /// # Errors
    /// Speed not positive, depth negative, or a computation that leaves the range of numbers.
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError>;

    /// All crossings of the unit circle from depth 0 to `depth_mm`, sampled at `samples` equal steps and finer where
    /// needed.
    ///
    /// # Errors
    /// As [`point()`](Self::point).
    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError>;

    /// The dominant multiplier at a speed and many depths, mm, in any order, each with its error.
    ///
    /// # Errors
    /// As [`point()`](Self::point).
    fn cells(&self, rpm: f64, depths_mm: &[f64]) -> Result<Vec<Cell>, StabilityError> {
        depths_mm
            .iter()
            .map(|&depth_mm| self.point(rpm, depth_mm).map(|point| Cell::from(&point)))
            .collect()
    }

    /// The lines at many speeds, in their order; the same for any number of threads.
    ///
    /// A method that can use one speed for the next overrides it, in parts that do not depend on the threads.
    ///
    /// # Errors
    /// Those of [`line()`](Self::line), of the first speed that fails.
    fn lines(
        &self,
        speeds_rpm: &[f64],
        depth_mm: f64,
        samples: usize,
    ) -> Result<Vec<SpeedLine>, StabilityError> {
        let lines: Vec<Result<SpeedLine, StabilityError>> = speeds_rpm
            .par_iter()
            .map(|&rpm| self.line(rpm, depth_mm, samples))
            .collect();
        lines.into_iter().collect()
    }
}
/// Label of a result: the method, its settings and its limits.
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
    /// The label of a method.
    pub fn of<M: Method + ?Sized>(method: &M) -> Self {
        Self {
            method: method.name(),
            settings: method.settings(),
            blind_to: method.blind_to(),
        }
    }
}

/// For captions.
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
