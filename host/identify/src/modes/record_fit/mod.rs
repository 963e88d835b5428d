//! Modes refined on the lines of whole records: maximum likelihood with noise in forces and responses alike, and with the
//! transient of each record as unknowns.
//!
//! At each line of the transform of a whole record, without a window,
//!
//!   X(k) = sⁿ H(s) F(k) + T(s) + noise,   s = i2πk/duration,
//!
//! n being 0 for a displacement, 2 for an acceleration. T has the poles of H and a polynomial in s: what moves before the
//! record begins and rings on after it ends. With it nothing leaks and no average over frequencies bends the resonances
//! (Pintelon and Schoukens, System Identification, 2nd ed. 2012, chapters 6 and 9). Averaged receptances (thesis eqs
//! 7.7–7.12) do both; and H1 takes noise of the forces for force, which weighs where the forces of a cut are nearly
//! dependent.
//!
//! What is left, e = X − sⁿ H F − T, has the covariance C = V_x + sⁿ H (V_f + V_d) Hᴴ s̄ⁿ: noise of the responses, noise of
//! the measured forces, and forces that act and are not measured, such as those of what is not linear in the structure.
//! The parameters minimise Σ eᴴ C⁻¹ e with V_f's part of C moving along, which is maximum likelihood over the unknown
//! true forces. Noise is white within the band, one variance per channel and record, found from what is left ([`noise`]).

mod equations;
mod line;
mod noise;

#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector, Matrix3};
use num_complex::Complex64;
use serde::Serialize;

use super::covariance::constrained_inverse;
use super::pole_residue::{PoleResidue, Refined, Shaped, step};
use super::{ModalModel, ModesError, shape, warnings};
use equations::{Equations, equations};
use line::Line;
use quietcut_frf::{ChannelLines, RecordSpectra};
use quietcut_model::structure::Direction;

/// Lines of all records from which on a fit would take minutes.
const LINES_MAX: usize = 200_000;

/// Fewest lines of a record.
const LINES_MIN: usize = 16;

/// Rounds in which parameters and variances of noise find each other, and the relative change of the variances at which
/// they have.
const ROUNDS: usize = 30;
const SAME_NOISE: f64 = 1e-3;

const STEPS_MAX: usize = 100;
const DAMPING_MAX: f64 = 1e12;

/// Relative decrease of the squares below which they are least.
const SETTLED: f64 = 1e-9;

/// Coefficients of the polynomial of a transient.
const SMOOTH: usize = 3;

/// Noise that was found on a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelNoise {
    /// The recording.
    pub recording: String,
    /// The channel.
    pub channel: String,
    /// Standard deviation of a sample, if it is white over all frequencies, SI.
    pub deviation: f64,
    /// The same in percent of the channel's root mean square.
    pub percent: f64,
}

/// The unknowns: the structure and the transient of each record.
#[derive(Clone)]
struct Unknowns {
    structure: PoleResidue,
    transients: Vec<Transient>,
}

/// T_p(s) = Σ_r c_pr/(s − λ_r) + conjugate at the conjugate pole + Σ_j a_pj (s/i s₀)ʲ iʲ of the responses p of one record.
#[derive(Clone)]
struct Transient {
    /// c by response and mode.
    residues: Vec<Vec<Complex64>>,
    /// a by response.
    smooth: Vec<[f64; SMOOTH]>,
}

/// Everything that does not change in a fit.
struct Data<'a> {
    records: &'a [RecordSpectra],
    /// Response and force of each of the outside terms of the structure.
    places: Vec<(usize, usize)>,
    /// Index in the right shape of each response, and in the left shape of each force, by record.
    axes: Vec<(Vec<usize>, Vec<usize>)>,
    /// 2π times the middle of the band, rad/s: the unit of the polynomials.
    omega: f64,
}

