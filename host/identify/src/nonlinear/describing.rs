//! Describing functions: the contribution of nonlinear terms to the dynamic stiffness F/X of a harmonic motion.
//!
//! With x = X·sin ωt a force f_r(x, v) acts at the fundamental as N(X, ω)·x, N = (2/(2πX))·∫f_r·(sin + i·cos) d(ωt)
//! over a period: the real part is a stiffness, the imaginary part a damping force per displacement.

use num_complex::Complex64;
use quietcut_model::effects::{EffectName, Harmonic};

/// Type of a nonlinear restoring or damping force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nonlinearity {
    /// Cubic spring k3·x³.
    CubicStiffness,
    /// Quadratic spring k2·x²; its force appears at twice the excitation frequency and as an offset.
    QuadraticStiffness,
    /// Cubic damping c3·v³.
    CubicDamping,
    /// Spring k3·x³ + k5·x⁵; with coefficients of opposite sign softening turns into hardening, or the reverse.
    SofteningHardening,
    /// Coulomb friction fc·sign(v).
    CoulombFriction,
    /// Backlash: a spring that exerts no force within a gap.
    Backlash,
    /// Hysteresis of Bouc and Wen.
    Hysteresis,
}

impl Nonlinearity {
    /// The effect of a case file that has this force.
    pub fn effect(self) -> EffectName {
        match self {
            Self::CubicStiffness => EffectName::CubicStiffness,
            Self::QuadraticStiffness => EffectName::QuadraticStiffness,
            Self::CubicDamping => EffectName::CubicDamping,
            Self::SofteningHardening => EffectName::SofteningHardening,
            Self::CoulombFriction => EffectName::CoulombFriction,
            Self::Backlash => EffectName::Backlash,
            Self::Hysteresis => EffectName::Hysteresis,
        }
    }

    /// Name of the nonlinear effect, as in a case file.
    pub fn name(self) -> &'static str {
        self.effect().name()
    }

    /// Describing functions N(X, ω) of the one or two terms of the nonlinear force, each for a unit coefficient, in the
    /// order of the coefficients. Zero for an effect without a describing function.
    pub fn describing_functions(self, at: Harmonic) -> [Complex64; 2] {
        self.effect()
            .spec()
            .describing_function
            .map_or([Complex64::ZERO; 2], |of| of(at))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// The describing function by numerical summation over a period, with x = X·cos p.
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

    fn first(of: Nonlinearity, at: Harmonic) -> Complex64 {
        of.describing_functions(at)[0]
    }

    #[test]
    fn describing_functions_equal_numerical_sums() {
        use Nonlinearity::{Backlash, CoulombFriction, CubicDamping, CubicStiffness, SofteningHardening};
        let (x, w) = (1.3, 2.0);
        let at = Harmonic::new(x, w);
        let gap = 0.4;
        let within = Harmonic::new(0.3, w).with_bend_m(gap);
        let [cubic, quintic] = SofteningHardening.describing_functions(at);
        let pairs = [
            (first(CubicStiffness, at), brute(x, |x, _| x.powi(3))),
            (cubic, brute(x, |x, _| x.powi(3))),
            (quintic, brute(x, |x, _| x.powi(5))),
            (first(CubicDamping, at), brute(x, |_, v| (w * v).powi(3))),
            (first(CoulombFriction, at), brute(x, |_, v| v.signum())),
            (
                first(Backlash, at.with_bend_m(gap)),
                brute(x, |x, _| -x.clamp(-gap, gap)),
            ),
            (first(Backlash, within), brute(0.3, |x, _| -x.clamp(-gap, gap))),
        ];
        for (closed, summed) in pairs {
            // The error of the midpoint rule at a kink of the force is of second order in the step.
            assert!((closed - summed).norm() < 1e-6, "{closed} {summed}");
        }
    }

    #[test]
    fn hysteresis_vanishes_at_small_and_is_friction_at_large_amplitude() {
        let hysteresis = |amplitude_m: f64, yield_m: f64| {
            first(
                Nonlinearity::Hysteresis,
                Harmonic::new(amplitude_m, 1.0).with_bend_m(yield_m),
            )
        };
        // At amplitudes X far below the yield displacement z_y, z = x up to a relative error of X/z_y.
        assert!(hysteresis(1e-3, 1.0).norm() < 2e-3);
        // At amplitudes X far above z_y the stiffness −1 cancels the spring and friction of the force z_y remains;
        // rounded corners reduce it by (z_y/X)^(3/2).
        let large = hysteresis(100.0, 1.0);
        let friction = first(Nonlinearity::CoulombFriction, Harmonic::new(100.0, 1.0));
        assert!((large - (friction - 1.0)).norm() < 3e-3, "{large}");
    }
}
