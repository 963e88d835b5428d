//! Fit of a machine to the orders of cuts, by the method of Levenberg and Marquardt.

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use super::moment::{Moment, phase_deviation};
use super::record::ReducedCut;
use super::space::{Space, Variable};
use quietcut_numerics::statistics::chi_squared_quantile;

/// Predicted decrease of χ² below which a fit has converged: a tenth of a standard deviation of any variable; and as a
/// share of the sum of squares, where the model is far from the records.
const CONVERGED: [f64; 2] = [1e-2, 1e-6];
/// The same where a step does not lower the sum of squares: orbits have an error of their own.
const EXHAUSTED: [f64; 2] = [1e-1, 1e-5];
/// Damping from which on a step that does not lower the cost ends a fit.
const MOST_DAMPING: f64 = 50.0;
/// Decrease of the cost over that predicted, from which on derivatives of an earlier step are trusted.
const TRUSTED: f64 = 0.5;
/// Multiple of the decrease that its derivatives predict, below which no fit is taken to end.
const HOPE: f64 = 3.0;
/// Largest step of a coordinate of an effect, in its widths: no derivative reaches farther.
pub(super) const REACH: f64 = 2.0;
/// Largest number of steps, those that are too long included.
const STEPS: usize = 40;

/// One cut at a point of the space.
struct State {
    middle: Moment,
    /// Early and late in the record, as far from its middle as times are on average; `None` for a machine that does not
    /// change.
    ends: Option<[Moment; 2]>,
    /// Measured minus predicted amplitudes, without what is common to the orders.
    error: DMatrix<Complex64>,
    /// The same and that of the trend, in standard deviations.
    residual: Vec<f64>,
}

/// A machine fitted to cuts.
pub(crate) struct Fit {
    /// The variables.
    pub z: Vec<f64>,
    /// χ² of the amplitudes.
    pub left: f64,
    /// Sum of squares of the variables.
    pub prior: f64,
    /// JᵀJ + I: the inverse of the covariance of the variables.
    pub information: DMatrix<f64>,
    /// Derivatives of the predicted amplitudes of all records, in standard deviations, by the variables.
    pub jacobian: DMatrix<f64>,
    /// Measured minus predicted amplitudes of all records, in standard deviations.
    pub residual: DVector<f64>,
    states: Vec<State>,
}

impl Fit {
    /// Sum of squares that a fit minimizes.
    pub(crate) fn cost(&self) -> f64 {
        self.left + self.prior
    }

    /// Logarithm of the marginal likelihood by Laplace's method, but for a constant of the records.
    pub(crate) fn evidence(&self) -> f64 {
        let determinant = Cholesky::new(self.information.clone()).map_or(f64::INFINITY, |factor| {
            factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>()
        });
        -0.5 * self.cost() - determinant
    }

    /// Covariance of the variables.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        Some(Cholesky::new(self.information.clone())?.inverse())
    }

    /// True if the amplitudes deviate no more than noise does in 999 of 1 000 sets of records.
    pub(crate) fn is_enough(&self) -> bool {
        self.left < chi_squared_quantile(0.999, self.residual.len() as f64)
    }
}

impl State {
    fn new(
        space: &Space<'_>,
        z: &[f64],
        number: usize,
        record: &ReducedCut,
        near: Option<&Self>,
    ) -> Option<Self> {
        let at = |time_s: f64, near: Option<&Moment>| Moment::new(space, z, number, record, time_s, near);
        let middle = at(record.conditions.time_s, near.map(|near| &near.middle))?;
        let ends = match &record.orders.trend {
            Some(trend) if space.depends_on_time() => {
                let near = |end: usize| {
                    near.and_then(|near| Some(&near.ends.as_ref()?[end]))
                        .unwrap_or(&middle)
                };
                let [early_s, late_s] = record.ends_s(trend);
                Some([at(early_s, Some(near(0)))?, at(late_s, Some(near(1)))?])
            }
            _ => None,
        };
        let mut trend = record.orders.trend.as_ref().map(|trend| trend.amplitudes.clone());
        if let (Some(trend), Some(ends)) = (&mut trend, &ends) {
            *trend -= half_difference(ends.each_ref().map(|end| &end.seen));
        }
        let error = &record.orders.amplitudes - &middle.seen;
        let own = record.errors.own(&error, trend.as_ref());
        let residual = record.errors.whitened(&error, trend.as_ref());
        Some(Self {
            middle,
            ends,
            error: own,
            residual,
        })
    }

