//! Tests whether a structure is linear, and which kind of nonlinearity it has (thesis section 4.2, as tests with error
//! rates).
//!
//! *Force-level dependence* and *homogeneity*: the dynamic stiffness F/X of a linear structure at one frequency does
//! not depend on the force level. The change with the level is fitted by the describing function of each candidate kind
//! of nonlinearity. A kind is named if it reduces the sum of squares by much more than chance does; a quadratic spring
//! is named if the second harmonic is significant. *Harmonics*: the response of a linear structure at 2ω and 3ω is
//! within the noise and within the response to the harmonics of the force.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_model::effects::Harmonic;
use quietcut_numerics::least_squares::LinearProblem;

use crate::criteria::{
    DIFFERENT_LEVELS, EXPLAINED_SHARE, FORCE_HARMONIC_DEVIATIONS, HARMONIC_DEVIATIONS, KIND_EVIDENCE,
    LINEAR_DEVIATIONS, QUADRATIC_STIFFNESS_RATIO, SAME_STEP,
};
use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::{Dwell, FourierSeries};
use crate::nonlinear::describing::Nonlinearity;
use crate::nonlinear::homogeneity::line;

/// Result of the linearity test.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Verdict {
    /// True if the data are consistent with a linear structure.
    pub linear: bool,
    /// The kinds of nonlinearity that explain the dependence of the stiffness F/X on the force level, followed by a
    /// quadratic spring if the second harmonic is significant. If a quadratic spring explains the dependence, other
    /// springs are left out. Empty if there is none.
    pub kinds: Vec<Nonlinearity>,
    /// χ² per degree of freedom of a linear structure's fit to the stiffnesses F/X of all dwells: near 1 if the
    /// structure is linear.
    pub linear_misfit: f64,
    /// χ² per degree of freedom of the fit with the kinds of nonlinearity that explain the dependence on the force
    /// level; without a kind, that of the linear structure.
    pub explained_misfit: f64,
    /// Largest relative change of the stiffness |F/X| between two dwells of one frequency.
    pub level_dependence: f64,
    /// Second and third harmonics of the measured motion in each dwell with force and motion in one direction, as in
    /// figures 5.4 (b) and (c) of the thesis.
    pub harmonics: Vec<Harmonics>,
}

/// Amplitudes of the second and third harmonic of the measured motion X (displacement, velocity or acceleration) in one
/// dwell, relative to the fundamental.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Harmonics {
    /// Excitation frequency, Hz.
    pub frequency_hz: f64,
    /// Force amplitude, N.
    pub force_n: f64,
    /// |X(2ω)|/|X(ω)|.
    pub second: f64,
    /// |X(3ω)|/|X(ω)|.
    pub third: f64,
    /// Standard deviation of the noise in the amplitude |X(2ω)| of the measured motion, relative to the fundamental.
    pub noise: f64,
}

/// Reason why the linearity test gives no result.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LinearityError {
    /// No frequency was measured at two levels, that is, at motion amplitudes that differ by more than 5 %.
    #[error(
        "no frequency was measured at two or more force levels ({dwells} dwells were found); a step-sine test at several levels, or a tone of rising force, is needed"
    )]
    OneLevel {
        /// Number of dwells found.
        dwells: usize,
    },
}

/// Dynamic stiffness F/X measured in one dwell: force phasor over displacement phasor.
#[derive(Clone, Copy, Debug)]
struct DwellStiffness {
    group: usize,
    omega: f64,
    amplitude: f64,
    stiffness: Complex64,
    /// Variance of the real part of the dynamic stiffness, equal to that of the imaginary part, (N/m)².
    variance: f64,
}

