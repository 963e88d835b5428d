//! Structure fitted to a table of receptances: modes with common poles, by vector fitting.
//!
//! The limits of the fitted structure follow from its equations of motion. The distance of its receptances from those of
//! the table is kept, so that the error of each limit contains it.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Matrix3, Matrix3xX, MatrixXx3};
use num_complex::Complex64;
use quietcut_numerics::singular_values::{Vectors, decompose};

use crate::criteria::{
    FIT_ERROR_MAX, FIT_IMPROVEMENT, FIT_LINES_MAX, FIT_MODES_MAX, FIT_PART, FIT_SETTLED, FIT_WIDTH_MIN,
    UNDAMPED,
};
use quietcut_frf::Interpolation;
use quietcut_frf::rational_fit::{RationalFit, fit, fit_from, residues_of_modes_alone};
use quietcut_model::structure::FirstOrder;

/// Poles that stand for the modes outside of the band of a table, rad/s per rad/s of its last or first frequency: a
/// choice, strongly damped and far enough from the band to be smooth within it.
const ABOVE: Complex64 = Complex64::new(-1.25, 2.165);
const BELOW: Complex64 = Complex64::new(-0.15, 0.26);

/// Structure fitted to a table of receptances.
#[derive(Clone, Debug)]
pub(crate) struct FittedStructure {
    /// Fitted structure in the axes of the table.
    pub(crate) structure: FirstOrder,
    /// Poles with positive imaginary part, rad/s, with their residues, m/(N s).
    pub(crate) modes: Vec<(Complex64, Matrix3<Complex64>)>,
    /// Largest deviation of an entry of the receptance matrix from the table on its lines, as a share of the largest
    /// entry.
    pub(crate) error: f64,
}

impl FittedStructure {
    /// Fits a structure to a table; `None` if no number of modes fits it to [`FIT_ERROR_MAX`].
    ///
    /// Modes are added until the largest deviation falls below [`FIT_SETTLED`], or two further modes do not lower it by
    /// [`FIT_IMPROVEMENT`].
    pub(crate) fn of_table(table: &Interpolation) -> Option<Self> {
        let functions = Functions::new(table)?;
        let mut best: Option<Self> = None;
        let mut without_improvement = 0;
        for count in 1..=FIT_MODES_MAX {
            let next = functions.fitted(count, best.as_ref());
            let error = best.as_ref().map_or(f64::INFINITY, |best| best.error);
            match next.filter(|next| next.error < (1.0 - FIT_IMPROVEMENT) * error) {
                Some(next) => {
                    without_improvement = 0;
                    best = Some(next);
                }
                None => without_improvement += 1,
            }
            let is_settled = best.as_ref().is_some_and(|best| best.error <= FIT_SETTLED);
            if is_settled || best.is_some() && without_improvement == 2 {
                break;
            }
        }
        best.filter(|best| best.error <= FIT_ERROR_MAX)
    }

    /// Number of modes.
    pub(crate) fn count(&self) -> usize {
        self.modes.len()
    }

    /// Receptance matrix H(s), m/N.
    pub(crate) fn transfer(&self, s: Complex64) -> Matrix3<Complex64> {
        self.modes.iter().fold(Matrix3::zeros(), |sum, (pole, residue)| {
            sum + residue * (s - pole).inv() + residue.conjugate() * (s - pole.conj()).inv()
        })
    }
}

/// Receptances of a table, entry by entry.
struct Functions<'a> {
    table: &'a Interpolation,
    /// Absolute value of the largest entry on all lines, m/N.
    largest: f64,
    /// Rows and columns of the entries other than zero, with their values on all lines.
    entries: Vec<((usize, usize), Vec<Complex64>)>,
}

impl<'a> Functions<'a> {
    fn new(table: &'a Interpolation) -> Option<Self> {
        let of = |(row, column): (usize, usize)| -> Vec<Complex64> {
            table.lines().iter().map(|line| line[(row, column)]).collect()
        };
        let entries: Vec<_> = (0..9)
            .map(|index| (index / 3, index % 3))
            .map(|entry| (entry, of(entry)))
            .filter(|(_, values)| values.iter().any(|value| *value != Complex64::ZERO))
            .collect();
        let largest = entries
            .iter()
            .map(|(_, values)| largest(values))
            .fold(0.0, f64::max);
        (largest.is_finite() && largest > 0.0).then_some(Self {
            table,
            largest,
            entries,
        })
    }