    /// Derivatives of the predicted amplitudes, in standard deviations, by the variables from the number `first` on: values ×
    /// variables.
    fn columns(
        &self,
        space: &Space<'_>,
        z: &[f64],
        first: usize,
        number: usize,
        record: &ReducedCut,
    ) -> DMatrix<f64> {
        let column = |index: usize| -> Option<Vec<f64>> {
            if !space.acts_on(index, number) {
                return None;
            }
            match &space.variables[index] {
                Variable::Phase(_) => {
                    let turned = &self.middle.by_phase * Complex64::from(phase_deviation(record));
                    Some(record.errors.independent(&turned, None))
                }
                _ => self.difference(space, z, index, number, record),
            }
        };
        let found: Vec<Option<Vec<f64>>> = (first..space.variables.len())
            .into_par_iter()
            .map(column)
            .collect();
        let rows = record.errors.count();
        let acting: Vec<usize> = (0..found.len()).filter(|index| found[*index].is_some()).collect();
        let mut own = DMatrix::from_iterator(
            rows,
            acting.len(),
            found.iter().flatten().flat_map(|column| column.iter().copied()),
        );
        record.errors.decorrelate(&mut own);
        let mut columns = DMatrix::zeros(rows, found.len());
        for (own, index) in own.column_iter().zip(acting) {
            columns.set_column(index, &own);
        }
        columns
    }

    /// Derivative of the predicted amplitudes by a variable, as values whose errors are independent but for what is common to
    /// the orders.
    fn difference(
        &self,
        space: &Space<'_>,
        z: &[f64],
        index: usize,
        number: usize,
        record: &ReducedCut,
    ) -> Option<Vec<f64>> {
        let slope = |moment: &Moment, time_s: f64| moment.slope(space, z, index, number, record, time_s);
        let middle = slope(&self.middle, record.conditions.time_s)?;
        let trend = match &record.orders.trend {
            Some(trend) if space.depends_on_time() => {
                let [early_s, late_s] = record.ends_s(trend);
                let [early, late] = self
                    .ends
                    .as_ref()
                    .map_or([&self.middle; 2], |ends| ends.each_ref());
                let slopes = [slope(early, early_s)?, slope(late, late_s)?];
                Some(half_difference(slopes.each_ref()))
            }
            _ => None,
        };
        Some(record.errors.independent(&middle, trend.as_ref()))
    }
}

/// Half of the second minus the first.
fn half_difference([early, late]: [&DMatrix<Complex64>; 2]) -> DMatrix<Complex64> {
    (late - early) * Complex64::from(0.5)
}

fn states(
    space: &Space<'_>,
    z: &[f64],
    records: &[ReducedCut],
    near: Option<&[State]>,
) -> Option<Vec<State>> {
    records
        .par_iter()
        .enumerate()
        .map(|(number, record)| State::new(space, z, number, record, near.map(|near| &near[number])))
        .collect()
}

/// The derivatives by the variables from the number `first` on; those before are kept.
fn update(
    jacobian: &mut DMatrix<f64>,
    first: usize,
    space: &Space<'_>,
    z: &[f64],
    records: &[ReducedCut],
    states: &[State],
) {
    let all: Vec<DMatrix<f64>> = states
        .par_iter()
        .zip(records)
        .enumerate()
        .map(|(number, (state, record))| state.columns(space, z, first, number, record))
        .collect();
    let mut row = 0;
    for columns in &all {
        jacobian
            .view_mut((row, first), columns.shape())
            .copy_from(columns);
        row += columns.nrows();
    }
}

fn stacked(states: &[State]) -> DVector<f64> {
    let all: Vec<f64> = states
        .iter()
        .flat_map(|state| state.residual.iter().copied())
        .collect();
    DVector::from_vec(all)
}

/// A point of a space at which a fit begins, with its orbits.
pub(crate) struct Start {
    z: Vec<f64>,
    states: Vec<State>,
}