/// Tests whether a structure is linear, from dwells with force and motion in one direction.
///
/// # Errors
/// No frequency at two levels.
pub fn verdict(dwells: &[Dwell]) -> Result<Verdict, LinearityError> {
    let points = points(dwells);
    let several = points
        .iter()
        .any(|a| points.iter().any(|b| a.group == b.group && differ(a, b)));
    if !several {
        return Err(LinearityError::OneLevel { dwells: dwells.len() });
    }
    let base = LinearModel::new(&points);
    let alone = base.sum_of_squares(&[]);
    let free = base.free();
    let mut best = KindSet {
        kinds: Vec::new(),
        parameters: 0,
        sum: alone,
    };
    // Largest χ² of a linear structure: it exceeds the degrees of freedom by four standard deviations, which chance
    // rarely does.
    let chance = free + LINEAR_DEVIATIONS * (2.0 * free).sqrt();
    let (second, third) = (harmonic(dwells, 2), harmonic(dwells, 3));
    if alone > chance {
        best = choose(&base, &points, best);
    }
    let mut kinds = best.kinds;
    if second {
        if is_due_to_quadratic_spring(&points, dwells) {
            kinds.retain(|kind| {
                !matches!(
                    kind,
                    Nonlinearity::CubicStiffness
                        | Nonlinearity::SofteningHardening
                        | Nonlinearity::Backlash
                        | Nonlinearity::Hysteresis
                )
            });
        }
        kinds.push(Nonlinearity::QuadraticStiffness);
    }
    Ok(Verdict {
        linear: alone <= chance && !second && !third,
        kinds,
        linear_misfit: alone / free.max(1.0),
        explained_misfit: best.sum / (free - best.parameters as f64).max(1.0),
        level_dependence: level_dependence(&points),
        harmonics: harmonics(dwells),
    })
}

fn differ(a: &DwellStiffness, b: &DwellStiffness) -> bool {
    (a.amplitude / b.amplitude - 1.0).abs() > DIFFERENT_LEVELS
}

fn pair(dwell: &Dwell) -> Option<(&FourierSeries, &FourierSeries)> {
    let force = dwell.force()?;
    let motion = dwell
        .motions
        .iter()
        .find(|line| line.direction == force.direction)?;
    Some((force, motion))
}

fn points(dwells: &[Dwell]) -> Vec<DwellStiffness> {
    let mut points: Vec<DwellStiffness> = dwells
        .iter()
        .filter_map(|dwell| {
            let (force, motion) = pair(dwell)?;
            let per_unit = dwell.gram_inverse[(1, 1)];
            let (f, y) = (force.phasor(1), motion.phasor(1));
            let x = y / Complex64::new(0.0, dwell.omega).powi(i32::from(derivative(motion.quantity)));
            let stiffness = f / x;
            let relative = per_unit * (force.variance / f.norm_sqr() + motion.variance / y.norm_sqr());
            Some(DwellStiffness {
                group: 0,
                omega: dwell.omega,
                amplitude: x.norm(),
                stiffness,
                variance: stiffness.norm_sqr() * relative,
            })
        })
        .filter(|point| point.stiffness.is_finite() && point.variance > 0.0)
        .collect();
    points.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    let mut group = 0;
    for index in 1..points.len() {
        // Dwells within 0.1 % in excitation frequency are repetitions of one frequency step.
        if points[index].omega > points[index - 1].omega * (1.0 + SAME_STEP) {
            group += 1;
        }
        points[index].group = group;
    }
    points
}

/// Linear model of the linearity test: one free complex stiffness F/X per frequency. Describing functions of the
/// candidate kinds are added to it for the change of stiffness with the level.
struct LinearModel<'a> {
    points: &'a [DwellStiffness],
    groups: usize,
}

impl<'a> LinearModel<'a> {
    fn new(points: &'a [DwellStiffness]) -> Self {
        Self {
            points,
            groups: points.last().map_or(0, |point| point.group + 1),
        }
    }

    fn free(&self) -> f64 {
        2.0 * (self.points.len() - self.groups) as f64
    }

