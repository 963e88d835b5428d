//! The restoring-force surface f_r(q̇, q) = f − m q̈ (thesis eq. 5.4), its slices, and the force law fitted to it.
//!
//! If a force acts, the law is fitted by least squares between force and motion *within a band* of frequencies. Force
//! and every term of the law, nonlinear terms included, pass the same filter: the filtered signals satisfy the same
//! equation, and noise of derivatives outside the band has no effect. If the law has a stiffness term k q, the error of
//! the force is weighted by the receptance of the law and becomes an error of the *motion*, which carries the noise
//! (Sanathanan–Koerner weighting). A free decay is fitted in weak form. One motion channel is sufficient; displacement,
//! velocity and acceleration follow from it by differentiation or integration.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::{LinearProblem, invert_normal_equations};

use crate::criteria::{BAND_SIGNAL_TO_NOISE, LEAST_SLICE_SAMPLES, SAMPLES_PER_TERM};
use crate::nonlinear::spectrum::{Spectral, band_of, dominant_frequency_hz};
use quietcut_numerics::statistics::NINETY_PERCENT;
use quietcut_recording::Quantity;

/// A term of a force law f(q, q̇, q̈) along one direction q.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ForceTerm {
    /// m q̈.
    Mass,
    /// c q̇.
    Damping,
    /// k q.
    Stiffness,
    /// k2 q².
    QuadraticStiffness,
    /// k3 q³.
    CubicStiffness,
    /// k5 q⁵.
    QuinticStiffness,
    /// c3 q̇³.
    CubicDamping,
    /// fc sign(q̇).
    CoulombFriction,
    /// A constant force, N.
    Offset,
}

impl ForceTerm {
    /// Key of the term in JSON answers and case files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Mass => "mass_kg",
            Self::Damping => "damping_ns_per_m",
            Self::Stiffness => "stiffness_n_per_m",
            Self::QuadraticStiffness => "k2_n_per_m2",
            Self::CubicStiffness => "k3_n_per_m3",
            Self::QuinticStiffness => "k5_n_per_m5",
            Self::CubicDamping => "c3_ns3_per_m3",
            Self::CoulombFriction => "fc_n",
            Self::Offset => "offset_n",
        }
    }

    /// Regressor of the term (its force per unit coefficient) at the displacement x, velocity v and acceleration a.
    pub fn value(self, x: f64, v: f64, a: f64) -> f64 {
        match self {
            Self::Mass => a,
            Self::Damping => v,
            Self::Stiffness => x,
            Self::QuadraticStiffness => x * x,
            Self::CubicStiffness => x * x * x,
            Self::QuinticStiffness => x.powi(5),
            Self::CubicDamping => v * v * v,
            Self::CoulombFriction => {
                if v == 0.0 {
                    0.0
                } else {
                    v.signum()
                }
            }
            Self::Offset => 1.0,
        }
    }
}

/// A record of force and motion along one direction.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// Force on the structure, N.
    pub force: &'a [f64],
    /// The measured motion, SI units; `quantity` states whether it is displacement, velocity or acceleration.
    pub motion: &'a [f64],
    /// Quantity of the measured motion: displacement, velocity or acceleration.
    pub quantity: Quantity,
    /// Samples per second.
    pub rate_hz: f64,
}

/// Settings of the fit of a force law to a record, and of its restoring-force surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The terms of the law.
    pub terms: Vec<ForceTerm>,
    /// Given moving mass, kg; `None` if the fit determines it. Required for a record without force.
    pub mass_kg: Option<f64>,
    /// Frequency band in which the force law is fitted, Hz. With a force, `None` takes the band in which the measured
    /// motion exceeds its noise; if velocity or acceleration is measured, a given band too starts at a quarter of the
    /// dominant frequency at least. For a free decay, `None` takes a third to five thirds of the frequency of the
    /// largest spectral line.
    pub band_hz: Option<[f64; 2]>,
    /// Duration that is left out of the fit and the surface at each end of the record, s; at most a quarter of the
    /// record at each end. Of a free decay only the surface is trimmed.
    pub trim_s: f64,
}

/// Displacement, velocity and acceleration of a structure along one direction at the samples of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Displacement, m.
    pub x: Vec<f64>,
    /// Velocity, m/s.
    pub v: Vec<f64>,
    /// Acceleration, m/s².
    pub a: Vec<f64>,
}