/// Variances per line of the noise of one record.
#[derive(Clone, Debug)]
struct Variances {
    /// Of the sensors of responses.
    responses: Vec<f64>,
    /// Of what looks like noise of the forces: V_f and V_d together.
    forces: Vec<f64>,
    /// The part that is in the measured forces: V_f; the rest is V_d.
    measured: Vec<f64>,
    /// sⁿ H V_d Hᴴ s̄ⁿ by line, of the structure of the round before.
    disturbance: Vec<Matrix3<Complex64>>,
}

/// Refines the modes of `model`, which come from averaged receptances, on the records themselves.
///
/// # Errors
/// Other directions than those of the model, too few or too many lines, a fit that does not converge.
pub fn refine_by_records(
    model: &ModalModel,
    records: &[RecordSpectra],
) -> Result<(ModalModel, Vec<ChannelNoise>), ModesError> {
    let data = Data::new(model, records)?;
    let broke = || ModesError::NotConverged(model.modes.len());
    let mut unknowns = data.start(model);
    let mut variances: Vec<Variances> = (0..records.len())
        .map(|record| noise::start(&data, record, &unknowns))
        .collect();
    for _ in 0..ROUNDS {
        unknowns = least_squares(&data, &variances, unknowns).ok_or_else(broke)?;
        let mut change = 0.0_f64;
        for (record, variances) in variances.iter_mut().enumerate() {
            change = change.max(noise::again(&data, record, &unknowns, variances));
        }
        if change < SAME_NOISE {
            break;
        }
    }
    let unknowns = least_squares(&data, &variances, unknowns).ok_or_else(broke)?;
    let refined = finished(&data, &variances, unknowns).ok_or_else(broke)?;
    Ok((updated(&data, model, &refined), data.found(&variances)))
}

impl<'a> Data<'a> {
    fn new(model: &ModalModel, records: &'a [RecordSpectra]) -> Result<Self, ModesError> {
        let lines: usize = records.iter().map(|record| record.frequency_hz.len()).sum();
        if lines > LINES_MAX {
            return Err(ModesError::Data(format!(
                "the records have {lines} lines in the band, at most {LINES_MAX} can be fitted; give a narrower --band-hz about the modes"
            )));
        }
        let index = |all: &[Direction], channels: &[ChannelLines]| -> Option<Vec<usize>> {
            let of = |channel: &ChannelLines| all.iter().position(|known| *known == channel.direction);
            channels.iter().map(of).collect()
        };
        let mut axes = Vec::new();
        for record in records {
            let found = (
                index(&model.responses, &record.responses),
                index(&model.forces, &record.forces),
            );
            let (Some(responses), Some(forces)) = found else {
                return Err(ModesError::Data(format!(
                    "{} has other directions than the receptances",
                    record.path.display()
                )));
            };
            if record.frequency_hz.len() < LINES_MIN {
                return Err(ModesError::Data(format!(
                    "{} has {} lines in the band; at least {LINES_MIN} are needed",
                    record.path.display(),
                    record.frequency_hz.len()
                )));
            }
            axes.push((responses, forces));
        }
        let place = |(response, force): (Direction, Direction)| {
            let p = model.responses.iter().position(|known| *known == response)?;
            Some((p, model.forces.iter().position(|known| *known == force)?))
        };
        let hertz: f64 = records.iter().flat_map(|record| &record.frequency_hz).sum();
        Ok(Self {
            records,
            places: model
                .outside
                .iter()
                .filter_map(|&(response, force, _)| place((response, force)))
                .collect(),
            axes,
            omega: std::f64::consts::TAU * hertz / lines.max(1) as f64,
        })
    }

    fn start(&self, model: &ModalModel) -> Unknowns {
        let modes = model.modes.iter().map(|found| Shaped {
            pole: found.mode.pole(),
            right: found.mode.right.clone(),
            left: found.mode.left.clone(),
        });
        let transient = |(responses, _): &(Vec<usize>, Vec<usize>)| Transient {
            residues: vec![vec![Complex64::ZERO; model.modes.len()]; responses.len()],
            smooth: vec![[0.0; SMOOTH]; responses.len()],
        };
        Unknowns {
            structure: PoleResidue {
                modes: modes.collect(),
                outside: model.outside.iter().map(|(.., values)| *values).collect(),
            },
            transients: self.axes.iter().map(transient).collect(),
        }
    }

