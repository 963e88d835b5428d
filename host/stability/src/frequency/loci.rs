//! Characteristic loci: eigenvalues traced along the frequency, their crossings of the positive real axis, and the
//! winding of a determinant about zero.

use std::f64::consts::PI;

use num_complex::Complex64;
use quietcut_numerics::roots::SignChange;

use crate::criteria::{ARGUMENT_CHANGE, LOCUS_BEND, LOCUS_LEVELS, LOCUS_MOVE};
use crate::error::Breakdown;

/// Eigenvalues at one frequency.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) omega: f64,
    pub(crate) values: Vec<Complex64>,
}

/// Crossing of the positive real axis by a characteristic locus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    /// Frequency, rad/s.
    pub(crate) omega: f64,
    /// Value of the characteristic locus where it crosses the real axis, 1/m.
    pub(crate) value: f64,
    /// True if the imaginary part of the locus rises with the frequency where it crosses the real axis.
    pub(crate) rises: bool,
}

/// Function of the frequency (rad/s) that returns the values of the characteristic loci of a loop there, 1/m, all
/// except those below a floor that the function itself knows.
pub(crate) trait Loci: Fn(f64) -> Result<Vec<Complex64>, Breakdown> {}
impl<F: Fn(f64) -> Result<Vec<Complex64>, Breakdown>> Loci for F {}

/// Samples characteristic loci on a frequency grid, so densely that every locus of at least `floor` is nearly straight
/// between two samples and can be told from the others where that matters: its middle deviates from the straight line
/// by at most `bend` × [`LOCUS_BEND`] of the larger of its values at both ends. An interval is halved at most
/// [`LOCUS_LEVELS`] times, even if that does not suffice.
///
/// # Errors
/// Those of the function `loci`.
pub(crate) fn trace(loci: &impl Loci, grid: &[f64], floor: f64, bend: f64) -> Result<Vec<Sample>, Breakdown> {
    let sample = |omega: f64| {
        Ok(Sample {
            omega,
            values: loci(omega)?,
        })
    };
    let mut samples = Vec::with_capacity(2 * grid.len());
    let Some((&first, rest)) = grid.split_first() else {
        return Ok(samples);
    };
    let mut low = sample(first)?;
    for &omega in rest {
        let high = sample(omega)?;
        samples.push(low.clone());
        divide(&sample, &low, &high, (floor, bend * LOCUS_BEND), 0, &mut samples)?;
        low = high;
    }
    samples.push(low);
    Ok(samples)
}

/// Adds frequency samples between two samples until every characteristic locus is straight and told apart from the
/// others, or below half the floor, or until the halvings are used up.
fn divide(
    sample: &impl Fn(f64) -> Result<Sample, Breakdown>,
    low: &Sample,
    high: &Sample,
    limits: (f64, f64),
    level: u32,
    samples: &mut Vec<Sample>,
) -> Result<(), Breakdown> {
    if level == LOCUS_LEVELS || is_nothing(low, limits.0) && is_nothing(high, limits.0) && level > 0 {
        return Ok(());
    }
    let middle = sample(0.5 * (low.omega + high.omega))?;
    if is_straight(low, &middle, high, limits) {
        samples.push(middle);
        return Ok(());
    }
    divide(sample, low, &middle, limits, level + 1, samples)?;
    samples.push(middle.clone());
    divide(sample, &middle, high, limits, level + 1, samples)
}

fn is_nothing(sample: &Sample, floor: f64) -> bool {
    sample.values.iter().all(|value| value.norm() < 0.5 * floor)
}