impl Start {
    /// A point of `space`; `near` is an earlier fit, of a part of the space. `None` if no orbit exists there.
    pub(crate) fn new(
        space: &Space<'_>,
        records: &[ReducedCut],
        z: Vec<f64>,
        near: Option<&Fit>,
    ) -> Option<Self> {
        let states = states(space, &z, records, near.map(|near| near.states.as_slice()))?;
        Some(Self { z, states })
    }

    /// Sum of squares that a fit minimizes.
    pub(crate) fn cost(&self) -> f64 {
        cost(&self.z, &self.states)
    }
}

fn cost(z: &[f64], states: &[State]) -> f64 {
    stacked(states).norm_squared() + z.iter().map(|z| z * z).sum::<f64>()
}

/// Fits the variables of `space` to the records, from `start`; `near` is an earlier fit, of a part of the space.
///
/// Derivatives by what is uncertain of the baseline hardly change, and most of the computing time is theirs: they are
/// those of the earlier fit and of earlier steps, until a step gains less than they promise, and at the end. A fit that
/// would not come below the sum of squares `useful` with [`HOPE`] times the decrease that is predicted ends where it is,
/// with the derivatives that it has.
pub(crate) fn fit(
    space: &Space<'_>,
    records: &[ReducedCut],
    start: Start,
    near: Option<&Fit>,
    useful: f64,
) -> Fit {
    let Start {
        mut z,
        states: mut current,
    } = start;
    let mut damping = 1e-6;
    let rows = records
        .iter()
        .map(|record: &ReducedCut| record.errors.count())
        .sum();
    let mut slopes = DMatrix::zeros(rows, z.len());
    let known = space.known();
    let inherited = near.filter(|near| near.jacobian.nrows() == rows && near.jacobian.ncols() >= known);
    if let Some(near) = inherited {
        slopes
            .columns_mut(0, known)
            .copy_from(&near.jacobian.columns(0, known));
    }
    // True if all derivatives are those at `z`.
    let mut exact = inherited.is_none();
    update(
        &mut slopes,
        if exact { 0 } else { known },
        space,
        &z,
        records,
        &current,
    );
    for taken in 0..STEPS {
        let residual = stacked(&current);
        let position = DVector::from_column_slice(&z);
        let cost = residual.norm_squared() + position.norm_squared();
        let normal = slopes.transpose() * &slopes;
        let gradient = slopes.tr_mul(&residual) - &position;
        let Some((moved, predicted)) = step(space, &z, &normal, &gradient, damping) else {
            break;
        };
        if taken > 0 && cost - HOPE * predicted > useful {
            exact = true;
            break;
        }
        let is_below = |[least, share]: [f64; 2]| predicted < least.max(share * cost);
        if is_below(CONVERGED) {
            if exact {
                break;
            }
            update(&mut slopes, 0, space, &z, records, &current);
            exact = true;
            continue;
        }
        let next = states(space, &moved, records, Some(&current));
        let new_cost = next
            .as_ref()
            .map_or(f64::INFINITY, |next| self::cost(&moved, next));
        tracing::trace!(
            cost,
            predicted,
            new_cost,
            damping,
            exact,
            from = ?&z[space.known()..],
            to = ?&moved[space.known()..],
            "step"
        );
        if new_cost < cost {
            damping = (0.1 * damping).max(1e-9);
            let Some(next) = next else { break };
            (z, current) = (moved, next);
            exact = (cost - new_cost) / predicted < TRUSTED;
            let first = if exact { 0 } else { known };
            update(&mut slopes, first, space, &z, records, &current);
        } else if !exact {
            update(&mut slopes, 0, space, &z, records, &current);
            exact = true;
        } else if damping > MOST_DAMPING || is_below(EXHAUSTED) {
            break;
        } else {
            damping = (10.0 * damping).max(0.1);
        }
    }
    if !exact {
        update(&mut slopes, 0, space, &z, records, &current);
    }
    let residual = stacked(&current);
    let mut information = slopes.transpose() * &slopes;
    for index in 0..information.nrows() {
        information[(index, index)] += 1.0;
    }
    Fit {
        left: residual.norm_squared(),
        prior: z.iter().map(|z| z * z).sum(),
        z,
        information,
        jacobian: slopes,
        residual,
        states: current,
    }
}

