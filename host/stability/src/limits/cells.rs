//! Cells at one speed: the dominant Floquet multiplier (characteristic multiplier) at many depths from samples at few.
//!
//! All multipliers that may be dominant are first computed at a few depths. Between two of these depths each multiplier
//! that may be dominant is interpolated by a cubic in depth through both ends with their derivatives. One or two Newton
//! steps on the characteristic matrix at the middle cell give the error of the cubic there. If the error is too large,
//! or if a multiplier cannot be followed, the depth interval is halved, down to single cells.

use num_complex::Complex64;

use super::bounds::{check_depth, check_speed};
use super::cell::Cell;
use crate::criteria::{
    CELL_FAR, CELL_FOLLOWED, CELL_TOLERANCE, CELL_TOLERANCE_FAR, FIRST_MESH_SHARE, LEAST_ERROR, UNCONFIRMED,
};
use crate::error::{NO_SOLUTION, StabilityError};
use crate::spectrum::along_depth::Spectrum;
use crate::spectrum::root::Root;
use crate::spectrum::verdict::Verdict;

/// Largest number of depth intervals of a cell chart at whose ends all multipliers are computed first. If a spindle
/// speed has no more cells than this, all are computed directly. A choice.
const INTERVALS: usize = 10;

/// Implements [`Method::cells`] for a method that gives a [`Spectrum`]. The function `spectrum` gives the multipliers
/// at this spindle speed, valid up to the axial depth (m) that is its argument.
pub(crate) fn cells_of<S: Spectrum>(
    rpm: f64,
    depths_mm: &[f64],
    spectrum: impl Fn(f64) -> S,
) -> Result<Vec<Cell>, StabilityError> {
    check_speed(rpm)?;
    for &depth_mm in depths_mm {
        check_depth(depth_mm)?;
    }
    let mut order: Vec<usize> = (0..depths_mm.len()).collect();
    order.sort_by(|&a, &b| depths_mm[a].total_cmp(&depths_mm[b]));
    let depths_m: Vec<f64> = order.iter().map(|&index| depths_mm[index] * 1e-3).collect();
    let Some(&last_m) = depths_m.last() else {
        return Ok(Vec::new());
    };
    let mut deepest_m = last_m * FIRST_MESH_SHARE;
    let mut column = Column {
        rpm,
        spectrum: spectrum(deepest_m),
        cells: vec![Cell::new(0.0, f64::INFINITY); depths_m.len()],
        depths_m,
    };
    let mut low: Option<Sample> = None;
    let stride = column.depths_m.len().div_ceil(INTERVALS);
    let mut index = 0;
    loop {
        let depth_m = column.depths_m[index];
        if depth_m > deepest_m {
            // The mesh of the period must be finer for larger depths: small depths use a coarser, cheaper one.
            deepest_m = (2.0 * deepest_m).max(depth_m).min(last_m);
            column.spectrum = spectrum(deepest_m);
        }
        let high = column.sample(index)?;
        if let Some(low) = &low {
            column.between(low, &high)?;
        }
        if index + 1 == column.depths_m.len() {
            break;
        }
        index = (index + stride).min(column.depths_m.len() - 1);
        low = Some(high);
    }
    let mut cells = column.cells.clone();
    for (cell, index) in column.cells.into_iter().zip(order) {
        cells[index] = cell;
    }
    Ok(cells)
}

/// All Floquet multipliers that may be dominant, sampled at the depth of one cell.
struct Sample {
    index: usize,
    depth_m: f64,
    /// Floquet multipliers with their derivatives dμ/dw; `None` if Newton's method fails for one of them or it lacks a
    /// derivative, so that cells next to this depth cannot be interpolated.
    roots: Option<Vec<Root>>,
}

impl Sample {
    /// Absolute value of the largest of `roots`; 0 without roots.
    fn largest(&self) -> f64 {
        let sizes = self.roots.iter().flatten().map(|root| root.multiplier.norm());
        sizes.fold(0.0, f64::max)
    }
}

/// Floquet multiplier between two sampled depths: a cubic in the fraction t of the depth interval, plus a quartic that
/// vanishes with its slope at both ends.
#[derive(Clone, Copy)]
struct Curve {
    from: Root,
    to: Root,
    step_m: f64,
    /// Coefficient of the quartic: the error of the cubic interpolant of the multiplier at the fraction t where it was
    /// checked, divided by t²(1 − t)².
    correction: Complex64,
}

