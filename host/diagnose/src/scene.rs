//! What a diagnosis looks at: the baseline, as the case has it, and the records, each beside its prediction.

use num_complex::Complex64;

use super::DiagnoseError;
use super::cubic::cubic_term;
use super::receptance::Receptance;
use super::record::{Known, Record};
use quietcut_model::case::Case;
use quietcut_model::structure::{Direction, FirstOrder, Form, Structure};
use quietcut_model::{Effects, ModelError, Term};
use quietcut_recording::Recording;
use quietcut_simulate::effect::Pickup;

/// In which quantity a record is compared with the baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// The force drives, the motion is predicted: y − H·(F − f_r).
    Response,
    /// The motion drives (`input = ["x"]`), or the structure is free to go away: F − (M ẍ + C ẋ + K x + f_r).
    Force,
}

/// The baseline: the case with its extensions.
pub struct Baseline<'a> {
    /// The case.
    pub case: &'a Case,
    /// Its structure, as it stands in the file.
    pub structure: &'a Structure,
    /// Its extensions.
    pub effects: Effects,
    /// The structure with what the case's extensions make of its numbers.
    pub altered: Structure,
    /// What the equation of motion has besides the linear structure.
    pub terms: Vec<Box<dyn Term>>,
    /// The linear structure with all that extensions change in it.
    pub first_order: FirstOrder,
    /// Its receptance.
    pub receptance: Receptance,
    /// True where a jump of the force makes the velocity jump, so that accelerations are means over a sample: see [`quietcut_simulate::Dynamics::velocity_jumps`].
    pub velocity_jumps: bool,
    /// The machine's axes (0, 1, 2) that the structure has.
    pub axes: Vec<usize>,
}

/// Baseline and records.
pub struct Scene<'a> {
    /// What is believed.
    pub baseline: Baseline<'a>,
    /// What was measured.
    pub records: Vec<Record>,
}

impl<'a> Baseline<'a> {
    /// The baseline of a case.
    ///
    /// # Errors
    /// No structure, an indefinite one, or an extension that it cannot have.
    pub fn new(case: &'a Case) -> Result<Self, DiagnoseError> {
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

    /// The linear structure with one effect more.
    ///
    /// # Errors
    /// What the effect cannot do to this structure.
    pub fn altered(&self, effect: &Effects) -> Result<FirstOrder, ModelError> {
        let (dynamics, _) = self.effects.clone().and(effect).dynamics(self.structure)?;
        Ok(dynamics.first_order())
    }

    /// True where the structure has a motion without stiffness: a stage that can go away.
    pub fn is_free(&self) -> bool {
        let poles = self.first_order.poles();
        let largest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
        poles.iter().any(|pole| pole.norm() <= 1e-9 * largest.max(1e-9))
    }

    /// Mass, damping and stiffness seen along an axis at iω: the dynamic stiffness Z = H⁻¹ over the axes of the structure, N/m.
    pub fn dynamic_stiffness(
        first_order: &FirstOrder,
        axes: &[usize],
        omega: f64,
    ) -> Option<Vec<Vec<Complex64>>> {
        let receptance = first_order.receptance(omega)?;
        let part = nalgebra::DMatrix::from_fn(axes.len(), axes.len(), |i, j| receptance[(axes[i], axes[j])]);
        let inverse = part.try_inverse()?;
        Some(
            (0..axes.len())
                .map(|i| (0..axes.len()).map(|j| inverse[(i, j)]).collect())
                .collect(),
        )
    }

    /// The longest time constant of the structure, s.
    pub fn slowest_decay_s(&self) -> f64 {
        self.first_order
            .poles()
            .iter()
            .map(|pole| 1.0 / (-pole.re).max(1e-6 * pole.norm()).max(1e-9))
            .fold(0.0, f64::max)
    }

    /// The lowest natural frequency, Hz; `None` where nothing vibrates.
    pub fn lowest_hz(&self) -> Option<f64> {
        self.first_order
            .poles()
            .iter()
            .filter(|pole| pole.im > 0.0)
            .map(|pole| pole.norm() / std::f64::consts::TAU)
            .min_by(f64::total_cmp)
    }

    /// What a channel reads, as the baseline has it; `None` for what is neither force nor motion along x, y or z.
    pub fn pickup(&self, name: &str) -> Option<Pickup> {
        pickup_of(name).map(|pickup| self.effects.pickup(pickup))
    }
}

impl<'a> Scene<'a> {
    /// Reads the records against the baseline.
    ///
    /// # Errors
    /// A case that cannot be simulated, or a record that tells nothing.
    pub fn new(case: &'a Case, recordings: &[Recording]) -> Result<Self, DiagnoseError> {
        Self::with(case, recordings, |_| Known::default())
    }

