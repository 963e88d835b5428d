//! Backlash: a share s of the spring does not act within a gap of total width g,
//! f_r += s·k·(d(x) − x) with d(x) = 0 for |x| ≤ g/2 and x ∓ g/2 beyond; k is the entry of the static stiffness matrix
//! for the direction. A backlash in series with friction is part of `coulomb_friction`.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;

use super::location::{along, axis_of, static_stiffness};
use super::{
    Argument, Class, Effect, EffectError, EffectName, EffectSpec, Harmonic, Locations, Parameter, Prior,
    Treatment,
};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce};

/// The specification.
pub(super) const BACKLASH: EffectSpec = EffectSpec {
    id: EffectName::Backlash,
    name: "backlash",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::EachDirection,
    parameters: &[
        Parameter::number("gap_mm", "mm", "total width of the gap")
            .main()
            .within(Prior::not_negative("a gap of 0 or more")),
        Parameter::number(
            "stiffness_fraction",
            "",
            "fraction of the stiffness that does not act within the gap; 1 without the key",
        )
        .linear()
        .within(SHARE),
        Parameter::word(
            "before",
            "\"coulomb-friction\" where the gap stands in series before that friction",
        ),
        Parameter::number(
            "contact_mm",
            "mm",
            "depth of a soft contact at the ends of the gap, with `before`",
        )
        .within(Prior::not_negative("a length of 0 or more")),
    ],
    treatment: Treatment::Equivalent,
    candidates: &["a fraction of the spring does not act within the gap"],
    shares_term_with: &[],
    summary: "a spring has no force, or less, within a gap",
    equation: "f_r += s·k·(d(x) − x), d the dead zone of total width g",
    shows: "stiffness that grows with amplitude towards that of the case, once the amplitude exceeds the gap; odd harmonics",
    hidden_by: "amplitudes within the gap, where it is less stiffness; it changes no damping",
    source: "Nordin and Gutman, Automatica 38 (2002)",
    example: "gap_mm = 0.05\nstiffness_fraction = 0.3\ndirection = \"x\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(Backlash {
            half_gap_m: 0.5e-3 * values.main("gap_mm")?,
            fraction: values.number("stiffness_fraction")?.unwrap_or(1.0),
            direction: values.direction()?,
        }))
    },
};

const SHARE: Prior = Prior {
    closed: [false, true],
    ..Prior::open(0.0, 1.0, "a share above 0 and up to 1")
};

/// Describing function of f_r for a stiffness of 1 N/m: a dead zone of ± half the gap minus the linear spring.
fn describing_function(at: Harmonic) -> [Complex64; 2] {
    let half_gap_m = at.bend_m;
    let missing = if at.amplitude_m <= half_gap_m {
        1.0
    } else {
        let share = half_gap_m / at.amplitude_m;
        2.0 / PI * (share.asin() + share * (1.0 - share * share).sqrt())
    };
    [Complex64::new(-missing, 0.0), Complex64::ZERO]
}

#[derive(Clone, Copy, Debug)]
struct Backlash {
    half_gap_m: f64,
    fraction: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct BacklashSpring {
    half_gap_m: f64,
    stiffness: f64,
    axis: usize,
}

const WITHIN: Regime = 0;
const ABOVE: Regime = 1;
const BELOW: Regime = 2;

impl Effect for Backlash {
    fn id(&self) -> EffectName {
        EffectName::Backlash
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        let axis = axis_of(structure, self.direction, self.name())?;
        let stiffness = static_stiffness(structure, self.name())?[(axis, axis)];
        Ok(vec![Box::new(BacklashSpring {
            half_gap_m: self.half_gap_m,
            stiffness: self.fraction * stiffness,
            axis,
        })])
    }
}

impl RestoringForce for BacklashSpring {
    fn restoring_n(&self, regime: Regime, at: &MotionState, _: &[f64]) -> [f64; 3] {
        let missing = match regime {
            ABOVE => self.half_gap_m,
            BELOW => -self.half_gap_m,
            _ => at.x[self.axis],
        };
        along(self.axis, -self.stiffness * missing)
    }

    fn describing_function(&self, amplitude_m: f64, omega: f64) -> Option<Complex64> {
        let at = Harmonic::new(amplitude_m, omega).with_bend_m(self.half_gap_m);
        Some(self.stiffness * describing_function(at)[0])
    }

    fn margin(&self, regime: Regime, at: &MotionState, _: &[f64], _: f64) -> f64 {
        let x = at.x[self.axis];
        match regime {
            ABOVE => x - self.half_gap_m,
            BELOW => -x - self.half_gap_m,
            _ => self.half_gap_m - x.abs(),
        }
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, _: &[f64], _: f64) -> Regime {
        let x = at.x[self.axis];
        match before {
            None if x > self.half_gap_m => ABOVE,
            None if x < -self.half_gap_m => BELOW,
            // At the end of the regime within the gap the displacement goes beyond an edge of the gap; at the end of
            // the other regimes it returns into the gap.
            Some(WITHIN) if x > 0.0 => ABOVE,
            Some(WITHIN) => BELOW,
            _ => WITHIN,
        }
    }
}