impl Curve {
    fn at(&self, t: f64) -> Complex64 {
        let (u, product) = (1.0 - t, t * (1.0 - t));
        self.from.multiplier * (u * u * (1.0 + 2.0 * t))
            + self.to.multiplier * (t * t * (3.0 - 2.0 * t))
            + (self.from.slope * u - self.to.slope * t) * (self.step_m * product)
            + self.correction * (product * product)
    }

    /// Sets the quartic from the error of the cubic interpolant at the fraction `share` of the depth interval; returns
    /// the absolute value of the quartic at the middle of the interval.
    fn correct(&mut self, share: f64, error: Complex64) -> f64 {
        let product = share * (1.0 - share);
        self.correction = error / (product * product);
        self.correction.norm() / 16.0
    }
}

/// Cells of a chart at one spindle speed while they are computed, by ascending depth.
struct Column<S> {
    rpm: f64,
    spectrum: S,
    depths_m: Vec<f64>,
    cells: Vec<Cell>,
}

impl<S: Spectrum> Column<S> {
    /// Computes all Floquet multipliers that may be dominant at the depth of a cell, and stores the largest |μ| and the
    /// largest error in the cell.
    fn sample(&mut self, index: usize) -> Result<Sample, StabilityError> {
        let depth_m = self.depths_m[index];
        let all = self
            .spectrum
            .multipliers(depth_m)
            .map_err(|cause| cause.at(self.rpm, depth_m * 1e3, NO_SOLUTION))?;
        let largest = all.first().map_or(0.0, |multiplier| multiplier.norm());
        let mut sizes = (0.0_f64, 0.0_f64);
        let mut roots = Some(Vec::with_capacity(4));
        for &multiplier in all
            .iter()
            .take_while(|multiplier| multiplier.norm() >= CELL_FOLLOWED * largest)
            .filter(|multiplier| multiplier.im >= 0.0)
        {
            let Some(root) = self.spectrum.root_near(multiplier, depth_m) else {
                let size = multiplier.norm();
                sizes = (sizes.0.max(size), sizes.1.max(UNCONFIRMED * size.max(1.0)));
                roots = None;
                continue;
            };
            // Newton's step on the characteristic matrix corrects the error of the period map. The remaining error is
            // far smaller, so that [`LEAST_ERROR`] is stated.
            let size = root.multiplier.norm();
            sizes = (sizes.0.max(size), sizes.1.max(LEAST_ERROR * size.max(1.0)));
            if let Some(roots) = &mut roots {
                roots.push(root);
            }
        }
        self.cells[index] = Cell::new(sizes.0, sizes.1);
        Ok(Sample {
            index,
            depth_m,
            roots,
        })
    }

    /// Fills the cells between two sampled depths, halving the depth interval if interpolation fails.
    fn between(&mut self, low: &Sample, high: &Sample) -> Result<(), StabilityError> {
        if high.index - low.index < 2 {
            return Ok(());
        }
        let middle = match self.follow(low, high) {
            Followed::Filled => return Ok(()),
            Followed::Bent(middle) => middle,
            Followed::Lost => self.sample(middle_of(low, high))?,
        };
        self.between(low, &middle)?;
        self.between(&middle, high)
    }

    /// Follows every multiplier that may be dominant between two sampled depths, and fills the cells there.
    fn follow(&mut self, low: &Sample, high: &Sample) -> Followed {
        let Some(mut curves) = curves(low, high) else {
            return Followed::Lost;
        };
        let index = middle_of(low, high);
        let depth_m = self.depths_m[index];
        let share = (depth_m - low.depth_m) / (high.depth_m - low.depth_m);
        let mut roots = Vec::with_capacity(curves.len());
        let (mut fits, mut worst) = (true, 0.0_f64);
        let least = low.largest().min(high.largest());
        let tolerance = if least > CELL_FAR {
            CELL_TOLERANCE_FAR
        } else {
            CELL_TOLERANCE
        };
        for curve in &mut curves {
            let guess = curve.at(share);
            let root = self.polished(guess, depth_m);
            let Some(root) = root.filter(|root| is_new(root, &roots)) else {
                return Followed::Lost;
            };
            let error = curve.correct(share, root.multiplier - guess);
            roots.push(root);
            fits &= error <= tolerance * least;
            worst = worst.max(error);
        }
        let middle = Sample {
            index,
            depth_m,
            roots: Some(roots),
        };
        self.cells[index] = Cell::exact(middle.largest());
        // Error of interpolated cells, to which `fill` adds [`LEAST_ERROR`]: twice the largest error of the cubics in
        // depth, although the quartics correct it; far outside the unit circle, where depth intervals are wide, four
        // times.
        let error = if least > CELL_FAR {
            4.0 * worst
        } else {
            2.0 * worst
        };
        if fits && self.fill(low, high, &curves, error).is_some() {
            Followed::Filled
        } else {
            Followed::Bent(middle)
        }
    }

