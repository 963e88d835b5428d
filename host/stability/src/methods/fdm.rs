//! Full discretization: coefficients, state and delayed displacement are linear in time within a step; the free
//! structure is solved exactly.
//!
//! With V = B (w K − β) C and σ = s/h within the step from t_i to t_i + h
//!
//!   x_{i+1} = e^{Ah} x_i + ∫₀^h e^{A(h−s)} [V(σ) x(σ) − w B K_d(σ) y_d(σ)] ds,
//!
//! each factor being linear in σ between its values at both ends (Ding, Zhu, Zhang & Ding, Int. J. Mach. Tools Manuf.
//! 50 (2010) 502). Matrix exponentials depend on h alone. Steps end where a tooth enters or leaves, with one-sided
//! limits of the coefficients at their ends, so that Floquet multipliers converge with h² at any immersion.

use nalgebra::{DMatrix, Matrix3};

use super::discretized::{Discretization, Discretized};
use super::stepped::{Mesh, Step, Stepped, moments, pushed};
use crate::problem::pitched::Pitched;

/// Full discretization with linear interpolation within a step (Ding et al. 2010).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FullDiscretization;

/// Full discretization with a given number of steps, applied to a problem.
pub type Fdm = Discretized<FullDiscretization>;

/// Matrix exponential e^{Ah} of a time step of duration h, and integrals ∫ e^{A(h−s)} B p(σ) ds over the step for the
/// products p of two linear functions of σ = s/h, n × 3.
struct Weights {
    duration_s: f64,
    flow: DMatrix<f64>,
    /// Integral ∫ e^{A(h−s)} B p(σ) ds over the step with p = (1 − σ)².
    start: DMatrix<f64>,
    /// Integral ∫ e^{A(h−s)} B p(σ) ds over the step with p = σ (1 − σ).
    mixed: DMatrix<f64>,
    /// Integral ∫ e^{A(h−s)} B p(σ) ds over the step with p = σ².
    end: DMatrix<f64>,
}

impl Weights {
    fn new(a: &DMatrix<f64>, b: &DMatrix<f64>, duration_s: f64) -> Self {
        let (flow, parts) = moments(a, b, duration_s, 3);
        Self {
            duration_s,
            flow,
            start: &parts[0] - &parts[1] * 2.0 + &parts[2],
            mixed: &parts[1] - &parts[2],
            end: parts[2].clone(),
        }
    }
}

impl Discretization for FullDiscretization {
    fn name(&self) -> &'static str {
        "fdm"
    }

    fn order(&self) -> u32 {
        2
    }

    fn map<'a>(&self, pitched: &'a Pitched, mesh: &'a Mesh, depth_m: f64) -> Option<Stepped<'a>> {
        let structure = &pitched.problem.structure;
        let order = structure.order();
        let b = DMatrix::from_fn(order, 3, |i, j| structure.b[(i, j)]);
        let c = DMatrix::from_fn(3, order, |i, j| structure.c[(i, j)]);
        let mut known: Option<Weights> = None;
        let mut steps = Vec::with_capacity(mesh.count());
        for index in 0..mesh.count() {
            let (start_s, duration_s) = mesh.step(index);
            // Between two entries or exits of teeth all steps have equal durations except for rounding, and share their
            // weights.
            let weights = known
                .take()
                .filter(|weights| (weights.duration_s - duration_s).abs() < 1e-9 * duration_s)
                .unwrap_or_else(|| Weights::new(&structure.a, &b, duration_s));
            let (first, last) = (mesh.at(pitched, index, 0.0), mesh.at(pitched, index, 1.0));
            // Integrals over a step of a force coefficient that is linear between `a` and `b`, times 1 − σ (`falling`)
            // and times σ (`rising`).
            let falling =
                |a: &Matrix3<f64>, b: &Matrix3<f64>| pushed(&weights.start, a) + pushed(&weights.mixed, b);
            let rising =
                |a: &Matrix3<f64>, b: &Matrix3<f64>| pushed(&weights.mixed, a) + pushed(&weights.end, b);
            let (present, next) = (first.present(depth_m), last.present(depth_m));
            let implicit = (DMatrix::identity(order, order) - rising(&present, &next) * &c).lu();
            let explicit = &weights.flow + falling(&present, &next) * &c;
            let mut step = Step::new(implicit.solve(&explicit)?);
            for ((delay_s, first), (_, last)) in first.regenerative.iter().zip(&last.regenerative) {
                let (first, last) = (first * -depth_m, last * -depth_m);
                let before_s = start_s - delay_s;
                step.add_past(mesh, before_s, &implicit.solve(&falling(&first, &last))?);
                step.add_past(
                    mesh,
                    before_s + duration_s,
                    &implicit.solve(&rising(&first, &last))?,
                );
            }
            steps.push(step);
            known = Some(weights);
        }
        Some(Stepped::new(pitched, mesh, depth_m, steps))
    }
}