/// Result of the fit to a record: the force law, and the restoring-force surface.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The fitted terms.
    pub terms: Vec<ForceTerm>,
    /// Coefficients of the terms, in the order of `terms`, SI units.
    pub theta: DVector<f64>,
    /// Standard deviations of the coefficients, in the order of `terms`, from the residual and its correlation in time;
    /// for a free decay from the scatter of fits without one part of it, and of fits with other bands.
    pub deviations: DVector<f64>,
    /// NRMSE of the force within the band: RMS of the residual over RMS of the force, or of m q̈ in a record without
    /// force.
    pub force_error: f64,
    /// Frequency band in which the force law was fitted, Hz.
    pub band_hz: [f64; 2],
    /// Motion at the samples of the record, without the trimmed ends.
    pub motion: Motion,
    /// Restoring force f_r = f − m q̈ at the samples of `motion`, N.
    pub restoring_n: Vec<f64>,
}

/// Reason why the fit of a force law to a record gives no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// The record has no force and the mass is not given.
    #[error(
        "no force acts in the record, so that only ratios to the mass can be found; give the mass (--mass-kg)"
    )]
    NoForce,
    /// The record has too few samples for the fit of the force law.
    #[error("{samples} samples are too few for {terms} terms; at least {needed} are needed")]
    TooShort {
        /// Number of samples: after trimming with a force, of the whole record for a free decay.
        samples: usize,
        /// Number of terms.
        terms: usize,
        /// Number of samples needed.
        needed: usize,
    },
    /// The fitted moving mass is not positive.
    #[error(
        "the fitted mass is {mass_kg} kg, and no structure has it: force and motion do not belong together; check the signs and units of both channels, whether the sensor sits where the force acts, and --band-hz, which must contain the resonance"
    )]
    NoMass {
        /// The fitted mass, kg.
        mass_kg: f64,
    },
    /// The record does not determine the coefficients of all terms.
    #[error("the record does not determine all terms; leave some out, or excite more strongly")]
    Undetermined,
}

/// Number of rounds of Sanathanan–Koerner weighting in the fit of a force law. A choice: the last round changes nothing
/// noticeable.
const REWEIGHTINGS: usize = 4;

