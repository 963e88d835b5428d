//! Two directions that share a nonlinear potential V = ½·k_xxyy·x²y² + k_xxy·x²y, with x the displacement along the
//! first and y that along the second; either coefficient may be zero.
//!
//! f_r += (k_xxyy·x·y² + 2·k_xxy·x·y, k_xxyy·x²·y + k_xxy·x²).

use std::sync::Arc;

use super::location::{axis_of, directions_in_words};
use super::{Argument, Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Treatment};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce, Slopes};

/// The specification.
pub(super) const MODE_COUPLING: EffectSpec = EffectSpec {
    id: EffectName::ModeCoupling,
    name: "mode-coupling",
    class: Class::RestoringForce(Argument::TwoDisplacements),
    locations: Locations::TwoDirections,
    parameters: &[
        Parameter::number("kxyy_n_per_m3", "N/m³", "quartic potential ½·k_xxyy·x²y²")
            .linear()
            .main(),
        Parameter::number("kxxy_n_per_m2", "N/m²", "cubic potential k_xxy·x²y").linear(),
    ],
    treatment: Treatment::Smooth,
    candidates: &["the quartic potential", "the cubic potential"],
    shares_term_with: &[],
    summary: "two directions share a nonlinear potential",
    equation: "f_r += ∂V/∂x and ∂V/∂y, V = ½·k_xxyy·x²y² or k_xxy·x²y",
    shows: "sums and differences of the frequencies of both directions; a stiffness of one that moves with the amplitude of the other",
    hidden_by: "recordings in which one of the directions rests",
    source: "Nayfeh and Mook, Nonlinear Oscillations (1979), ch. 6",
    example: "kxyy_n_per_m3 = 1e12\ndirections = [\"x\", \"y\"]",
    describing_function: None,
    build: |values| {
        let cubic = values.number("kxxy_n_per_m2")?;
        let quartic = match cubic {
            Some(_) => match values.number("")? {
                Some(quartic) => quartic,
                None => values.number("kxyy_n_per_m3")?.unwrap_or(0.0),
            },
            None => values.main("kxyy_n_per_m3")?,
        };
        Ok(Arc::new(ModeCoupling {
            quartic,
            cubic: cubic.unwrap_or(0.0),
            directions: values.directions()?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct ModeCoupling {
    /// Coefficient k_xxyy of the quartic potential ½·k_xxyy·x²y², N/m³.
    quartic: f64,
    /// Coefficient k_xxy of the cubic potential k_xxy·x²y, N/m².
    cubic: f64,
    directions: Option<[Direction; 2]>,
}

#[derive(Debug)]
struct CouplingPotential {
    quartic: f64,
    cubic: f64,
    axes: [usize; 2],
}

impl Effect for ModeCoupling {
    fn id(&self) -> EffectName {
        EffectName::ModeCoupling
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        let axes = match self.directions {
            Some([a, b]) => [
                axis_of(structure, Some(a), self.name())?,
                axis_of(structure, Some(b), self.name())?,
            ],
            None => {
                let axes: Vec<usize> = structure.directions.iter().filter_map(|d| d.axis()).collect();
                match axes[..] {
                    [a, b] => [a, b],
                    _ => {
                        return Err(EffectError::Direction {
                            name: self.name(),
                            what: "it must say its two directions (directions = [\"x\", \"y\"])".into(),
                            directions: directions_in_words(structure),
                        });
                    }
                }
            }
        };
        Ok(vec![Box::new(CouplingPotential {
            quartic: self.quartic,
            cubic: self.cubic,
            axes,
        })])
    }
}

impl RestoringForce for CouplingPotential {
    fn restoring_n(&self, _: Regime, at: &MotionState, _: &[f64]) -> [f64; 3] {
        let (x, y) = (at.x[self.axes[0]], at.x[self.axes[1]]);
        let mut force = [0.0; 3];
        force[self.axes[0]] = x * y * (self.quartic * y + 2.0 * self.cubic);
        force[self.axes[1]] = x * x * (self.quartic * y + self.cubic);
        force
    }

    fn slopes(&self, at: &MotionState) -> Option<Slopes> {
        let [a, b] = self.axes;
        let (x, y) = (at.x[a], at.x[b]);
        let mut slopes = Slopes::default();
        slopes.stiffness[a][a] = y * (self.quartic * y + 2.0 * self.cubic);
        slopes.stiffness[a][b] = 2.0 * x * (self.quartic * y + self.cubic);
        slopes.stiffness[b][a] = slopes.stiffness[a][b];
        slopes.stiffness[b][b] = x * x * self.quartic;
        Some(slopes)
    }
}