fn is_straight(low: &Sample, middle: &Sample, high: &Sample, (floor, bend): (f64, f64)) -> bool {
    let (Some(first), Some(second)) = (pairs(low, middle, floor), pairs(middle, high, floor)) else {
        return false;
    };
    middle.values.iter().enumerate().all(|(index, value)| {
        if value.norm() < 0.5 * floor {
            return true;
        }
        let from = first
            .iter()
            .find(|pair| pair.1 == index)
            .map(|pair| low.values[pair.0]);
        let to = second
            .iter()
            .find(|pair| pair.0 == index)
            .map(|pair| high.values[pair.1]);
        match (from, to) {
            (Some(from), Some(to)) => {
                let size = from.norm().max(to.norm());
                (value - (from + to) * 0.5).norm() <= bend * size
                    && (to - from).norm() <= LOCUS_MOVE * bend * size
                    && is_alone(middle, index, (to - from).norm())
            }
            // A characteristic locus without a partner in a neighbouring frequency sample must lie below the floor.
            _ => value.norm() < floor,
        }
    })
}

/// True if a characteristic locus that moves by `travel` cannot be confused with another, or if confusion has no effect
/// because one of the two is far from the positive real axis.
fn is_alone(sample: &Sample, index: usize, travel: f64) -> bool {
    let value = sample.values[index];
    let is_near_axis = |value: Complex64| value.re > -travel && value.im.abs() <= 2.0 * travel;
    let mut others = sample
        .values
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != index);
    others.all(|(_, other)| (other - value).norm() > travel || !is_near_axis(value) || !is_near_axis(*other))
}

/// Pairs the eigenvalues at two frequencies, nearest first, as indices in `a` and in `b`. `None` if an eigenvalue of at
/// least `floor` has no partner.
fn pairs(a: &Sample, b: &Sample, floor: f64) -> Option<Vec<(usize, usize)>> {
    let mut near: Vec<(f64, usize, usize)> = Vec::with_capacity(a.values.len() * b.values.len());
    for (i, p) in a.values.iter().enumerate() {
        for (j, q) in b.values.iter().enumerate() {
            near.push(((p - q).norm(), i, j));
        }
    }
    near.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut pairs: Vec<(usize, usize)> = Vec::with_capacity(a.values.len());
    for (_, i, j) in near {
        if pairs.iter().all(|pair| pair.0 != i && pair.1 != j) {
            pairs.push((i, j));
        }
    }
    let is_left = |sample: &Sample, index: usize, used: bool| !used && sample.values[index].norm() >= floor;
    let left = (0..a.values.len()).any(|i| is_left(a, i, pairs.iter().any(|pair| pair.0 == i)))
        || (0..b.values.len()).any(|j| is_left(b, j, pairs.iter().any(|pair| pair.1 == j)));
    (!left).then_some(pairs)
}

/// Part of a characteristic locus between two frequency samples: frequency (rad/s) and value at both ends.
pub(crate) type Step = [(f64, Complex64); 2];

/// Steps between two frequency samples, one for each characteristic locus with a value in both.
fn steps_between(low: &Sample, high: &Sample) -> Vec<Step> {
    // With an infinite floor no eigenvalue needs a partner, so that pairing cannot fail.
    let pairs = pairs(low, high, f64::INFINITY).unwrap_or_default();
    pairs
        .into_iter()
        .map(|(i, j)| [(low.omega, low.values[i]), (high.omega, high.values[j])])
        .collect()
}

/// Steps between all neighbouring samples.
pub(crate) fn steps(samples: &[Sample]) -> impl Iterator<Item = Step> {
    samples
        .windows(2)
        .flat_map(|pair| steps_between(&pair[0], &pair[1]))
}

/// Solutions that `solve` finds on every step of every characteristic locus between neighbouring frequency samples.
///
/// If `solve` gives `None` on a step, for example because two close loci were exchanged, the interval is halved and
/// solved again.
///
/// # Errors
/// Those of the function `loci`, or `solve` still fails after 2 × [`LOCUS_LEVELS`] halvings.
pub(crate) fn solve_steps<T>(
    loci: &impl Loci,
    samples: &[Sample],
    solve: &impl Fn(Step) -> Option<Vec<T>>,
) -> Result<Vec<T>, Breakdown> {
    let mut found = Vec::new();
    for pair in samples.windows(2) {
        found.extend(solve_between(loci, &pair[0], &pair[1], solve, 0)?);
    }
    Ok(found)
}

