//! The dominant multiplier at one speed and depth, with its error.

use num_complex::Complex64;
use serde::Serialize;

use super::characteristic::Characteristic;
use super::collocation;
use super::multiplier::{Kind, Verdict, chatter_hz};
use super::period::{Period, Resolution};
use super::{Problem, StabilityError};

/// The least error that is ever stated, relative to max(1, |μ|): what has been checked against independent
/// computations. Collocation itself settles at 1e-10 and below.
pub const LEAST_ERROR: f64 = 1e-7;

/// What is known of one working point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// The dominant multiplier over one tooth period; of a pair the one above the real axis.
    #[serde(serialize_with = "as_pair")]
    pub multiplier: Complex64,
    /// Its absolute value.
    pub multiplier_abs: f64,
    /// An estimate of the error of the multiplier, from a second, finer collocation.
    pub error: f64,
    /// What follows.
    pub verdict: Verdict,
    /// How the dominant multiplier leaves, or would leave, the unit circle.
    pub kind: Kind,
    /// Frequency of the motion that belongs to the dominant multiplier, Hz.
    pub chatter_hz: Option<f64>,
}

fn as_pair<S: serde::Serializer>(value: &Complex64, serializer: S) -> Result<S::Ok, S::Error> {
    [value.re, value.im].serialize(serializer)
}

/// The dominant multiplier at a speed and depth.
///
/// # Errors
/// Speed not positive, depth negative, or a computation that leaves the range of numbers.
pub fn point(problem: &Problem, rpm: f64, depth_mm: f64) -> Result<Point, StabilityError> {
    check_speed(rpm)?;
    check_depth(depth_mm)?;
    let broke_down = |what| StabilityError::BrokeDown { rpm, depth_mm, what };
    let depth_m = depth_mm * 1e-3;
    // |w (1 − 1/μ)| is about twice the depth for the multipliers that matter, those near the unit circle.
    let period = Period::new(problem, rpm, 2.0 * depth_m, Resolution::WORKING);
    let coarse = collocation::dominant(&period, depth_m)
        .ok_or_else(|| broke_down("the collocation equations have no finite solution"))?;
    let finer = Period::new(problem, rpm, 2.0 * depth_m, Resolution::FINE);
    let fine = nearest(&finer, coarse, depth_m)
        .ok_or_else(|| broke_down("a finer collocation has no multiplier near the one found"))?;
    let multiplier = Complex64::new(fine.re, fine.im.abs());
    let multiplier_abs = multiplier.norm();
    let error = (10.0 * (coarse - fine).norm()).max(LEAST_ERROR * multiplier_abs.max(1.0));
    Ok(Point {
        rpm,
        depth_mm,
        multiplier,
        multiplier_abs,
        error,
        verdict: Verdict::of(multiplier_abs, error),
        kind: Kind::of(multiplier),
        chatter_hz: chatter_hz(problem, rpm, &finer, multiplier, depth_m),
    })
}

/// The multiplier of a finer collocation that belongs to a coarse one: by Newton, else among all.
fn nearest(period: &Period, coarse: Complex64, depth_m: f64) -> Option<Complex64> {
    let characteristic = Characteristic::new(period, 2.0 * depth_m);
    let reach = 0.05 * coarse.norm();
    // The radius of the polynomials: small multipliers lie outside, and are found among all instead.
    let inside = coarse.norm() > 0.5;
    let newton = if inside {
        characteristic.multiplier_near(coarse, depth_m, reach, &mut characteristic.workspace())
    } else {
        None
    };
    newton.or_else(|| {
        collocation::multipliers(period, depth_m)?
            .into_iter()
            .min_by(|p, q| (p - coarse).norm().total_cmp(&(q - coarse).norm()))
    })
}

pub(super) fn check_speed(rpm: f64) -> Result<(), StabilityError> {
    if rpm.is_finite() && rpm > 0.0 {
        Ok(())
    } else {
        Err(StabilityError::Argument {
            quantity: "spindle speed, rev/min,",
            value: rpm,
            expected: "a speed greater than 0",
        })
    }
}

pub(super) fn check_depth(depth_mm: f64) -> Result<(), StabilityError> {
    if depth_mm.is_finite() && depth_mm >= 0.0 {
        Ok(())
    } else {
        Err(StabilityError::Argument {
            quantity: "axial depth, mm,",
            value: depth_mm,
            expected: "a depth of 0 or more",
        })
    }
}
