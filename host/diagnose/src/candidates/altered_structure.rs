//! Readings of a structure that differs a little from the baseline.
//!
//! With H the receptance and θ a change of the structure, x = H(θ) F, and where Z = H⁻¹ is linear in θ (every structure of
//! mass, damping and stiffness) the residual along the measured motion is exact for changes of any size: x − H F = −θ H
//! (∂Z/∂θ) x = θ (∂H/∂θ) F_eff with F_eff = H⁻¹ x. Where H nearly vanishes (between two modes), F_eff would be noise. It is
//! therefore computed as F_eff = F + H* (x − H F)/(|H|² + ε²), which is near the measured force F there.

use nalgebra::{DMatrix, DVector, Matrix3};
use num_complex::Complex64;
use quietcut_numerics::least_squares::{Idle, NormalEquations};
use rayon::prelude::*;

use crate::baseline::dynamic_stiffness;
use crate::baseline::receptance::Receptance;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::structure::{FirstOrder, Structure};
use quietcut_recording::Quantity;
use quietcut_simulate::Effects;

/// Size of the receptance |H| at which it counts as nearly vanishing, over the root sum of squares of its modal
/// contributions. The regularization ε of the effective force F + H* (x − H F)/(|H|² + ε²) is this number times that
/// root.
const VANISHING: f64 = 0.05;

/// A structure with linear effects.
pub(crate) struct AlteredStructure {
    structure: Structure,
    first_order: FirstOrder,
}

impl AlteredStructure {
    /// `structure` with `effects`.
    ///
    /// # Errors
    /// An effect does not apply to the structure.
    pub(crate) fn new(structure: &Structure, effects: &Effects) -> Result<Self, String> {
        let (dynamics, _) = effects.dynamics(structure).map_err(|error| error.to_string())?;
        Ok(Self {
            structure: effects.altered(structure).map_err(|error| error.to_string())?,
            first_order: dynamics.first_order(),
        })
    }
}

/// Change of the readings of `record`, by channel and sample, between two structures near the baseline, over `change`.
pub(crate) fn response_to(
    study: &Study<'_>,
    record: &Record,
    [below, above]: [&AlteredStructure; 2],
    change: f64,
) -> Vec<Vec<f64>> {
    let baseline = &study.baseline;
    let grid = &record.grid;
    let folded = of_folded_forces(record);
    let bins = if folded.is_some() {
        grid.fine_bins()
    } else {
        grid.bins()
    };
    let difference = difference(study, record, [below, above], bins, change);
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
    record
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
        .collect()
}

/// Difference of the receptances of two structures, or of their dynamic stiffnesses where forces are compared, over
/// `change`.
fn difference(
    study: &Study<'_>,
    record: &Record,
    [below, above]: [&AlteredStructure; 2],
    bins: usize,
    change: f64,
) -> Vec<Matrix3<Complex64>> {
    let (grid, axes) = (&record.grid, &study.baseline.axes);
    let over = Complex64::from(change);
    match record.domain {
        Domain::Response => {
            let (below, above) = (
                Receptance::new(&below.first_order),
                Receptance::new(&above.first_order),
            );
            (0..bins)
                .into_par_iter()
                .map(|bin| {
                    let omega = grid.omega(bin);
                    (above.at(omega) - below.at(omega)) / over
                })
                .collect()
        }
        Domain::Force => {
            let of = |altered: &AlteredStructure| {
                dynamic_stiffness::table(&altered.structure, &altered.first_order, axes, grid)
            };
            of(above)
                .iter()
                .zip(&of(below))
                .map(|(above, below)| (above - below) / over)
                .collect()
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
