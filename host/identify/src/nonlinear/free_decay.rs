//! Force law of a free decay, fitted in weak form: its linear terms need no derivative of a measured signal.
//!
//! Each equation is the law multiplied by a modulating function φ = ψ″ of compact support and integrated over time
//! (Shinbrot, Trans. ASME 79 (1957) 1131). Integration by parts moves the derivatives to φ:
//!
//!   ∫φ q̈ dt = ∫φ″ q dt,  ∫φ q̇ dt = −∫φ′ q dt,  and for a measured acceleration  ∫ψ″ q dt = ∫ψ q̈ dt.
//!
//! φ and its first three derivatives vanish at both ends of its support, which lies within the record. So the step with
//! which a decay begins does not enter the linear terms, nor, if displacement is measured, an offset or a linear drift
//! of the sensor. A linear filter of the sensor changes all linear terms alike. Nonlinear terms use displacement and
//! velocity by filters of the whole record; therefore equations near its ends are left out.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};

use super::block_jackknife;
use super::restoring_force::{ForceTerm, Motion, Options, Record, Surface, SurfaceError};
use super::spectrum::{Spectral, peak_frequency_hz};
use crate::criteria::{DECAY_BLOCKS, DECAY_SUPPORTS, SAMPLES_PER_TERM};
use quietcut_numerics::least_squares::LinearProblem;
use quietcut_numerics::statistics::{NINETY_PERCENT, student_ninety_percent};

/// Number of equations per period of the centre frequency of ψ, if the sample rate allows as many. A choice: the band
/// of ψ reaches up to twice the centre frequency, which needs four.
const EQUATIONS_PER_PERIOD: f64 = 8.0;

/// Power of the cosine that bounds ψ. With 6 the fifth derivative of ψ is continuous, and φ″ = ψ⁗ falls to zero at the
/// ends. A choice.
const POWER: i32 = 6;

/// Number of periods of the largest spectral line that no equation uses at each end of the record: for a measured
/// displacement, and for a measured velocity or acceleration, which is integrated. Over them the error of
/// [`Spectral::near_resonance`] from the ends dies out. A choice.
const MARGIN_PERIODS: [f64; 2] = [2.0, 4.0];

/// A modulating function ψ(t) = cos⁶(πt/L) cos(2πft) for |t| < L/2.
#[derive(Clone, Copy, Debug)]
struct Modulating {
    /// Centre frequency f, Hz.
    centre_hz: f64,
    /// Length L of the support, s.
    length_s: f64,
}

impl Modulating {
    /// The function whose transform has its first zeros at both ends of `band_hz`, at f ± 4/L.
    fn of_band(band_hz: [f64; 2]) -> Self {
        Self {
            centre_hz: 0.5 * (band_hz[0] + band_hz[1]),
            length_s: (POWER + 2) as f64 / (band_hz[1] - band_hz[0]),
        }
    }

    /// The same with the length of the support multiplied by `factor`.
    fn longer(self, factor: f64) -> Self {
        Self {
            length_s: factor * self.length_s,
            ..self
        }
    }

    /// Samples of the derivative of ψ of this order at `rate_hz`, about the middle sample, times the sample interval:
    /// their scalar product with a signal is an integral.
    ///
    /// cos⁶u = (10 + 15 cos 2u + 6 cos 4u + cos 6u)/32 makes ψ a sum of cosines.
    fn samples(self, order: i32, rate_hz: f64) -> Vec<f64> {
        let half = (0.5 * self.length_s * rate_hz).floor() as i64;
        let omega = TAU * self.centre_hz;
        let weights = [10.0, 7.5, 3.0, 0.5];
        (-half..=half)
            .map(|index| {
                let t = index as f64 / rate_hz;
                let mut sum = 0.0;
                for (k, weight) in weights.iter().enumerate() {
                    let shift = 2.0 * PI * k as f64 / self.length_s;
                    let sides: &[f64] = if k == 0 { &[0.0] } else { &[-1.0, 1.0] };
                    for side in sides {
                        let rate = omega + side * shift;
                        sum +=
                            weight / 32.0 * rate.powi(order) * (rate * t + 0.5 * PI * f64::from(order)).cos();
                    }
                }
                sum / rate_hz
            })
            .collect()
    }
}

/// A free decay whose law is sought.
struct FreeDecay<'a> {
    record: &'a Record<'a>,
    /// Displacement, velocity and acceleration about the resonance, for the nonlinear terms.
    motion: Motion,
    /// Frequency of [`peak_frequency_hz`], Hz: an estimate of the natural frequency.
    peak_hz: f64,
}

struct Fit {
    matrix: DMatrix<f64>,
    theta: DVector<f64>,
    left: DVector<f64>,
    /// Norm of the residual `left` over that of the integrals ∫φ·m q̈ dt.
    error: f64,
}

