//! The baseline model: the case file with its extensions, in numbers.

pub(crate) mod cubic_term;
pub(crate) mod dynamic_stiffness;
pub(crate) mod receptance;
pub(crate) mod uncertain;

use self::cubic_term::cubic_term;
use self::receptance::Receptance;
use crate::error::DiagnoseError;
use quietcut_model::case::Case;
use quietcut_model::structure::{Direction, FirstOrder, Form, Structure};
use quietcut_model::{Effects, ModelError, RestoringForce};
use quietcut_simulate::effect::Pickup;

/// The baseline model (case file with its extensions).
pub(crate) struct Baseline<'a> {
    /// The case file.
    pub case: &'a Case,
    /// Structure of the case file, without extensions.
    pub structure: &'a Structure,
    /// Extensions of the case file.
    pub effects: Effects,
    /// Structure of the case file with its mass, damping and stiffness as the extensions change them, without restoring
    /// forces and additional modes of extensions.
    pub altered: Structure,
    /// Restoring forces f_r of the extensions and of the structure's cubic matrices, which the linear structure does
    /// not contain.
    pub terms: Vec<Box<dyn RestoringForce>>,
    /// The linear structure with all linear extensions, additional modes included, in first-order form.
    pub first_order: FirstOrder,
    /// Receptance at the tool of the linear structure with all linear extensions (`first_order`).
    pub receptance: Receptance,
    /// True if a step of the force makes the velocity of the tool jump, so that accelerations are averages over a
    /// sampling interval: see [`quietcut_simulate::Dynamics::velocity_jumps`].
    pub velocity_jumps: bool,
    /// The machine's axes (0, 1, 2) along which the structure moves, in the order of its directions.
    pub axes: Vec<usize>,
}

impl<'a> Baseline<'a> {
    /// The baseline model of a case.
    ///
    /// # Errors
    /// The case has no structure, or an extension or the structure with it is refused.
    pub(crate) fn new(case: &'a Case) -> Result<Self, DiagnoseError> {
        let structure = case.structure()?;
        let wrong = |error| DiagnoseError::simulate(&case.path, error);
        let effects = Effects::of_case(case)
            .map_err(|error| DiagnoseError::simulate(&case.path, ModelError::from(error)))?;
        let (dynamics, mut terms) = effects.dynamics(structure).map_err(wrong)?;
        if let Some(cubic) = cubic_term(structure) {
            terms.push(cubic);
        }
        let first_order = dynamics.first_order();
        let altered = effects.altered(structure).map_err(|error| wrong(error.into()))?;
        Ok(Self {
            altered,
            case,
            structure,
            effects,
            terms,
            receptance: Receptance::new(&first_order),
            first_order,
            velocity_jumps: dynamics.velocity_jumps(),
            axes: axes_of(structure),
        })
    }

    /// True if the baseline structure has a rigid-body mode: a pole within 1e-9 times the largest |pole| (taken as at
    /// least 1e-9 rad/s) of zero.
    pub(crate) fn is_free(&self) -> bool {
        let poles = self.first_order.poles();
        let largest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        poles.iter().any(|pole| pole.norm() <= 1e-9 * largest.max(1e-9))
    }

    /// Number of modes of a structure that is given by its modes; 0 for one given otherwise.
    pub(crate) fn mode_count(&self) -> usize {
        match &self.structure.form {
            Form::Modes(modes) => modes.len(),
            _ => 0,
        }
    }

    /// The longest time constant of the baseline structure, s: the largest −1/Re λ of its poles λ, with −Re λ taken as
    /// at least 1e-6·|λ| and 1e-9 1/s.
    pub(crate) fn slowest_decay_s(&self) -> f64 {
        self.first_order
            .poles()
            .iter()
            .map(|pole| 1.0 / (-pole.re).max(1e-6 * pole.norm()).max(1e-9))
            .fold(0.0, f64::max)
    }

    /// The lowest natural frequency |λ|/2π of the oscillating modes of the baseline structure, Hz; `None` without such
    /// modes.
    pub(crate) fn lowest_hz(&self) -> Option<f64> {
        self.first_order
            .poles()
            .iter()
            .filter(|pole| pole.im > 0.0)
            .map(|pole| pole.norm() / std::f64::consts::TAU)
            .min_by(f64::total_cmp)
    }

    /// The sensor of the channel `name`, with the sensor effects of the case's extensions; `None` for a name that
    /// stands neither for a force nor for a displacement, velocity or acceleration along x, y or z.
    pub(crate) fn pickup(&self, name: &str) -> Option<Pickup> {
        pickup_of(name).map(|pickup| self.effects.pickup(pickup))
    }
}

/// The machine's axes (0, 1, 2) along which a structure moves, in the order of its directions. Rotations have none.
pub(crate) fn axes_of(structure: &Structure) -> Vec<usize> {
    structure
        .directions
        .iter()
        .filter_map(|direction| direction.axis())
        .collect()
}

/// The direction x, y or z of the machine's axis 0, 1 or 2.
pub(crate) fn direction_of(axis: usize) -> Direction {
    [Direction::X, Direction::Y, Direction::Z][axis.min(2)]
}

/// The ideal sensor of a channel name such as fx, x, vx or ax; `None` for a name that is not of this form.
pub(crate) fn pickup_of(name: &str) -> Option<Pickup> {
    use quietcut_recording::Quantity;
    let (quantity, axis) = match name.as_bytes() {
        [axis] => (Quantity::Displacement, axis),
        [b'f', axis] => (Quantity::Force, axis),
        [b'v', axis] => (Quantity::Velocity, axis),
        [b'a', axis] => (Quantity::Acceleration, axis),
        _ => return None,
    };
    let axis = b"xyz".iter().position(|known| known == axis)?;
    Some(Pickup::of_axis(quantity, axis))
}

/// The restoring forces of `effects` alone on `structure`, without those of the baseline.
pub(crate) fn terms_of(
    effects: &Effects,
    structure: &Structure,
) -> Result<Vec<Box<dyn RestoringForce>>, quietcut_simulate::EffectError> {
    let mut terms = Vec::new();
    for effect in &effects.0 {
        terms.extend(effect.restoring_forces(structure)?);
    }
    Ok(terms)
}

/// Number of time derivatives from displacement to a quantity: 1 for velocity, 2 for acceleration, 0 for every other
/// quantity.
pub(crate) fn derivatives(quantity: quietcut_recording::Quantity) -> i32 {
    match quantity {
        quietcut_recording::Quantity::Velocity => 1,
        quietcut_recording::Quantity::Acceleration => 2,
        _ => 0,
    }
}
