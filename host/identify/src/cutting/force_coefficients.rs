//! Force coefficients from cutting tests with measured forces.
//!
//! At every instant F = Σ a {(K_tc e_t + K_rc e_r + K_ac e_a)(φ) h + (K_te e_t + K_re e_r + K_ae e_a)(φ)/sin γ}, summed
//! over the engaged teeth, with the axial depth a and the edge angle γ (thesis eqs 3.2 to 3.4). The chip thickness h
//! comes from [`chips`] and contains the runout of each tooth. The coefficients minimize the weighted squared residual
//! of the force over the revolutions of full engagement, without the samples beside tooth entries and exits; each
//! channel is weighted with the inverse of its residual variance. The mean-force method (Altintas) serves for
//! comparison: forces averaged over a revolution are regressed on those that each unit coefficient would cause at the
//! feed of the test. Runout and stable vibration do not affect it as long as every tooth stays in contact. Intervals
//! come from the scatter between revolutions.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Vector3};
use quietcut_numerics::least_squares::{
    LinearFit, LinearProblem, invert_normal_equations, solve_normal_equations,
};
use rayon::prelude::*;

use crate::criteria::{LARGEST_LAST_STEP, LEAST_METHOD_DIFFERENCE, SAME_FEED};
use crate::cutting::chip::{Chip, chips};
use crate::cutting::force_test::CuttingTest;
use crate::cutting::prepared_test::{Prepared, prepared};
use quietcut_model::milling::Runout;
use quietcut_numerics::statistics::{NINETY_PERCENT, student_ninety_percent};

/// Keys of the force coefficients in a case: three cutting coefficients in MPa, three edge coefficients in N/mm.
pub const KEYS: [&str; 6] = [
    "ktc_mpa",
    "krc_mpa",
    "kac_mpa",
    "kte_n_per_mm",
    "kre_n_per_mm",
    "kae_n_per_mm",
];

/// A fitted force coefficient or tooth offset; the half-width of its 90 % interval is 1.645 standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// The estimated value.
    pub value: f64,
    /// Standard deviation of the value.
    pub deviation: f64,
}

/// Length of a Gauss–Newton step below which a fit of force coefficients stops, in standard deviations. A choice.
const SETTLED: f64 = 1e-2;

/// Result of the fit: force coefficients from a set of cutting tests.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Force coefficients from instantaneous forces, in the order of [`KEYS`]; `None` for the axial ones unless the
    /// axial force was measured in every test.
    pub coefficients: [Option<Value>; 6],
    /// Force coefficients from mean forces of revolutions, in the order of [`KEYS`], each `None` as in `coefficients`.
    /// `None` altogether if all feeds are equal within 2 %, or if mean forces do not determine the coefficients.
    pub averaged: Option<[Option<Value>; 6]>,
    /// Radial offset of the edge of each tooth from the mean of all teeth, m, by tooth.
    pub runout_m: Vec<Value>,
    /// NRMSE of the fitted force at the samples of the fit.
    pub relative_error: f64,
    /// Number of revolutions of full engagement in the fit, over all tests.
    pub revolutions: usize,
    /// Number of feeds per tooth among the tests that differ by more than 2 %.
    pub feeds: usize,
    /// Mean of the feeds per tooth of all tests, m.
    pub feed_per_tooth_m: f64,
}

/// Reason why the fit of force coefficients gives no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForceCoefficientError {
    /// The tests have different numbers of teeth.
    #[error("the tests have tools with {0} and {1} teeth; tests of one tool are needed")]
    Teeth(usize, usize),
    /// Some test lacks fz, and at this edge angle the coefficients of radial and axial force are then not separately
    /// identifiable.
    #[error(
        "no fz was measured, and with an edge angle of {0:.1} degrees radial and axial forces act in one direction in the plane of the tool; fz, or a square end mill (90 degrees), is needed"
    )]
    NoAxialForce(f64),
    /// There are no cutting tests, or they do not determine force coefficients and runout.
    #[error(
        "the tests do not determine the coefficients; cuts at two or more feeds, in which teeth cut air now and then, are needed"
    )]
    Undetermined,
    /// The fit does not converge.
    #[error("the fit does not converge: chips that come and go with the runout; larger feeds are needed")]
    NotConverged,
}