/// Fits the force law of `options` to a record without force, for the moving mass `mass_kg`.
///
/// The standard deviations are those of the delete-a-block jackknife, multiplied so that 90 % intervals by the normal
/// distribution are Student's. They are at least the RMS change of the coefficients in fits with other lengths of the
/// modulating function, which an error of the law or of a filter causes.
///
/// # Errors
/// The record is too short for the terms, or does not determine them.
pub(super) fn surface(record: &Record<'_>, options: &Options, mass_kg: f64) -> Result<Surface, SurfaceError> {
    let decay = FreeDecay::new(record, options.band_hz);
    let band_hz = options
        .band_hz
        .unwrap_or([decay.peak_hz / 3.0, 5.0 * decay.peak_hz / 3.0]);
    let terms: Vec<ForceTerm> = options
        .terms
        .iter()
        .copied()
        .filter(|term| *term != ForceTerm::Mass)
        .collect();
    let modulating = Modulating::of_band(band_hz);
    let fit = decay.fit(&terms, mass_kg, modulating)?;
    let blocks = DECAY_BLOCKS.min(fit.matrix.nrows() / (2 * terms.len()).max(1));
    let scatter =
        block_jackknife::deviations(&fit.matrix, &fit.left, blocks).ok_or(SurfaceError::Undetermined)?;
    let student = student_ninety_percent(blocks.saturating_sub(1)) / NINETY_PERCENT;
    let others: Vec<DVector<f64>> = DECAY_SUPPORTS
        .iter()
        .filter_map(|factor| decay.fit(&terms, mass_kg, modulating.longer(*factor)).ok())
        .map(|other| other.theta - &fit.theta)
        .collect();
    let deviations = DVector::from_fn(terms.len(), |term, _| {
        let squares: f64 = others.iter().map(|change| change[term] * change[term]).sum();
        let of_bands = (squares / others.len().max(1) as f64).sqrt();
        (student * scatter[term]).max(of_bands)
    });
    let range = record.kept(options.trim_s);
    let kept = |samples: &[f64]| samples[range.clone()].to_vec();
    let motion = Motion {
        x: kept(&decay.motion.x),
        v: kept(&decay.motion.v),
        a: kept(&decay.motion.a),
    };
    Ok(Surface {
        terms,
        theta: fit.theta,
        deviations,
        force_error: fit.error,
        band_hz,
        restoring_n: motion.a.iter().map(|a| -mass_kg * a).collect(),
        motion,
    })
}

impl<'a> FreeDecay<'a> {
    fn new(record: &'a Record<'a>, band_hz: Option<[f64; 2]>) -> Self {
        let (samples, rate_hz) = (record.motion, record.rate_hz);
        let peak_hz = peak_frequency_hz(samples, rate_hz, record.quantity, band_hz);
        let spectral = Spectral::new(samples.len(), rate_hz);
        let measured = record.derivatives();
        let of = |order: i32| spectral.near_resonance(samples, order - measured, peak_hz);
        Self {
            record,
            motion: Motion {
                x: of(0),
                v: of(1),
                a: of(2),
            },
            peak_hz,
        }
    }

    fn fit(&self, terms: &[ForceTerm], mass_kg: f64, modulating: Modulating) -> Result<Fit, SurfaceError> {
        let columns: Vec<DVector<f64>> = terms
            .iter()
            .map(|term| self.integrals(*term, modulating, terms.len()))
            .collect::<Result<_, _>>()?;
        let matrix = DMatrix::from_columns(&columns);
        let right = self.integrals(ForceTerm::Mass, modulating, terms.len())? * -mass_kg;
        let theta = LinearProblem::new(&matrix, &right)
            .solve()
            .map_err(|_| SurfaceError::Undetermined)?
            .parameters;
        let left = &right - &matrix * &theta;
        Ok(Fit {
            error: left.norm() / right.norm(),
            matrix,
            theta,
            left,
        })
    }

    /// Integrals ∫φ·term dt of a term of a law of `count` terms, one for each equation, in the order of time.
    ///
    /// # Errors
    /// The record is shorter than the support of φ, both margins and the equations that the law needs are together.
    fn integrals(
        &self,
        term: ForceTerm,
        modulating: Modulating,
        count: usize,
    ) -> Result<DVector<f64>, SurfaceError> {
        let (samples, rate_hz) = (self.record.motion, self.record.rate_hz);
        let measured = self.record.derivatives();
        let linear = match term {
            ForceTerm::Mass => Some(2),
            ForceTerm::Damping => Some(1),
            ForceTerm::Stiffness => Some(0),
            _ => None,
        };
        // If q⁽ᵐ⁾ is measured, the term q⁽ⁿ⁾ has the integral ∫ψ″ q⁽ⁿ⁾ dt = (−1)ⁿ⁻ᵐ ∫ψ⁽²⁺ⁿ⁻ᵐ⁾ q⁽ᵐ⁾ dt.
        let order = linear.map_or(2, |derivative: i32| 2 + derivative - measured);
        let sign = if order % 2 == 0 { 1.0 } else { -1.0 };
        let kernel = modulating.samples(order, rate_hz);
        let margin = MARGIN_PERIODS[usize::from(measured > 0)] / self.peak_hz * rate_hz;
        let stride = (rate_hz / (EQUATIONS_PER_PERIOD * modulating.centre_hz)).max(1.0);
        let half = kernel.len() / 2;
        let first = margin.ceil() as usize + half;
        let equations = SAMPLES_PER_TERM * count;
        let needed = 2 * first + 1 + (equations as f64 * stride).ceil() as usize;
        if samples.len() < needed {
            return Err(SurfaceError::TooShort {
                samples: samples.len(),
                terms: count,
                needed,
            });
        }
        let rows = ((samples.len() - 2 * first - 1) as f64 / stride) as usize + 1;
        let Motion { x, v, a } = &self.motion;
        let values: Vec<f64> = match linear {
            Some(_) => samples.to_vec(),
            None => (0..samples.len()).map(|i| term.value(x[i], v[i], a[i])).collect(),
        };
        Ok(DVector::from_fn(rows, |row, _| {
            let from = first + (row as f64 * stride) as usize - half;
            let pairs = values[from..from + kernel.len()].iter().zip(&kernel);
            sign * pairs.map(|(value, weight)| value * weight).sum::<f64>()
        }))
    }
}
