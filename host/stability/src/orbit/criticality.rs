//! Criticality of torus and flip: whether the vibration that begins at a stability loss is stable, from the coefficient of
//! the normal form.
//!
//! Let x_k be the motion over the k-th tooth period; the delay equals that period, so that x_{k−1} is the delayed motion.
//! On the centre manifold at a torus, with the critical multiplier μ and the Floquet mode q,
//!
//!   x_k = x* + z q + z̄ q̄ + ½ h₂₀ z² + h₁₁ z z̄ + ½ h₀₂ z̄² + …,   z_k = μ z_{k−1} + c z_{k−1}|z_{k−1}|².
//!
//! Each coefficient solves an ordinary differential equation with G(λ) = J + (1 − 1/λ) R of the
//! [mode equation](super::curve), and the second and third derivatives N″, N‴ of the nonlinear terms:
//!
//!   ḣ₂₀ = G(μ²) h₂₀ − N″[q, q], h₂₀(T) = μ² h₂₀(0);   ḣ₁₁ = G(1) h₁₁ − N″[q, q̄], h₁₁(T) = h₁₁(0).
//!
//! The equation for z|z|² is solvable only with
//!
//!   c = ⟨p, v(T)⟩/⟨p, q(0) − s(T)⟩,   v̇ = G(μ) v − N″[q, h₁₁] − ½ N″[q̄, h₂₀] − ½ N‴[q, q, q̄],   ṡ = G(μ) s + μ̄² R q,
//!
//! with v(0) = s(0) = 0 and the left null vector p of Φ(μ) − μ I, where Φ is the transition matrix of G(μ). The loss is
//! supercritical if Re(μ̄ c) < 0. At a flip μ = −1 and z is real: the forcing of v is −½ N″[q, h₂₀] − ⅙ N‴[q, q, q] and
//! ⟨p, ·⟩ and the criterion are the same.
//!
//! Source: Kuznetsov, *Elements of Applied Bifurcation Theory*, 3rd ed., sections 4.7 and 5.4, for maps; the projection of
//! a periodic orbit of a delay equation reduces to these ordinary equations since the delay is the period.
//!
//! All teeth are taken to stay in contact, as in stability limits.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use serde::Serialize;

use super::branch::Event;
use super::forced::ForcedProblem;
use super::parameter::{Parameter, Setting};
use super::tooth_period::{SUBINTERVAL_ANGLE, Subinterval, ToothPeriod, jacobians};
use crate::spectrum::stability_loss::StabilityLoss;
use quietcut_numerics::eigenvalues::eigenvector;

/// Distance of μ^q from 1, for q = 1, 2, 3 and 4, below which a torus is in strong resonance, and the normal form is
/// another one. A choice: nearer, the coefficients grow beyond their range of validity.
const RESONANT: f64 = 1e-3;

/// Whether the vibration that begins at a torus or flip is stable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Criticality {
    /// Real part of μ̄ c, per square of the amplitude of the mode: negative if the loss is supercritical.
    #[serde(skip)]
    pub coefficient: f64,
    /// Half the range of the stroboscopic displacements, mm, that the mode with amplitude 1 adds, in feed, normal and
    /// axial direction.
    #[serde(skip)]
    pub mode_mm: [f64; 3],
}

impl Criticality {
    /// True if the vibration is stable: its amplitude grows from zero beyond the loss. False if an unstable vibration
    /// surrounds the stable orbit before the loss, which larger disturbances leave.
    pub fn is_supercritical(&self) -> bool {
        self.coefficient < 0.0
    }

    /// Half the range of the stroboscopic displacements of the vibration, mm, for a multiplier of the orbit with the
    /// absolute value 1 + `excess`, near the loss; `None` if there is no vibration on this side of it.
    pub fn spread_mm(&self, excess: f64) -> Option<[f64; 3]> {
        let square = -excess / self.coefficient;
        (square > 0.0).then(|| self.mode_mm.map(|mode| mode * square.sqrt()))
    }
}