/// Parameters that are fitted to the forces of cutting tests: force coefficients, and radial offsets of the teeth.
#[derive(Clone)]
struct State {
    /// Force coefficients in the order of [`KEYS`].
    coefficients: [f64; 6],
    runout_m: Vec<f64>,
}

/// Normal equations and squared force residuals, summed over the samples of one or more cutting tests.
struct Sums {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Σ g gᵀ over revolutions, with g the gradient, by the parameters, of half the weighted sum of squared force
    /// residuals of one revolution; the sandwich covariance uses it.
    scatter: DMatrix<f64>,
    /// Sum of squared force residuals in feed, normal and axial direction, N².
    left: Vector3<f64>,
    all: f64,
    samples: usize,
    revolutions: usize,
}

impl Sums {
    fn new(size: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
            scatter: DMatrix::zeros(size, size),
            left: Vector3::zeros(),
            all: 0.0,
            samples: 0,
            revolutions: 0,
        }
    }

    fn add(mut self, other: &Self) -> Self {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.scatter += &other.scatter;
        self.left += other.left;
        self.all += other.all;
        self.samples += other.samples;
        self.revolutions += other.revolutions;
        self
    }
}

/// Fits the force coefficients to tests with one tool.
///
/// # Errors
/// See [`ForceCoefficientError`].
pub fn fit(tests: &[CuttingTest]) -> Result<Fit, ForceCoefficientError> {
    let Some(first) = tests.first() else {
        return Err(ForceCoefficientError::Undetermined);
    };
    if let Some(other) = tests.iter().find(|test| test.teeth != first.teeth) {
        return Err(ForceCoefficientError::Teeth(first.teeth, other.teeth));
    }
    let has_axial = tests.iter().all(|test| test.has_axial_force);
    if !has_axial && first.edge_angle.sees_axial_displacement() {
        return Err(ForceCoefficientError::NoAxialForce(first.edge_angle.degrees()));
    }
    let mut fitter = Fitter {
        tests: tests.iter().map(prepared).collect(),
        teeth: first.teeth,
        has_axial,
    };
    let start = State {
        coefficients: [0.0; 6],
        runout_m: vec![0.0; first.teeth],
    };
    // With all force coefficients zero the runout has no effect, so the first step fits the coefficients alone.
    let linear = fitter.step(&start, &fitter.sums(&start))?.0;
    fitter.weigh(&linear);
    let state = fitter.settle(linear)?;
    // The residual variances of the converged fit are better weights than those of the first step.
    fitter.weigh(&state);
    let state = fitter.settle(state)?;
    Ok(fitter.finish(&state))
}

struct Fitter<'a> {
    tests: Vec<Prepared<'a>>,
    teeth: usize,
    has_axial: bool,
}

