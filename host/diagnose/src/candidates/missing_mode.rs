//! A further mode in the receptance of the tool along one axis: the displacement y changes by F/(m·(ω_m² − ω² + 2iζω_m
//! ω)), which is exact if F is a measured force along the axis.
//!
//! Shows: a resonance with its phase at a frequency where the case has none, the same at all levels of excitation. Does
//! not show: harmonics, or a dependence on amplitude. A mode far outside the band of the records acts as a small
//! stiffness or mass (the residual terms of a modal fit). Fit: linear in 1/m, the inverse modal mass; ω_m and ζ are
//! nonlinear parameters. Source: Ewins, Modal Testing (2000), ch. 4.
//!
//! A free decay without measured force is taken to start from static deflection: the mode begins at rest at its
//! deflection under the static force F₀ = H(0)⁻¹ u(0), with the initial displacement u(0) of the baseline, and y
//! changes by F₀/(m ω_m²)·e^(−ζω_m t)·(cos ω_d t + ζω_m/ω_d · sin ω_d t), ω_d = ω_m √(1 − ζ²).

use nalgebra::Vector3;
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

use crate::baseline::derivatives;
use crate::candidates::cause::{Cause, Location, Parameter, Regressor, Regressors, WRONG_LOCATION};
use crate::candidates::closed_loop::{holding_force_n, starts_anywhere};
use crate::records::channel::Observed;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

pub(super) struct MissingMode;

/// Damping ratios of a missing mode with which its frequency is searched.
const DAMPING: [f64; 3] = [0.008, 0.025, 0.08];
/// Number of candidate modes (frequency, damping ratio) that are kept as start values of a missing mode: those at the
/// largest peaks, over frequency, of the reduction of the residual energy.
const KEPT: usize = 4;

impl Cause for MissingMode {
    fn effect(&self) -> EffectName {
        EffectName::MissingMode
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        if !study.all_in(Domain::Response) || study.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        study
            .driven_axes()
            .into_iter()
            .filter(|axis| {
                study
                    .records
                    .iter()
                    .any(|record| !record.force_n[*axis].is_empty() || is_free_decay_along(record, *axis))
            })
            .map(Location::Axis)
            .collect()
    }

    fn nonlinear_grid(&self, study: &Study<'_>, location: &Location) -> Vec<Vec<f64>> {
        let residual: Vec<Vec<Vec<f64>>> = study
            .records
            .iter()
            .map(|record| record.channels.iter().map(Observed::residual).collect())
            .collect();
        self.nonlinear_grid_beside(study, location, &residual)
    }

    /// Pairs of frequency, Hz, and damping ratio of one further mode at the `KEPT` largest peaks, over frequency, of
    /// its reduction of the energy of the residual `left`, the largest first.
    fn nonlinear_grid_beside(
        &self,
        study: &Study<'_>,
        location: &Location,
        left: &[Vec<Vec<f64>>],
    ) -> Vec<Vec<f64>> {
        let Location::Axis(axis) = location else {
            return Vec::new();
        };
        let [[low, high], _] = self.bounds(study, location)[..] else {
            return Vec::new();
        };
        let count = 160;
        let (bins, free_decays) = (bins(study, *axis, left), free_decays(study, *axis, left));
        let chi_square_reduction: Vec<Vec<(f64, Vec<f64>)>> = DAMPING
            .par_iter()
            .map(|damping| {
                (0..count)
                    .map(|index| {
                        let frequency = low * (high / low).powf(f64::from(index) / f64::from(count - 1));
                        let reduction = chi_square_reduction(&bins, &free_decays, frequency, *damping);
                        (reduction, vec![frequency, *damping])
                    })
                    .collect()
            })
            .collect();
        let mut peaks: Vec<(f64, Vec<f64>)> = Vec::new();
        for of_damping in chi_square_reduction {
            for (index, (value, nonlinear_parameters)) in of_damping.iter().enumerate() {
                let below = |other: Option<&(f64, Vec<f64>)>| other.is_none_or(|other| other.0 <= *value);
                let before = index.checked_sub(1).and_then(|index| of_damping.get(index));
                if below(before) && below(of_damping.get(index + 1)) {
                    peaks.push((*value, nonlinear_parameters.clone()));
                }
            }
        }
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        peaks.truncate(KEPT);
        peaks
            .into_iter()
            .map(|(_, nonlinear_parameters)| nonlinear_parameters)
            .collect()
    }