fn solve_between<T>(
    loci: &impl Loci,
    low: &Sample,
    high: &Sample,
    solve: &impl Fn(Step) -> Option<Vec<T>>,
    level: u32,
) -> Result<Vec<T>, Breakdown> {
    let whole: Option<Vec<Vec<T>>> = steps_between(low, high).into_iter().map(solve).collect();
    if let Some(found) = whole {
        return Ok(found.into_iter().flatten().collect());
    }
    if level == 2 * LOCUS_LEVELS {
        return Err(Breakdown::NoSolution);
    }
    let omega = 0.5 * (low.omega + high.omega);
    let middle = Sample {
        omega,
        values: loci(omega)?,
    };
    let mut found = solve_between(loci, low, &middle, solve, level + 1)?;
    found.extend(solve_between(loci, &middle, high, solve, level + 1)?);
    Ok(found)
}

/// Crossings of the positive real axis by characteristic loci of at least `floor`, largest value first. The imaginary
/// part at a crossing is at most 1e-12 of the larger |value| of the locus at both ends of the step, or 1e-9 where
/// rounding of the frequency forbids more.
///
/// # Errors
/// As [`solve_steps`].
pub(crate) fn crossings(
    loci: &impl Loci,
    samples: &[Sample],
    floor: f64,
) -> Result<Vec<Crossing>, Breakdown> {
    let mut found = solve_steps(loci, samples, &|[low, high]: Step| {
        if (low.1.im > 0.0) == (high.1.im > 0.0) || low.1.re.max(high.1.re) < 0.5 * floor {
            return Some(Vec::new());
        }
        let mark = |(omega, value): (f64, Complex64)| LocusPoint {
            omega,
            value,
            miss: value.im,
        };
        let tolerance = 1e-12 * low.1.norm().max(high.1.norm());
        let (omega, value) = zero(mark(low), mark(high), tolerance, |omega| {
            let loci = loci(omega).ok()?;
            Some(loci.into_iter().map(|value| (value, value.im)).collect())
        })?;
        let crossing = Crossing {
            omega,
            value: value.re,
            rises: high.1.im > 0.0,
        };
        Some(
            Some(crossing)
                .filter(|crossing| crossing.value >= floor)
                .into_iter()
                .collect(),
        )
    })?;
    found.sort_by(|a, b| b.value.total_cmp(&a.value));
    Ok(found)
}

/// Point of a characteristic locus with the residual of the equation that is solved along the locus; the residual
/// vanishes at the solution.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocusPoint {
    pub(crate) omega: f64,
    pub(crate) value: Complex64,
    pub(crate) miss: f64,
}

/// Zero of the residual between two points of a locus with residuals of opposite sign: the frequency, and the locus
/// there. `at` returns all loci at a frequency with their residuals; the one nearest to the straight line is used.
/// Regula falsi, until the residual is below the tolerance. `None` if it does not get there: if the residual jumps over
/// zero, two loci were exchanged.
pub(crate) fn zero(
    low: LocusPoint,
    high: LocusPoint,
    tolerance: f64,
    at: impl Fn(f64) -> Option<Vec<(Complex64, f64)>>,
) -> Option<(f64, Complex64)> {
    let mut bracket = SignChange::new([low.omega, low.miss], [high.omega, high.miss]);
    for _ in 0..80 {
        let omega = bracket.next();
        let share = (omega - low.omega) / (high.omega - low.omega);
        let expected = low.value + (high.value - low.value) * share;
        let (value, miss) = at(omega)?
            .into_iter()
            .min_by(|p, q| (p.0 - expected).norm().total_cmp(&(q.0 - expected).norm()))?;
        // On a frequency interval as narrow as rounding a residual of up to a thousand times the tolerance is accepted,
        // since eigenvalues have rounding errors too.
        let is_narrow = bracket.width() <= 1e-15 * high.omega;
        if miss.abs() <= tolerance || is_narrow && miss.abs() <= 1e3 * tolerance {
            return Some((omega, value));
        }
        if is_narrow {
            return None;
        }
        bracket.narrow(omega, miss);
    }
    None
}

