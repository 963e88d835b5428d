//! The stabilization diagram: poles that are stable in frequency, damping and shape as the model order increases.

use nalgebra::DMatrix;
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::denominator;
use super::error::ModesError;
use super::receptances::Receptances;
use super::rejected::{Rejected, reject};
use super::shape::assurance;
use crate::criteria::{
    LEAST_HEIGHT, LEAST_ORDERS, ORDERS_SHARE, OVERDAMPED, SAME_DAMPING, SAME_FREQUENCY, SAME_POLE_DISTANCE,
    SAME_POLE_SHAPE, SAME_SHAPE,
};
use quietcut_frf::rational_fit::{RationalFitError, residues};

/// A pole of the model of one order in the stabilization diagram.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Order of the model that the pole belongs to.
    pub order: usize,
    /// The pole λ, rad/s.
    pub pole: Complex64,
    /// Height of the pole's resonance peak: norm of its residues, with each receptance normalized by its RMS, divided
    /// by the decay rate −Re λ; dimensionless.
    pub height: f64,
    /// True if the pole continues a pole of the previous model order, with which it agrees in frequency, damping and
    /// shape. No two poles continue the same one.
    pub is_stable: bool,
    /// Index of the chain of stable poles over the model orders that the pole continues or starts.
    line: usize,
    /// Distance to the pole of the previous order in the chain, the larger one of the relative changes of frequency and
    /// damping, in multiples of `SAME_FREQUENCY` and `SAME_DAMPING`; infinite for the first pole of the chain.
    change: f64,
    /// Residues of the pole in all receptances, each receptance normalized by its RMS, as a vector of norm 1.
    shape: Vec<Complex64>,
}

impl Candidate {
    /// Frequency |λ|/2π, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.pole.norm() / TAU
    }

    /// Damping ratio ζ = −Re λ/|λ|.
    pub fn damping_ratio(&self) -> f64 {
        -self.pole.re / self.pole.norm()
    }
}

/// Stabilization diagram: poles of all model orders, and the poles that are modes.
#[derive(Clone, Debug, Default)]
pub struct Stabilization {
    /// Poles in the band with a damping ratio above 0 and below 0.5, in ascending model order.
    pub candidates: Vec<Candidate>,
    /// Highest model order.
    pub highest_order: usize,
    /// Poles selected as modes, strongest first, rad/s; of a structure in several parts, those of one part after the other.
    pub selected: Vec<Complex64>,
    /// Poles of the highest model order in the band whose damping is not positive, rad/s.
    unstable: Vec<Complex64>,
    /// Chains of poles that are no modes: too weak, or too short although they reach the highest order. The pole of
    /// each, rad/s, and the reason.
    discarded: Vec<(Complex64, String)>,
}

impl Stabilization {
    /// The stabilization diagrams of several parts of a structure in one. Its candidates are sorted by model order; the
    /// poles selected as modes and the rejected ones are listed part by part.
    pub(super) fn together(diagrams: Vec<Self>) -> Self {
        let mut all = Self::default();
        for diagram in diagrams {
            all.highest_order = all.highest_order.max(diagram.highest_order);
            all.candidates.extend(diagram.candidates);
            all.selected.extend(diagram.selected);
            all.unstable.extend(diagram.unstable);
            all.discarded.extend(diagram.discarded);
        }
        all.candidates.sort_by_key(|candidate| candidate.order);
        all
    }

    /// Poles of the stabilization diagram that are rejected as modes, with the reasons.
    pub(super) fn rejected(&self) -> Vec<Rejected> {
        let unstable = self
            .unstable
            .iter()
            .map(|pole| reject(*pole, "negative damping".into()));
        let discarded = self
            .discarded
            .iter()
            .map(|(pole, why)| reject(*pole, why.clone()));
        unstable.chain(discarded).collect()
    }
}

/// Computes the poles of the models of order 1 to `highest_order`, or to the highest order that the number of lines
/// allows, and selects the stable ones.
///
/// # Errors
/// The number of lines or `highest_order` allows too few model orders, or the poles or residues cannot be computed.
pub(super) fn stabilize(data: &Receptances, highest_order: usize) -> Result<Stabilization, ModesError> {
    let lines = data.frequency_hz.len();
    let highest = highest_order.min((lines - 1) / 3);
    if highest <= LEAST_ORDERS {
        return Err(ModesError::Data(format!(
            "order {highest} is the highest that {lines} frequencies and --order allow; more than {LEAST_ORDERS} are needed"
        )));
    }
    let [from_hz, to_hz] = data.band_hz();
    let in_band = |pole: &Complex64| (from_hz..=to_hz).contains(&(pole.norm() / TAU)) && pole.im > 0.0;
    let mut found = Stabilization {
        candidates: Vec::new(),
        highest_order: highest,
        selected: Vec::new(),
        unstable: Vec::new(),
        discarded: Vec::new(),
    };
    let mut lines = 0;
    let mut before: Vec<Candidate> = Vec::new();
    for (index, mut poles) in denominator::poles(data, highest)?.into_iter().enumerate() {
        let order = index + 1;
        poles.retain(in_band);
        if order == highest {
            found.unstable = poles.iter().copied().filter(|pole| pole.re >= 0.0).collect();
        }
        poles.retain(|pole| pole.re < 0.0 && -pole.re < OVERDAMPED * pole.norm());
        let mut now = candidates(data, order, &poles)?;
        connect(&mut now, &before, &mut lines);
        found.candidates.extend(now.iter().cloned());
        before = now;
    }
    select(&mut found, lines);
    Ok(found)
}