    fn found(&self, variances: &[Variances]) -> Vec<ChannelNoise> {
        let mut found = Vec::new();
        for (record, variances) in self.records.iter().zip(variances) {
            let forces = record.forces.iter().zip(&variances.forces);
            for (channel, variance) in forces.chain(record.responses.iter().zip(&variances.responses)) {
                let deviation = variance.sqrt();
                found.push(ChannelNoise {
                    recording: record.path.display().to_string(),
                    channel: channel.name.clone(),
                    deviation,
                    percent: 100.0 * deviation / channel.root_mean_square,
                });
            }
        }
        found
    }
}

impl Unknowns {
    /// Each record's transient after the structure: residues by response and mode, then polynomials.
    fn moved(&self, structure: &DVector<f64>, transients: &[DVector<f64>]) -> Self {
        let mut moved = self.clone();
        moved.structure = self.structure.moved(structure.as_slice());
        for (transient, step) in moved.transients.iter_mut().zip(transients) {
            let mut values = step.iter();
            let mut next = || values.next().copied().unwrap_or(0.0);
            for residue in transient.residues.iter_mut().flatten() {
                *residue += Complex64::new(next(), next());
            }
            for value in transient.smooth.iter_mut().flatten() {
                *value += next();
            }
        }
        moved
    }
}

impl Transient {
    /// How many numbers it is.
    fn width(&self) -> usize {
        self.residues.iter().map(|row| 2 * row.len() + SMOOTH).sum()
    }
}

/// Σ eᴴ C⁻¹ e.
fn squares(data: &Data<'_>, variances: &[Variances], unknowns: &Unknowns) -> f64 {
    let of_record = |record: usize| -> f64 {
        (0..data.records[record].frequency_hz.len())
            .map(|k| {
                let line = Line::of(data, record, unknowns, &variances[record], k);
                line.map_or(f64::INFINITY, |line| line.square)
            })
            .sum()
    };
    (0..data.records.len()).map(of_record).sum()
}