    /// χ² of the measured stiffnesses F/X after a fit of the describing functions `features` and a free complex
    /// stiffness per frequency; without `features` if they are linearly dependent.
    fn sum_of_squares(&self, features: &[Vec<Complex64>]) -> f64 {
        let rows = 2 * self.points.len();
        let mut matrix = DMatrix::zeros(rows, features.len().max(1));
        let mut right = DVector::zeros(rows);
        for part in 0..2 {
            let pick = |value: Complex64| if part == 0 { value.re } else { value.im };
            let column = |values: &dyn Fn(usize) -> f64| self.centered(values);
            let of_data = column(&|i| pick(self.points[i].stiffness));
            for (i, value) in of_data.into_iter().enumerate() {
                right[2 * i + part] = value;
            }
            for (index, feature) in features.iter().enumerate() {
                for (i, value) in column(&|i| pick(feature[i])).into_iter().enumerate() {
                    matrix[(2 * i + part, index)] = value;
                }
            }
        }
        if features.is_empty() {
            return right.norm_squared();
        }
        match LinearProblem::new(&matrix, &right).solve() {
            Ok(fit) => fit.sum_of_squares,
            Err(_) => right.norm_squared(),
        }
    }

    /// Values `value` of all dwells minus their weighted mean over the dwells of the same frequency, divided by the
    /// standard deviation of the stiffness F/X of the dwell.
    fn centered(&self, value: &dyn Fn(usize) -> f64) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); self.groups];
        for (i, point) in self.points.iter().enumerate() {
            let weight = 1.0 / point.variance;
            sums[point.group].0 += weight * value(i);
            sums[point.group].1 += weight;
        }
        self.points
            .iter()
            .enumerate()
            .map(|(i, point)| (value(i) - sums[point.group].0 / sums[point.group].1) / point.variance.sqrt())
            .collect()
    }
}

#[derive(Clone, Debug)]
struct KindSet {
    kinds: Vec<Nonlinearity>,
    parameters: usize,
    sum: f64,
}

/// The set of one or two kinds of nonlinearity with the fewest parameters that explains the dependence of stiffness on
/// the level; `nothing` if no kind is significant.
fn choose(base: &LinearModel<'_>, points: &[DwellStiffness], nothing: KindSet) -> KindSet {
    let candidates = candidates(base, points);
    let mut all: Vec<KindSet> = candidates
        .iter()
        .map(|candidate| KindSet {
            kinds: vec![candidate.kind],
            parameters: candidate.parameters,
            sum: base.sum_of_squares(&candidate.features),
        })
        .collect();
    all.retain(|choice| nothing.sum - choice.sum > KIND_EVIDENCE * choice.parameters as f64);
    for (i, a) in candidates.iter().enumerate() {
        for b in candidates[i + 1..].iter().filter(|b| a.can_act_with(b)) {
            let features: Vec<_> = a.features.iter().chain(&b.features).cloned().collect();
            let sum = base.sum_of_squares(&features);
            let needs = |other: &Candidate, parameters: usize| {
                base.sum_of_squares(&other.features) - sum > KIND_EVIDENCE * parameters as f64
            };
            if needs(a, b.parameters) && needs(b, a.parameters) {
                all.push(KindSet {
                    kinds: vec![a.kind, b.kind],
                    parameters: a.parameters + b.parameters,
                    sum,
                });
            }
        }
    }
    all.sort_by(|a, b| a.sum.total_cmp(&b.sum));
    let Some(least) = all.first().cloned() else {
        return nothing;
    };
    // A set of kinds is sufficient if its χ² is a small share of that of a linear structure, or not much larger than
    // that of the best set. The set with the fewest parameters is chosen; among equals the one with the best fit.
    let enough = (least.sum + KIND_EVIDENCE).max(EXPLAINED_SHARE * nothing.sum);
    all.into_iter()
        .filter(|choice| choice.sum <= enough)
        .min_by_key(|choice| choice.parameters)
        .unwrap_or(least)
}

impl Candidate {
    /// True if two kinds of nonlinearity may act together: one is a nonlinear spring and the other a nonlinear damping.
    /// Hysteresis contains both already.
    fn can_act_with(&self, other: &Self) -> bool {
        self.spring != other.spring
            && self.kind != Nonlinearity::Hysteresis
            && other.kind != Nonlinearity::Hysteresis
    }
}

