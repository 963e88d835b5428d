//! The dominant Floquet multiplier (characteristic multiplier) at one speed and depth, with its error.

use num_complex::Complex64;
use serde::Serialize;

use super::bounds::{check_depth, check_speed};
use crate::criteria::{KAPPA_MAX, LEAST_ERROR, MESH_ROOM, RIVAL, UNCONFIRMED, WOUND};
use crate::error::{Breakdown, NO_DOMINANT, StabilityError};
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
    /// Dominant Floquet multiplier over one tooth period, or over the revolution if that is the period of the method's
    /// equation (unequal teeth); of a conjugate pair the one above the real axis.
    #[serde(serialize_with = "as_pair")]
    pub multiplier: Complex64,
    /// Absolute value |μ| of the dominant multiplier.
    pub multiplier_abs: f64,
    /// Error estimate of the multiplier: see [`Method::point`](crate::Method::point). Collocation over the tooth period
    /// takes it from a second, finer mesh. If its period map is not reliable, it is at least the distance from |μ| to
    /// the radius beyond which a winding number counts no multiplier, since a larger multiplier may lie between. If no
    /// multiplier above 0.25 was found then, it is that radius itself.
    pub error: f64,
    /// Verdict from |μ| and its error. It is also unstable if this multiplier certainly lies outside the unit circle,
    /// even if a larger one may exist.
    pub verdict: Verdict,
    /// Kind of stability loss: how the dominant multiplier leaves the unit circle, or would leave it if it grew.
    pub kind: StabilityLoss,
    /// Frequency of the vibration that belongs to the dominant multiplier, Hz; `None` if it cannot be computed.
    pub chatter_hz: Option<f64>,
}

