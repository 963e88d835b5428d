//! Exact response of a linear system to inputs that are polynomials on a subinterval.

use nalgebra::DMatrix;

use quietcut_numerics::quadrature::Gauss;

/// Terms of the Taylor series of a step. With ‖hA‖ ≤ 1 the first one that is left out is below 1/21! = 2e-20.
const TERMS: usize = 20;

/// States at the nodes and at the end of a subinterval: x = E x₀ + W f, with the states x₀ at its start and the inputs f
/// at its nodes, node by node.
#[derive(Clone, Debug)]
pub(super) struct SubintervalResponse {
    /// (E, W) at every node.
    pub(super) at_nodes: Vec<(DMatrix<f64>, DMatrix<f64>)>,
    /// (E, W) at the end.
    pub(super) at_end: (DMatrix<f64>, DMatrix<f64>),
}

impl SubintervalResponse {
    /// Response of ẋ = A x + B f on a subinterval of `duration_s`, with f the polynomial through its values at the
    /// Gauss nodes. Taylor series of the states, exact but for rounding: dx/dσ = h (A x + B f(σ)), σ from 0 to 1.
    pub(super) fn new(a: &DMatrix<f64>, b: &DMatrix<f64>, gauss: &Gauss, duration_s: f64) -> Self {
        let (size, inputs, nodes) = (a.nrows(), b.ncols(), gauss.nodes.len());
        let rate = a * duration_s;
        let driven = b * duration_s;
        let norm = one_norm(&rate);
        let columns = size + nodes * inputs;
        let mut states = DMatrix::zeros(size, columns);
        states.fill_diagonal(1.0);
        let mut term = DMatrix::zeros(size, columns);
        let mut next = DMatrix::zeros(size, columns);
        let mut at = Vec::with_capacity(nodes + 1);
        let mut from = 0.0;
        for &to in gauss.nodes.iter().chain(&[1.0]) {
            let steps = (norm * (to - from)).ceil().max(1.0);
            let step = (to - from) / steps;
            for index in 0..steps as usize {
                let place = from + step * index as f64;
                let lagrange = expansions(&gauss.nodes, place);
                term.copy_from(&states);
                let mut power = 1.0;
                for order in 0..TERMS.max(nodes + 1) {
                    next.gemm(1.0, &rate, &term, 0.0);
                    for (node, expansion) in lagrange.iter().enumerate() {
                        let Some(coefficient) = expansion.get(order) else {
                            continue;
                        };
                        let mut block = next.columns_mut(size + node * inputs, inputs);
                        block.zip_apply(&driven, |sum, value| *sum += coefficient * value);
                    }
                    next /= (order + 1) as f64;
                    power *= step;
                    states.zip_apply(&next, |sum, value| *sum += power * value);
                    std::mem::swap(&mut term, &mut next);
                }
            }
            at.push((
                states.columns(0, size).into_owned(),
                states.columns(size, nodes * inputs).into_owned(),
            ));
            from = to;
        }
        // The loop runs over the nodes and the end, so that there is a last element.
        let at_end = at
            .pop()
            .unwrap_or_else(|| (DMatrix::identity(size, size), DMatrix::zeros(size, 0)));
        Self { at_nodes: at, at_end }
    }
}

fn one_norm(matrix: &DMatrix<f64>) -> f64 {
    let columns = matrix
        .column_iter()
        .map(|column| column.iter().map(|x| x.abs()).sum());
    columns.fold(0.0, f64::max)
}

/// Coefficients of the Lagrange polynomials of the nodes in powers of the distance from `place`.
fn expansions(nodes: &[f64], place: f64) -> Vec<Vec<f64>> {
    let of = |own: usize| {
        let mut coefficients = vec![1.0];
        for (index, node) in nodes.iter().enumerate().filter(|(index, _)| *index != own) {
            let scale = 1.0 / (nodes[own] - nodes[index]);
            let shift = place - node;
            coefficients.push(0.0);
            for power in (0..coefficients.len()).rev() {
                let lower = if power > 0 { coefficients[power - 1] } else { 0.0 };
                coefficients[power] = scale * (coefficients[power] * shift + lower);
            }
        }
        coefficients
    };
    (0..nodes.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillator_under_a_polynomial_force_has_its_closed_form() {
        // q̈ + 2δ q̇ + ω² q = t: q = (t − 2δ/ω²)/ω² + free vibration.
        let (omega, delta, duration_s) = (30.0, 0.7, 0.6);
        let a = DMatrix::from_row_slice(2, 2, &[0.0, omega, -omega, -2.0 * delta]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, 1.0 / omega]);
        let gauss = Gauss::shared(8);
        let response = SubintervalResponse::new(&a, &b, gauss, duration_s);
        let f = DMatrix::from_iterator(8, 1, gauss.nodes.iter().map(|node| node * duration_s));
        let omega_d = (omega * omega - delta * delta).sqrt();
        let mean = -2.0 * delta / omega.powi(4);
        let exact = |t: f64| {
            // q(0) = 0 and q̇(0) = 0.
            let (c, s) = (-mean, (-1.0 / (omega * omega) - delta * mean) / omega_d);
            t / (omega * omega)
                + mean
                + (-delta * t).exp() * (c * (omega_d * t).cos() + s * (omega_d * t).sin())
        };
        for (node, (_, weights)) in gauss.nodes.iter().zip(&response.at_nodes) {
            let found = (weights * &f)[0];
            assert!((found - exact(node * duration_s)).abs() < 1e-14, "{found}");
        }
        assert!(((&response.at_end.1 * &f)[0] - exact(duration_s)).abs() < 1e-14);
        // Free vibration from q(0) = 1.
        let free = response.at_end.0[(0, 0)];
        let expected = (-delta * duration_s).exp()
            * ((omega_d * duration_s).cos() + delta / omega_d * (omega_d * duration_s).sin());
        assert!((free - expected).abs() < 1e-13, "{free} {expected}");
    }
}
