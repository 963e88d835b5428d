//! The multi-frequency solution (Budak & Altintas 1998, Merdol & Altintas 2004), with harmonics of the directional
//! coefficients. Roots s of the loop give the Floquet multipliers (characteristic multipliers) exp(sτ).

use num_complex::Complex64;

use crate::criteria::{HARMONICS_SETTLED_LIMIT, HARMONICS_SETTLED_MULTIPLIER, SAME_WITH_TWICE_HARMONICS};
use crate::error::{NOT_FINITE, StabilityError};
use crate::frequency::averaged::AveragedLoop;
use crate::frequency::fitted_line::fitted_line;
use crate::frequency::fitted_point::fitted_point;
use crate::frequency::fitted_structure::FittedStructure;
use crate::frequency::harmonic::HarmonicLoop;
use crate::frequency::limits::{AxisCrossing, limits, speed_line};
use crate::frequency::problem::FrequencyProblem;
use crate::frequency::root::{NO_ROOT, point_of, polish, rightmost};
use crate::limits::bounds::{check_depth, check_speed};
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;
use crate::spectrum::stability_loss::StabilityLoss;

/// Number K of harmonics of the tooth-passing frequency at about which its doubling stops: a limit on computing time. A
/// choice.
const HARMONICS_MAX: usize = 400;

/// Multi-frequency solution on modelled or measured receptances.
///
/// The harmonic transfer matrix contains harmonics from −K−1 to K of the tooth-passing frequency and includes flips. If
/// K is not set, it is doubled until the result settles.
#[derive(Clone, Debug)]
pub struct MultiFrequency {
    /// Receptances and cutting process.
    pub problem: FrequencyProblem,
    /// Number K of harmonics of the tooth-passing frequency; `None` doubles K until the limits or the multiplier
    /// settle.
    pub harmonics: Option<usize>,
}

impl MultiFrequency {
    fn open_loop(&self, rpm: f64, harmonics: usize) -> HarmonicLoop<'_> {
        HarmonicLoop::new(&self.problem, rpm, harmonics)
    }

    /// Harmonic loop with as many harmonics as the limits need to settle, its limits, and the limits with half as many
    /// harmonics. If the user sets the number K: loop and limits with K, and the limits with 2K + 1.
    fn settled(&self, rpm: f64, depth_mm: f64) -> Result<Settled<'_>, StabilityError> {
        let broke_down = |what| StabilityError::BrokeDown { rpm, depth_mm, what };
        let find = |harmonics| {
            let open_loop = self.open_loop(rpm, harmonics);
            limits(&open_loop, depth_mm * 1e-3)
                .map(|limits| (open_loop, limits))
                .map_err(|cause| cause.at(rpm, depth_mm, NOT_FINITE))
        };
        if let Some(harmonics) = self.harmonics {
            let (open_loop, limits) = find(harmonics)?;
            let (_, other) = find(2 * harmonics + 1)?;
            return Ok((open_loop, limits, other));
        }
        let mut harmonics = HarmonicLoop::least_harmonics(&self.problem, rpm);
        let mut found = find(harmonics)?;
        while 2 * harmonics <= HARMONICS_MAX {
            harmonics *= 2;
            let finer = find(harmonics)?;
            let change = largest_change(&found.1, &finer.1, depth_mm * 1e-3);
            let (_, coarser) = std::mem::replace(&mut found, finer);
            if change.is_some_and(|change| change <= HARMONICS_SETTLED_LIMIT) {
                return Ok((found.0, found.1, coarser));
            }
        }
        Err(broke_down(
            "limits do not settle with the harmonics that can be computed",
        ))
    }
}

type Settled<'a> = (HarmonicLoop<'a>, Vec<AxisCrossing>, Vec<AxisCrossing>);

