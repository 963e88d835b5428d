//! Gauss–Legendre quadrature on [0, 1], and the integrals that collocation on its nodes needs.

use std::f64::consts::PI;
use std::sync::OnceLock;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::spherical_bessel::spherical_bessel;

/// Gauss–Legendre rule: m nodes c in (0, 1), their weights b, and the integrals S_ij = ∫₀^{c_i} ℓ_j of the Lagrange
/// polynomials ℓ_j of the nodes.
///
/// Quadrature with b is exact for polynomials up to degree 2m − 1, integration with S up to degree m − 1. A collocation
/// step on these nodes has order 2m (Hairer, Nørsett & Wanner, Solving ODEs I, II.7).
///
/// ```
/// let gauss = quietcut_numerics::quadrature::Gauss::shared(3);
/// let values = gauss.nodes.iter().map(|x| x.powi(5));
/// let integral: f64 = gauss.weights.iter().zip(values).map(|(b, value)| b * value).sum();
/// assert!((integral - 1.0 / 6.0).abs() < 1e-15);
/// ```
#[derive(Clone, Debug)]
pub struct Gauss {
    /// Nodes c_i, in ascending order.
    pub nodes: Vec<f64>,
    /// Weights b_i on [0, 1], in the order of the nodes.
    pub weights: Vec<f64>,
    /// Integrals S_ij = ∫₀^{c_i} ℓ_j of the Lagrange polynomials ℓ_j of the nodes c, m × m.
    pub integrals: DMatrix<f64>,
}

/// Number of places for cached Gauss–Legendre rules, by the number of nodes: 1 to 40; place 0 stays empty.
const SHARED: usize = 41;

impl Gauss {
    /// Gauss–Legendre rule with the number of nodes from 1 to 40 that is nearest to `count`; it is computed once and
    /// cached.
    pub fn shared(count: usize) -> &'static Self {
        static RULES: [OnceLock<Gauss>; SHARED] = [const { OnceLock::new() }; SHARED];
        let count = count.clamp(1, SHARED - 1);
        RULES[count].get_or_init(|| Self::new(count))
    }

    /// Computes the Gauss–Legendre rule with `count` nodes, at least 1.
    pub fn new(count: usize) -> Self {
        let (points, weights): (Vec<f64>, Vec<f64>) = (0..count).map(|i| root(count, i)).unzip();
        // On [−1, 1]: ℓ_j(x) = Σ_k (2k + 1)/2 w_j P_k(x_j) P_k(x) for k < m, exact since the rule integrates ℓ_j P_k
        // exactly; ∫_{−1}^x P_k = (P_{k+1} − P_{k−1})/(2k + 1), and x + 1 for k = 0.
        let values: Vec<Vec<f64>> = points.iter().map(|&x| legendre(count + 1, x)).collect();
        let integrals = DMatrix::from_fn(count, count, |i, j| {
            let sum: f64 = (1..count)
                .map(|k| values[j][k] * (values[i][k + 1] - values[i][k - 1]))
                .sum();
            0.25 * weights[j] * (points[i] + 1.0 + sum)
        });
        Self {
            nodes: points.iter().map(|x| 0.5 * (x + 1.0)).collect(),
            weights: weights.iter().map(|w| 0.5 * w).collect(),
            integrals,
        }
    }

    /// Values of the Lagrange polynomials ℓ_j at the coordinate `place` in [0, 1], in the order of their nodes.
    pub fn lagrange(&self, place: f64) -> Vec<f64> {
        let nodes = &self.nodes;
        let weight = |i: usize| -> f64 {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
            others
                .map(|(_, node)| (place - node) / (nodes[i] - node))
                .product()
        };
        (0..nodes.len()).map(weight).collect()
    }
}

