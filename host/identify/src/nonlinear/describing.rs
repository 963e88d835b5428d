//! Describing functions: the contribution of nonlinear terms to the dynamic stiffness F/X of a harmonic motion.
//!
//! With x = X·sin ωt a force f_r(x, v) acts at the fundamental as N(X, ω)·x, N = (2/(2πX))·∫f_r·(sin + i·cos) d(ωt) over a period:
//! the real part is a stiffness, the imaginary part a damping force per displacement.

use std::f64::consts::PI;

use num_complex::Complex64;

/// A kind of nonlinearity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// k3·x³.
    CubicStiffness,
    /// k2·x²: seen at twice the frequency.
    QuadraticStiffness,
    /// c3·v³.
    CubicDamping,
    /// k3·x³ + k5·x⁵ of opposite signs.
    SofteningHardening,
    /// fc·sign(v).
    CoulombFriction,
    /// A spring with a gap.
    Backlash,
    /// Bouc–Wen.
    Hysteresis,
}

impl Kind {
    /// Its name, as in a case.
    pub fn name(self) -> &'static str {
        match self {
            Self::CubicStiffness => "cubic-stiffness",
            Self::QuadraticStiffness => "quadratic-stiffness",
            Self::CubicDamping => "cubic-damping",
            Self::SofteningHardening => "softening-hardening",
            Self::CoulombFriction => "coulomb-friction",
            Self::Backlash => "backlash",
            Self::Hysteresis => "hysteresis",
        }
    }
}

/// k3·x³ with k3 = 1: ¾X².
pub fn cubic_stiffness(amplitude: f64) -> Complex64 {
    Complex64::new(0.75 * amplitude * amplitude, 0.0)
}

/// k5·x⁵ with k5 = 1: ⅝X⁴.
pub fn quintic_stiffness(amplitude: f64) -> Complex64 {
    Complex64::new(0.625 * amplitude.powi(4), 0.0)
}

/// c3·v³ with c3 = 1: ¾ω³X² in quadrature.
pub fn cubic_damping(amplitude: f64, omega: f64) -> Complex64 {
    Complex64::new(0.0, 0.75 * omega.powi(3) * amplitude * amplitude)
}

/// fc·sign(v) with fc = 1: 4/(πX) in quadrature.
pub fn coulomb_friction(amplitude: f64) -> Complex64 {
    Complex64::new(0.0, 4.0 / (PI * amplitude))
}

/// A spring of unit stiffness with a dead zone ±`half_gap`, minus the spring without it.
pub fn backlash(amplitude: f64, half_gap: f64) -> Complex64 {
    if amplitude <= half_gap {
        return Complex64::new(-1.0, 0.0);
    }
    let share = half_gap / amplitude;
    let missing = 2.0 / PI * (share.asin() + share * (1.0 - share * share).sqrt());
    Complex64::new(-missing, 0.0)
}

/// A Bouc–Wen element of stiffness 1, n = 1 and γ = β = ½, less the spring x: (z − x) at the fundamental.
///
/// With n = 1 and γ = β the element is linear while it unloads and saturates exponentially while it loads.
pub fn hysteresis(amplitude: f64, yield_m: f64) -> Complex64 {
    // From peak to peak: unloading from +z₀ with slope 1 to z = 0, then loading z = −z_y(1 − e^{−s/z_y}) over what is
    // left, to −z₀. z₀ is the fixed point of that.
    let stroke = 2.0 * amplitude;
    let mut low = 0.0;
    let mut high = yield_m.min(stroke);
    for _ in 0..60 {
        let z = 0.5 * (low + high);
        let reached = -yield_m * (-(stroke - z) / yield_m).exp_m1();
        if reached > z { low = z } else { high = z }
    }
    let top = 0.5 * (low + high);
    let count = 256;
    let mut sum = Complex64::ZERO;
    // Half a period from the upper peak down: x = X·cos p; the other half is the same turned around.
    for k in 0..count {
        let p = PI * (f64::from(k) + 0.5) / f64::from(count);
        let gone = amplitude * (1.0 - p.cos());
        let z = if gone <= top {
            top - gone
        } else {
            yield_m * (-(gone - top) / yield_m).exp_m1()
        };
        let rest = z - amplitude * p.cos();
        // Against cos p in phase, and against −sin p, the velocity, in quadrature.
        sum += Complex64::new(rest * p.cos(), -rest * p.sin());
    }
    sum * (2.0 / (f64::from(count) * amplitude))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The describing function by a plain sum over a period, with x = X·cos p.
    fn brute(amplitude: f64, force: impl Fn(f64, f64) -> f64) -> Complex64 {
        let count = 200_000;
        let mut sum = Complex64::ZERO;
        for k in 0..count {
            let p = 2.0 * PI * (f64::from(k) + 0.5) / f64::from(count);
            let f = force(amplitude * p.cos(), -amplitude * p.sin());
            sum += Complex64::new(f * p.cos(), -f * p.sin());
        }
        sum * (2.0 / (f64::from(count) * amplitude))
    }

    #[test]
    fn closed_forms_are_the_sums() {
        let (x, w) = (1.3, 2.0);
        let gap = 0.4;
        let pairs = [
            (cubic_stiffness(x), brute(x, |x, _| x.powi(3))),
            (quintic_stiffness(x), brute(x, |x, _| x.powi(5))),
            (cubic_damping(x, w), brute(x, |_, v| (w * v).powi(3))),
            (coulomb_friction(x), brute(x, |_, v| v.signum())),
            (backlash(x, gap), brute(x, |x, _| -x.clamp(-gap, gap))),
            (backlash(0.3, gap), brute(0.3, |x, _| -x.clamp(-gap, gap))),
        ];
        for (closed, summed) in pairs {
            // A kink costs the midpoint rule a step squared.
            assert!((closed - summed).norm() < 1e-6, "{closed} {summed}");
        }
    }

    #[test]
    fn hysteresis_is_nothing_small_and_friction_large() {
        // Much smaller than the yield: z = x but for a share X/z_y.
        assert!(hysteresis(1e-3, 1.0).norm() < 2e-3);
        // Much larger: −1 (the spring is gone) and friction of z_y; corners round off a share (z_y/X)^(3/2) of it.
        let large = hysteresis(100.0, 1.0);
        assert!((large - (coulomb_friction(100.0) - 1.0)).norm() < 3e-3, "{large}");
    }
}