    /// Structure of `count` modes within the band of the table, with further ones outside if these halve the deviation;
    /// `None` if there is none.
    ///
    /// Vector fitting converges to other poles from other start values. It begins once from equally spaced poles, and
    /// once from those of a fit of `fewer` modes and the line where this deviates most; the better fit counts.
    fn fitted(&self, count: usize, fewer: Option<&FittedStructure>) -> Option<FittedStructure> {
        let all_hz = self.table.frequency_hz();
        // A vector fit has a term of 1/s², which is infinite at 0 Hz.
        let from = all_hz.partition_point(|hz| *hz <= 0.0);
        let stride = all_hz.len().div_ceil(FIT_LINES_MAX);
        let kept = |values: &[Complex64]| {
            values
                .iter()
                .skip(from)
                .step_by(stride)
                .copied()
                .collect::<Vec<_>>()
        };
        let frequency_hz: Vec<f64> = all_hz.iter().skip(from).step_by(stride).copied().collect();
        // Entries that are far smaller than the largest one, such as the noise of a cross receptance, do not determine
        // the poles.
        let decisive: Vec<Vec<Complex64>> = self
            .entries
            .iter()
            .filter(|(_, values)| largest(values) >= FIT_PART * self.largest)
            .map(|(_, values)| kept(values))
            .collect();
        let decisive: Vec<&[Complex64]> = decisive.iter().map(Vec::as_slice).collect();
        let equally_spaced = fit(&frequency_hz, &decisive, count).ok();
        let from_peaks = fit_from(&frequency_hz, &decisive, self.start(count, fewer)).ok();
        let both = [equally_spaced, from_peaks].into_iter().flatten();
        let best = both.min_by(|a, b| a.residual.total_cmp(&b.residual));
        let RationalFit { poles, .. } = best?;
        let (first, last) = (TAU * all_hz.first()?, TAU * all_hz.last()?);
        let further: [&[Complex64]; 3] = [&[], &[ABOVE * last], &[ABOVE * last, BELOW * first]];
        let mut best: Option<FittedStructure> = None;
        for further in further.into_iter().take(if first > 0.0 { 3 } else { 2 }) {
            let next = self.with_poles(poles.iter().chain(further).copied().collect());
            let error = best.as_ref().map_or(f64::INFINITY, |best| best.error);
            best = next.filter(|next| next.error < 0.5 * error).or(best);
            if best.as_ref().is_some_and(|best| best.error <= FIT_SETTLED) {
                break;
            }
        }
        best
    }

    /// Start values of `count` poles within the band, rad/s: those of `fewer` modes, and poles with a damping ratio of 1 %
    /// at the lines where the table deviates most from it. A line next to a chosen pole is left out.
    fn start(&self, count: usize, fewer: Option<&FittedStructure>) -> Vec<Complex64> {
        let (first_hz, last_hz) = self.table.band_hz();
        let in_band = |pole: &Complex64| (TAU * first_hz..=TAU * last_hz).contains(&pole.im);
        let known = fewer.into_iter().flat_map(|fewer| &fewer.modes);
        let mut poles: Vec<Complex64> = known.map(|(pole, _)| *pole).filter(in_band).take(count).collect();
        let deviation = |hz: f64, line: &Matrix3<Complex64>| {
            let fitted = fewer.map_or_else(Matrix3::zeros, |fewer| {
                fewer.transfer(Complex64::new(0.0, TAU * hz))
            });
            (fitted - line)
                .iter()
                .map(|entry| entry.norm())
                .fold(0.0, f64::max)
        };
        let mut lines: Vec<(f64, f64)> = self
            .table
            .frequency_hz()
            .iter()
            .zip(self.table.lines())
            .filter(|(hz, _)| **hz > 0.0)
            .map(|(hz, line)| (*hz, deviation(*hz, line)))
            .collect();
        lines.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (hz, _) in lines {
            if poles.len() == count {
                break;
            }
            let omega = TAU * hz;
            if poles.iter().all(|pole| (pole.im - omega).abs() > 0.02 * omega) {
                poles.push(Complex64::new(-0.01 * omega, omega));
            }
        }
        poles
    }