/// Levenberg and Marquardt; transients are eliminated record by record.
fn least_squares(data: &Data<'_>, variances: &[Variances], mut unknowns: Unknowns) -> Option<Unknowns> {
    let mut least = squares(data, variances, &unknowns);
    let mut damping = 1e-3;
    for _ in 0..STEPS_MAX {
        let all: Vec<Equations> = (0..data.records.len())
            .map(|record| equations(data, record, &unknowns, &variances[record]))
            .collect::<Option<_>>()?;
        let size = unknowns.structure.parameters().len();
        let (mut normal, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for of_record in &all {
            normal += &of_record.normal;
            gradient += &of_record.gradient;
        }
        let before = least;
        while damping < DAMPING_MAX {
            if let Some(step) = step(&normal, &gradient, damping) {
                let transients: Vec<DVector<f64>> =
                    all.iter().map(|of_record| of_record.transient(&step)).collect();
                let next = unknowns.moved(&step, &transients);
                let then = squares(data, variances, &next);
                if then <= least {
                    (unknowns, least) = (next, then);
                    damping = (0.1 * damping).max(1e-9);
                    break;
                }
            }
            damping *= 10.0;
        }
        if damping >= DAMPING_MAX || before - least <= SETTLED * before {
            return least.is_finite().then_some(unknowns);
        }
    }
    None
}

/// The fit with its covariance B⁻¹ M B⁻¹: M is that of the gradient, which the noise of the estimated forces makes larger
/// than the curvature B of half the squares.
fn finished(data: &Data<'_>, variances: &[Variances], mut unknowns: Unknowns) -> Option<Refined> {
    let directions = unknowns
        .structure
        .modes
        .first()
        .map_or((0, 0), |mode| (mode.right.len(), mode.left.len()));
    let shared = data.shared(directions);
    for mode in &mut unknowns.structure.modes {
        shape::normalize(&mut mode.right, &mut mode.left, &shared);
    }
    let size = unknowns.structure.parameters().len();
    let mut of_gradient = DMatrix::<f64>::zeros(size, size);
    let mut curvature = DMatrix::<f64>::zeros(size, size);
    for (record, variances) in variances.iter().enumerate() {
        let equations = equations(data, record, &unknowns, variances)?;
        of_gradient += &equations.normal;
        curvature += &equations.normal;
        curvature -= equations::of_force_noise(data, record, &unknowns, variances)?;
    }
    let bread = constrained_inverse(&unknowns.structure, &shared, &curvature)?;
    // Of a complex number of variance 1, what goes along a direction has a variance of ½.
    let covariance = &bread * (0.5 * of_gradient) * &bread;
    let (mut rest, mut all, mut values) = (0.0, 0.0, 0);
    for (record, spectra) in data.records.iter().enumerate() {
        for k in 0..spectra.frequency_hz.len() {
            let line = Line::of(data, record, &unknowns, &variances[record], k)?;
            let sizes = data.sizes(record);
            for (p, size) in sizes.iter().enumerate() {
                rest += line.left[p].norm_sqr() / size;
                all += 1.0;
                values += 2;
            }
        }
    }
    let unknown = size + unknowns.transients.iter().map(Transient::width).sum::<usize>();
    let freedom = values - unknown.min(values - 1);
    Some(Refined {
        misfit: 2.0 * squares(data, variances, &unknowns) / freedom as f64,
        relative_error: (rest / all).sqrt(),
        fit: unknowns.structure,
        covariance,
    })
}

impl Data<'_> {
    /// Mean square of the lines of each response of a record.
    fn sizes(&self, record: usize) -> Vec<f64> {
        let of = |channel: &ChannelLines| {
            let power: f64 = channel.lines.iter().map(|line| line.norm_sqr()).sum();
            (power / channel.lines.len().max(1) as f64).max(f64::MIN_POSITIVE)
        };
        self.records[record].responses.iter().map(of).collect()
    }

    /// Directions that are both driven and seen, as indices of right and left shape.
    fn shared(&self, (rights, lefts): (usize, usize)) -> Vec<(usize, usize)> {
        let directions = |index: usize, of_response: bool| {
            self.axes.iter().zip(self.records).find_map(|(axes, record)| {
                let (indices, channels) = if of_response {
                    (&axes.0, &record.responses)
                } else {
                    (&axes.1, &record.forces)
                };
                let at = indices.iter().position(|&known| known == index)?;
                Some(channels[at].direction)
            })
        };
        let of_right = |p: usize| directions(p, true);
        let of_left = |q: usize| directions(q, false);
        let pairs = (0..rights).flat_map(|p| (0..lefts).map(move |q| (p, q)));
        pairs
            .filter(|&(p, q)| of_right(p).is_some() && of_right(p) == of_left(q))
            .collect()
    }
}

fn updated(data: &Data<'_>, model: &ModalModel, refined: &Refined) -> ModalModel {
    let mut updated = model.clone();
    updated.modes = (0..refined.fit.modes.len())
        .map(|index| refined.mode(index))
        .collect();
    updated
        .modes
        .sort_by(|a, b| a.mode.frequency_hz.total_cmp(&b.mode.frequency_hz));
    for (k, &(p, q)) in data.places.iter().enumerate() {
        updated.outside[k] = (model.responses[p], model.forces[q], refined.fit.outside[k]);
    }
    updated.fit_error = refined.relative_error;
    updated.misfit = Some(refined.misfit);
    let longest_s = data
        .records
        .iter()
        .map(|record| record.seconds)
        .fold(0.0, f64::max);
    updated.warnings = warnings(longest_s.recip(), &updated);
    updated
}
