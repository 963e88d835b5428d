//! The rightmost root of the loop of cut and structure at one spindle speed and axial depth, and the dominant Floquet
//! multiplier (characteristic multiplier) that belongs to it.

use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::newton::Newton;

use super::averaged::AveragedLoop;
use super::limits::unstable_roots;
use super::loci::{steps, trace};
use super::open_loop::OpenLoop;
use super::problem::FrequencyProblem;
use crate::criteria::{
    LEAST_ERROR, LOCUS_REACH, PREDICTED_BETWEEN, PREDICTED_DISTANCE, PREDICTED_LAG, ROOT_LINES,
};
use crate::error::{Breakdown, StabilityError};
use crate::limits::point::CutStability;
use crate::spectrum::stability_loss::StabilityLoss;

/// Text for the error that the dominant multiplier is not found from receptances.
pub(crate) const NO_ROOT: &str = "the rightmost root cannot be found from receptances; limits can";

/// Rightmost root s of a loop, 1/s, with Im s ≥ 0, at an axial depth, m.
///
/// First, the poles of a modelled structure are the starting values of roots. Then loci are traced along lines Re s =
/// σ: if one passes near 1/w, its linear continuation away from the line predicts a root, which is then solved for. The
/// rightmost root found is verified by counting the roots to its right; with a table of receptances, by counting the
/// unstable roots only.
///
/// # Errors
/// No root is verified; the reason is that of the last line Re s = σ along which loci could not be traced, if there is
/// one.
pub(crate) fn rightmost(open_loop: &impl OpenLoop, depth_m: f64) -> Result<Complex64, Breakdown> {
    let decay = open_loop
        .problem()
        .resonances()
        .iter()
        .map(|resonance| resonance.width)
        .fold(f64::INFINITY, f64::min);
    // Without resonances there is no slowest decay rate: all lines Re s = σ then coincide with the imaginary axis.
    let decay = if decay.is_finite() { decay } else { 0.0 };
    let mut best = from_poles(open_loop, depth_m);
    if let Some(root) = best
        && is_rightmost(open_loop, depth_m, root, decay)
    {
        return Ok(root);
    }
    let mut reason = Breakdown::NoSolution;
    for multiple in ROOT_LINES {
        let found = match from_line(open_loop, depth_m, multiple * decay, decay) {
            Ok(found) => found,
            Err(cause) => {
                reason = cause;
                None
            }
        };
        best = [best, found]
            .into_iter()
            .flatten()
            .max_by(|p, q| p.re.total_cmp(&q.re));
        if let Some(root) = found.and(best)
            && is_rightmost(open_loop, depth_m, root, decay)
        {
            return Ok(root);
        }
    }
    Err(reason)
}

/// Rightmost of the loop's roots found with the poles of the modelled structure as starting values; `None` if none is
/// found.
fn from_poles(open_loop: &impl OpenLoop, depth_m: f64) -> Option<Complex64> {
    open_loop
        .problem()
        .poles()
        .iter()
        .filter(|pole| pole.im >= 0.0)
        .filter_map(|&pole| polish(open_loop, depth_m, open_loop.folded(pole)))
        .max_by(|p, q| p.re.total_cmp(&q.re))
        .map(|root| Complex64::new(root.re, root.im.abs()))
}

/// Rightmost of the loop's roots that are predicted from characteristic loci along a line Re s = `sigma`; `None` if
/// there is none, or at depth 0.
fn from_line(
    open_loop: &impl OpenLoop,
    depth_m: f64,
    sigma: f64,
    decay: f64,
) -> Result<Option<Complex64>, Breakdown> {
    let target = depth_m.recip();
    if !target.is_finite() {
        return Ok(None);
    }
    let floor = LOCUS_REACH * target;
    let grid = open_loop.grid(target)?;
    let loci = |omega: f64| loci_at(open_loop, Complex64::new(sigma, omega), 0.2 * floor);
    let samples = trace(&loci, &grid, floor, 1.0)?;
    let mut best: Option<Complex64> = None;
    for [(low, from), (high, to)] in steps(&samples) {
        let share = (target - from) / (to - from);
        let width = high - low;
        if !PREDICTED_BETWEEN.contains(&share.re)
            || share.im.abs() * width > PREDICTED_DISTANCE * (width + decay)
        {
            continue;
        }
        let guess = Complex64::new(sigma, low) + Complex64::I * share * width;
        if best.is_some_and(|best| guess.re < best.re - PREDICTED_LAG * decay - (best.re - sigma).abs()) {
            continue;
        }
        if let Some(root) = polish(open_loop, depth_m, guess)
            && best.is_none_or(|best| root.re > best.re)
        {
            best = Some(Complex64::new(root.re, root.im.abs()));
        }
    }
    Ok(best)
}

/// True if counting shows that the loop has no root to the right of the given one, that is with a larger real part.
/// With a table of receptances: true if it shows that unstable roots exist exactly when the given one is unstable.
fn is_rightmost(open_loop: &impl OpenLoop, depth_m: f64, root: Complex64, decay: f64) -> bool {
    // The roots are counted to the right of a line Re s = const that lies slightly right of the given root.
    let sigma = root.re + 1e-3 * (root.re.abs() + 1e-3 * decay);
    if open_loop.problem().band_hz().is_none() {
        return unstable_roots(open_loop, depth_m, sigma) == Some(0);
    }
    // The poles of a table of receptances away from the imaginary axis are not known; only whether a root lies right of
    // that axis can be verified.
    unstable_roots(open_loop, depth_m, 0.0).is_some_and(|unstable| (unstable > 0) == (root.re > 0.0))
}