    fn bounds(&self, study: &Study<'_>, _: &Location) -> Vec<[f64; 2]> {
        let rate = study
            .records
            .iter()
            .map(|record| record.grid.rate_hz())
            .fold(f64::INFINITY, f64::min);
        let longest = study
            .records
            .iter()
            .map(|record| record.grid.count() as f64 / record.grid.rate_hz())
            .fold(0.0, f64::max);
        let highest = study
            .records
            .iter()
            .map(|record| record.highest_hz)
            .fold(0.0, f64::max);
        let low = (3.0 / longest).min(0.1 * highest);
        vec![[low, (2.0 * highest).min(0.45 * rate)], [0.001, 0.5]]
    }

    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        let (Location::Axis(axis), [frequency, damping]) = (location, nonlinear_parameters) else {
            return Err(WRONG_LOCATION.into());
        };
        if is_free_decay_along(record, *axis) {
            let force_n = static_force_n(study, record).ok_or(
                "the static force before the free decay cannot be computed: the static stiffness is singular",
            )?[*axis];
            let count = record.grid.count();
            let of = |channel| free_decay_of_mode(record, channel, *axis, force_n, [*frequency, *damping]);
            let observed = record
                .channels
                .iter()
                .map(|channel| of(channel).take(count).collect())
                .collect();
            return Ok(vec![Regressor::of_channels(observed)]);
        }
        let force = &record.force_n[*axis];
        let observed = record
            .channels
            .iter()
            .map(|channel| {
                let weight = channel.pickup.weights[*axis];
                if force.is_empty() || weight == 0.0 {
                    return Vec::new();
                }
                let mut spectrum = record.grid.spectrum(force);
                for (bin, value) in spectrum.iter_mut().enumerate() {
                    let omega = record.grid.omega(bin);
                    *value *= mode(omega, *frequency, *damping) * record.factor(channel, bin) * weight;
                }
                record.grid.samples(&spectrum)
            })
            .collect();
        Ok(vec![Regressor::of_channels(observed)])
    }

    /// Frequency, damping ratio and modal mass of the missing mode. `None` if the modal mass is not positive, if
    /// `location` is no axis, or if the baseline has a mode of smaller modal mass along the axis whose half-power
    /// bandwidth overlaps with that of the missing mode: the fit then describes a change of the baseline's mode.
    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        nonlinear_parameters: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let per_mass = *coefficients.first()?;
        let (Location::Axis(axis), natural) = (location, TAU * nonlinear_parameters[0]) else {
            return None;
        };
        let is_known = study
            .baseline
            .receptance
            .modes_along(*axis)
            .any(|(pole, known_per_mass)| {
                (pole.norm() - natural).abs() < -pole.re + nonlinear_parameters[1] * natural
                    && per_mass < known_per_mass
            });
        (per_mass > 0.0 && !is_known).then(|| {
            vec![
                ("frequency_hz", nonlinear_parameters[0]),
                ("damping_ratio", nonlinear_parameters[1]),
                ("modal_mass_kg", 1.0 / per_mass),
            ]
        })
    }
}

/// 1/(ω_m² − ω² + 2iζω_m ω): the receptance, m/N, of a mode with modal mass 1 kg.
fn mode(omega: f64, frequency_hz: f64, damping_ratio: f64) -> Complex64 {
    let natural = TAU * frequency_hz;
    Complex64::new(
        natural * natural - omega * omega,
        2.0 * damping_ratio * natural * omega,
    )
    .inv()
}

/// True for a free decay whose force along `axis` is not measured.
fn is_free_decay_along(record: &Record, axis: usize) -> bool {
    starts_anywhere(record) && record.force_n[axis].is_empty()
}

/// The static force along x, y and z that held the baseline in the fitted initial state of a record's free decay, N;
/// `None` if it cannot be computed.
fn static_force_n(study: &Study<'_>, record: &Record) -> Option<Vector3<f64>> {
    holding_force_n(study, &study.baseline.first_order, &record.decays.start)
}

