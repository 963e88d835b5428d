//! Map of the delayed state over one period in time steps, x_{i+1} = P_i x_i + Σ_j R_ij y_j with y = C x at earlier
//! steps; shared by semi-discretization and full discretization.
//!
//! Of the past only displacements act. The period map is applied without forming its matrix: a step updates the n
//! states of the structure and appends one displacement vector to those before.

use nalgebra::{DMatrix, DVector, Matrix3};
use num_complex::Complex64;

use crate::problem::exponential::Exponential;
use crate::problem::pitched::Pitched;
use crate::problem::tooth_passages::{Coefficients, ToothPassages};
use crate::spectrum::chatter_frequency::dominant_frequency_hz;
use crate::spectrum::krylov::LinearMap;
use crate::spectrum::map_spectrum::PeriodMap;

/// Distance of a delayed time from the start or end of a time step, as a share of the step, within which it counts as
/// that start or end. Larger than rounding, far below the discretization error.
const ON_STEP: f64 = 1e-9;

/// Nodes and weights of the mean of force coefficients over a time step: three Gauss nodes, exact for polynomials up to
/// degree 5.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// Times of the time steps of a period, including every entry and exit of a tooth.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    /// Starts and ends of all time steps, from 0 to the period, s, ascending.
    pub(crate) times_s: Vec<f64>,
    pub(crate) passages: ToothPassages,
}

impl Mesh {
    /// Mesh with about `steps` time steps in each tooth period, and at least one between two entries or exits of teeth.
    pub(crate) fn new(pitched: &Pitched, rpm: f64, steps: usize) -> Self {
        let passages = ToothPassages::new(pitched, rpm);
        let shortest_s = passages
            .list
            .iter()
            .map(|passage| passage.delay_s)
            .fold(pitched.problem.tooth_period_s(rpm), f64::min);
        // A delay shorter than a time step would make the step implicit in the displacement at its own end.
        let longest_s = (pitched.problem.tooth_period_s(rpm) / steps.max(1) as f64).min(shortest_s);
        let mut times_s = vec![0.0];
        for ends in passages.switches_s().windows(2) {
            let count = ((ends[1] - ends[0]) / longest_s - ON_STEP).ceil().max(1.0) as usize;
            times_s.extend((1..=count).map(|i| ends[0] + (ends[1] - ends[0]) * i as f64 / count as f64));
        }
        Self { times_s, passages }
    }

    /// Number of steps.
    pub(crate) fn count(&self) -> usize {
        self.times_s.len() - 1
    }

    /// Start and duration of a time step, s.
    pub(crate) fn step(&self, index: usize) -> (f64, f64) {
        let start_s = self.times_s[index];
        (start_s, self.times_s[index + 1] - start_s)
    }

    /// Mean of the force coefficients of the cut over a time step.
    pub(crate) fn mean(&self, pitched: &Pitched, index: usize) -> Coefficients {
        let (start_s, duration_s) = self.step(index);
        let nodes = GAUSS
            .iter()
            .map(|(node, share)| (start_s + duration_s * node, *share));
        Coefficients::mean(pitched, &self.passages, start_s + 0.5 * duration_s, nodes)
    }

    /// Force coefficients at the fraction `share` of a time step; at its ends the one-sided limits from within.
    pub(crate) fn at(&self, pitched: &Pitched, index: usize, share: f64) -> Coefficients {
        let (start_s, duration_s) = self.step(index);
        let node = std::iter::once((start_s + duration_s * share, 1.0));
        Coefficients::mean(pitched, &self.passages, start_s + 0.5 * duration_s, node)
    }