/// Characteristic loci κλ/w at a complex exponent s off the imaginary axis as well, 1/m: those of absolute value
/// `floor` and above, and possibly smaller ones.
fn loci_at(open_loop: &impl OpenLoop, s: Complex64, floor: f64) -> Result<Vec<Complex64>, Breakdown> {
    let regeneration = open_loop.regeneration(s);
    let size = regeneration.norm();
    if size < 1e-14 {
        return Ok(Vec::new());
    }
    let mut loci = open_loop.eigenvalues(s, floor / size)?;
    for locus in &mut loci {
        *locus *= regeneration;
    }
    Ok(loci)
}

/// Root s of a loop near a guess, by secant steps on w − 1/ℓ with the axial depth w and the characteristic locus ℓ(s) =
/// κλ/w for which the difference is smallest. `None` if the steps do not converge, leave the neighbourhood of the
/// guess, or end where the difference is not small.
pub(crate) fn polish(open_loop: &impl OpenLoop, depth_m: f64, guess: Complex64) -> Option<Complex64> {
    // Least axial depth, m, that sets the floor of loci and the tolerance. At depth 0 the roots are poles, where a
    // locus is infinite.
    const SHALLOW_M: f64 = 1e-3;
    let floor = 0.3 / depth_m.max(SHALLOW_M);
    let miss = |s: Complex64| {
        let loci = loci_at(open_loop, s, floor).ok()?;
        loci.into_iter()
            .map(|locus| depth_m - locus.inv())
            .min_by(|p, q| p.norm().total_cmp(&q.norm()))
    };
    // A characteristic locus is infinite at a pole of the loop, which is the root at depth 0.
    let is_pole = depth_m == 0.0;
    let scale = guess.norm().max(1e-6);
    let mut before = guess + Complex64::new(1e-4, 1e-4) * scale;
    let mut miss_before = miss(before)?;
    let start = guess + Complex64::new(1e-6, 0.0) * scale;
    let root = Newton::new(40, 1e-13)
        .with_least_size(scale)
        .solve(start, |&s: &Complex64| {
            if (s - guess).norm() > 0.3 * scale {
                return Err(Stop::LeftDomain);
            }
            let Some(miss_now) = miss(s) else {
                return if is_pole {
                    Ok(Complex64::ZERO)
                } else {
                    Err(Stop::LeftDomain)
                };
            };
            if miss_now.norm() < 1e-13 * depth_m.max(1e-3 * SHALLOW_M) {
                return Ok(Complex64::ZERO);
            }
            let step = miss_now * (s - before) / (miss_now - miss_before);
            (before, miss_before) = (s, miss_now);
            Ok(step)
        })
        .converged()?;
    match miss(root) {
        Some(miss) => (miss.norm() < 1e-6 * depth_m.max(SHALLOW_M)).then_some(root),
        None => is_pole.then_some(root),
    }
}

/// Dominant Floquet multiplier of a loop with averaged coefficients.
///
/// With a table of receptances the stated error contains the change of the multiplier when every second line is
/// omitted, infinite if no root is found then. Cubic interpolation through all lines errs by about a sixteenth of that
/// change where lines are dense.
///
/// # Errors
/// The root cannot be found or verified, or lies outside the measured frequencies.
pub(crate) fn averaged_point(
    problem: &FrequencyProblem,
    rpm: f64,
    depth_mm: f64,
    open_loop: impl Fn(&FrequencyProblem) -> AveragedLoop<'_>,
) -> Result<CutStability, StabilityError> {
    let at = |problem: &FrequencyProblem| rightmost(&open_loop(problem), depth_mm * 1e-3);
    let root = at(problem).map_err(|cause| cause.at(rpm, depth_mm, NO_ROOT))?;
    let multiplier = |root: Complex64| (root * problem.tooth_period_s(rpm)).exp();
    let error = match problem.thinned() {
        Some(thinned) => at(&thinned).map_or(f64::INFINITY, |other| {
            (multiplier(other) - multiplier(root)).norm()
        }),
        None => 0.0,
    };
    let chatter_hz = root.im.abs() / std::f64::consts::TAU;
    problem.check_band(Some(chatter_hz), rpm, depth_mm)?;
    let kind = if root.im == 0.0 {
        StabilityLoss::Fold
    } else {
        StabilityLoss::Hopf
    };
    Ok(point_of(
        rpm,
        depth_mm,
        multiplier(root),
        error,
        kind,
        Some(chatter_hz),
    ))
}

/// Stability of a cut from its dominant multiplier and the error of that multiplier, to which [`LEAST_ERROR`] is added.
pub(crate) fn point_of(
    rpm: f64,
    depth_mm: f64,
    multiplier: Complex64,
    error: f64,
    kind: StabilityLoss,
    chatter_hz: Option<f64>,
) -> CutStability {
    let error = error + LEAST_ERROR * multiplier.norm().max(1.0);
    let point = CutStability::new(rpm, depth_mm, multiplier, error, chatter_hz);
    CutStability { kind, ..point }
}
