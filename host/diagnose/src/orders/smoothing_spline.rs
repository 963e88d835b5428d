//! Cubic smoothing spline whose smoothing follows from the data by restricted maximum likelihood.
//!
//! The values y_k at the knots x_k are those of a function g with errors of unknown variance σ². As a prior, g is a
//! straight line plus an integrated Wiener process, g″ = white noise of intensity ρ σ²; the posterior mean of g is the
//! natural cubic smoothing spline with the smoothing parameter 1/ρ (Wahba, *Spline Models for Observational Data*,
//! 1990, 1.5). With the divided second differences w = Qᵀy, which contain no straight line, and Reinsch's matrix R,
//!
//! w ~ N(0, σ² B), B = QᵀQ + ρ R, g = y − Q B⁻¹ w, g″ = ρ B⁻¹ w,
//!
//! and ρ minimizes (N − 2) ln(wᵀB⁻¹w) + ln det B. B has two subdiagonals, so that the cost is proportional to the number
//! of knots.

use quietcut_numerics::roots::minimum;

/// Largest ρ of the search, for knots one unit apart. QᵀQ is at most 16, R at least 1/3: above ρ = 1000 the spline
/// interpolates within 16/333 = 5 % of the error of a value.
const LARGEST_RATIO: f64 = 1e3;

/// Least ρ of the search. R/(QᵀQ) is at most 1e11, so that Cholesky's decomposition of B keeps five digits of sixteen.
const LEAST_RATIO: f64 = 1e-11;

/// Ratio of ρ between two points of the grid from which its search starts. The likelihood of ln ρ has no structure
/// narrower than the smoothing length, which changes with ρ^(1/4): by a factor of 1.5 at this ratio.
const GRID_RATIO: f64 = 5.0;

/// A function fitted to values with errors.
#[derive(Clone, Debug)]
pub(crate) struct SmoothingSpline {
    knots: Vec<f64>,
    values: Vec<f64>,
    /// Second derivatives at the knots; zero at both ends.
    curvatures: Vec<f64>,
    /// Standard deviation σ of the error of a value.
    pub deviation: f64,
    /// Effective number of parameters: from 2 (straight line) to the number of knots (interpolation).
    pub parameters: f64,
    /// Standard deviations of the errors of the function at the first and the last knot.
    pub end_deviations: [f64; 2],
}

impl SmoothingSpline {
    /// Fits `values` at `knots`, which ascend with a mean distance of about one unit; at least four of them.
    pub(crate) fn new(knots: Vec<f64>, values: &[f64]) -> Self {
        let count = knots.len();
        let equations = Equations::new(&knots, values);
        let criterion = |log_ratio: f64| {
            let factor = equations.factor(log_ratio.exp());
            let solution = factor.solve(&equations.differences);
            let squares = dot(&solution, &equations.differences).max(f64::MIN_POSITIVE);
            (count - 2) as f64 * squares.ln() + factor.log_determinant()
        };
        // A spline that bends over N knots at least has ρ ~ (π/N)⁴; a hundredth of it is a straight line.
        let straight = 1e-2 * (std::f64::consts::PI / count as f64).powi(4);
        let (low, high) = (straight.max(LEAST_RATIO).ln(), LARGEST_RATIO.ln());
        let steps = ((high - low) / GRID_RATIO.ln()).ceil();
        let at = |index: f64| low + (high - low) * index / steps;
        let best = (0..=steps as usize)
            .map(|index| (criterion(at(index as f64)), index as f64))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(0.0, |(_, index)| index);
        let around = [at((best - 1.0).max(0.0)), at((best + 1.0).min(steps))];
        // A hundredth of ln ρ changes the smoothing length by 0.25 %.
        let ratio = minimum(around, 1e-2, criterion).exp();
        equations.fitted(knots, values, ratio)
    }

    /// The straight line with the values 0, 1, 2 … at the `count` knots 0, 1, 2 …
    pub(crate) fn line(count: usize) -> Self {
        let values: Vec<f64> = (0..count).map(|knot| knot as f64).collect();
        Self {
            knots: values.clone(),
            values,
            curvatures: vec![0.0; count],
            deviation: 0.0,
            parameters: 0.0,
            end_deviations: [0.0; 2],
        }
    }

    /// Values of the function at ascending places within the knots.
    pub(crate) fn at(&self, places: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut interval = 0;
        places
            .map(|place| {
                while interval + 2 < self.knots.len() && self.knots[interval + 1] <= place {
                    interval += 1;
                }
                self.in_interval(interval, place)
            })
            .collect()
    }

    fn in_interval(&self, interval: usize, place: f64) -> f64 {
        let width = self.knots[interval + 1] - self.knots[interval];
        let u = (place - self.knots[interval]) / width;
        let v = 1.0 - u;
        let bend =
            (u * u * u - u) * self.curvatures[interval + 1] + (v * v * v - v) * self.curvatures[interval];
        v * self.values[interval] + u * self.values[interval + 1] + width * width / 6.0 * bend
    }