struct Candidate {
    kind: Nonlinearity,
    spring: bool,
    parameters: usize,
    features: Vec<Vec<Complex64>>,
}

fn candidates(base: &LinearModel<'_>, points: &[DwellStiffness]) -> Vec<Candidate> {
    // Describing functions of the first `count` terms of a kind, at all points; the force law bends at `bend_m`, m.
    let features = |kind: Nonlinearity, count: usize, bend_m: f64| -> Vec<Vec<Complex64>> {
        let of = |point: &DwellStiffness, term: usize| {
            let at = Harmonic::new(point.amplitude, point.omega).with_bend_m(bend_m);
            kind.describing_functions(at)[term]
        };
        (0..count)
            .map(|term| points.iter().map(|point| of(point, term)).collect())
            .collect()
    };
    let linear = |kind, spring, parameters| Candidate {
        kind,
        spring,
        parameters,
        features: features(kind, parameters, 0.0),
    };
    // The gap of backlash and the yield displacement of hysteresis are searched from 0.05 times the smallest to 1.5
    // times the largest measured displacement amplitude.
    let sizes = points.iter().map(|point| point.amplitude);
    let (least, largest) = sizes.fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    let with_bend = |kind| {
        let features = |size: f64| features(kind, 1, size.exp());
        let sum = |size: f64| base.sum_of_squares(&features(size));
        let (mut from, mut to) = ((0.05 * least).ln(), (1.5 * largest).ln());
        // The coarse grid of gaps or yield displacements is refined three times around the best value.
        for _ in 0..4 {
            let step = (to - from) / 40.0;
            let mut best = (f64::INFINITY, from);
            for k in 0..=40 {
                let size = from + step * f64::from(k);
                let found = sum(size);
                if found < best.0 {
                    best = (found, size);
                }
            }
            (from, to) = (best.1 - step, best.1 + step);
        }
        Candidate {
            kind,
            spring: true,
            parameters: 2,
            features: features(0.5 * (from + to)),
        }
    };
    vec![
        linear(Nonlinearity::CubicStiffness, true, 1),
        linear(Nonlinearity::CubicDamping, false, 1),
        linear(Nonlinearity::CoulombFriction, false, 1),
        linear(Nonlinearity::SofteningHardening, true, 2),
        with_bend(Nonlinearity::Backlash),
        with_bend(Nonlinearity::Hysteresis),
    ]
}

/// True if the change of the stiffness F/X with the level is that of a quadratic spring alone.
///
/// Harmonic balance of k₂x² near resonance: a₀ = −k₂X²/2k, X₂ = k₂X²/6k, with the offset a₀, the amplitude X at ω and
/// X₂ at 2ω. The stiffness changes by k₂(2a₀ + X₂) = −(5/6)k₂²X²/k = −30·k·(X₂/X)². k is the value at ω = 0 of the line
/// through Re(F/X) over ω² at the lowest level of each frequency.
fn is_due_to_quadratic_spring(points: &[DwellStiffness], dwells: &[Dwell]) -> bool {
    let shares: Vec<(f64, f64, f64)> = dwells
        .iter()
        .filter_map(|dwell| {
            let (_, motion) = pair(dwell)?;
            // Ratio X₂/X of the second harmonic of the displacement to its fundamental. In a velocity or an
            // acceleration the ratio is larger by the factor 2 for each differentiation.
            let larger = f64::from(1 << derivative(motion.quantity));
            let share = at_harmonic(motion, dwell, 2)?.0 / motion.amplitude(1) / larger;
            let size = motion.amplitude(1) / dwell.omega.powi(i32::from(derivative(motion.quantity)));
            Some((dwell.omega, size, share))
        })
        .collect();
    let share_of = |point: &DwellStiffness| {
        shares
            .iter()
            .find(|(omega, size, _)| *omega == point.omega && (size / point.amplitude - 1.0).abs() < 1e-9)
            .map(|(_, _, share)| share * share)
    };
    let mut lowest: Vec<&DwellStiffness> = Vec::new();
    for point in points {
        match lowest.last_mut() {
            Some(last) if last.group == point.group => {
                if point.amplitude < last.amplitude {
                    *last = point;
                }
            }
            _ => lowest.push(point),
        }
    }
    let by_frequency: Vec<(f64, f64)> = lowest
        .iter()
        .map(|p| (p.omega * p.omega, p.stiffness.re))
        .collect();
    let [stiffness, _] = line(&by_frequency);
    // Regression of the change of stiffness on the change of (X₂/X)², both against the lowest level of the same
    // frequency; X₂/X is the second harmonic over the fundamental.
    let (mut above, mut below) = (0.0, 0.0);
    for point in points {
        let Some(base) = lowest.iter().find(|base| base.group == point.group) else {
            continue;
        };
        if let (Some(share), Some(at_base)) = (share_of(point), share_of(base)) {
            above += (share - at_base) * (point.stiffness.re - base.stiffness.re);
            below += (share - at_base) * (share - at_base);
        }
    }
    // The ratio of the change of stiffness to k·(X₂/X)² is −30 for a quadratic spring; ±50 % allow for damping, other
    // modes and the next order of the balance.
    let ratio = above / (below * stiffness);
    let [least, most] = QUADRATIC_STIFFNESS_RATIO;
    (-most..-least).contains(&ratio)
}