    /// The same with what is `known`: the motion as a case that explains a record says that its channels read it, where there is such.
    ///
    /// Along a measured motion every term carries the noise of that motion, which is also in the residual: the coefficient of a
    /// term is then off by about the square of noise over signal, which is more than its deviation once
    /// (noise over signal)·√(number of samples) is above one. Along the motion of a model that explains the records it is not.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn with(
        case: &'a Case,
        recordings: &[Recording],
        known: impl Fn(usize) -> Known,
    ) -> Result<Self, DiagnoseError> {
        if recordings.is_empty() {
            return Err(DiagnoseError::NoRecording);
        }
        let baseline = Baseline::new(case)?;
        let records = recordings
            .iter()
            .enumerate()
            .map(|(index, recording)| Record::new(&baseline, index, recording, known(index)))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self { baseline, records })
    }

    /// Axes that a force or a motion drives in some record, with a motion to show for it.
    pub fn driven_axes(&self) -> Vec<usize> {
        self.baseline
            .axes
            .iter()
            .copied()
            .filter(|axis| self.records.iter().any(|record| record.moves(*axis)))
            .collect()
    }

    /// True where every record is judged in `domain`.
    pub fn all_in(&self, domain: Domain) -> bool {
        self.records.iter().all(|record| record.domain == domain)
    }

    /// True where a sidecar says that a channel, or with no channel named any, sits somewhere else than at the tool tip.
    pub fn sits_elsewhere(&self, channel: Option<&str>) -> bool {
        self.records
            .iter()
            .flat_map(|record| &record.elsewhere)
            .any(|name| channel.is_none_or(|channel| channel == name))
    }

    /// True where the case has its structure as modes.
    pub fn has_modes(&self) -> bool {
        matches!(self.baseline.structure.form, Form::Modes(_))
    }
}

/// The machine's axes of a structure.
pub(super) fn axes_of(structure: &Structure) -> Vec<usize> {
    structure
        .directions
        .iter()
        .filter_map(|direction| direction.axis())
        .collect()
}

/// The direction of an axis.
pub(super) fn direction_of(axis: usize) -> Direction {
    [Direction::X, Direction::Y, Direction::Z][axis.min(2)]
}

/// A channel of the conventions of recordings: fx, x, vx, ax …
fn pickup_of(name: &str) -> Option<Pickup> {
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

/// The terms of one effect alone.
pub(super) fn terms_of(
    effects: &Effects,
    structure: &Structure,
) -> Result<Vec<Box<dyn Term>>, quietcut_simulate::EffectError> {
    let mut terms = Vec::new();
    for effect in &effects.0 {
        terms.extend(effect.terms(structure)?);
    }
    Ok(terms)
}

/// Number of derivatives that a channel's quantity is of displacement.
pub(super) fn derivatives(quantity: quietcut_recording::Quantity) -> i32 {
    match quantity {
        quietcut_recording::Quantity::Velocity => 1,
        quietcut_recording::Quantity::Acceleration => 2,
        _ => 0,
    }
}
