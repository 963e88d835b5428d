//! The dominant Floquet multiplier (characteristic multiplier) at one speed and depth, with its error.

use num_complex::Complex64;
use serde::Serialize;

use super::bounds::{check_depth, check_speed};
use crate::criteria::{KAPPA_MAX, LEAST_ERROR, MESH_ROOM, RIVAL, UNCONFIRMED, WOUND};
use crate::error::StabilityError;
use crate::problem::linear::Problem;
use crate::problem::period::{Period, Resolution, check_length};
use crate::spectrum::characteristic::Characteristic;
use crate::spectrum::chatter_frequency::chatter_hz;
use crate::spectrum::period_map;
use crate::spectrum::stability_loss::StabilityLoss;
use crate::spectrum::verdict::Verdict;
use crate::spectrum::winding::Search;

/// Stability of one cut: its dominant Floquet multiplier with the stated error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CutStability {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// The dominant multiplier over one tooth period; of a pair the one above the real axis.
    #[serde(serialize_with = "as_pair")]
    pub multiplier: Complex64,
    /// Its absolute value.
    pub multiplier_abs: f64,
    /// An estimate of the error of the multiplier, from a second, finer collocation. Where the multipliers of nearly one size are
    /// too many to tell which is the largest, how much larger or, below 0.27, how different the largest may be.
    pub error: f64,
    /// The verdict that follows; unstable also where it is certain that this multiplier lies outside and a larger one is not excluded.
    pub verdict: Verdict,
    /// How the dominant multiplier leaves, or would leave, the unit circle.
    pub kind: StabilityLoss,
    /// Frequency of the motion that belongs to the dominant multiplier, Hz.
    pub chatter_hz: Option<f64>,
}

impl CutStability {
    /// A point from its dominant multiplier, either one of a pair, and the error of it: size, verdict and kind follow.
    pub(crate) fn new(
        rpm: f64,
        depth_mm: f64,
        multiplier: Complex64,
        error: f64,
        chatter_hz: Option<f64>,
    ) -> Self {
        let multiplier = Complex64::new(multiplier.re, multiplier.im.abs());
        let multiplier_abs = multiplier.norm();
        Self {
            rpm,
            depth_mm,
            multiplier,
            multiplier_abs,
            error,
            verdict: Verdict::of(multiplier_abs, error),
            kind: StabilityLoss::of(multiplier),
            chatter_hz,
        }
    }
}

fn as_pair<S: serde::Serializer>(value: &Complex64, serializer: S) -> Result<S::Ok, S::Error> {
    [value.re, value.im].serialize(serializer)
}

/// The dominant multiplier at a speed and depth.
///
/// # Errors
/// Speed not positive, depth negative, or a computation that leaves the range of numbers.
pub fn point(problem: &Problem, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
    check_speed(rpm)?;
    check_depth(depth_mm)?;
    check_length(problem, rpm, depth_mm)?;
    let broke_down = |what| StabilityError::BrokeDown { rpm, depth_mm, what };
    let depth_m = depth_mm * 1e-3;
    let scan = Period::new(problem, rpm, 2.0 * depth_m, Resolution::SCAN);
    let candidates = period_map::largest(&scan, depth_m, RIVAL).unwrap_or_default();
    let certain = candidates
        .is_certain
        .then(|| Rough::new(&candidates.multipliers, depth_m));
    let of_maps = || of_maps(problem, rpm, depth_m, certain.as_ref()?);
    let found = match &certain {
        Some(rough) if rough.kappa_m > KAPPA_MAX * depth_m => of_maps(),
        Some(rough) => confirmed(problem, rpm, depth_m, rough),
        None => None,
    };
    // Where Newton leads nowhere from the multipliers of a map, rounding has moved them.
    let found = found
        .or_else(|| searched(problem, rpm, depth_m, &candidates.multipliers))
        .or_else(of_maps)
        .ok_or_else(|| {
            broke_down(
                "motions grow beyond the range of numbers, or multipliers of nearly one size are too many to tell apart",
            )
        })?;
    let multiplier = Complex64::new(found.multiplier.re, found.multiplier.im.abs());
    let chatter_hz = chatter_hz(problem, rpm, &found.period, multiplier, depth_m);
    let point = CutStability::new(rpm, depth_mm, multiplier, found.error, chatter_hz);
    Ok(CutStability {
        verdict: found.verdict.unwrap_or(point.verdict),
        ..point
    })
}

/// The dominant multiplier.
struct Solution {
    multiplier: Complex64,
    error: f64,
    /// The period at the working resolution.
    period: Period,
    /// Where more is known than multiplier and error say.
    verdict: Option<Verdict>,
}

/// From what changes between the working and a finer resolution; no less than `least`, relative to max(1, |μ|).
fn error(coarse: Complex64, fine: Complex64, least: f64) -> f64 {
    (MESH_ROOM * (coarse - fine).norm()).max(least * fine.norm().max(1.0))
}

