//! Exact response of a linear system to inputs that are polynomials on a subinterval.

use nalgebra::DMatrix;

use quietcut_numerics::quadrature::Gauss;

/// Terms of the Taylor series of a step. With ‖hA‖ ≤ 1 the first one that is left out is below 1/21! = 2e-20.
const TERMS: usize = 20;
/// Largest number of doublings of a step: 2^60 periods of a mode within it are lost in rounding.
const MOST_DOUBLINGS: f64 = 60.0;

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
    /// Gauss nodes; from node to node, exact but for rounding: dx/dσ = h (A x + B f(σ)), σ from 0 to 1.
    pub(super) fn new(a: &DMatrix<f64>, b: &DMatrix<f64>, gauss: &Gauss, duration_s: f64) -> Self {
        let (size, inputs, nodes) = (a.nrows(), b.ncols(), gauss.nodes.len());
        let rate = a * duration_s;
        let driven = b * duration_s;
        let mut free = DMatrix::identity(size, size);
        let mut forced = DMatrix::zeros(size, nodes * inputs);
        let mut at = Vec::with_capacity(nodes + 1);
        let mut from = 0.0;
        for &to in gauss.nodes.iter().chain(&[1.0]) {
            let step = StepResponse::new(&rate, &driven, to - from, nodes);
            free = &step.free * free;
            forced = &step.free * forced;
            for (node, derivatives) in derivatives(&gauss.nodes, from).iter().enumerate() {
                let mut block = forced.columns_mut(node * inputs, inputs);
                for (derivative, moment) in derivatives.iter().zip(&step.moments) {
                    block.zip_apply(moment, |sum, value| *sum += derivative * value);
                }
            }
            at.push((free.clone(), forced.clone()));
            from = to;
        }
        // The loop runs over the nodes and the end, so that there is a last element.
        let at_end = at
            .pop()
            .unwrap_or_else(|| (DMatrix::identity(size, size), DMatrix::zeros(size, 0)));
        Self { at_nodes: at, at_end }
    }
}

/// Response of dx/dσ = R x + D f(σ) at the end of a step from σ = 0 to its length l.
struct StepResponse {
    /// e^{R l}.
    free: DMatrix<f64>,
    /// M_m = ∫_0^l e^{R (l − σ)} σ^m/m! dσ D, the response to f = σ^m/m!: l^{m+1} φ_{m+1}(R l) D.
    moments: Vec<DMatrix<f64>>,
}

impl StepResponse {
    /// Taylor series over a part of the step with ‖R l‖ ≤ 1, doubled until it is the whole (scaling and squaring): the
    /// cost grows with the logarithm of ‖R l‖, so that a stiff mode does not hold up the others.
    fn new(rate: &DMatrix<f64>, driven: &DMatrix<f64>, length: f64, count: usize) -> Self {
        let size = rate.nrows();
        let doublings = (one_norm(rate) * length).log2().ceil().clamp(0.0, MOST_DOUBLINGS) as i32;
        let part = length * 0.5_f64.powi(doublings);
        let rate = rate * part;
        let mut free = DMatrix::identity(size, size);
        let mut power = DMatrix::identity(size, size);
        let mut moments = vec![DMatrix::zeros(size, driven.ncols()); count];
        let mut of_inputs = driven.clone();
        for order in 0..TERMS {
            // (R l)^k D l^{m+1}/(k + m + 1)!
            let mut factor = (1..=order).fold(1.0, |factor, k| factor / k as f64);
            for (degree, moment) in moments.iter_mut().enumerate() {
                factor *= part / (order + degree + 1) as f64;
                moment.zip_apply(&of_inputs, |sum, value| *sum += factor * value);
            }
            of_inputs = &rate * of_inputs;
            power = &rate * power / (order + 1) as f64;
            free += &power;
        }
        let mut step = Self { free, moments };
        for doubling in 0..doublings {
            step = step.doubled(part * 2.0_f64.powi(doubling));
        }
        step
    }

    /// The response over twice the length: σ^m/m! = Σ_j l^{m−j}/(m−j)! (σ − l)^j/j! in its second half.
    fn doubled(&self, length: f64) -> Self {
        let moments = (0..self.moments.len()).map(|degree| {
            let mut sum = &self.free * &self.moments[degree];
            let mut factor = 1.0;
            for lower in 0..=degree {
                let moment = &self.moments[degree - lower];
                sum.zip_apply(moment, |sum, value| *sum += factor * value);
                factor *= length / (lower + 1) as f64;
            }
            sum
        });
        Self {
            moments: moments.collect(),
            free: &self.free * &self.free,
        }
    }
}

fn one_norm(matrix: &DMatrix<f64>) -> f64 {
    let columns = matrix
        .column_iter()
        .map(|column| column.iter().map(|x| x.abs()).sum());
    columns.fold(0.0, f64::max)
}

/// Derivatives of the Lagrange polynomials of the nodes at `place`, from the zeroth on.
fn derivatives(nodes: &[f64], place: f64) -> Vec<Vec<f64>> {
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
        let mut factorial = 1.0;
        for (power, coefficient) in coefficients.iter_mut().enumerate().skip(1) {
            factorial *= power as f64;
            *coefficient *= factorial;
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

    #[test]
    fn a_stiff_mode_follows_its_input() {
        // Far above its cut-off frequency the input is a static one: q = (f − 2ζ f′/ω + …)/ω², and its own vibration is gone.
        let omega = 1e9;
        let a = DMatrix::from_row_slice(2, 2, &[0.0, omega, -omega, -0.2 * omega]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, omega]);
        let gauss = Gauss::shared(8);
        let response = SubintervalResponse::new(&a, &b, gauss, 0.6);
        let f = DMatrix::from_iterator(8, 1, gauss.nodes.iter().map(|node| node.powi(3)));
        for (node, (free, weights)) in gauss.nodes.iter().zip(&response.at_nodes) {
            let found = (weights * &f)[0];
            assert!((found - node.powi(3)).abs() < 1e-7, "{found}");
            assert!(free.amax() < 1e-12, "{free}");
        }
    }
}