/// Largest relative change in depth between two lists of limits; `None` if the lists do not contain the same limits.
fn largest_change(coarse: &[AxisCrossing], fine: &[AxisCrossing], depth_m: f64) -> Option<f64> {
    // A limit close to the last depth may lie beyond it in one of the two lists; such limits are not compared.
    let inside = |limits: &[AxisCrossing]| -> Vec<AxisCrossing> {
        let within = limits
            .iter()
            .filter(|limit| limit.depth_m < (1.0 - HARMONICS_SETTLED_LIMIT) * depth_m);
        within.copied().collect()
    };
    let (coarse, fine) = (inside(coarse), inside(fine));
    if coarse.len() != fine.len() {
        return None;
    }
    let mut free = fine;
    let mut largest = 0.0_f64;
    for limit in coarse {
        let change = |other: &AxisCrossing| (other.depth_m / limit.depth_m - 1.0).abs();
        let (index, nearest) = free
            .iter()
            .enumerate()
            .filter(|(_, other)| other.kind == limit.kind && other.outward == limit.outward)
            .map(|(index, other)| (index, change(other)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        if nearest > SAME_WITH_TWICE_HARMONICS {
            return None;
        }
        free.swap_remove(index);
        largest = largest.max(nearest);
    }
    Some(largest)
}

impl Method for MultiFrequency {
    fn name(&self) -> &'static str {
        "multi-frequency"
    }

    fn settings(&self) -> Option<String> {
        let fitted = self.fitted()?;
        let deviation = if fitted.error < 1e-4 {
            "less than 0.01 %".into()
        } else {
            format!("{:.2} %", 100.0 * fitted.error)
        };
        Some(format!(
            "limits of {} fitted modes, which deviate from the table by {deviation} of its largest receptance",
            fitted.count(),
        ))
    }

    fn takes_seconds(&self) -> bool {
        self.fitted().is_none()
    }

    /// Computes the dominant multiplier with 2K + 1 harmonics. If K is not set, it starts from the least number and is
    /// doubled further until the multiplier settles or `HARMONICS_MAX` is reached. The error contains the change by the
    /// last doubling. Of a table of receptances that a structure fits, it is that of the structure, with the deviation of
    /// the table in the error.
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        if let Some(fitted) = self.fitted() {
            return fitted_point(&self.problem, fitted, rpm, depth_mm);
        }
        let broke_down = |what| StabilityError::BrokeDown { rpm, depth_mm, what };
        let depth_m = depth_mm * 1e-3;
        let delay_s = self.problem.tooth_period_s(rpm);
        let mut harmonics = self
            .harmonics
            .unwrap_or_else(|| HarmonicLoop::least_harmonics(&self.problem, rpm));
        let mut root = rightmost(&self.open_loop(rpm, harmonics), depth_m)
            .map_err(|cause| cause.at(rpm, depth_mm, NO_ROOT))?;
        loop {
            let finer = self.open_loop(rpm, 2 * harmonics + 1);
            let before = (root * delay_s).exp();
            root = polish(&finer, depth_m, root)
                .ok_or(broke_down("the rightmost root is lost with more harmonics"))?;
            let multiplier = (root * delay_s).exp();
            let change = (multiplier - before).norm();
            harmonics = 2 * harmonics + 1;
            let is_enough = change <= HARMONICS_SETTLED_MULTIPLIER * multiplier.norm().max(1.0);
            if self.harmonics.is_some() || is_enough || 2 * harmonics > HARMONICS_MAX {
                return self.stability_of_root(&finer, rpm, depth_mm, root, change);
            }
        }
    }

    /// Without a set number of harmonics, limits from a table of receptances are those of a structure that is fitted to
    /// it, if one fits to `FIT_ERROR_MAX`; their error contains the deviation from the table.
    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        check_speed(rpm)?;
        check_depth(depth_mm)?;
        AveragedLoop::check_reach(&self.problem, rpm, depth_mm)?;
        match self.fitted() {
            Some(fitted) => fitted_line(&self.problem, fitted, rpm, depth_mm, samples),
            None => self.harmonic_line(rpm, depth_mm),
        }
    }
}

impl MultiFrequency {
    /// Structure fitted to the table of receptances, whose limits are used; `None` if the harmonics are set or no
    /// structure fits.
    fn fitted(&self) -> Option<&FittedStructure> {
        match self.harmonics {
            Some(_) => None,
            None => self.problem.fitted(),
        }
    }

    /// Limits at one spindle speed from the harmonic transfer matrix.
    pub(crate) fn harmonic_line(&self, rpm: f64, depth_mm: f64) -> Result<SpeedLine, StabilityError> {
        let (open_loop, limits, other) = self.settled(rpm, depth_mm)?;
        let mut others = vec![other];
        others.extend(open_loop.thinned_limits(depth_mm * 1e-3));
        speed_line(&open_loop, rpm, depth_mm, &limits, &others, |limit| {
            open_loop.chatter_hz(limit)
        })
    }

    /// Stability of a cut from a root s, with the error due to the truncated harmonics and to the table of receptances.
    fn stability_of_root(
        &self,
        open_loop: &HarmonicLoop<'_>,
        rpm: f64,
        depth_mm: f64,
        root: Complex64,
        change: f64,
    ) -> Result<CutStability, StabilityError> {
        let delay_s = self.problem.tooth_period_s(rpm);
        let depth_m = depth_mm * 1e-3;
        let multiplier = (root * delay_s).exp();
        let of_lines = match self.problem.thinned() {
            Some(thinned) => {
                let coarse = HarmonicLoop::new(&thinned, rpm, open_loop.harmonics());
                polish(&coarse, depth_m, root).map_or(f64::INFINITY, |other| {
                    ((other * delay_s).exp() - multiplier).norm()
                })
            }
            None => 0.0,
        };
        // A multiplier within 1e-9 |μ| of the real axis, which truncation may cause, is taken as real: a flip lies
        // exactly on the axis.
        let is_real = multiplier.im.abs() <= 1e-9 * multiplier.norm();
        let multiplier = if is_real {
            Complex64::from(multiplier.re)
        } else {
            multiplier
        };
        let chatter_hz = open_loop.vibration_hz(root, depth_m);
        self.problem.check_band(chatter_hz, rpm, depth_mm)?;
        let kind = StabilityLoss::of(multiplier);
        Ok(point_of(
            rpm,
            depth_mm,
            multiplier,
            change + of_lines,
            kind,
            chatter_hz,
        ))
    }
}
