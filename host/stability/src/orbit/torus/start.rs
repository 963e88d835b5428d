//! The first torus of a branch, beside the bifurcation at which it begins.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::corrector::{Corrected, Corrector, Torus};
use crate::orbit::branch::Event;
use quietcut_numerics::eigenvalues::eigenvector;

/// Sizes of the first torus, in the unit of the state, of which the first is used from which Newton's method finds one. A
/// choice: larger ones are less well predicted, nearer to the bifurcation the equations are nearly singular.
const SIZES: [f64; 3] = [0.02, 0.05, 0.005];

/// The forced orbit at a bifurcation as a torus of size 0.
pub(super) fn flat(event: &Event, angles: usize) -> Torus {
    Torus {
        states: DMatrix::from_fn(event.orbit.start.len(), angles, |row, _| event.orbit.start[row]),
        rotation: event.multiplier.arg().abs(),
        depth_m: event.orbit.value,
    }
}

/// Floquet mode of the critical multiplier: the null vector of Φ(μ) − μ I, in the first harmonic of the linearized
/// equations of the torus.
fn mode(corrector: &Corrector<'_>, flat: &Torus) -> Option<DVector<Complex64>> {
    let (order, angles) = (corrector.problem.order(), corrector.circle.angles);
    let (_, by, _) = corrector.residual(flat);
    let turned = |k: usize, sign: f64| Complex64::from_polar(1.0, sign * corrector.circle.angle(k));
    let mut first = DMatrix::<Complex64>::zeros(order, order);
    for (row, column) in (0..angles).flat_map(|row| (0..angles).map(move |column| (row, column))) {
        let factor = turned(row, -1.0) * turned(column, 1.0) / angles as f64;
        let block = by.view((row * order, column * order), (order, order));
        first += block.map(|entry| factor * entry);
    }
    eigenvector(&first, Complex64::ZERO)
}

/// The torus nearest to a bifurcation, with the tangent that leads away from it. `None` if none is found.
pub(super) fn beside(corrector: &Corrector<'_>, event: &Event) -> Option<Corrected> {
    let flat = flat(event, corrector.circle.angles);
    let mode = mode(corrector, &flat)?;
    let mut along = DVector::zeros(corrector.size());
    for k in 0..corrector.circle.angles {
        let turn = Complex64::from_polar(1.0, corrector.circle.angle(k));
        for (state, entry) in mode.iter().enumerate() {
            along[k * mode.len() + state] = (entry * turn).re;
        }
    }
    let along = along.normalize();
    SIZES.iter().find_map(|&size| {
        let guess = corrector.moved(&flat, &along, size);
        corrector.correct(&guess, &along, &guess.states)
    })
}