impl CutStability {
    /// Stability of a cut from its dominant multiplier (either one of a conjugate pair) and the error of that
    /// multiplier.
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

/// Dominant multiplier of a cut at a spindle speed (rev/min) and an axial depth (mm).
///
/// # Errors
/// Speed not positive, depth negative, one of them not finite, too many vibrations in a tooth period, or a computation
/// that breaks down, for example because it leaves the range of numbers.
pub fn point(problem: &Problem, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
    check_speed(rpm)?;
    check_depth(depth_mm)?;
    check_length(problem, rpm, depth_mm)?;
    let depth_m = depth_mm * 1e-3;
    let scan = Period::new(problem, rpm, 2.0 * depth_m, Resolution::SCAN);
    let scanned = period_map::largest(&scan, depth_m, RIVAL);
    let failed = scanned.as_ref().err().copied();
    let candidates = scanned.unwrap_or_default();
    let certain = candidates
        .is_certain
        .then(|| ScannedMultipliers::new(&candidates.multipliers, depth_m));
    let of_maps = || of_maps(problem, rpm, depth_m, certain.as_ref()?);
    let found = match &certain {
        Some(rough) if rough.kappa_m > KAPPA_MAX * depth_m => of_maps(),
        Some(rough) => confirmed(problem, rpm, depth_m, rough),
        None => None,
    };
    // Newton's method from the eigenvalues of the period map does not converge if rounding has moved these eigenvalues;
    // a winding number is used then.
    let found = found
        .or_else(|| searched(problem, rpm, depth_m, &candidates.multipliers))
        .or_else(of_maps)
        .ok_or_else(|| {
            failed
                .unwrap_or(Breakdown::NoSolution)
                .at(rpm, depth_mm, NO_DOMINANT)
        })?;
    let multiplier = Complex64::new(found.multiplier.re, found.multiplier.im.abs());
    let chatter_hz = chatter_hz(problem, rpm, &found.period, multiplier, depth_m);
    let point = CutStability::new(rpm, depth_mm, multiplier, found.error, chatter_hz);
    Ok(CutStability {
        verdict: found.verdict.unwrap_or(point.verdict),
        ..point
    })
}

/// Dominant Floquet multiplier of a cut with its error, before the chatter frequency is known.
struct Solution {
    multiplier: Complex64,
    error: f64,
    /// Working mesh of the tooth period.
    period: Period,
    /// Verdict on the cut, if it is more certain than |μ| and its error show; otherwise `None`.
    verdict: Option<Verdict>,
}

/// Error of a multiplier: [`MESH_ROOM`] times its change between the working and a finer mesh, and at least `least`,
/// relative to max(1, |μ|).
fn error(coarse: Complex64, fine: Complex64, least: f64) -> f64 {
    (MESH_ROOM * (coarse - fine).norm()).max(least * fine.norm().max(1.0))
}

/// Floquet multipliers from a coarse mesh of the tooth period, as starting values.
struct ScannedMultipliers {
    /// Floquet multipliers on the coarse mesh; of a conjugate pair the upper one.
    multipliers: Vec<Complex64>,
    /// Largest complex depth |w (1 − 1/μ)| of these multipliers at the axial depth w, m, and at least 2 w, its largest
    /// value on the unit circle.
    kappa_m: f64,
}

impl ScannedMultipliers {
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

/// Dominant Floquet multiplier of a cut on the working and a finer mesh by Newton's method; `None` if [`dominant_of`]
/// fails on one of them.
fn confirmed(problem: &Problem, rpm: f64, depth_m: f64, rough: &ScannedMultipliers) -> Option<Solution> {
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

/// Dominant Floquet multiplier of a cut from the period maps on the working and a finer mesh, for multipliers too small
/// for Newton's method, and if all else fails; `None` if one of the maps fails or its largest multipliers are not
/// certain.
fn of_maps(problem: &Problem, rpm: f64, depth_m: f64, rough: &ScannedMultipliers) -> Option<Solution> {
    let kappa_m = rough.kappa_m.min(KAPPA_MAX * depth_m);
    let largest = |resolution, share| {
        let period = Period::new(problem, rpm, kappa_m, resolution);
        let found = period_map::largest(&period, depth_m, share)
            .ok()
            .filter(|found| found.is_certain);
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

/// Dominant Floquet multiplier of a cut if period maps are not reliable: the largest one found. Its error reaches at
/// least to a radius beyond which a winding number counts no multiplier. `None` if there is no such radius, if no
/// candidate lies within it, or if the multiplier is lost on the finer mesh.
fn searched(problem: &Problem, rpm: f64, depth_m: f64, candidates: &[Complex64]) -> Option<Solution> {
    let kappa_m = (1.0 + WOUND.recip()) * depth_m;
    let working = Period::new(problem, rpm, kappa_m, Resolution::WORKING);
    let characteristic = Characteristic::new(&working, kappa_m);
    let beyond = Search::new(&characteristic, depth_m).largest(candidates);
    if !beyond.radius.is_finite() {
        return None;
    }
    let Some(coarse) = beyond.multiplier else {
        // All multipliers lie within `beyond.radius`. It may remain open which of the candidates is the largest.
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
        // A larger multiplier may lie between the largest one found and the radius beyond which none was counted.
        error: own.max(beyond.radius - fine.norm()),
        period: working,
        // If this multiplier certainly lies outside the unit circle, the cut is unstable: a larger multiplier would lie
        // outside as well.
        verdict: (fine.norm() - own > 1.0).then_some(Verdict::Unstable),
    })
}

/// Largest of the Floquet multipliers to which Newton's method converges from the guesses; `None` if there is no guess,
/// or if the method fails from one or moves by more than 5 % of it.
fn dominant_of(period: &Period, kappa_m: f64, depth_m: f64, guesses: &[Complex64]) -> Option<Complex64> {
    let characteristic = Characteristic::new(period, kappa_m);
    let mut work = characteristic.workspace();
    let found: Option<Vec<Complex64>> = guesses
        .iter()
        .map(|&guess| characteristic.multiplier_near(guess, depth_m, 0.05 * guess.norm(), &mut work))
        .collect();
    found?.into_iter().max_by(|p, q| p.norm().total_cmp(&q.norm()))
}
