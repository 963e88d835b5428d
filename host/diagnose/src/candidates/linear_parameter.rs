//! Mass, stiffness or damping of the structure that differs from the case.
//!
//! Shows: a receptance that differs from the baseline and does not depend on amplitude: above resonance for mass, below
//! it for stiffness, at it for damping. Does not show: harmonics, or response at frequencies without excitation. All
//! three changed by one factor are equivalent to a gain of the only channel of motion. Fit: linear in the relative
//! change. Source: the output-error equation of Pintelon and Schoukens, System Identification (2012).
//!
//! With H the receptance and θ the relative change of the parameter, x = H(θ) F, and where Z = H⁻¹ is linear in θ
//! (every structure of mass, damping and stiffness) the residual along the measured motion is exact for changes of any
//! size: x − H F = −θ H (∂Z/∂θ) x = θ (∂H/∂θ) F_eff with F_eff = H⁻¹ x. Where H nearly vanishes (between two modes),
//! F_eff would be noise. It is therefore computed as F_eff = F + H* (x − H F)/(|H|² + ε²), which is near the measured
//! force F there.

use nalgebra::{DMatrix, DVector, Matrix3};
use num_complex::Complex64;
use quietcut_numerics::least_squares::{Idle, NormalEquations};
use rayon::prelude::*;

use crate::baseline::dynamic_stiffness;
use crate::baseline::receptance::Receptance;
use crate::candidates::cause::{Cause, Location, Parameter, Regressor, Regressors};
use crate::criteria::LEAST_RELATIVE_CHANGE;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::structure::Form;
use quietcut_recording::Quantity;
use quietcut_simulate::Effects;

/// Relative change θ of mass, damping or stiffness in the central differences that give the derivative of the
/// receptance with respect to θ (of the dynamic stiffness if forces are compared). Their relative truncation error is
/// about `STEP`², 1e-8.
const STEP: f64 = 1e-4;
/// Size of the receptance |H| at which it counts as nearly vanishing, over the root sum of squares of its modal
/// contributions. The regularization ε of the effective force F + H* (x − H F)/(|H|² + ε²) is this number times that
/// root.
const VANISHING: f64 = 0.05;

#[derive(Clone, Copy)]
pub(super) enum StructureMatrix {
    Mass,
    Stiffness,
    Damping,
}

pub(super) struct LinearChange(pub(super) StructureMatrix);

impl LinearChange {
    fn key(&self) -> &'static str {
        match self.0 {
            StructureMatrix::Mass => "mass_kg",
            StructureMatrix::Stiffness => "stiffness_n_per_m",
            StructureMatrix::Damping => "damping_ns_per_m",
        }
    }

    /// Diagonal entry of the case's mass, stiffness or damping matrix for the direction of `location`; `None` if the
    /// structure is not given by matrices, or if `location` has no single direction in which the structure moves.
    fn entry(&self, study: &Study<'_>, location: &Location) -> Option<f64> {
        let Form::Matrices(matrices) = &study.baseline.structure.form else {
            return None;
        };
        let directions = &study.baseline.structure.directions;
        let index = directions
            .iter()
            .position(|direction| Some(*direction) == location.direction())?;
        let matrix = match self.0 {
            StructureMatrix::Mass => &matrices.mass,
            StructureMatrix::Stiffness => &matrices.stiffness,
            StructureMatrix::Damping => &matrices.damping,
        };
        Some(matrix[(index, index)])
    }

    fn effect(&self, location: &Location, relative: f64) -> Result<Effects, String> {
        let mut table = location.table();
        table.insert("relative_change".into(), relative.into());
        Effects::of_extension(self.name(), &table).map_err(|error| error.to_string())
    }
}

impl Cause for LinearChange {
    fn effect(&self) -> EffectName {
        match self.0 {
            StructureMatrix::Mass => EffectName::Mass,
            StructureMatrix::Stiffness => EffectName::Stiffness,
            StructureMatrix::Damping => EffectName::Damping,
        }
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        if study.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        let driven = study.driven_axes();
        if study.has_modes() {
            return if driven.is_empty() {
                Vec::new()
            } else {
                vec![Location::Everywhere]
            };
        }
        let mut locations: Vec<Location> = driven
            .iter()
            .map(|axis| Location::Axis(*axis))
            .filter(|location| self.entry(study, location).is_some_and(|entry| entry != 0.0))
            .collect();
        if driven.len() > 1 {
            locations.push(Location::Everywhere);
        }
        locations
    }