/// A damped step within the bounds, and the decrease of the cost that it predicts.
fn step(
    space: &Space<'_>,
    z: &[f64],
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<(Vec<f64>, f64)> {
    let size = z.len();
    let mut held = vec![false; size];
    loop {
        let mut matrix = normal.clone();
        let mut right = gradient.clone();
        for index in 0..size {
            matrix[(index, index)] += 1.0 + damping * normal[(index, index)];
            if held[index] {
                matrix.row_mut(index).fill(0.0);
                matrix.column_mut(index).fill(0.0);
                matrix[(index, index)] = 1.0;
                right[index] = 0.0;
            }
        }
        let change = Cholesky::new(matrix)?.solve(&right);
        // One at a time: held at its bound, it may turn another back into the range.
        let is_beyond =
            |index: &usize| !held[*index] && z[*index] <= space.lower(*index) && change[*index] < 0.0;
        let farthest = (0..size)
            .filter(is_beyond)
            .min_by(|a, b| change[*a].total_cmp(&change[*b]));
        if let Some(index) = farthest {
            held[index] = true;
            continue;
        }
        let farthest = (space.known()..size)
            .map(|index| change[index].abs())
            .fold(REACH, f64::max);
        let moved: Vec<f64> = (0..size)
            .map(|index| (z[index] + change[index] * REACH / farthest).max(space.lower(index)))
            .collect();
        let change = DVector::from_iterator(size, moved.iter().zip(z).map(|(moved, z)| moved - z));
        let predicted = 2.0 * gradient.dot(&change) - change.dot(&(normal * &change)) - change.norm_squared();
        return Some((moved, predicted));
    }
}

impl Fit {
    /// Measured minus predicted amplitudes without what is common to the orders, by record.
    pub(crate) fn errors(&self) -> impl Iterator<Item = &DMatrix<Complex64>> {
        self.states.iter().map(|state| &state.error)
    }

    /// Fourier coefficients of the channels in a record.
    pub(crate) fn coefficients(&self, record: usize) -> &DMatrix<Complex64> {
        &self.states[record].middle.coefficients
    }

    /// Largest half ranges of displacement, m, and velocity, m/s, along x, y, z over the cuts.
    pub(crate) fn half_ranges(&self) -> [[f64; 3]; 2] {
        let mut largest = [[0.0_f64; 3]; 2];
        for state in &self.states {
            let ranges = state.middle.orbit.half_ranges();
            for (largest, range) in largest.as_flattened_mut().iter_mut().zip(ranges.as_flattened()) {
                *largest = largest.max(*range);
            }
        }
        largest
    }

    /// Derivatives of the predicted amplitudes by the coordinates of a further candidate at `coordinates`, added to this
    /// fit of `space`: records stacked, a column per coordinate; `None` if it has none there.
    pub(crate) fn columns_of(
        &self,
        space: &Space<'_>,
        candidate: &super::candidate::Candidate,
        coordinates: &[f64],
        records: &[ReducedCut],
    ) -> Option<DMatrix<f64>> {
        let wider = space.with(candidate);
        let mut z = self.z.clone();
        z.extend_from_slice(coordinates);
        let first = self.z.len();
        let rows = records
            .iter()
            .map(|record: &ReducedCut| record.errors.count())
            .sum();
        let mut columns = DMatrix::zeros(rows, coordinates.len());
        let mut row = 0;
        for (number, (state, record)) in self.states.iter().zip(records).enumerate() {
            // Where an effect is faint, only its size acts.
            let count = if candidate.is_faint_at_start() {
                1
            } else {
                coordinates.len()
            };
            let mut own = DMatrix::zeros(record.errors.count(), coordinates.len());
            for index in 0..count {
                let column = state.difference(&wider, &z, first + index, number, record)?;
                own.column_mut(index).copy_from_slice(&column);
            }
            record.errors.decorrelate(&mut own);
            columns.view_mut((row, 0), own.shape()).copy_from(&own);
            row += record.errors.count();
        }
        Some(columns)
    }
}