    /// Floquet multiplier near a guess, from one Newton step, or two if the first is 1e-5 of the guess or longer;
    /// `None` if one of them fails.
    fn polished(&mut self, guess: Complex64, depth_m: f64) -> Option<Root> {
        let root = self.spectrum.root_near(guess, depth_m)?;
        // After a relative Newton step below 1e-5 the remaining relative error is about its square: 1e-10.
        if (root.multiplier - guess).norm() < 1e-5 * guess.norm() {
            return Some(root);
        }
        self.spectrum.root_near(root.multiplier, depth_m)
    }

    /// Fills the cells between two sampled depths from interpolants of the multipliers with a given error; `None` if
    /// there is no interpolant, or if a cell is undecided and its multiplier cannot be computed directly.
    fn fill(&mut self, low: &Sample, high: &Sample, curves: &[Curve], error: f64) -> Option<()> {
        for index in low.index + 1..high.index {
            if index == middle_of(low, high) {
                continue;
            }
            let depth_m = self.depths_m[index];
            let share = (depth_m - low.depth_m) / (high.depth_m - low.depth_m);
            let largest = curves
                .iter()
                .map(|curve| curve.at(share))
                .max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr()))?;
            let size = largest.norm();
            let mut cell = Cell::new(size, error + LEAST_ERROR * size.max(1.0));
            if cell.verdict == Verdict::Undecided {
                let root = self.polished(largest, depth_m)?;
                cell = Cell::exact(root.multiplier.norm());
            }
            self.cells[index] = cell;
        }
        Some(())
    }
}

/// Result of following multipliers from one sampled depth to the next.
enum Followed {
    /// All multipliers were followed between the two depths, and the cells there are filled.
    Filled,
    /// The interpolants of the multipliers err too much, or `fill` failed; the multipliers at the middle cell are
    /// known.
    Bent(Sample),
    /// There are no interpolants (see [`curves`]), Newton's method failed at the middle cell, or two interpolants led
    /// to one multiplier.
    Lost,
}

/// True if the multiplier differs from all of `others` by more than 1e-6 of its size.
fn is_new(root: &Root, others: &[Root]) -> bool {
    let distance = |other: &Root| (other.multiplier - root.multiplier).norm();
    others
        .iter()
        .all(|other| distance(other) > 1e-6 * root.multiplier.norm())
}

fn middle_of(low: &Sample, high: &Sample) -> usize {
    (low.index + high.index) / 2
}

/// Interpolants of all multipliers that may be dominant between two sampled depths; `None` if a multiplier without a
/// partner may be dominant, or if a sample has no roots.
fn curves(low: &Sample, high: &Sample) -> Option<Vec<Curve>> {
    let step_m = high.depth_m - low.depth_m;
    let mut free = high.roots.clone()?;
    let mut strays = Vec::new();
    let mut curves = Vec::with_capacity(free.len());
    for root in low.roots.as_ref()? {
        match root.take_next(&mut free, step_m) {
            Some(to) => curves.push(Curve {
                from: *root,
                to,
                step_m,
                correction: Complex64::ZERO,
            }),
            None => strays.push(*root),
        }
    }
    strays.extend(free);
    let half_way = curves
        .iter()
        .map(|curve| curve.at(0.5).norm())
        .fold(0.0, f64::max);
    let least = half_way.min(low.largest()).min(high.largest());
    // A multiplier without a partner at the other depth must stay smaller than the dominant one over the depth
    // interval, even if it moves twice as far as its derivative predicts.
    let reach = |root: &Root| root.multiplier.norm() + 2.0 * root.slope.norm() * step_m;
    strays.iter().all(|root| reach(root) < least).then_some(curves)
}