    /// Values of the function at its knots.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Divided second differences of the values and the bands of QᵀQ and R.
struct Equations {
    /// Distances of the knots.
    widths: Vec<f64>,
    differences: Vec<f64>,
    /// Diagonal and the two subdiagonals of QᵀQ.
    squares: [Vec<f64>; 3],
    /// Diagonal and subdiagonal of R.
    spline: [Vec<f64>; 2],
}

impl Equations {
    fn new(knots: &[f64], values: &[f64]) -> Self {
        let widths: Vec<f64> = knots.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let rows = knots.len() - 2;
        let row = |j: usize| {
            let [first, last] = [1.0 / widths[j], 1.0 / widths[j + 1]];
            [first, -first - last, last]
        };
        let product = |apart: usize, j: usize| {
            let (upper, lower) = (row(j), row(j + apart));
            (apart..3)
                .map(|column| upper[column] * lower[column - apart])
                .sum()
        };
        let squares = std::array::from_fn(|apart| {
            (0..rows.saturating_sub(apart))
                .map(|j| product(apart, j))
                .collect()
        });
        let differences = (0..rows)
            .map(|j| {
                (values[j + 2] - values[j + 1]) / widths[j + 1] - (values[j + 1] - values[j]) / widths[j]
            })
            .collect();
        let diagonal = (0..rows).map(|j| (widths[j] + widths[j + 1]) / 3.0).collect();
        let beside = (0..rows - 1).map(|j| widths[j + 1] / 6.0).collect();
        Self {
            widths,
            differences,
            squares,
            spline: [diagonal, beside],
        }
    }

    fn factor(&self, ratio: f64) -> Factor {
        let add = |apart: usize| {
            self.squares[apart]
                .iter()
                .zip(&self.spline[apart])
                .map(|(square, spline)| square + ratio * spline)
                .collect::<Vec<f64>>()
        };
        Factor::new(add(0), add(1), self.squares[2].clone())
    }

    fn fitted(&self, knots: Vec<f64>, values: &[f64], ratio: f64) -> SmoothingSpline {
        let factor = self.factor(ratio);
        let solution = factor.solve(&self.differences);
        let rows = solution.len();
        let mut smooth = values.to_vec();
        for (j, value) in solution.iter().enumerate() {
            let [first, last] = [1.0 / self.widths[j], 1.0 / self.widths[j + 1]];
            smooth[j] -= value * first;
            smooth[j + 1] += value * (first + last);
            smooth[j + 2] -= value * last;
        }
        let mut curvatures = vec![0.0; knots.len()];
        for (curvature, value) in curvatures[1..].iter_mut().zip(&solution) {
            *curvature = ratio * value;
        }
        let inverse = factor.bands_of_inverse();
        let trace: f64 = (0..3)
            .map(|apart| (if apart == 0 { 1.0 } else { 2.0 }) * dot(&inverse[apart], &self.squares[apart]))
            .sum();
        let variance = dot(&solution, &self.differences) / rows as f64;
        let end =
            |row: usize, width: f64| (variance * (1.0 - inverse[0][row] / (width * width)).max(0.0)).sqrt();
        SmoothingSpline {
            values: smooth,
            curvatures,
            deviation: variance.max(0.0).sqrt(),
            parameters: knots.len() as f64 - trace,
            end_deviations: [end(0, self.widths[0]), end(rows - 1, self.widths[rows])],
            knots,
        }
    }
}

/// Decomposition L D Lᵀ of a positive definite matrix with two subdiagonals.
struct Factor {
    pivots: Vec<f64>,
    /// Subdiagonals of L.
    below: [Vec<f64>; 2],
}

impl Factor {
    fn new(diagonal: Vec<f64>, first: Vec<f64>, second: Vec<f64>) -> Self {
        let size = diagonal.len();
        let (mut pivots, mut below) = (diagonal, [first, second]);
        for i in 0..size {
            let pivot = pivots[i];
            let one = below[0].get(i).map_or(0.0, |entry| entry / pivot);
            let two = below[1].get(i).map_or(0.0, |entry| entry / pivot);
            if i + 1 < size {
                pivots[i + 1] -= one * one * pivot;
                below[0][i] = one;
            }
            if i + 2 < size {
                below[0][i + 1] -= one * two * pivot;
                pivots[i + 2] -= two * two * pivot;
                below[1][i] = two;
            }
        }
        Self { pivots, below }
    }

    fn log_determinant(&self) -> f64 {
        self.pivots.iter().map(|pivot| pivot.ln()).sum()
    }

    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut x = right.to_vec();
        let size = x.len();
        for i in 0..size {
            for (apart, below) in self.below.iter().enumerate() {
                if i + apart + 1 < size {
                    x[i + apart + 1] -= below[i] * x[i];
                }
            }
        }
        for (value, pivot) in x.iter_mut().zip(&self.pivots) {
            *value /= pivot;
        }
        for i in (0..size).rev() {
            for (apart, below) in self.below.iter().enumerate() {
                if i + apart + 1 < size {
                    x[i] -= below[i] * x[i + apart + 1];
                }
            }
        }
        x
    }

    /// Diagonal and the two subdiagonals of the inverse (Hutchinson and de Hoog, Numer. Math. 47 (1985) 99).
    fn bands_of_inverse(&self) -> [Vec<f64>; 3] {
        let size = self.pivots.len();
        let mut bands = [vec![0.0; size], vec![0.0; size], vec![0.0; size]];
        for i in (0..size).rev() {
            let one = self.below[0].get(i).copied().unwrap_or(0.0);
            let two = self.below[1].get(i).copied().unwrap_or(0.0);
            let next = |band: usize, row: usize| bands[band].get(row).copied().unwrap_or(0.0);
            let first = -one * next(0, i + 1) - two * next(1, i + 1);
            let second = -one * next(1, i + 1) - two * next(0, i + 2);
            bands[0][i] = 1.0 / self.pivots[i] - one * first - two * second;
            bands[1][i] = first;
            bands[2][i] = second;
        }
        bands
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