/// Increase of the argument of a complex function of the frequency over a frequency grid, rad. Each interval of the
/// grid is halved, at most twenty times, until the argument changes by less than π/5 in each half.
///
/// `None` if the function returns `None`, vanishes or is not finite.
pub(crate) fn argument_increase(function: &impl Fn(f64) -> Option<Complex64>, grid: &[f64]) -> Option<f64> {
    let mut sum = 0.0;
    let Some((&first, rest)) = grid.split_first() else {
        return Some(sum);
    };
    let mut low = (first, function(first)?);
    for &omega in rest {
        let high = (omega, function(omega)?);
        sum += argument_increase_between(function, low, high, 0)?;
        low = high;
    }
    sum.is_finite().then_some(sum)
}

fn argument_increase_between(
    function: &impl Fn(f64) -> Option<Complex64>,
    low: (f64, Complex64),
    high: (f64, Complex64),
    level: u32,
) -> Option<f64> {
    let middle_omega = 0.5 * (low.0 + high.0);
    let middle = (middle_omega, function(middle_omega)?);
    let (first, second) = ((middle.1 / low.1).arg(), (high.1 / middle.1).arg());
    if !(first.is_finite() && second.is_finite()) {
        return None;
    }
    // Twenty halvings reach a millionth of the grid interval: if the argument of the function still changes by π/5, the
    // function has a zero on or next to the path.
    if first.abs().max(second.abs()) < ARGUMENT_CHANGE * PI || level == 20 {
        return Some(first + second);
    }
    Some(
        argument_increase_between(function, low, middle, level + 1)?
            + argument_increase_between(function, middle, high, level + 1)?,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two loci: receptances of one mode each, times the regeneration factor of a delay.
    fn two(omega: f64) -> Result<Vec<Complex64>, Breakdown> {
        let mode = |natural: f64, size: f64| {
            size / Complex64::new(natural * natural - omega * omega, 0.04 * natural * omega)
                * (Complex64::ONE - Complex64::cis(-omega))
        };
        Ok(vec![mode(10.0, 1.0), mode(23.0, 5.0)])
    }

    #[test]
    fn crossings_are_on_the_axis_and_a_coarse_grid_finds_the_same() {
        let find = |step: f64| {
            let grid: Vec<f64> = (0..=(60.0 / step) as usize).map(|i| step * i as f64).collect();
            let samples = trace(&two, &grid, 1e-4, 1.0).unwrap();
            crossings(&two, &samples, 1e-4).unwrap()
        };
        let (fine, coarse) = (find(0.01), find(0.5));
        assert!(fine.len() > 4);
        assert_eq!(fine.len(), coarse.len());
        for (a, b) in fine.iter().zip(&coarse) {
            assert!(
                (a.value - b.value).abs() < 1e-9 * a.value && a.rises == b.rises,
                "{a:?} {b:?}"
            );
            let nearest = two(a.omega)
                .unwrap()
                .into_iter()
                .map(|value| (value - a.value).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-10 * a.value);
        }
    }

    #[test]
    fn the_argument_grows_by_a_quarter_revolution_for_each_root_to_the_left() {
        // Polynomial (s + 1)(s² + 0.02 s + 4)(s − 3)(s² − 0.01 s + 9): three roots left, three right of the axis.
        let function = |omega: f64| {
            let s = Complex64::new(0.0, omega);
            Some((s + 1.0) * (s * s + s * 0.02 + 4.0) * (s - 3.0) * (s * s - s * 0.01 + 9.0))
        };
        let grid = [0.0, 1.9, 2.1, 2.95, 3.05, 1e4];
        let increase = argument_increase(&function, &grid).unwrap();
        // From 0 to infinity each root on the left adds π/2, each on the right subtracts it; the remainder at 1e4 rad/s
        // is 1e-3.
        assert!(increase.abs() < 1e-2, "{increase}");
        let stable = |omega: f64| {
            let s = Complex64::new(0.0, omega);
            Some((s + 1.0) * (s * s + s * 0.02 + 4.0))
        };
        let increase = argument_increase(&stable, &grid).unwrap();
        assert!((increase - 1.5 * PI).abs() < 1e-2, "{increase}");
    }
}
