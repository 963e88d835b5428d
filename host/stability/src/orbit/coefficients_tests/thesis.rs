//! The smoothed autonomous system of the thesis (eqs 6.13 to 6.19), dimensionless, integrated in time by the Runge–Kutta
//! method of fourth order with a fixed step. Written from the thesis, without the code under test.

use nalgebra::{Matrix2, Vector2};
use quietcut_model::case::Case;
use quietcut_model::structure::Form;

/// √(k_yy/m_yy), rad/s.
const NATURAL_RAD_PER_S: f64 = 109.641_6;

/// Unit of lengths, m: the feed per tooth of chapter 6.
const LENGTH_M: f64 = 0.15e-3;

/// Tooth periods over which the depth grows, and those at which the growth of a disturbance is measured first and last.
const PERIODS: [usize; 3] = [300, 500, 900];

/// Tooth periods over which a size is averaged. A choice: many rotations of the critical mode.
const WINDOW: usize = 60;

/// The system at a tooth period τ. States: X, Ẋ, Y.
pub(super) struct Thesis {
    beta: Matrix2<f64>,
    c: Matrix2<f64>,
    k: Matrix2<f64>,
    c3: Matrix2<f64>,
    k3: Matrix2<f64>,
    kr: f64,
    tau: f64,
    /// ε₁ of eq. 6.19.
    entry: f64,
}

type State = [f64; 6];

/// Steps of the integration over a tooth period. A choice: the error of the limit is below 1e-6 of it.
const STEPS: usize = 160;

impl Thesis {
    pub(super) fn new(case: &Case, tau: f64, entry: f64) -> Self {
        let Form::Matrices(own) = &case.structure.as_ref().unwrap().form else {
            panic!("matrices are needed");
        };
        let of = |matrix: &nalgebra::DMatrix<f64>| Matrix2::from_fn(|i, j| matrix[(i, j)]);
        let inverse = of(&own.mass).try_inverse().unwrap();
        let n = NATURAL_RAD_PER_S;
        let cubic = |matrix: &Option<nalgebra::DMatrix<f64>>| inverse * of(matrix.as_ref().unwrap());
        let material = case.material.as_ref().unwrap();
        Self {
            beta: inverse * own.mass[(1, 1)],
            c: inverse * of(&own.damping) / n,
            k: inverse * of(&own.stiffness) / (n * n),
            c3: cubic(&own.cubic_damping) * n * LENGTH_M.powi(2),
            k3: cubic(&own.cubic_stiffness) * LENGTH_M.powi(2) / (n * n),
            kr: material.krc_mpa / material.ktc_mpa,
            tau,
            entry,
        }
    }

    /// Time derivative, for the delayed displacement.
    fn rate(&self, s: &State, delayed: Vector2<f64>, w: f64) -> State {
        let (x, v, y) = ([s[0], s[1]], [s[2], s[3]], [s[4], s[5]]);
        let (x, v) = (Vector2::from(x), Vector2::from(v));
        let [y1, y2] = y;
        // Eq. 6.17, and 6.19 for half immersion.
        let alpha = Matrix2::new(
            -y2 * (y1 + self.kr * y2),
            -y1 * (y1 + self.kr * y2),
            y2 * (y2 - self.kr * y1),
            y1 * (y2 - self.kr * y1),
        );
        let g = 0.5 * (1.0 + (-y1 * y2 / self.entry).tanh());
        let wave = Vector2::new(1.0, 0.0) + x - delayed;
        let force = self.beta * alpha * wave * (w * g);
        let cubes = |a: Vector2<f64>| a.map(|entry| entry.powi(3));
        let a = force - self.c * v - self.k * x - self.c3 * cubes(v) - self.k3 * cubes(x);
        // Eq. 6.13 with ε = 1.
        let omega = std::f64::consts::PI / self.tau;
        let size = y1 * y1 + y2 * y2;
        [
            v[0],
            v[1],
            a[0],
            a[1],
            y1 - omega * y2 - y1 * size,
            omega * y1 + y2 - y2 * size,
        ]
    }

    /// Growth rate per tooth period of the difference between successive periods, at a depth.
    fn growth(&self, w: f64) -> f64 {
        let h = self.tau / STEPS as f64;
        // Displacement and velocity over the last period.
        let mut history = vec![[0.0; 4]; STEPS + 1];
        let mut state: State = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let mut strobe: Vec<[f64; 4]> = Vec::new();
        for period in 0..PERIODS[2] + WINDOW {
            let mut next = Vec::with_capacity(STEPS + 1);
            strobe.push([state[0], state[1], state[2], state[3]]);
            for step in 0..STEPS {
                let at = period as f64 + step as f64 / STEPS as f64;
                let grown = (at / PERIODS[0] as f64).min(1.0);
                let w = w * grown * grown * (3.0 - 2.0 * grown);
                let delayed = |share: f64| {
                    let (a, b) = (history[step], history[step + 1]);
                    Vector2::from_fn(|i, _| hermite(share, [a[i], a[i + 2] * h], [b[i], b[i + 2] * h]))
                };
                next.push([state[0], state[1], state[2], state[3]]);
                let moved = |by: &State, share: f64| -> State {
                    std::array::from_fn(|i| state[i] + share * h * by[i])
                };
                let k1 = self.rate(&state, delayed(0.0), w);
                let k2 = self.rate(&moved(&k1, 0.5), delayed(0.5), w);
                let k3 = self.rate(&moved(&k2, 0.5), delayed(0.5), w);
                let k4 = self.rate(&moved(&k3, 1.0), delayed(1.0), w);
                state =
                    std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            }
            next.push([state[0], state[1], state[2], state[3]]);
            history = next;
        }
        let size = |from: usize| {
            let moves = strobe[from..from + WINDOW].windows(2);
            let square: f64 = moves
                .flat_map(|pair| (0..4).map(move |i| (pair[1][i] - pair[0][i]).powi(2)))
                .sum();
            square.sqrt()
        };
        (size(PERIODS[2]) / size(PERIODS[1])).ln() / (PERIODS[2] - PERIODS[1]) as f64
    }

    /// Depth at which the growth rate is 0, by the secant through two depths near a guess, and once more.
    pub(super) fn limit(&self, guess: f64) -> f64 {
        let (mut a, mut b) = (0.99 * guess, 1.005 * guess);
        let (mut at_a, mut at_b) = (self.growth(a), self.growth(b));
        for _ in 0..3 {
            let next = b - at_b * (b - a) / (at_b - at_a);
            (a, at_a) = (b, at_b);
            (b, at_b) = (next, self.growth(next));
        }
        b
    }
}

/// Cubic between two points with values and slopes.
fn hermite(x: f64, a: [f64; 2], b: [f64; 2]) -> f64 {
    let own = x * x * (3.0 - 2.0 * x);
    a[0] * (1.0 - own) + b[0] * own + a[1] * x * (x - 1.0).powi(2) + b[1] * x * x * (x - 1.0)
}