fn candidates(
    data: &Receptances,
    order: usize,
    poles: &[Complex64],
) -> Result<Vec<Candidate>, RationalFitError> {
    let functions: Vec<&[Complex64]> = data.values.iter().map(Vec::as_slice).collect();
    let fit = residues(&data.frequency_hz, &functions, poles.to_vec())?;
    let sizes: Vec<f64> = data
        .values
        .iter()
        .map(|values| (values.iter().map(|h| h.norm_sqr()).sum::<f64>() / values.len() as f64).sqrt())
        .collect();
    let found = poles
        .iter()
        .enumerate()
        .map(|(r, &pole)| {
            let mut shape: Vec<Complex64> = fit
                .residues
                .iter()
                .zip(&sizes)
                .map(|(row, size)| row[r] / *size)
                .collect();
            let norm = shape.iter().map(|entry| entry.norm_sqr()).sum::<f64>().sqrt();
            if norm > 0.0 {
                for entry in &mut shape {
                    *entry /= norm;
                }
            }
            Candidate {
                order,
                pole,
                height: norm / -pole.re,
                is_stable: false,
                line: 0,
                change: f64::INFINITY,
                shape,
            }
        })
        .collect();
    Ok(found)
}

/// Distance of two poles: the larger one of the relative differences of frequency and damping ratio, in multiples of
/// `SAME_FREQUENCY` and `SAME_DAMPING`. Up to 1 the poles agree in both.
fn distance(a: &Candidate, b: &Candidate) -> f64 {
    let frequency = (a.frequency_hz() / b.frequency_hz() - 1.0).abs() / SAME_FREQUENCY;
    let damping = (a.damping_ratio() / b.damping_ratio() - 1.0).abs() / SAME_DAMPING;
    frequency.max(damping)
}

/// Continues chains of poles of the previous model order by poles of this order that agree with them in frequency,
/// damping and shape, the nearest pairs first; a pole without a predecessor starts a new chain.
fn connect(now: &mut [Candidate], before: &[Candidate], lines: &mut usize) {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, a) in now.iter().enumerate() {
        for (j, b) in before.iter().enumerate() {
            let distance = distance(a, b);
            if distance <= 1.0 && assurance(&a.shape, &b.shape) >= SAME_SHAPE {
                pairs.push((distance, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = vec![false; before.len()];
    for (distance, i, j) in pairs {
        if !(now[i].is_stable || taken[j]) {
            taken[j] = true;
            now[i].is_stable = true;
            now[i].line = before[j].line;
            now[i].change = distance;
        }
    }
    for candidate in now.iter_mut().filter(|candidate| !candidate.is_stable) {
        candidate.line = *lines;
        *lines += 1;
    }
}

/// Selects the chains of poles that extend over enough model orders and are strong enough. Each is represented by the
/// pole that changed least from the previous order.
fn select(found: &mut Stabilization, lines: usize) {
    let needed = ((ORDERS_SHARE * found.highest_order as f64).ceil() as usize).max(LEAST_ORDERS);
    let mut of_line: Vec<Vec<&Candidate>> = vec![Vec::new(); lines];
    for candidate in &found.candidates {
        of_line[candidate.line].push(candidate);
    }
    let mut long: Vec<(&Candidate, usize)> = Vec::new();
    let mut discarded = Vec::new();
    for line in &of_line {
        let Some(best) = line.iter().min_by(|a, b| a.change.total_cmp(&b.change)) else {
            continue;
        };
        if line.len() > needed {
            long.push((best, line.len()));
        } else if line
            .iter()
            .any(|candidate| candidate.order == found.highest_order)
        {
            discarded.push((
                best.pole,
                format!(
                    "the same over {} orders only; more than {needed} are needed",
                    line.len()
                ),
            ));
        }
    }
    // Two chains of the same pole, of which one is interrupted and continued later, are one mode, which the longer
    // chain represents.
    long.sort_by_key(|(_, length)| std::cmp::Reverse(*length));
    let mut kept: Vec<&Candidate> = Vec::new();
    for (candidate, _) in long {
        let is_known = |other: &&Candidate| {
            distance(candidate, other) <= SAME_POLE_DISTANCE
                && assurance(&candidate.shape, &other.shape) > SAME_POLE_SHAPE
        };
        if !kept.iter().any(is_known) {
            kept.push(candidate);
        }
    }
    kept.sort_by(|a, b| b.height.total_cmp(&a.height));
    let highest = kept.first().map_or(0.0, |candidate| candidate.height);
    for candidate in kept {
        if candidate.height > LEAST_HEIGHT * highest {
            found.selected.push(candidate.pole);
        } else {
            let part = 100.0 * candidate.height / highest;
            discarded.push((
                candidate.pole,
                format!(
                    "{part:.2} % of the strongest mode; {:.1} % are needed",
                    100.0 * LEAST_HEIGHT
                ),
            ));
        }
    }
    found.discarded = discarded;
}

/// Residues of one pole in all receptances as a matrix, responses by forces.
pub(super) fn matrix_of(data: &Receptances, residues: &[Vec<Complex64>], mode: usize) -> DMatrix<Complex64> {
    let mut matrix = DMatrix::zeros(data.responses.len(), data.forces.len());
    for (&place, row) in data.places.iter().zip(residues) {
        matrix[place] = row[mode];
    }
    matrix
}