impl Fitter<'_> {
    /// Indices in [`KEYS`] of the fitted force coefficients: all, or all but the axial ones if some test lacks the
    /// axial force.
    fn active(&self) -> Vec<usize> {
        (0..6).filter(|index| self.has_axial || index % 3 != 2).collect()
    }

    /// Number of fitted parameters: force coefficients, and radial offsets of all teeth but the last.
    fn size(&self) -> usize {
        self.active().len() + self.teeth - 1
    }

    /// Force on the tool at one sample, N; `slopes` receives its derivatives by the coefficients and by the radial
    /// offset of every tooth.
    fn model(
        &self,
        prepared: &Prepared<'_>,
        cut: &[Chip],
        state: &State,
        slopes: &mut [Vector3<f64>],
    ) -> Vector3<f64> {
        slopes.fill(Vector3::zeros());
        let mut force = Vector3::zeros();
        let sin_edge = prepared.test.edge_angle.sin();
        for chip in cut {
            let mut per_meter = Vector3::zeros();
            for part in 0..3 {
                let cutting = prepared.cutting[part].at(chip.phi);
                let edge = prepared.edge[part].at(chip.phi);
                slopes[part] += cutting * chip.thickness_m;
                slopes[part + 3] += edge;
                per_meter += cutting * state.coefficients[part];
                force += edge * state.coefficients[part + 3];
            }
            force += per_meter * chip.thickness_m;
            slopes[6 + chip.tooth] += per_meter * sin_edge;
            slopes[6 + chip.ahead] -= per_meter * sin_edge;
        }
        force
    }

    fn sums(&self, state: &State) -> Sums {
        let of_tests: Vec<Sums> = self
            .tests
            .par_iter()
            .map(|prepared| self.sums_of(prepared, state))
            .collect();
        of_tests.iter().fold(Sums::new(self.size()), Sums::add)
    }

    fn sums_of(&self, prepared: &Prepared<'_>, state: &State) -> Sums {
        let (active, size) = (self.active(), self.size());
        let chips = chips(prepared.test, &state.runout_m);
        let mut sums = Sums::new(size);
        let mut slopes = vec![Vector3::zeros(); 6 + self.teeth];
        let mut row = DVector::zeros(size);
        let mut gradient = DVector::zeros(size);
        for [from, to] in &prepared.revolutions {
            gradient.fill(0.0);
            for (sample, cut) in (*from..).zip(&chips[*from..*to]) {
                if prepared.switching.contains(&sample) {
                    continue;
                }
                let measured = prepared.test.force[sample];
                let left = measured - self.model(prepared, cut, state, &mut slopes);
                sums.samples += 1;
                sums.left += left.component_mul(&left);
                sums.all += measured.norm_squared();
                if cut.is_empty() {
                    continue;
                }
                for axis in 0..3 {
                    let weight = prepared.weights[axis];
                    for (place, index) in active.iter().enumerate() {
                        row[place] = slopes[*index][axis];
                    }
                    // The radial offset of the last tooth is minus the sum of the others.
                    for tooth in 0..self.teeth - 1 {
                        row[active.len() + tooth] =
                            slopes[6 + tooth][axis] - slopes[6 + self.teeth - 1][axis];
                    }
                    sums.matrix.ger(weight, &row, &row, 1.0);
                    gradient.axpy(weight * left[axis], &row, 1.0);
                }
            }
            sums.scatter.ger(1.0, &gradient, &gradient, 1.0);
            sums.gradient += &gradient;
            sums.revolutions += 1;
        }
        sums
    }

    /// The parameters after one Gauss–Newton step, and the length of the step in standard deviations of the parameters.
    fn step(&self, state: &State, sums: &Sums) -> Result<(State, f64), ForceCoefficientError> {
        let active = self.active();
        // With all force coefficients zero the radial offsets have no effect and are not fitted.
        let known = if state.coefficients == [0.0; 6] {
            active.len()
        } else {
            self.size()
        };
        let matrix = sums.matrix.view((0, 0), (known, known)).into_owned();
        let gradient = sums.gradient.rows(0, known).into_owned();
        let step = solve_normal_equations(&matrix, &gradient).ok_or(ForceCoefficientError::Undetermined)?;
        let mut next = state.clone();
        for (place, index) in active.iter().enumerate() {
            next.coefficients[*index] += step[place];
        }
        if known > active.len() {
            let mut last = 0.0;
            for tooth in 0..self.teeth - 1 {
                next.runout_m[tooth] += step[active.len() + tooth];
                last -= next.runout_m[tooth];
            }
            next.runout_m[self.teeth - 1] = last;
        }
        Ok((next, step.dot(&(matrix * &step)).max(0.0).sqrt()))
    }

    /// Gauss–Newton iteration without damping: the forces are bilinear in force coefficients and runout.
    fn settle(&self, mut state: State) -> Result<State, ForceCoefficientError> {
        let mut length = f64::INFINITY;
        for _ in 0..30 {
            (state, length) = self.step(&state, &self.sums(&state))?;
            if length < SETTLED {
                return Ok(state);
            }
        }
        if length < LARGEST_LAST_STEP {
            Ok(state)
        } else {
            Err(ForceCoefficientError::NotConverged)
        }
    }

    /// Sets the weight of each force direction of each test to the inverse of the residual variance in that direction,
    /// and the axial weight to 0 if the axial coefficients are not fitted.
    fn weigh(&mut self, state: &State) {
        let variances: Vec<Vector3<f64>> = self
            .tests
            .iter()
            .map(|prepared| {
                let sums = self.sums_of(prepared, state);
                // An exact fit would give an infinite weight; the residual variance is at least 1e-20 of the mean
                // square force.
                let least = 1e-20 * sums.all / sums.samples.max(1) as f64;
                (sums.left / sums.samples.max(1) as f64).map(|variance| variance.max(least))
            })
            .collect();
        let axial = if self.has_axial { 1.0 } else { 0.0 };
        for (prepared, variance) in self.tests.iter_mut().zip(variances) {
            let weight = |axis: usize| {
                if variance[axis] > 0.0 {
                    1.0 / variance[axis]
                } else {
                    1.0
                }
            };
            prepared.weights = [weight(0), weight(1), axial * weight(2)];
        }
    }

    fn finish(&self, state: &State) -> Fit {
        let sums = self.sums(state);
        let (active, size) = (self.active(), self.size());
        let covariance = invert_normal_equations(&sums.matrix).map_or_else(
            || DMatrix::from_element(size, size, f64::INFINITY),
            |inverse| &inverse * &sums.scatter * &inverse,
        );
        let few = few(sums.revolutions, size);
        let deviation = |variance: f64| few * variance.max(0.0).sqrt();
        let coefficients = std::array::from_fn(|index| {
            let place = active.iter().position(|known| *known == index)?;
            Some(Value {
                value: state.coefficients[index],
                deviation: deviation(covariance[(place, place)]),
            })
        });
        let of_runout = covariance.view((active.len(), active.len()), (self.teeth - 1, self.teeth - 1));
        let runout_m = (0..self.teeth)
            .map(|tooth| Value {
                value: state.runout_m[tooth],
                deviation: deviation(if tooth + 1 < self.teeth {
                    of_runout[(tooth, tooth)]
                } else {
                    of_runout.sum()
                }),
            })
            .collect();
        let feeds = self.feeds();
        Fit {
            coefficients,
            averaged: if feeds > 1 { self.averaged() } else { None },
            runout_m,
            relative_error: (sums.left.sum() / sums.all.max(f64::MIN_POSITIVE)).sqrt(),
            revolutions: sums.revolutions,
            feeds,
            feed_per_tooth_m: self.mean_feed_m(),
        }
    }

    fn mean_feed_m(&self) -> f64 {
        let feeds = self.tests.iter().map(|prepared| prepared.test.feed_per_tooth_m);
        feeds.sum::<f64>() / self.tests.len() as f64
    }

    fn feeds(&self) -> usize {
        let mut feeds: Vec<f64> = self
            .tests
            .iter()
            .map(|prepared| prepared.test.feed_per_tooth_m)
            .collect();
        feeds.sort_by(f64::total_cmp);
        feeds.dedup_by(|next, known| *next <= *known * (1.0 + SAME_FEED));
        feeds.len()
    }

    /// Force coefficients from mean forces, by least squares; `None` if the tests do not determine them.
    fn averaged(&self) -> Option<[Option<Value>; 6]> {
        let active = self.active();
        let directions = if self.has_axial { 3 } else { 2 };
        let (mut rows, mut right) = (Vec::new(), Vec::new());
        let mut ends = Vec::new();
        for prepared in &self.tests {
            for [from, to] in &prepared.revolutions {
                let (columns, force) = prepared.mean_forces([*from, *to]);
                for axis in 0..directions {
                    rows.extend(active.iter().map(|index| columns[*index][axis]));
                    right.push(force[axis]);
                }
                ends.push(right.len());
            }
        }
        let matrix = DMatrix::from_row_slice(right.len(), active.len(), &rows);
        let right = DVector::from_vec(right);
        let LinearFit {
            parameters: solution,
            covariance: inverse,
            ..
        } = LinearProblem::new(&matrix, &right).solve().ok()?;
        let left = right - &matrix * &solution;
        let mut scatter = DMatrix::zeros(active.len(), active.len());
        for end in &ends {
            let from = end - directions;
            let gradient = matrix.rows(from, directions).tr_mul(&left.rows(from, directions));
            scatter += &gradient * gradient.transpose();
        }
        let covariance = &inverse * scatter * &inverse;
        let few = few(ends.len(), active.len());
        Some(std::array::from_fn(|index| {
            let place = active.iter().position(|known| *known == index)?;
            Some(Value {
                value: solution[place],
                deviation: few * covariance[(place, place)].max(0.0).sqrt(),
            })
        }))
    }
}

