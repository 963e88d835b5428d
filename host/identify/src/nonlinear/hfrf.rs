//! Higher-order FRF of a structure with cubic terms by thesis eqs 5.15 to 5.17: exact as the force F → 0 and biased at
//! finite force.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::least_squares::LinearProblem;

use crate::criteria::LEAST_LEVELS;
use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::Dwell;
use crate::nonlinear::law::{Law, NonlinearTerm, Role};

/// Higher-order FRFs H₁, H₃(ω, ω, −ω) and H₅(ω, ω, ω, −ω, −ω) of a structure at one frequency ω, in m/N, m/N³, m/N⁵.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HigherOrder {
    /// Angular frequency, rad/s.
    pub omega: f64,
    /// The values H₁, H₃, H₅ in m/N, m/N³, m/N⁵.
    pub h: [Complex64; 3],
}

/// Displacements of a structure at one frequency under one or several force amplitudes.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Angular frequency, rad/s.
    pub omega: f64,
    /// For each force level the pair (F_n, Q_n): force amplitude, N, and displacement phasor with the phase relative to
    /// the force, m.
    pub levels: Vec<(f64, Complex64)>,
}

/// Parameters of a single-degree-of-freedom equation of motion by thesis eqs 5.16 and 5.17, with the standard
/// deviations of the linear regressions.
#[derive(Clone, Debug, PartialEq)]
pub struct HfrfFit {
    /// The equation of motion with the parameters m, c, k, k3, c3.
    pub law: Law,
    /// Values θ of the parameters.
    pub theta: DVector<f64>,
    /// Standard deviations of the parameters from the scatter over frequency. They do not include the bias of the
    /// method.
    pub deviations: DVector<f64>,
    /// The higher-order FRFs, one for each frequency at which [`higher_order`] gives them.
    pub estimates: Vec<HigherOrder>,
}

/// Reason why the method of higher-order FRF gives no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HfrfError {
    /// Higher-order FRFs are determined at fewer than two frequencies.
    #[error(
        "{frequencies} frequencies were measured at three or more force levels; higher-order FRF need at least 2 of them"
    )]
    Levels {
        /// Number of frequencies at which higher-order FRFs are determined.
        frequencies: usize,
    },
    /// The regression for m, c and k or that for k3 and c3 is singular.
    #[error("the responses do not determine the parameters")]
    Undetermined,
}

/// Groups dwells by excitation frequency: dwells up to the factor 1 + `tolerance` above the lowest frequency of a group
/// belong to it. Dwells without motion in the direction of the largest force are left out.
pub fn responses(dwells: &[Dwell], tolerance: f64) -> Vec<Response> {
    let mut points: Vec<(f64, f64, Complex64)> = dwells
        .iter()
        .filter_map(|dwell| {
            let force = dwell.force()?;
            let motion = dwell
                .motions
                .iter()
                .find(|line| line.direction == force.direction)?;
            let iomega = Complex64::new(0.0, dwell.omega);
            let q = motion.phasor(1) / iomega.powi(i32::from(derivative(motion.quantity)));
            let f = force.phasor(1);
            Some((dwell.omega, f.norm(), q * f.conj() / f.norm()))
        })
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<Response> = Vec::new();
    for (omega, force, q) in points {
        match groups.last_mut() {
            Some(group) if omega <= group.omega * (1.0 + tolerance) => group.levels.push((force, q)),
            _ => groups.push(Response {
                omega,
                levels: vec![(force, q)],
            }),
        }
    }
    groups
}