impl Gauss {
    /// ∫₀¹ ℓ_j(x) e^{−ikκx} dx of the Lagrange polynomials ℓ_j, for κ ≥ 0 and k = 0, 1, …; `orders` × m.
    ///
    /// With ℓ_j(x) = Σ_n (2n + 1) b_j P_n(2c_j − 1) P_n(2x − 1) and the plane wave in spherical Bessel functions,
    /// ∫₀¹ P_n(2x − 1) e^{−iωx} dx = e^{−iω/2} (−i)ⁿ j_n(ω/2) (Abramowitz & Stegun 10.1.14).
    pub fn fourier(&self, kappa: f64, orders: usize) -> DMatrix<Complex64> {
        let count = self.nodes.len();
        // (2n + 1) b_j P_n(2c_j − 1), node by node.
        let expansion: Vec<f64> = self
            .nodes
            .iter()
            .zip(&self.weights)
            .flat_map(|(node, weight)| {
                let values = legendre(count.max(1), 2.0 * node - 1.0);
                (0..count).map(move |n| (2 * n + 1) as f64 * weight * values[n])
            })
            .collect();
        let mut found = DMatrix::zeros(orders, count);
        let mut bessel = vec![0.0; count];
        for order in 0..orders {
            let half = 0.5 * kappa * order as f64;
            spherical_bessel(half, &mut bessel);
            let turn = Complex64::cis(-half);
            for (node, expansion) in expansion.chunks_exact(count).enumerate() {
                // (−i)ⁿ is 1, −i, −1, i.
                let mut parts = [0.0; 2];
                for (n, (factor, value)) in expansion.iter().zip(&bessel).enumerate() {
                    let signed = if n % 4 < 2 {
                        factor * value
                    } else {
                        -factor * value
                    };
                    parts[n % 2] += signed;
                }
                found[(order, node)] = turn * Complex64::new(parts[0], -parts[1]);
            }
        }
        found
    }
}

/// Legendre polynomials P_0 … P_{count} at x, for `count` ≥ 1.
fn legendre(count: usize, x: f64) -> Vec<f64> {
    let mut values = vec![1.0, x];
    for k in 1..count {
        let k_f = k as f64;
        values.push(((2.0 * k_f + 1.0) * x * values[k] - k_f * values[k - 1]) / (k_f + 1.0));
    }
    values
}

/// The i-th root, i from 0, of the Legendre polynomial P_count in ascending order, and its quadrature weight for an
/// integral over [−1, 1], by Newton's method from the first term of Tricomi's estimate.
fn root(count: usize, i: usize) -> (f64, f64) {
    let n = count as f64;
    let mut x = -(PI * (i as f64 + 0.75) / (n + 0.5)).cos();
    let mut slope = 1.0;
    // Newton's method about doubles the number of correct digits in each step.
    for _ in 0..6 {
        let values = legendre(count, x);
        slope = n * (x * values[count] - values[count - 1]) / (x * x - 1.0);
        x -= values[count] / slope;
    }
    (x, 2.0 / ((1.0 - x * x) * slope * slope))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fourier_integrals_are_those_of_a_finer_rule() {
        let (coarse, fine) = (Gauss::shared(8), Gauss::shared(40));
        for kappa in [0.0, 1e-6, 0.01, 0.7] {
            let found = coarse.fourier(kappa, 100);
            for order in 0..100 {
                for node in 0..8 {
                    let exact: Complex64 = fine
                        .nodes
                        .iter()
                        .zip(&fine.weights)
                        .map(|(x, weight)| {
                            weight * coarse.lagrange(*x)[node] * Complex64::cis(-kappa * order as f64 * x)
                        })
                        .sum();
                    let error = (found[(order, node)] - exact).norm();
                    assert!(error < 1e-14, "{kappa} {order} {node}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn powers_are_integrated_exactly() {
        for count in [1, 2, 3, 6, 12, 20] {
            let gauss = Gauss::new(count);
            for power in 0..2 * count {
                let sum: f64 = gauss
                    .nodes
                    .iter()
                    .zip(&gauss.weights)
                    .map(|(c, w)| w * c.powi(power as i32))
                    .sum();
                // Tolerance: rounding of a sum of `count` terms smaller than one.
                assert!(
                    (sum - 1.0 / (power as f64 + 1.0)).abs() < 1e-14,
                    "{count} {power}"
                );
            }
            for power in 0..count {
                for i in 0..count {
                    let sum: f64 = (0..count)
                        .map(|j| gauss.integrals[(i, j)] * gauss.nodes[j].powi(power as i32))
                        .sum();
                    let exact = gauss.nodes[i].powi(power as i32 + 1) / (power as f64 + 1.0);
                    assert!((sum - exact).abs() < 1e-13, "{count} {power} {i}");
                }
            }
        }
    }
}
