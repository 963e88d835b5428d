//! Receptances of two records compared: forward sweep with backward sweep, or one force level with another.
//!
//! The local polynomial method estimates the receptance of one record line by line. Over 2R + 1 neighbouring lines Y =
//! H·F + T, with H and T parabolas in the frequency; T is the transient that the start and the end of the record cause.
//! The estimate does not depend on the rate or the direction of the sweep, unlike the ratio at the instantaneous
//! frequency: two sweeps of a linear structure give the same H within noise.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::least_squares::{Idle, NormalEquations};
use rustfft::FftPlanner;

use crate::criteria::{LEAST_SWEEP_CHANGE, LEAST_SWEEP_ESTIMATES, SWEEP_MISFIT, SWEPT_POWER_SHARE};

/// Number R of frequency lines on each side of the middle line that a local estimate of the receptance uses.
const R: i64 = 7;
/// Number of complex unknowns of a local estimate: three polynomial coefficients of the receptance H and three of the
/// transient T.
const UNKNOWNS: usize = 6;

/// The spectra of force and motion of one record.
pub struct Spectra {
    force: Vec<Complex64>,
    motion: Vec<Complex64>,
    /// Frequency difference of neighbouring lines, Hz.
    spacing_hz: f64,
}

/// Comparison of the receptances of two records.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Mean over the common band of the squared difference of the two receptances divided by its variance: usually 1 to
    /// 3 for a linear structure.
    pub misfit: f64,
    /// Largest difference of the receptances, relative to the largest receptance of the first record.
    pub largest_change: f64,
    /// True if the receptances of both records agree with one linear structure within noise, or differ by less than 0.5
    /// % of the peak.
    pub same: bool,
}

/// Local polynomial estimate of the receptance of one record at one frequency.
struct Local {
    h: Complex64,
    /// Variance of the noise of one line of the motion's spectrum around this frequency.
    noise: f64,
    /// Variance of the estimated receptance divided by the noise variance of a line.
    gain: f64,
}

impl Spectra {
    /// Spectra of a record of force, N, and displacement, velocity or acceleration, sampled at `rate_hz`.
    pub fn new(force: &[f64], motion: &[f64], rate_hz: f64) -> Self {
        let mut planner = FftPlanner::new();
        let plan = planner.plan_fft_forward(force.len());
        let transform = |samples: &[f64]| {
            let mut line: Vec<Complex64> = samples.iter().map(|x| Complex64::new(*x, 0.0)).collect();
            plan.process(&mut line);
            line.truncate(samples.len() / 2);
            line
        };
        Self {
            force: transform(force),
            motion: transform(motion),
            spacing_hz: rate_hz / force.len() as f64,
        }
    }

    /// Band of the sweep, Hz: from the upper end of the first to the lower end of the last interval of 2R + 1 lines
    /// whose force power exceeds the share [`SWEPT_POWER_SHARE`] of the largest one. `None` without force.
    fn band_hz(&self) -> Option<[f64; 2]> {
        let width = (2 * R + 1) as usize;
        let power: Vec<f64> = self
            .force
            .chunks(width)
            .map(|lines| lines.iter().map(Complex64::norm_sqr).sum())
            .collect();
        let largest = power.iter().copied().fold(0.0, f64::max);
        let strong = |power: &f64| *power > SWEPT_POWER_SHARE * largest;
        let (first, last) = (power.iter().position(strong)?, power.iter().rposition(strong)?);
        let hertz = |chunk: usize| (chunk * width) as f64 * self.spacing_hz;
        Some([hertz(first + 1), hertz(last)])
    }

    fn local(&self, frequency_hz: f64) -> Option<Local> {
        let center = (frequency_hz / self.spacing_hz).round() as i64;
        if center <= R || center + R >= self.force.len() as i64 {
            return None;
        }
        let rows = (2 * R + 1) as usize;
        let lines = |k: i64| (center + k) as usize;
        let size = (-R..=R)
            .map(|k| self.force[lines(k)].norm_sqr())
            .sum::<f64>()
            .sqrt();
        if size <= 0.0 {
            return None;
        }
        let matrix = DMatrix::from_fn(rows, UNKNOWNS, |row, column| {
            let k = row as i64 - R;
            let power = (k as f64 / R as f64).powi((column % 3) as i32);
            if column < 3 {
                self.force[lines(k)] * (power / size)
            } else {
                Complex64::new(power, 0.0)
            }
        });
        let right = DVector::from_fn(rows, |row, _| self.motion[lines(row as i64 - R)]);
        let normal = matrix.adjoint() * &matrix;
        let inverse = NormalEquations::new(&normal, 0.0, Idle::Refuse)?.inverse();
        let solution = &inverse * matrix.adjoint() * &right;
        let left = (&right - &matrix * &solution).norm_squared();
        let off = (frequency_hz / self.spacing_hz - center as f64) / R as f64;
        Some(Local {
            h: (solution[0] + solution[1] * off + solution[2] * (off * off)) / size,
            noise: left / (rows - UNKNOWNS) as f64,
            gain: inverse[(0, 0)].re / (size * size),
        })
    }
}

/// Compares the receptances of two records with the same direction of force and the same motion; `None` if one has no
/// force, or if their common band has too few independent estimates.
pub fn compare(a: &Spectra, b: &Spectra) -> Option<Comparison> {
    let (of_a, of_b) = (a.band_hz()?, b.band_hz()?);
    let (low, high) = (of_a[0].max(of_b[0]), of_a[1].min(of_b[1]));
    let step = (2 * R + 1) as f64 * a.spacing_hz.max(b.spacing_hz);
    let count = ((high - low) / step).floor();
    if count.is_nan() || count < LEAST_SWEEP_ESTIMATES {
        return None;
    }
    let pairs: Vec<(Local, Local)> = (0..=count as usize)
        .filter_map(|k| {
            let frequency = low + step * k as f64;
            Some((a.local(frequency)?, b.local(frequency)?))
        })
        .collect();
    // Noise of the motion sensor is taken as equal at all lines. The residual of a nonlinear structure near resonance
    // is not noise, so the noise is the median of the local residuals over the estimates.
    let median = |of: &dyn Fn(&(Local, Local)) -> f64| {
        let mut values: Vec<f64> = pairs.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let noise = [median(&|pair| pair.0.noise), median(&|pair| pair.1.noise)];
    let (mut sum, mut change, mut largest) = (0.0, 0.0_f64, 0.0_f64);
    for (a, b) in &pairs {
        let difference = (a.h - b.h).norm();
        sum += difference * difference / (noise[0] * a.gain + noise[1] * b.gain).max(f64::MIN_POSITIVE);
        change = change.max(difference);
        largest = largest.max(a.h.norm());
    }
    let misfit = sum / pairs.len() as f64;
    let largest_change = change / largest;
    Some(Comparison {
        misfit,
        largest_change,
        same: misfit < SWEEP_MISFIT || largest_change < LEAST_SWEEP_CHANGE,
    })
}