/// Multipliers of a rough map.
struct Rough {
    /// Of pairs the upper ones.
    multipliers: Vec<Complex64>,
    /// The complex depth w (1 − 1/μ) of the smallest of them, m; for those near the unit circle it is about twice the depth.
    kappa_m: f64,
}

impl Rough {
    fn new(multipliers: &[Complex64], depth_m: f64) -> Self {
        let upper = multipliers
            .iter()
            .copied()
            .filter(|multiplier| multiplier.im >= 0.0);
        let multipliers: Vec<Complex64> = upper.collect();
        let kappa_m = multipliers
            .iter()
            .map(|multiplier| (Complex64::ONE - multiplier.inv()).norm() * depth_m)
            .fold(2.0 * depth_m, f64::max);
        Self { multipliers, kappa_m }
    }
}

/// The dominant multiplier at the working and at a finer resolution by Newton; `None` where that leads nowhere.
fn confirmed(problem: &Problem, rpm: f64, depth_m: f64, rough: &Rough) -> Option<Solution> {
    let dominant = |resolution, guesses: &[Complex64]| {
        let period = Period::new(problem, rpm, rough.kappa_m, resolution);
        let found = dominant_of(&period, rough.kappa_m, depth_m, guesses);
        found.map(|found| (found, period))
    };
    let (coarse, period) = dominant(Resolution::WORKING, &rough.multipliers)?;
    let (fine, _) = dominant(Resolution::FINE, &[coarse])?;
    Some(Solution {
        multiplier: fine,
        error: error(coarse, fine, LEAST_ERROR),
        period,
        verdict: None,
    })
}

/// The same from the multipliers of the maps themselves: of small ones, which are out of Newton's reach.
fn of_maps(problem: &Problem, rpm: f64, depth_m: f64, rough: &Rough) -> Option<Solution> {
    let kappa_m = rough.kappa_m.min(KAPPA_MAX * depth_m);
    let largest = |resolution, share| {
        let period = Period::new(problem, rpm, kappa_m, resolution);
        let found = period_map::largest(&period, depth_m, share).filter(|found| found.is_certain);
        found.map(|found| (found.multipliers, period))
    };
    let (coarse, period) = largest(Resolution::WORKING, 1.0)?;
    let coarse = *coarse.first()?;
    let (fine, _) = largest(Resolution::FINE, RIVAL)?;
    let fine = fine
        .into_iter()
        .min_by(|p, q| (p - coarse).norm().total_cmp(&(q - coarse).norm()))?;
    Some(Solution {
        multiplier: fine,
        error: error(coarse, fine, UNCONFIRMED),
        period,
        verdict: None,
    })
}

/// The dominant multiplier where maps do not tell: one that is found, and a radius beyond which none is.
fn searched(problem: &Problem, rpm: f64, depth_m: f64, candidates: &[Complex64]) -> Option<Solution> {
    let kappa_m = (1.0 + WOUND.recip()) * depth_m;
    let working = Period::new(problem, rpm, kappa_m, Resolution::WORKING);
    let characteristic = Characteristic::new(&working, kappa_m);
    let beyond = Search::new(&characteristic, depth_m).largest(candidates);
    if !beyond.radius.is_finite() {
        return None;
    }
    let Some(coarse) = beyond.multiplier else {
        // All are small, and which is the largest may remain open.
        let within = |candidate: &&Complex64| candidate.norm() < beyond.radius;
        return Some(Solution {
            multiplier: *candidates.iter().find(within)?,
            error: beyond.radius,
            period: working,
            verdict: None,
        });
    };
    let finer = Period::new(problem, rpm, kappa_m, Resolution::FINE);
    let fine = dominant_of(&finer, kappa_m, depth_m, &[coarse])?;
    let own = error(coarse, fine, LEAST_ERROR);
    Some(Solution {
        multiplier: fine,
        // Another may lie between this one and the radius.
        error: own.max(beyond.radius - fine.norm()),
        period: working,
        // Then that one lies outside as well.
        verdict: (fine.norm() - own > 1.0).then_some(Verdict::Unstable),
    })
}

/// The largest of the multipliers near guesses, by Newton; `None` where one of them leads nowhere.
fn dominant_of(period: &Period, kappa_m: f64, depth_m: f64, guesses: &[Complex64]) -> Option<Complex64> {
    let characteristic = Characteristic::new(period, kappa_m);
    let mut work = characteristic.workspace();
    let found: Option<Vec<Complex64>> = guesses
        .iter()
        .map(|&guess| characteristic.multiplier_near(guess, depth_m, 0.05 * guess.norm(), &mut work))
        .collect();
    found?.into_iter().max_by(|p, q| p.norm().total_cmp(&q.norm()))
}