/// Higher-order FRF at one frequency: thesis eq. 5.15 by least squares; `None` with fewer than three force levels, or
/// if they do not determine H₁, H₃ and H₅.
pub fn higher_order(response: &Response) -> Option<HigherOrder> {
    if response.levels.len() < LEAST_LEVELS {
        return None;
    }
    let count = response.levels.len();
    let powers = DMatrix::from_fn(count, 3, |n, order| {
        let force = response.levels[n].0;
        [force, 0.75 * force.powi(3), 0.625 * force.powi(5)][order]
    });
    let part = |of: fn(&Complex64) -> f64| {
        let right = DVector::from_iterator(count, response.levels.iter().map(|(_, q)| of(q)));
        Some(LinearProblem::new(&powers, &right).solve().ok()?.parameters)
    };
    let (re, im) = (part(|q| q.re)?, part(|q| q.im)?);
    Some(HigherOrder {
        omega: response.omega,
        h: std::array::from_fn(|order| Complex64::new(re[order], im[order])),
    })
}

/// Fits m, c and k to 1/H₁ and k3 and c3 to H₃/(H₁³H₁*), each by linear least squares over all frequencies (thesis eqs
/// 5.16 and 5.17).
///
/// # Errors
/// Higher-order FRFs are determined at fewer than two frequencies, or a regression is singular.
pub fn fit(responses: &[Response]) -> Result<HfrfFit, HfrfError> {
    let estimates: Vec<HigherOrder> = responses.iter().filter_map(higher_order).collect();
    if estimates.len() < 2 {
        return Err(HfrfError::Levels {
            frequencies: estimates.len(),
        });
    }
    let rows = 2 * estimates.len();
    let (mut linear, mut cubic) = (DMatrix::zeros(rows, 3), DMatrix::zeros(rows, 2));
    let (mut linear_right, mut cubic_right) = (DVector::zeros(rows), DVector::zeros(rows));
    for (index, HigherOrder { omega, h }) in estimates.iter().enumerate() {
        let (re, im) = (2 * index, 2 * index + 1);
        // Columns of the regression of 1/H₁, in this order: m, k, c.
        (linear[(re, 0)], linear[(re, 1)], linear[(im, 2)]) = (-omega * omega, 1.0, *omega);
        let inverse = h[0].inv();
        (linear_right[re], linear_right[im]) = (inverse.re, inverse.im);
        // Columns of the regression of H₃/(H₁³H₁*), in this order: c3, k3.
        (cubic[(re, 1)], cubic[(im, 0)]) = (-1.0, -omega.powi(3));
        let ratio = h[1] / (h[0].powi(3) * h[0].conj());
        (cubic_right[re], cubic_right[im]) = (ratio.re, ratio.im);
    }
    let (of_linear, linear_std) = regression(&linear, &linear_right)?;
    let (of_cubic, cubic_std) = regression(&cubic, &cubic_right)?;
    let law = Law::new(1, &[NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping]);
    let mut theta = DVector::zeros(law.parameters.len());
    let mut deviations = DVector::zeros(law.parameters.len());
    let found = [
        (Role::Mass(0, 0), of_linear[0], linear_std[0]),
        (Role::Stiffness(0, 0), of_linear[1], linear_std[1]),
        (Role::Damping(0, 0), of_linear[2], linear_std[2]),
        (Role::CubicDamping(0), of_cubic[0], cubic_std[0]),
        (Role::CubicStiffness(0), of_cubic[1], cubic_std[1]),
    ];
    for (role, value, deviation) in found {
        if let Some(index) = law.index(role) {
            (theta[index], deviations[index]) = (value, deviation);
        }
    }
    Ok(HfrfFit {
        law,
        theta,
        deviations,
        estimates,
    })
}

/// Solution of a linear least-squares problem, with standard deviations from its residual.
fn regression(
    matrix: &DMatrix<f64>,
    right: &DVector<f64>,
) -> Result<(DVector<f64>, DVector<f64>), HfrfError> {
    let fit = LinearProblem::new(matrix, right)
        .solve()
        .map_err(|_| HfrfError::Undetermined)?;
    let variance = fit.sum_of_squares / fit.degrees_of_freedom.max(1) as f64;
    let deviations = fit.covariance.diagonal().map(|entry| (entry * variance).sqrt());
    Ok((fit.parameters, deviations))
}