/// Criticality of a torus or flip on a branch of a problem over a parameter within a range, in the unit of results; `setting`
/// holds the other parameters.
///
/// `None` at a fold, in a strong resonance, if an equation is singular, or if the problem is nonlinear in another way
/// than by cubic stiffness and damping.
pub fn criticality(
    problem: &ForcedProblem,
    setting: Setting,
    parameter: Parameter,
    range: [f64; 2],
    event: &Event,
) -> Option<Criticality> {
    if !is_covered(problem, event) {
        return None;
    }
    let setting = setting.with(parameter, event.value);
    let problem = problem.at(&setting);
    let depth_m = setting.depth_m();
    // The mesh of the branch, on which its orbits are.
    let slowest_rpm = match parameter {
        Parameter::Rpm => range[0].min(range[1]),
        _ => setting.rpm,
    };
    let map = ToothPeriod::on_mesh_of(slowest_rpm, &problem, setting.rpm, SUBINTERVAL_ANGLE);
    let orbit = event.orbit.states.as_slice();
    if map.subintervals.len() != orbit.len() {
        return None;
    }
    let subintervals = map.subintervals.iter().zip(orbit);
    let pieces: Vec<Piece> = subintervals
        .map(|(subinterval, states)| Piece::new(&map, subinterval, states, depth_m))
        .collect();
    let system = ModeSystem {
        problem: &problem,
        pieces,
        integrals: &map.gauss.integrals,
        weights: &map.gauss.weights,
    };
    let mu = match event.kind {
        StabilityLoss::Flip => Complex64::from(-1.0),
        _ => event.multiplier,
    };
    system.coefficient(mu, event.kind == StabilityLoss::Flip)
}

fn is_covered(problem: &ForcedProblem, event: &Event) -> bool {
    let is_resonant = |q: i32| (event.multiplier.powi(q) - 1.0).norm() < RESONANT;
    let is_possible = match event.kind {
        StabilityLoss::Fold => false,
        StabilityLoss::Flip => true,
        StabilityLoss::Hopf => !(1..=4).any(is_resonant),
    };
    is_possible
        && problem.cubic.is_some()
        && !problem.is_over_revolution()
        && !problem.has_smooth_forces()
        && problem.chip_exponent().is_none()
        && !problem.linear.process.axial_depth_modulation
}

/// Values at the nodes of each subinterval.
type Values = Vec<Vec<DVector<Complex64>>>;

/// Subinterval of the tooth period with the matrices of the mode equation at its nodes.
struct Piece {
    duration_s: f64,
    jacobians: Vec<DMatrix<f64>>,
    /// Regenerative matrix R.
    chips: Vec<DMatrix<f64>>,
    states: DMatrix<f64>,
}

impl Piece {
    fn new(map: &ToothPeriod<'_>, subinterval: &Subinterval, states: &DMatrix<f64>, depth_m: f64) -> Self {
        let nodes = 0..map.gauss.nodes.len();
        Self {
            duration_s: subinterval.duration,
            jacobians: jacobians(map.problem, subinterval, states, depth_m),
            chips: nodes
                .map(|node| map.chip_per_depth(subinterval, node) * depth_m)
                .collect(),
            states: states.clone(),
        }
    }
}

struct ModeSystem<'a> {
    problem: &'a ForcedProblem,
    pieces: Vec<Piece>,
    integrals: &'a DMatrix<f64>,
    weights: &'a [f64],
}

