//! The first orbit of a period-doubled branch, beside the flip at which it begins.

use nalgebra::DVector;

use super::period::SubharmonicPeriod;
use crate::orbit::branch::Event;
use crate::orbit::follower::{Follower, Sample};
use crate::orbit::periodic_orbit::{Orbit, OrbitError, PeriodMap};

/// Sizes of the first doubled orbit, in the unit of the state along the branch, of which the first is used from which
/// Newton's method finds one. A choice: larger ones are less well predicted, nearer to the flip the equations are nearly
/// singular.
const SIZES: [f64; 3] = [0.02, 0.005, 0.05];

/// The forced orbit at a flip as an orbit of two tooth periods.
pub(super) fn repeated(flip: &Event) -> Orbit {
    let orbit = &flip.orbit;
    let order = orbit.start.len();
    let mut start = DVector::zeros(2 * order);
    start.rows_mut(0, order).copy_from(&orbit.start);
    start.rows_mut(order, order).copy_from(&orbit.start);
    Orbit {
        value: orbit.value,
        start,
        states: [orbit.states.as_slice(), orbit.states.as_slice()].concat(),
    }
}

/// The doubled orbit nearest to a flip, with the tangent that leads away from it.
///
/// At the flip the equations of the doubled orbit are singular: their null vector is the Floquet mode (v, −v), along
/// which the doubled orbits leave the forced ones. The orbit is corrected at a fixed distance along that mode, with the
/// parameter free.
pub(super) fn beside(
    follower: &Follower<SubharmonicPeriod<'_>>,
    at_flip: &Orbit,
) -> Result<Sample, OrbitError> {
    let map = &follower.map;
    let place = follower.place(at_flip);
    let singular = OrbitError::Singular { place };
    let integration = map
        .integrate(&at_flip.start, at_flip.value, &at_flip.states)
        .ok_or(singular)?;
    let decomposed = integration.periodic().svd(false, true);
    let smallest = decomposed.singular_values.imin();
    let vectors = decomposed.v_t.ok_or(singular)?;
    let mut along = DVector::zeros(map.size() + 1);
    along
        .rows_mut(0, map.size())
        .copy_from(&vectors.row(smallest).transpose());
    let mut last = singular;
    for size in SIZES {
        let change = follower.scale.unscaled(&(&along * size));
        let mut guess = at_flip.clone();
        guess.start += change.rows(0, map.size());
        for (states, values) in guess.states.iter_mut().zip(&integration.values) {
            let moved = values * &change;
            for (entry, moved) in states.iter_mut().zip(&moved) {
                *entry += moved;
            }
        }
        match follower.sample(&guess, &along) {
            Ok(sample) => return Ok(sample),
            Err(error) => last = error,
        }
    }
    Err(last)
}