impl Fit {
    /// Keys of the force coefficients whose values from mean forces and from instantaneous forces differ by more than
    /// the sum of both 90 % half-widths plus 1/20 of the largest coefficient of their kind (cutting or edge). For edge
    /// coefficients, the largest cutting coefficient times the mean feed per tooth replaces the largest edge
    /// coefficient if it is larger.
    pub fn apart(&self) -> Vec<&'static str> {
        let averaged = self.averaged.unwrap_or_default();
        let largest = |values: &[Option<Value>]| {
            let sizes = values.iter().flatten().map(|value| value.value.abs());
            sizes.fold(0.0, f64::max)
        };
        let cutting = largest(&self.coefficients[..3]);
        // MPa times m gives 10³ N/mm.
        let edge = largest(&self.coefficients[3..]).max(1e3 * self.feed_per_tooth_m * cutting);
        let differs = |&(index, _): &(usize, &'static str)| {
            let (Some(one), Some(other)) = (self.coefficients[index], averaged[index]) else {
                return false;
            };
            let least = LEAST_METHOD_DIFFERENCE * if index < 3 { cutting } else { edge };
            (one.value - other.value).abs() > NINETY_PERCENT * (one.deviation + other.deviation) + least
        };
        KEYS.into_iter()
            .enumerate()
            .filter(differs)
            .map(|(_, key)| key)
            .collect()
    }
}