    /// Indices of the two times of the mesh on either side of a time, s (at most the period, possibly negative), with
    /// their weights in linear interpolation. Negative indices lie in the preceding period.
    fn around(&self, time_s: f64) -> [(isize, f64); 2] {
        let (period_s, count) = (self.passages.period_s, self.count() as isize);
        let turns = (time_s / period_s).floor();
        let within_s = time_s - turns * period_s;
        let first = self
            .times_s
            .partition_point(|&start_s| start_s <= within_s)
            .saturating_sub(1)
            .min(self.count() - 1);
        let (start_s, duration_s) = self.step(first);
        let mut share = (within_s - start_s) / duration_s;
        if share < ON_STEP {
            share = 0.0;
        } else if share > 1.0 - ON_STEP {
            share = 1.0;
        }
        let index = first as isize + turns as isize * count;
        [(index, 1.0 - share), (index + 1, share)]
    }
}

/// One time step.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// Matrix P of the step, n × n, by which the state at its start acts on the state at its end.
    pub(crate) flow: DMatrix<f64>,
    /// Indices of earlier times of the mesh at which the displacement acts on this step, with their matrices R, n × 3;
    /// n × d once a [`Stepped`] contains the step.
    past: Vec<(isize, DMatrix<f64>)>,
}

impl Step {
    /// Time step on which only the state at its start acts so far, through the matrix `flow`.
    pub(crate) fn new(flow: DMatrix<f64>) -> Self {
        Self {
            flow,
            past: Vec::new(),
        }
    }

    /// Lets the displacement at a time, s, act on this step through the matrix `response` (n × 3); the displacement is
    /// interpolated linearly between the times of the mesh.
    pub(crate) fn add_past(&mut self, mesh: &Mesh, time_s: f64, response: &DMatrix<f64>) {
        for (index, share) in mesh.around(time_s) {
            if share == 0.0 {
                continue;
            }
            match self.past.iter_mut().find(|(known, _)| *known == index) {
                Some((_, sum)) => *sum += response * share,
                None => self.past.push((index, response * share)),
            }
        }
    }
}

/// Map of one period at one axial depth: it advances the state x_0 of the structure and the earlier displacements
/// y_{−1}, …, y_{−K} by one period.
#[derive(Clone, Debug)]
pub(crate) struct Stepped<'a> {
    pitched: &'a Pitched,
    mesh: &'a Mesh,
    depth_m: f64,
    steps: Vec<Step>,
    /// Number K of earlier displacements in the state of the period map.
    history: usize,
    /// Indices of the d displacement components that the state of the map stores: those of directions in which the tool
    /// moves.
    seen: Vec<usize>,
    /// Rows of the output matrix C for the stored displacement components, d × n.
    observe: DMatrix<f64>,
}

impl<'a> Stepped<'a> {
    /// Period map at an axial depth, m, from all time steps of a mesh.
    pub(crate) fn new(pitched: &'a Pitched, mesh: &'a Mesh, depth_m: f64, mut steps: Vec<Step>) -> Self {
        let structure = &pitched.problem.structure;
        let seen: Vec<usize> = (0..3)
            .filter(|&axis| structure.c.row(axis).amax() > 0.0)
            .collect();
        for (_, response) in steps.iter_mut().flat_map(|step| &mut step.past) {
            *response = response.select_columns(&seen);
        }
        let earliest = steps
            .iter()
            .flat_map(|step| &step.past)
            .map(|(index, _)| *index)
            .fold(0, isize::min);
        Self {
            pitched,
            mesh,
            depth_m,
            steps,
            history: earliest.unsigned_abs(),
            observe: DMatrix::from_fn(seen.len(), structure.order(), |i, j| structure.c[(seen[i], j)]),
            seen,
        }
    }

    fn order(&self) -> usize {
        self.observe.ncols()
    }

    /// State of the structure at the end of the period, and the displacements y_{−K} … y_N stacked in order of time,
    /// for each column of initial states.
    fn trace(&self, columns: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        let (order, kept, width) = (self.order(), self.seen.len(), columns.ncols());
        let mut trace = DMatrix::zeros((self.history + self.steps.len() + 1) * kept, width);
        for back in 1..=self.history {
            let from = columns.rows(order + (back - 1) * kept, kept);
            trace
                .rows_mut((self.history - back) * kept, kept)
                .copy_from(&from);
        }
        let mut state = columns.rows(0, order).into_owned();
        let mut next = state.clone();
        let mut place = self.history * kept;
        self.observe.mul_to(&state, &mut trace.rows_mut(place, kept));
        for step in &self.steps {
            step.flow.mul_to(&state, &mut next);
            for (index, response) in &step.past {
                // The earliest displacement has the index −K, so that its row in the stacked displacements is not
                // negative.
                let row = (index + self.history as isize) as usize * kept;
                next.gemm(1.0, response, &trace.rows(row, kept), 1.0);
            }
            std::mem::swap(&mut state, &mut next);
            place += kept;
            self.observe.mul_to(&state, &mut trace.rows_mut(place, kept));
        }
        (state, trace)
    }
}

