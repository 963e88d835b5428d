//! Two directions that share a nonlinear potential: ½·k_xxyy·x²y² or k_xxy·x²y, with x and y the two directions.
//!
//! f_r += (k_xxyy·x·y², k_xxyy·x²·y), or (2·k_xxy·x·y, k_xxy·x²).

use std::sync::Arc;

use super::place::axis_of;
use super::{Effect, EffectError, Kind};
use crate::structure::{Direction, Structure};
use crate::{At, Branch, Slopes, Term};

pub(super) const KIND: Kind = Kind {
    name: "mode-coupling",
    keys: "kxyy_n_per_m3 or kxxy_n_per_m2, and directions",
    build: |parameters| {
        let quadratic = parameters.finite("kxxy_n_per_m2")?;
        let quartic = match quadratic {
            Some(_) => match parameters.finite("")? {
                Some(quartic) => quartic,
                None => parameters.finite("kxyy_n_per_m3")?.unwrap_or(0.0),
            },
            None => parameters.main("kxyy_n_per_m3")?,
        };
        Ok(Arc::new(ModeCoupling {
            quartic,
            cubic: quadratic.unwrap_or(0.0),
            directions: parameters.pair("directions")?,
        }))
    },
};

#[derive(Clone, Copy, Debug)]
struct ModeCoupling {
    /// k_xxyy, N/m³.
    quartic: f64,
    /// k_xxy, N/m².
    cubic: f64,
    directions: Option<[Direction; 2]>,
}

#[derive(Debug)]
struct Shared {
    quartic: f64,
    cubic: f64,
    axes: [usize; 2],
}

impl Effect for ModeCoupling {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axes = match self.directions {
            Some([a, b]) => [
                axis_of(structure, Some(a), KIND.name)?,
                axis_of(structure, Some(b), KIND.name)?,
            ],
            None => {
                let axes: Vec<usize> = structure.directions.iter().filter_map(|d| d.axis()).collect();
                match axes[..] {
                    [a, b] => [a, b],
                    _ => {
                        return Err(EffectError::Direction {
                            name: KIND.name,
                            what: "it must say its two directions (directions = [\"x\", \"y\"])".into(),
                            directions: axes.len().to_string(),
                        });
                    }
                }
            }
        };
        Ok(vec![Box::new(Shared {
            quartic: self.quartic,
            cubic: self.cubic,
            axes,
        })])
    }
}

impl Term for Shared {
    fn restoring_n(&self, _: Branch, at: &At, _: &[f64]) -> [f64; 3] {
        let (x, y) = (at.x[self.axes[0]], at.x[self.axes[1]]);
        let mut force = [0.0; 3];
        force[self.axes[0]] = x * y * (self.quartic * y + 2.0 * self.cubic);
        force[self.axes[1]] = x * x * (self.quartic * y + self.cubic);
        force
    }

    fn slopes(&self, at: &At) -> Option<Slopes> {
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