impl Record<'_> {
    /// Displacement, velocity and acceleration of the record within `band_hz`, from its measured motion.
    pub fn motion(&self, band_hz: [f64; 2]) -> Motion {
        let spectral = Spectral::new(self.motion.len(), self.rate_hz);
        let measured = self.derivatives();
        let of = |order: i32| spectral.derivative(self.motion, order, band_hz);
        Motion {
            x: of(-measured),
            v: of(1 - measured),
            a: of(2 - measured),
        }
    }

    /// Order of the time derivative of the displacement that is measured: 1 for velocity, 2 for acceleration, otherwise
    /// 0.
    pub(super) fn derivatives(&self) -> i32 {
        match self.quantity {
            Quantity::Velocity => 1,
            Quantity::Acceleration => 2,
            _ => 0,
        }
    }

    /// True if the force is zero at all samples, as in a free decay.
    pub(super) fn is_free(&self) -> bool {
        self.force.iter().all(|force| *force == 0.0)
    }

    /// Fits the force law to a record with a force and computes its restoring-force surface.
    ///
    /// # Errors
    /// See [`SurfaceError`].
    pub(super) fn driven_surface(&self, options: &Options) -> Result<Surface, SurfaceError> {
        let mut band_hz = options
            .band_hz
            .unwrap_or_else(|| band_of(self.motion, self.rate_hz, BAND_SIGNAL_TO_NOISE));
        let dominant_hz = dominant_frequency_hz(self.motion, self.rate_hz);
        // Integration of the motion amplifies noise without limit towards frequency 0, so the band starts at a quarter
        // of the dominant frequency.
        let integrated = matches!(self.quantity, Quantity::Velocity | Quantity::Acceleration);
        let lowest_hz = if integrated { 0.25 * dominant_hz } else { 0.0 };
        band_hz[0] = band_hz[0].max(lowest_hz);
        // Nonlinear terms produce harmonics of the motion above the band of the fit; they belong to the restoring-force
        // surface, so the motion keeps them.
        let highest_hz = (1.5 * band_hz[1]).max(3.5 * dominant_hz).min(0.5 * self.rate_hz);
        let motion = self.motion([lowest_hz, highest_hz]);
        // With a given mass m the fitted force is f − m q̈, and mass is not a term of the law.
        let mass = options.mass_kg.unwrap_or(0.0);
        let known: Vec<f64> = self
            .force
            .iter()
            .zip(&motion.a)
            .map(|(f, a)| f - mass * a)
            .collect();
        let terms: Vec<ForceTerm> = options
            .terms
            .iter()
            .copied()
            .filter(|term| options.mass_kg.is_none() || *term != ForceTerm::Mass)
            .collect();
        let range = self.kept(options.trim_s);
        let needed = SAMPLES_PER_TERM * terms.len();
        if range.len() < needed {
            return Err(SurfaceError::TooShort {
                samples: range.len(),
                terms: terms.len(),
                needed,
            });
        }
        let columns: Vec<Vec<f64>> = terms
            .iter()
            .map(|term| {
                (0..self.motion.len())
                    .map(|i| term.value(motion.x[i], motion.v[i], motion.a[i]))
                    .collect()
            })
            .collect();
        let spectral = Spectral::new(self.motion.len(), self.rate_hz);
        let within = |frequency: f64| (band_hz[0]..=band_hz[1]).contains(&frequency);
        let regress = |weight: &dyn Fn(f64) -> f64| {
            let filtered = |samples: &[f64]| {
                let whole = spectral.weighted(samples, |f| if within(f) { weight(f) } else { 0.0 });
                DVector::from_column_slice(&whole[range.clone()])
            };
            let columns: Vec<DVector<f64>> = columns.iter().map(|column| filtered(column)).collect();
            let (matrix, right) = (DMatrix::from_columns(&columns), filtered(&known));
            let fit = LinearProblem::new(&matrix, &right)
                .solve()
                .map_err(|_| SurfaceError::Undetermined)?;
            let theta = fit.parameters;
            let left = &right - &matrix * &theta;
            Ok((matrix, theta, left, right))
        };
        let (mut matrix, mut theta, mut left, _) = regress(&|_| 1.0)?;
        let whole = spectral.weighted(self.force, |f| f64::from(u8::from(within(f))));
        let scale = DVector::from_column_slice(&whole[range.clone()]).norm();
        let mut force_error = left.norm() / scale;
        // Each frequency is weighted with the receptance of the fitted linear terms, relative to the static compliance;
        // this needs a stiffness term.
        if terms.contains(&ForceTerm::Stiffness) {
            for _ in 0..REWEIGHTINGS {
                let receptance = receptance(&terms, &theta, mass);
                let weighted = regress(&receptance)?;
                (matrix, theta, left) = (weighted.0, weighted.1, weighted.2);
            }
            let (plain, _, _, right) = regress(&|_| 1.0)?;
            force_error = (right - plain * &theta).norm() / scale;
        }
        let deviations = deviations(&matrix, &left).ok_or(SurfaceError::Undetermined)?;
        let found_mass = terms
            .iter()
            .position(|term| *term == ForceTerm::Mass)
            .map_or(mass, |index| theta[index]);
        if found_mass <= 0.0 && (mass > 0.0 || terms.contains(&ForceTerm::Mass)) {
            return Err(SurfaceError::NoMass { mass_kg: found_mass });
        }
        let kept = |samples: &[f64]| samples[range.clone()].to_vec();
        let motion = Motion {
            x: kept(&motion.x),
            v: kept(&motion.v),
            a: kept(&motion.a),
        };
        let restoring_n = self.force[range.clone()]
            .iter()
            .zip(&motion.a)
            .map(|(f, a)| f - found_mass * a)
            .collect();
        Ok(Surface {
            terms,
            theta,
            deviations,
            force_error,
            band_hz,
            motion,
            restoring_n,
        })
    }

    /// Residual force of a law that was fitted elsewhere, relative to the force, both within `band_hz` and without the
    /// trimmed ends: ‖f − Σ θ·term‖/‖f‖, as [`Surface::force_error`] for a record with force.
    pub fn force_error(&self, law: &[(ForceTerm, f64)], band_hz: [f64; 2], trim_s: f64) -> f64 {
        let motion = self.motion([0.0, 0.5 * self.rate_hz]);
        let left: Vec<f64> = (0..self.motion.len())
            .map(|i| {
                let of = |(term, theta): &(ForceTerm, f64)| {
                    theta * term.value(motion.x[i], motion.v[i], motion.a[i])
                };
                self.force[i] - law.iter().map(of).sum::<f64>()
            })
            .collect();
        let spectral = Spectral::new(self.motion.len(), self.rate_hz);
        let within = |frequency: f64| f64::from(u8::from((band_hz[0]..=band_hz[1]).contains(&frequency)));
        let size = |samples: &[f64]| {
            let whole = spectral.weighted(samples, within);
            DVector::from_column_slice(&whole[self.kept(trim_s)]).norm()
        };
        size(&left) / size(self.force)
    }

    pub(super) fn kept(&self, trim_s: f64) -> std::ops::Range<usize> {
        let trim = (trim_s * self.rate_hz).ceil() as usize;
        let trim = trim.min(self.motion.len() / 4);
        trim..self.motion.len() - trim
    }
}