impl LinearMap for Stepped<'_> {
    fn size(&self) -> usize {
        self.order() + self.history * self.seen.len()
    }

    fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let (order, kept) = (self.order(), self.seen.len());
        let (state, trace) = self.trace(columns);
        let mut image = DMatrix::zeros(self.size(), columns.ncols());
        image.rows_mut(0, order).copy_from(&state);
        let last = self.history + self.steps.len();
        for back in 1..=self.history {
            image
                .rows_mut(order + (back - 1) * kept, kept)
                .copy_from(&trace.rows((last - back) * kept, kept));
        }
        image.iter().all(|entry| entry.is_finite()).then_some(image)
    }
}

impl PeriodMap for Stepped<'_> {
    fn chatter_hz(&self, multiplier: Complex64, vector: &DVector<Complex64>) -> Option<f64> {
        let kept = self.seen.len();
        let parts = DMatrix::from_fn(
            vector.len(),
            2,
            |i, j| {
                if j == 0 { vector[i].re } else { vector[i].im }
            },
        );
        let (_, trace) = self.trace(&parts);
        dominant_frequency_hz(
            &self.pitched.problem,
            self.depth_m,
            self.mesh.passages.period_s,
            multiplier,
            |s| {
                let mut harmonic = DVector::<Complex64>::zeros(kept);
                for index in 0..self.steps.len() {
                    let (start_s, duration_s) = self.mesh.step(index);
                    let factor = (-s * start_s).exp() * duration_s;
                    for i in 0..kept {
                        let row = (self.history + index) * kept + i;
                        harmonic[i] += factor * Complex64::new(trace[(row, 0)], trace[(row, 1)]);
                    }
                }
                Some(harmonic.norm())
            },
        )
    }
}

/// Product of a force response B and a matrix K of force coefficients, n × 3.
pub(crate) fn pushed(response: &DMatrix<f64>, force: &Matrix3<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(response.nrows(), 3, |i, j| {
        (0..3).map(|axis| response[(i, axis)] * force[(axis, j)]).sum()
    })
}

/// Matrix exponential e^{Ah} over a time step h, and moments ∫₀^h e^{A(h−s)} (s/h)^q ds B for q = 0 … `moments` − 1,
/// each n × 3.
pub(crate) fn moments(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    duration_s: f64,
    moments: usize,
) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
    let order = a.nrows();
    let inputs = b.ncols();
    // Augmented system ẋ = A x + B z_0, ż_0 = z_1/h, …: z_0 = (s/h)^q/q! if z_q starts at 1 (Van Loan 1978).
    let mut augmented = DMatrix::zeros(order + inputs * moments, order + inputs * moments);
    augmented
        .view_mut((0, 0), (order, order))
        .copy_from(&(a * duration_s));
    augmented
        .view_mut((0, order), (order, inputs))
        .copy_from(&(b * duration_s));
    for index in 1..moments {
        let (row, column) = (order + inputs * (index - 1), order + inputs * index);
        augmented
            .view_mut((row, column), (inputs, inputs))
            .fill_with_identity();
    }
    let whole = Exponential::new(&augmented).at(1.0);
    let mut factorial = 1.0;
    let parts = (0..moments).map(|q| {
        factorial *= q.max(1) as f64;
        whole.view((0, order + inputs * q), (order, inputs)) * factorial
    });
    let parts = parts.collect();
    (whole.view((0, 0), (order, order)).into_owned(), parts)
}