/// Samples of a channel that reads the free decay of a mode with modal mass 1 kg. The mode starts at rest at its
/// deflection under the static force `force_n` along `axis`; the samples do not end.
fn free_decay_of_mode<'a>(
    record: &'a Record,
    channel: &'a Observed,
    axis: usize,
    force_n: f64,
    [frequency_hz, damping_ratio]: [f64; 2],
) -> impl Iterator<Item = f64> + 'a {
    let natural = TAU * frequency_hz;
    let pole = natural * Complex64::new(-damping_ratio, (1.0 - damping_ratio * damping_ratio).sqrt());
    // Modal displacement η(t) = η(0)·Re[−λ̄/(i ω_d)·e^(λt)] with the pole λ = −ζω_m + iω_d: it starts at η(0) with zero
    // velocity.
    let start = -pole.conj() / Complex64::new(0.0, pole.im)
        * pole.powi(derivatives(channel.pickup.quantity))
        * channel.pickup.dynamics(pole);
    let size = channel.pickup.weights[axis] * force_n / (natural * natural);
    let since = move |sample: usize| sample as f64 / record.grid.rate_hz() - channel.pickup.delay_s;
    (0_usize..).map(move |sample| match since(sample) {
        t if t < 0.0 => 0.0,
        t => size * (start * (pole * t).exp()).re,
    })
}

/// A free decay and a channel that reads `axis`: record, channel, residual of the channel, axis, and static force along
/// the axis, N.
type FreeDecay<'a> = (&'a Record, &'a Observed, &'a [f64], usize, f64);

fn free_decays<'a>(study: &'a Study<'_>, axis: usize, left: &'a [Vec<Vec<f64>>]) -> Vec<FreeDecay<'a>> {
    let mut all = Vec::new();
    for (record, left) in study.records.iter().zip(left) {
        let Some(force) = static_force_n(study, record).filter(|_| is_free_decay_along(record, axis)) else {
            continue;
        };
        let reads = |(channel, _): &(&Observed, _)| channel.pickup.weights[axis] != 0.0;
        for (channel, left) in record.channels.iter().zip(left).filter(reads) {
            all.push((record, channel, &left[..], axis, force[axis]));
        }
    }
    all
}

/// One frequency bin of a channel: ω in rad/s; the spectrum of the exciting force as the channel would read it if it
/// were the displacement (weight and dynamics of the sensor included); the spectrum of the residual. Both spectra are
/// divided by the standard deviation of the channel's noise.
type Bin = (f64, Complex64, Complex64);

fn bins(study: &Study<'_>, axis: usize, left: &[Vec<Vec<f64>>]) -> Vec<Bin> {
    let mut all = Vec::new();
    let forced = |(record, _): &(&Record, _)| !record.force_n[axis].is_empty();
    for (record, left) in study.records.iter().zip(left).filter(forced) {
        let force = record.grid.spectrum(&record.force_n[axis]);
        let reads = |(channel, _): &(&Observed, _)| channel.pickup.weights[axis] != 0.0;
        for (channel, left) in record.channels.iter().zip(left).filter(reads) {
            let residual = record.grid.spectrum(left);
            for bin in 1..record.grid.bins() {
                let omega = record.grid.omega(bin);
                if omega > TAU * record.band_hz {
                    break;
                }
                let read = force[bin] * channel.factor(omega) * channel.pickup.weights[axis];
                all.push((omega, read / channel.deviation, residual[bin] / channel.deviation));
            }
        }
    }
    all
}

/// Reduction of the residual energy by a missing mode of this frequency and damping ratio, with the modal mass that
/// fits best; 0 if that mass is not positive. For free decays alone it is that of χ²; bins count with the energy of the
/// unnormalized spectrum.
fn chi_square_reduction(
    bins: &[Bin],
    free_decays: &[FreeDecay<'_>],
    frequency_hz: f64,
    damping_ratio: f64,
) -> f64 {
    let (mut along, mut size) = (0.0, 0.0);
    for (omega, force, residual) in bins {
        let column = mode(*omega, frequency_hz, damping_ratio) * force;
        along += (column.conj() * residual).re;
        size += column.norm_sqr();
    }
    for (record, channel, residual, axis, force_n) in free_decays {
        let column = free_decay_of_mode(record, channel, *axis, *force_n, [frequency_hz, damping_ratio]);
        for (column, residual) in column.zip(residual.iter()) {
            let power = channel.deviation * channel.deviation;
            along += column * residual / power;
            size += column * column / power;
        }
    }
    if size > 0.0 && along > 0.0 {
        along * along / size
    } else {
        0.0
    }
}
