//! One step of the Dormand–Prince 5(4) method, with its fourth-order interpolant.
//!
//! Coefficients and interpolant: Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I*, II.5 and II.6
//! (code DOPRI5). The local error is O(h⁶) for a step and O(h⁵) for the interpolant. A delay equation whose delayed
//! values are taken from the interpolant keeps the global order 5 if steps end where the solution is not smooth.

/// Polynomial of degree 4 in the fraction u = (t − t₀)/h of a time step, u in [0, 1]: the coefficients of 1, u, … u⁴.
pub type Quartic = [f64; 5];

/// Times c_i of the stages of a Dormand–Prince step, as fractions of the step.
const NODES: [f64; 7] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];

/// Coefficients a_ij of the stages of a Dormand–Prince step: row i gives the argument of stage i + 1 from stages 0 to
/// i. The last row also gives the fifth-order solution.
const STAGES: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
        0.0,
        0.0,
    ],
    [
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
        0.0,
    ],
    [
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];

/// Coefficients of the stages in the error estimate of a Dormand–Prince step: the difference between the fifth- and the
/// fourth-order solution.
const ERROR: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// Coefficients of the stages in the term r5 of the interpolant of a Dormand–Prince step (code DOPRI5).
const INTERPOLANT: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// Stages and result of one step of the Dormand–Prince method. An integration uses the same value for all steps.
#[derive(Clone, Debug)]
pub struct DormandPrince {
    stages: [Vec<f64>; 7],
    at_stage: Vec<f64>,
    end: Vec<f64>,
}

impl DormandPrince {
    /// Allocates the stages for a state vector y with `dimension` entries.
    pub fn new(dimension: usize) -> Self {
        Self {
            stages: std::array::from_fn(|_| vec![0.0; dimension]),
            at_stage: vec![0.0; dimension],
            end: vec![0.0; dimension],
        }
    }

    /// Computes the derivative ẏ at the start of the next step; required before the first step and after every jump of
    /// y or ẏ.
    pub fn start(&mut self, t: f64, y: &[f64], mut rate: impl FnMut(f64, &[f64], &mut [f64])) {
        rate(t, y, &mut self.stages[0]);
    }

    /// Reuses the derivative ẏ at the end of the accepted step as ẏ at the start of the next step.
    pub fn follow(&mut self) {
        self.stages.swap(0, 6);
    }

    /// Computes a trial step of the differential equation ẏ = rate(t, y) from y at t to t + h; ẏ at t is that of
    /// [`Self::start`] or [`Self::follow`].
    pub fn attempt(&mut self, t: f64, h: f64, y: &[f64], mut rate: impl FnMut(f64, &[f64], &mut [f64])) {
        for (index, weights) in STAGES.iter().enumerate() {
            let stage = index + 1;
            self.at_stage.copy_from_slice(y);
            for (weight, k) in weights
                .iter()
                .zip(&self.stages)
                .filter(|(weight, _)| **weight != 0.0)
            {
                for (x, k) in self.at_stage.iter_mut().zip(k) {
                    *x += h * weight * k;
                }
            }
            rate(t + NODES[stage] * h, &self.at_stage, &mut self.stages[stage]);
        }
        // The last stage is evaluated at the fifth-order solution, which is the result (first same as last).
        self.end.copy_from_slice(&self.at_stage);
    }

    /// State y at the end of the last trial step.
    pub fn end(&self) -> &[f64] {
        &self.end
    }

    /// Root mean square of the estimated errors of the elements of y in the last trial step of length `h`, each divided
    /// by the `tolerance` of its element. Up to 1 the step is within tolerance.
    pub fn error(&self, h: f64, tolerance: impl Fn(usize) -> f64) -> f64 {
        let sum: f64 = (0..self.end.len())
            .map(|element| {
                let error: f64 = ERROR.iter().zip(&self.stages).map(|(e, k)| e * k[element]).sum();
                (h * error / tolerance(element)).powi(2)
            })
            .sum();
        (sum / self.end.len() as f64).sqrt()
    }

    /// Writes the interpolant of the last trial step, which has the length `h` and begins at the state `y`: one
    /// polynomial of degree 4 for each element of y.
    pub fn interpolant(&self, h: f64, y: &[f64], quartics: &mut [Quartic]) {
        for (element, quartic) in quartics.iter_mut().enumerate() {
            let rise = self.end[element] - y[element];
            let r3 = h * self.stages[0][element] - rise;
            let r4 = rise - h * self.stages[6][element] - r3;
            let r5: f64 = INTERPOLANT
                .iter()
                .zip(&self.stages)
                .map(|(d, k)| h * d * k[element])
                .sum();
            // Interpolant y + u(rise + (1 − u)(r3 + u(r4 + (1 − u) r5))), expanded in powers of u.
            *quartic = [y[element], rise + r3, r4 + r5 - r3, -r4 - 2.0 * r5, r5];
        }
    }
}

/// Value of the interpolant's polynomial of degree 4 at the fraction u of the time step.
pub fn at(quartic: &Quartic, u: f64) -> f64 {
    quartic
        .iter()
        .rev()
        .fold(0.0, |sum, coefficient| sum * u + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Harmonic oscillator ẏ = [y₁, −y₀]: rotation of the plane.
    fn turn(_: f64, y: &[f64], rate: &mut [f64]) {
        rate.copy_from_slice(&[y[1], -y[0]]);
    }

    fn one_step(h: f64) -> (f64, f64, f64) {
        let mut step = DormandPrince::new(2);
        let y = [0.0, 1.0];
        step.start(0.0, &y, turn);
        step.attempt(0.0, h, &y, turn);
        let mut quartics = [[0.0; 5]; 2];
        step.interpolant(h, &y, &mut quartics);
        let between = (0..=20)
            .map(|i| (at(&quartics[0], f64::from(i) / 20.0) - (h * f64::from(i) / 20.0).sin()).abs())
            .fold(0.0, f64::max);
        ((step.end()[0] - h.sin()).abs(), between, step.error(h, |_| 1.0))
    }

    #[test]
    fn local_errors_have_the_orders_of_the_method() {
        let (coarse, fine) = (one_step(0.2), one_step(0.1));
        // Halving h divides the error by 2⁶ for the step and 2⁵ for the interpolant; 0.25 in the exponent allows for
        // higher orders.
        assert!((coarse.0 / fine.0).log2() > 6.0 - 0.25, "{coarse:?} {fine:?}");
        assert!((coarse.1 / fine.1).log2() > 5.0 - 0.25, "{coarse:?} {fine:?}");
        assert!((coarse.2 / fine.2).log2() > 5.0 - 0.25, "{coarse:?} {fine:?}");
        assert!(coarse.2 > coarse.0, "the estimate is above the error: {coarse:?}");
    }
}