fn level_dependence(points: &[DwellStiffness]) -> f64 {
    let mut largest = 0.0_f64;
    for a in points {
        for b in points.iter().filter(|b| b.group == a.group) {
            largest = largest.max((a.stiffness.norm() / b.stiffness.norm() - 1.0).abs());
        }
    }
    largest
}

/// Amplitude of harmonic h of a force or motion channel in a dwell, and the standard deviation of its noise, in the
/// unit of the channel; `None` if the Fourier series does not reach harmonic h.
fn at_harmonic(line: &FourierSeries, dwell: &Dwell, h: usize) -> Option<(f64, f64)> {
    let place = 2 * h - 1;
    if line.coefficients.len() <= place + 1 {
        return None;
    }
    let variance = line.variance * dwell.gram_inverse[(place, place)];
    Some((line.amplitude(h), variance.sqrt()))
}

/// True if harmonic h of the motion exceeds the response to harmonic h of the force by more than noise, over all dwells
/// together.
fn harmonic(dwells: &[Dwell], h: usize) -> bool {
    let (mut sum, mut count) = (0.0, 0.0);
    for dwell in dwells {
        let Some((force, motion)) = pair(dwell) else {
            continue;
        };
        let (Some((x, noise)), Some((f, force_noise))) =
            (at_harmonic(motion, dwell, h), at_harmonic(force, dwell, h))
        else {
            continue;
        };
        // The receptance at hω, above resonance, is at most the receptance at ω near resonance, so that this bounds the
        // response to harmonic h of the force.
        let caused =
            (f - FORCE_HARMONIC_DEVIATIONS * force_noise).max(0.0) * motion.amplitude(1) / force.amplitude(1);
        sum += ((x - caused).max(0.0) / noise).powi(2);
        count += 2.0;
    }
    // The harmonic is significant if its χ² exceeds the mean of the χ² distribution by more than five standard
    // deviations.
    count > 0.0 && sum > count + HARMONIC_DEVIATIONS * (2.0_f64 * count).sqrt()
}

fn harmonics(dwells: &[Dwell]) -> Vec<Harmonics> {
    dwells
        .iter()
        .filter_map(|dwell| {
            let (force, motion) = pair(dwell)?;
            let first = motion.amplitude(1);
            Some(Harmonics {
                frequency_hz: dwell.omega / std::f64::consts::TAU,
                force_n: force.amplitude(1),
                second: at_harmonic(motion, dwell, 2)?.0 / first,
                third: at_harmonic(motion, dwell, 3)?.0 / first,
                noise: at_harmonic(motion, dwell, 2)?.1 / first,
            })
        })
        .collect()
}