    fn regressors(&self, study: &Study<'_>, record: &Record, location: &Location, _: &[f64]) -> Regressors {
        let [below, above] = [-STEP, STEP].map(|step| {
            let effect = self.effect(location, step)?;
            let first_order = study.baseline.altered(&effect);
            Ok::<_, String>((effect, first_order.map_err(|error| error.to_string())?))
        });
        let ((below_effect, below), (above_effect, above)) = (below?, above?);
        let baseline = &study.baseline;
        let grid = &record.grid;
        let folded = of_folded_forces(record);
        let bins = if folded.is_some() {
            grid.fine_bins()
        } else {
            grid.bins()
        };
        let difference: Vec<Matrix3<Complex64>> = match record.domain {
            Domain::Response => {
                let (below, above) = (Receptance::new(&below), Receptance::new(&above));
                (0..bins)
                    .into_par_iter()
                    .map(|bin| {
                        let omega = grid.omega(bin);
                        (above.at(omega) - below.at(omega)) / Complex64::from(2.0 * STEP)
                    })
                    .collect()
            }
            Domain::Force => {
                let of = |effect: &Effects, first_order| {
                    let structure = baseline
                        .effects
                        .clone()
                        .and(effect)
                        .altered(baseline.structure)
                        .map_err(|error| error.to_string())?;
                    Ok::<_, String>(dynamic_stiffness::table(
                        &structure,
                        first_order,
                        &baseline.axes,
                        grid,
                    ))
                };
                let (below, above) = (of(&below_effect, &below)?, of(&above_effect, &above)?);
                above
                    .iter()
                    .zip(&below)
                    .map(|(above, below)| (above - below) / Complex64::from(2.0 * STEP))
                    .collect()
            }
        };
        let into = match record.domain {
            Domain::Response => {
                let mut force = effective_force(study, record);
                for (force, beyond) in force.iter_mut().zip(folded.into_iter().flatten()) {
                    let known = force.len();
                    force.extend(beyond.into_iter().flatten().skip(known));
                    force.resize(bins, Complex64::ZERO);
                }
                force
            }
            Domain::Force => record.displacement.clone(),
        };
        let observed = record
            .channels
            .iter()
            .map(|channel| {
                let spectrum: Vec<Complex64> = (0..bins)
                    .map(|bin| {
                        let mut sum = Complex64::ZERO;
                        for (axis, weight) in channel.pickup.weights.iter().enumerate() {
                            if *weight == 0.0 {
                                continue;
                            }
                            for &from in &baseline.axes {
                                sum += difference[bin][(axis, from)] * into[from][bin] * *weight;
                            }
                        }
                        match record.domain {
                            Domain::Response => sum * record.factor(channel, bin),
                            Domain::Force => sum,
                        }
                    })
                    .collect();
                if bins > grid.bins() {
                    grid.samples_of_fine(&spectrum)
                } else {
                    grid.samples(&spectrum)
                }
            })
            .collect();
        Ok(vec![Regressor::of_channels(observed)])
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let relative = *coefficients.first()?;
        if relative <= LEAST_RELATIVE_CHANGE {
            return None;
        }
        Some(match self.entry(study, location) {
            Some(entry) => vec![(self.key(), entry * (1.0 + relative))],
            None => vec![("relative_change", relative)],
        })
    }

    fn also(&self, study: &Study<'_>, _: &Location, parameters: &[Parameter]) -> Vec<Parameter> {
        let [("relative_change", relative)] = parameters else {
            return Vec::new();
        };
        let Form::Modes(modes) = &study.baseline.structure.form else {
            return Vec::new();
        };
        let [mode] = modes.as_slice() else {
            return Vec::new();
        };
        match self.0 {
            StructureMatrix::Mass => vec![("frequency_hz", mode.frequency_hz / (1.0 + relative).sqrt())],
            StructureMatrix::Stiffness => vec![("frequency_hz", mode.frequency_hz * (1.0 + relative).sqrt())],
            StructureMatrix::Damping => vec![("damping_ratio", mode.damping_ratio * (1.0 + relative))],
        }
    }
}

/// Spectra of the baseline's cutting forces on the upsampled grid, by axis, for a cut with measured acceleration;
/// otherwise `None`. Above half the sample rate the structure responds as a mass, and sampling folds its acceleration
/// into the band.
fn of_folded_forces(record: &Record) -> Option<[Option<Vec<Complex64>>; 3]> {
    let cut = record.cut.as_ref()?;
    record
        .channels
        .iter()
        .any(|channel| channel.pickup.quantity == Quantity::Acceleration)
        .then(|| record.cut_spectra(&cut.force))
}

/// The force F_eff = F + H*(x − H F)/(|H|² + ε²) that explains the estimated displacement x of the tool, N: by axis and
/// frequency bin. F is the force that excites the structure (measured, or predicted in a cut; 0 along an axis without
/// force), H the receptance of the baseline, and ε keeps the division regular where H nearly vanishes. With several
/// axes H is a matrix, and H*(…)/(|H|² + ε²) stands for H*(H H* + ε²)⁻¹(…). F_eff is 0 in a bin where that inverse does
/// not exist.
fn effective_force(study: &Study<'_>, record: &Record) -> [Vec<Complex64>; 3] {
    let baseline = &study.baseline;
    let (axes, grid) = (&baseline.axes, &record.grid);
    let measured: [Option<Vec<Complex64>>; 3] = std::array::from_fn(|axis| {
        (!record.force_n[axis].is_empty()).then(|| grid.spectrum(&record.force_n[axis]))
    });
    let size = axes.len();
    let found: Vec<[Complex64; 3]> = (0..grid.bins())
        .into_par_iter()
        .map(|bin| {
            let force = DVector::from_fn(size, |i, _| {
                measured[axes[i]]
                    .as_ref()
                    .map_or(Complex64::ZERO, |force| force[bin])
            });
            let h = DMatrix::from_fn(size, size, |i, j| record.transfer[bin][(axes[i], axes[j])]);
            let x = DVector::from_fn(size, |i, _| record.displacement[axes[i]][bin]);
            let left = x - &h * &force;
            let omega = grid.omega(bin);
            let mut normal = &h * h.adjoint();
            for i in 0..size {
                let vanishing = VANISHING * baseline.receptance.size_at(omega, axes[i]);
                normal[(i, i)] += Complex64::from(vanishing * vanishing);
            }
            let mut whole = [Complex64::ZERO; 3];
            if let Some(equations) = NormalEquations::new(&normal, 0.0, Idle::Refuse) {
                let added = h.adjoint() * equations.solve(&left);
                for i in 0..size {
                    whole[axes[i]] = force[i] + added[i];
                }
            }
            whole
        })
        .collect();
    std::array::from_fn(|axis| found.iter().map(|force| force[axis]).collect())
}