impl ModeSystem<'_> {
    fn order(&self) -> usize {
        self.problem.order()
    }

    fn coefficient(&self, mu: Complex64, is_flip: bool) -> Option<Criticality> {
        let order = self.order();
        let (_, transition) = self.advance(mu, &DMatrix::identity(order, order), None)?;
        // By inverse iteration: where the criticality changes, the coefficient is the difference of two large terms, and the
        // singular value decomposition of nalgebra errs by up to a percent in these vectors.
        let start = eigenvector(&transition, mu)?;
        let left = eigenvector(&transition.adjoint(), mu.conj())?;
        let (q, _) = self.from(mu, &start, None)?;
        let conjugate = map(&q, |value| value.conjugate());
        let one = Complex64::from(1.0);
        let h20 = self.periodic(mu * mu, &self.minus_second(&q, &q))?;
        let third = self.minus_third(&q, &q, &conjugate);
        let forcing = if is_flip {
            let second = self.minus_second(&q, &h20);
            sum(&[(0.5, &second), (1.0 / 6.0, &third)])
        } else {
            let h11 = self.periodic(one, &self.minus_second(&q, &conjugate))?;
            let with_h11 = self.minus_second(&q, &h11);
            let with_h20 = self.minus_second(&conjugate, &h20);
            sum(&[(1.0, &with_h11), (0.5, &with_h20), (0.5, &third)])
        };
        let rest = DVector::zeros(order);
        let (_, v) = self.from(mu, &rest, Some(&forcing))?;
        let delayed = self.delayed(&q, mu.conj() * mu.conj());
        let (_, s) = self.from(mu, &rest, Some(&delayed))?;
        let c = left.dotc(&v) / left.dotc(&(&start - s));
        let coefficient = (mu.conj() * c).re;
        let displacement = self.problem.linear.structure.c.map(Complex64::from) * &start;
        // A torus adds z q + z̄ q̄, of which the phase of z runs through all angles; a flip adds ± z q.
        let parts = if is_flip { 1.0 } else { 2.0 };
        coefficient.is_finite().then(|| Criticality {
            coefficient,
            mode_mm: std::array::from_fn(|axis| 1e3 * parts * displacement[axis].norm()),
        })
    }

    /// Solution of ż = G(λ) z + forcing with z(T) = λ z(0), at the nodes.
    fn periodic(&self, lambda: Complex64, forcing: &Values) -> Option<Values> {
        let order = self.order();
        let (_, transition) = self.advance(lambda, &DMatrix::identity(order, order), None)?;
        let (_, forced) = self.from(lambda, &DVector::zeros(order), Some(forcing))?;
        let matrix = DMatrix::from_diagonal_element(order, order, lambda) - transition;
        let start = matrix.lu().solve(&forced)?;
        Some(self.from(lambda, &start, Some(forcing))?.0)
    }

    /// Solution of ż = G(λ) z + forcing from a start, at the nodes and at the end of the period.
    fn from(
        &self,
        lambda: Complex64,
        start: &DVector<Complex64>,
        forcing: Option<&Values>,
    ) -> Option<(Values, DVector<Complex64>)> {
        let start = DMatrix::from_column_slice(start.len(), 1, start.as_slice());
        let (nodes, end) = self.advance(lambda, &start, forcing)?;
        let order = self.order();
        let of_piece = |values: &DMatrix<Complex64>| {
            let column = values.as_slice().chunks_exact(order);
            column.map(DVector::from_column_slice).collect()
        };
        Some((nodes.iter().map(of_piece).collect(), end.column(0).into_owned()))
    }

    /// Collocated solutions of ż = G(λ) z + forcing from several starts, one a column: stacked values at the nodes of each
    /// subinterval, and the ends. `None` if a subinterval is singular.
    fn advance(
        &self,
        lambda: Complex64,
        start: &DMatrix<Complex64>,
        forcing: Option<&Values>,
    ) -> Option<(Vec<DMatrix<Complex64>>, DMatrix<Complex64>)> {
        let (order, columns) = (self.order(), start.ncols());
        let regeneration = Complex64::from(1.0) - lambda.inv();
        let mut here = start.clone();
        let mut all = Vec::with_capacity(self.pieces.len());
        for (index, piece) in self.pieces.iter().enumerate() {
            let nodes = piece.jacobians.len();
            let forced = |node: usize| forcing.map(|values| &values[index][node]);
            let matrices: Vec<DMatrix<Complex64>> = piece
                .jacobians
                .iter()
                .zip(&piece.chips)
                .map(|(jacobian, chip)| {
                    jacobian.map(Complex64::from) + chip.map(|entry| regeneration * entry)
                })
                .collect();
            let mut matrix = DMatrix::identity(order * nodes, order * nodes);
            let mut right = DMatrix::zeros(order * nodes, columns);
            for i in 0..nodes {
                let mut block = right.view_mut((i * order, 0), (order, columns));
                block += &here;
                for (j, of_node) in matrices.iter().enumerate() {
                    let weight = Complex64::from(piece.duration_s * self.integrals[(i, j)]);
                    let mut entry = matrix.view_mut((i * order, j * order), (order, order));
                    entry -= of_node * weight;
                    if let Some(force) = forced(j) {
                        for mut column in block.column_iter_mut() {
                            column.axpy(weight, force, Complex64::from(1.0));
                        }
                    }
                }
            }
            let values = matrix.lu().solve(&right)?;
            for (j, of_node) in matrices.iter().enumerate() {
                let weight = Complex64::from(piece.duration_s * self.weights[j]);
                here += (of_node * values.rows(j * order, order)) * weight;
                if let Some(force) = forced(j) {
                    for mut column in here.column_iter_mut() {
                        column.axpy(weight, force, Complex64::from(1.0));
                    }
                }
            }
            all.push(values);
        }
        Some((all, here))
    }

    /// R q times a factor, at the nodes.
    fn delayed(&self, q: &Values, factor: Complex64) -> Values {
        let pieces = self.pieces.iter().zip(q);
        let of_piece = |(piece, values): (&Piece, &Vec<DVector<Complex64>>)| {
            let nodes = piece.chips.iter().zip(values);
            nodes
                .map(|(chip, value)| chip.map(Complex64::from) * value * factor)
                .collect()
        };
        pieces.map(of_piece).collect()
    }

    /// −N″[a, b] about the orbit, at the nodes.
    fn minus_second(&self, a: &Values, b: &Values) -> Values {
        let along = |index: usize, node: usize| {
            let state = self.pieces[index].states.column(node).map(Complex64::from);
            self.minus_cubic(&state, &a[index][node], &b[index][node])
        };
        self.at_nodes(along)
    }

    /// −N‴[a, b, c], at the nodes.
    fn minus_third(&self, a: &Values, b: &Values, c: &Values) -> Values {
        self.at_nodes(|index, node| self.minus_cubic(&a[index][node], &b[index][node], &c[index][node]))
    }

    fn at_nodes(&self, value: impl Fn(usize, usize) -> DVector<Complex64>) -> Values {
        let pieces = self.pieces.iter().enumerate();
        pieces
            .map(|(index, piece)| (0..piece.chips.len()).map(|node| value(index, node)).collect())
            .collect()
    }

    /// Symmetric trilinear form of the cubic terms N, whose value for three equal states is −6 N.
    fn minus_cubic(
        &self,
        a: &DVector<Complex64>,
        b: &DVector<Complex64>,
        c: &DVector<Complex64>,
    ) -> DVector<Complex64> {
        let mut form = DVector::zeros(self.order());
        let Some(cubic) = &self.problem.cubic else {
            return form;
        };
        let size = cubic.size();
        let ones = vec![1.0; size];
        let product = a.component_mul(b).component_mul(c);
        for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
            // Six times the entries of both matrices.
            let [by_q, by_v] = cubic.curvatures((i, j), &ones, &ones);
            form[size + i] -= product[j] * by_q + product[size + j] * by_v;
        }
        form
    }
}

fn map(values: &Values, of: impl Fn(&DVector<Complex64>) -> DVector<Complex64>) -> Values {
    values
        .iter()
        .map(|piece| piece.iter().map(&of).collect())
        .collect()
}

/// Sum of values with real factors.
fn sum(parts: &[(f64, &Values)]) -> Values {
    let Some((_, first)) = parts.first() else {
        return Vec::new();
    };
    let zero = map(first, |value| DVector::zeros(value.len()));
    parts.iter().fold(zero, |mut sum, (factor, values)| {
        for (sum, values) in sum.iter_mut().zip(*values) {
            for (sum, value) in sum.iter_mut().zip(values) {
                *sum += value * Complex64::from(*factor);
            }
        }
        sum
    })
}