    /// Structure with these poles; `None` if one of them is undamped, or narrower than the lines resolve.
    fn with_poles(&self, poles: Vec<Complex64>) -> Option<FittedStructure> {
        let frequency_hz = self.table.frequency_hz();
        let is_resolved = |pole: &Complex64| {
            let spacing_hz = self.line_spacing_hz(pole.im / TAU);
            -pole.re > (UNDAMPED * pole.norm()).max(FIT_WIDTH_MIN * TAU * spacing_hz)
        };
        if !poles.iter().all(is_resolved) {
            return None;
        }
        let values: Vec<&[Complex64]> = self.entries.iter().map(|(_, values)| values.as_slice()).collect();
        let found = residues_of_modes_alone(frequency_hz, &values, poles).ok()?;
        let residue = |mode: usize| {
            let mut residue = Matrix3::zeros();
            for ((entry, _), residues) in self.entries.iter().zip(&found.residues) {
                residue[*entry] = residues[mode];
            }
            residue
        };
        let modes: Vec<_> = found
            .poles
            .iter()
            .enumerate()
            .map(|(mode, pole)| (*pole, residue(mode)))
            .collect();
        let whole = self.of_modes(modes, |_| 0.0)?;
        // Noise gives residues to directions in which a mode does not act: states of their own, whose free decay may be
        // the slowest of the cut. With n lines within the bandwidth |Re λ|/π Hz a residue averages πn/2 of them, so that four
        // of its deviations are 3.2/√n of those of a line, of which the largest on all lines is 1.6 at least.
        let least = |pole: Complex64| {
            let count = -pole.re / (std::f64::consts::PI * self.line_spacing_hz(pole.im / TAU));
            let share = whole.error * (2.0 / count.sqrt()).min(1.0);
            self.largest * share.max(1e-12)
        };
        self.of_modes(whole.modes, least)
    }

    /// Distance of the lines of the table on both sides of a frequency, Hz; 0 outside of the table.
    fn line_spacing_hz(&self, hertz: f64) -> f64 {
        let frequency_hz = self.table.frequency_hz();
        let above = frequency_hz.partition_point(|hz| *hz < hertz);
        let below = above.checked_sub(1).and_then(|index| frequency_hz.get(index));
        match (below, frequency_hz.get(above)) {
            (Some(below), Some(above)) => above - below,
            _ => 0.0,
        }
    }

    /// Structure of modes, without the parts of their residues whose peak |σ/Re λ| is at most `least` of the pole λ,
    /// m/N.
    fn of_modes(
        &self,
        modes: Vec<(Complex64, Matrix3<Complex64>)>,
        least: impl Fn(Complex64) -> f64,
    ) -> Option<FittedStructure> {
        let mut kept = Vec::with_capacity(modes.len());
        let mut shapes = Vec::new();
        for (pole, residue) in modes {
            let whole = DMatrix::from_fn(3, 3, |row, column| residue[(row, column)]);
            let parts = decompose(whole, Vectors::Both).ok()?;
            let (left, right) = (parts.u?, parts.v_t?);
            let mut sum = Matrix3::zeros();
            for (part, &size) in parts.singular_values.iter().enumerate() {
                if size > least(pole) * -pole.re {
                    let shape = left.column(part) * Complex64::from(size.sqrt());
                    let force = right.row(part) * Complex64::from(size.sqrt());
                    sum += Matrix3::from_fn(|row, column| shape[row] * force[column]);
                    shapes.push((pole, shape, force));
                }
            }
            if sum != Matrix3::zeros() {
                kept.push((pole, sum));
            }
        }
        let order = 2 * shapes.len();
        let mut structure = FirstOrder {
            a: DMatrix::zeros(order, order),
            b: MatrixXx3::zeros(order),
            c: Matrix3xX::zeros(order),
        };
        for (index, (pole, shape, force)) in shapes.iter().enumerate() {
            let (re, im) = (2 * index, 2 * index + 1);
            (structure.a[(re, re)], structure.a[(im, im)]) = (pole.re, pole.re);
            (structure.a[(re, im)], structure.a[(im, re)]) = (-pole.im, pole.im);
            for axis in 0..3 {
                (structure.b[(re, axis)], structure.b[(im, axis)]) = (force[axis].re, force[axis].im);
                (structure.c[(axis, re)], structure.c[(axis, im)]) =
                    (2.0 * shape[axis].re, -2.0 * shape[axis].im);
            }
        }
        let mut fitted = FittedStructure {
            structure,
            modes: kept,
            error: 0.0,
        };
        for (hz, line) in self.table.frequency_hz().iter().zip(self.table.lines()) {
            let deviation = fitted.transfer(Complex64::new(0.0, TAU * hz)) - line;
            let deviation = deviation.iter().map(|entry| entry.norm()).fold(0.0, f64::max);
            fitted.error = fitted.error.max(deviation / self.largest);
        }
        (order > 0 && fitted.error.is_finite()).then_some(fitted)
    }
}

/// Absolute value of the largest of some receptances.
fn largest(values: &[Complex64]) -> f64 {
    values.iter().map(|value| value.norm()).fold(0.0, f64::max)
}