/// Offset e of the tool axis from the spindle axis, and its angle ψ, from the radial offsets r_j = e cos(ψ + 2πj/N) of
/// the N teeth.
///
/// `None` for one tooth, or if the offset does not exceed the largest 90 % half-width of a tooth's radial offset. Two
/// teeth show only the component of the offset along the line through them.
pub fn runout(fit: &Fit) -> Option<Runout> {
    let teeth = fit.runout_m.len();
    let (mut cosine, mut sine) = (0.0, 0.0);
    for (tooth, out) in fit.runout_m.iter().enumerate() {
        let (sin, cos) = (TAU * tooth as f64 / teeth as f64).sin_cos();
        cosine += out.value * cos;
        sine -= out.value * sin;
    }
    let share = if teeth > 2 { 2.0 } else { 1.0 } / teeth as f64;
    let (cosine, sine) = (share * cosine, if teeth > 2 { share * sine } else { 0.0 });
    let offset_m = cosine.hypot(sine);
    let largest = fit
        .runout_m
        .iter()
        .map(|value| value.deviation)
        .fold(0.0, f64::max);
    (teeth > 1 && offset_m > NINETY_PERCENT * largest).then(|| Runout {
        offset_um: 1e6 * offset_m,
        angle_deg: sine.atan2(cosine).to_degrees(),
    })
}

/// Factor by which standard deviations are enlarged for few revolutions: the ratio of Student's 90 % quantile to the
/// normal one, times √(n/(n − p)) for n revolutions and p fitted parameters.
fn few(revolutions: usize, parameters: usize) -> f64 {
    let count = revolutions as f64;
    let taken = count / (count - parameters as f64).max(1.0);
    taken.sqrt() * student_ninety_percent(revolutions.saturating_sub(1)) / NINETY_PERCENT
}