/// Magnitude of the receptance of the force law's linear terms, relative to the static compliance; the returned
/// function takes the frequency in Hz.
fn receptance(terms: &[ForceTerm], theta: &DVector<f64>, mass: f64) -> impl Fn(f64) -> f64 + use<> {
    let of = |term: ForceTerm| {
        let place = terms.iter().position(|known| *known == term);
        place.map_or(0.0, |index| theta[index])
    };
    let mass = if mass > 0.0 { mass } else { of(ForceTerm::Mass) };
    let (damping, stiffness) = (of(ForceTerm::Damping), of(ForceTerm::Stiffness));
    move |frequency: f64| {
        let omega = TAU * frequency;
        let stiff = stiffness - mass * omega * omega;
        // The damping force per displacement has the lower bound 1e-3 of the stiffness, since a mode without damping
        // would put all weight on one line.
        let lossy = (damping * omega).abs().max(1e-3 * stiffness.abs());
        stiffness.abs() / stiff.hypot(lossy)
    }
}

/// Standard deviations of a least-squares solution whose residual is correlated in time: sandwich covariance from sums
/// over blocks of samples (the block form of Newey and West). `None` if the normal equations are singular.
pub(crate) fn deviations(matrix: &DMatrix<f64>, left: &DVector<f64>) -> Option<DVector<f64>> {
    let inverse = invert_normal_equations(&matrix.tr_mul(matrix))?;
    let blocks = 40.min(matrix.nrows() / (2 * matrix.ncols()).max(1)).max(1);
    let size = matrix.nrows().div_ceil(blocks);
    let mut scatter = DMatrix::zeros(matrix.ncols(), matrix.ncols());
    for from in (0..matrix.nrows()).step_by(size) {
        let rows = size.min(matrix.nrows() - from);
        let gradient = matrix.rows(from, rows).tr_mul(&left.rows(from, rows));
        scatter += &gradient * gradient.transpose();
    }
    let covariance = &inverse * scatter * &inverse;
    Some(covariance.diagonal().map(|variance| variance.max(0.0).sqrt()))
}

/// Slice through a restoring-force surface along displacement or velocity, with a polynomial of first and third power
/// fitted to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Samples of the slice: displacement x, m, or velocity v, m/s, and restoring force f_r, N.
    pub points: Vec<(f64, f64)>,
    /// Coefficient of the first power of x or v, and its standard deviation.
    pub linear: (f64, f64),
    /// Coefficient of the third power of x or v, and its standard deviation.
    pub cubic: (f64, f64),
}

impl Surface {
    /// Stiffness slice of the surface: restoring force f_r over displacement x at the samples with |v| up to the
    /// fraction `share` of the largest |v|. A linear term in v accounts for the remaining velocity. `None` with too few
    /// such samples, or if they do not determine the polynomial.
    pub fn stiffness_slice(&self, share: f64) -> Option<Slice> {
        slice(&self.motion.x, &self.motion.v, &self.restoring_n, share)
    }

    /// Damping slice of the surface: restoring force f_r over velocity v at the samples with |x| up to the fraction
    /// `share` of the largest |x|. A linear term in x accounts for the remaining displacement. `None` as for
    /// [`Self::stiffness_slice`].
    pub fn damping_slice(&self, share: f64) -> Option<Slice> {
        slice(&self.motion.v, &self.motion.x, &self.restoring_n, share)
    }

    /// Half-width of the 90 % interval of the coefficient of the term with this index.
    pub fn half_width(&self, index: usize) -> f64 {
        NINETY_PERCENT * self.deviations[index]
    }

    /// The coefficient of a term of the force law; `None` if the law does not have the term.
    pub fn value(&self, term: ForceTerm) -> Option<f64> {
        self.terms
            .iter()
            .position(|known| *known == term)
            .map(|index| self.theta[index])
    }
}

fn slice(along: &[f64], across: &[f64], restoring: &[f64], share: f64) -> Option<Slice> {
    let largest = across.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let chosen: Vec<usize> = (0..along.len())
        .filter(|&i| across[i].abs() <= share * largest)
        .collect();
    if chosen.len() < LEAST_SLICE_SAMPLES {
        return None;
    }
    let matrix = DMatrix::from_fn(chosen.len(), 3, |row, column| {
        let i = chosen[row];
        [along[i], along[i].powi(3), across[i]][column]
    });
    let right = DVector::from_iterator(chosen.len(), chosen.iter().map(|&i| restoring[i]));
    let solution = LinearProblem::new(&matrix, &right).solve().ok()?.parameters;
    let deviations = deviations(&matrix, &(&right - &matrix * &solution))?;
    Some(Slice {
        points: chosen.iter().map(|&i| (along[i], restoring[i])).collect(),
        linear: (solution[0], deviations[0]),
        cubic: (solution[1], deviations[1]),
    })
}
