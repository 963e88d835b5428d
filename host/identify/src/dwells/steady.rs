//! Steady periodic motions from recordings of harmonic tests.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use num_complex::Complex64;
use quietcut_numerics::least_squares::solve_normal_equations;

use crate::criteria::{LEAST_DWELL_PERIODS, NOISE_OVER_TRANSIENT, STEADY_CHANGE, STEADY_DEVIATIONS};
use crate::dwells::dwell::{Dwell, DwellSegment, direction_of, dwell_segments, pool_variances};
use quietcut_recording::Recording;

/// Assumed length of the transient at the start of each dwell, which is left out. Unless the user sets the length, more
/// is left out while the motion still changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Settling {
    /// A length of the transient set by the user, s.
    Seconds(f64),
    /// The transient is the first half of the dwell.
    Half,
    /// The transient ends when a decay e^{−σt}, initially as large as the steady motion, has fallen below a fifth of
    /// the standard deviation of the motion's Fourier coefficients; σ is the given decay rate, 1/s.
    Decay(f64),
}

/// Dwells with steady motion found in recordings, and warnings, for example about skipped dwells.
#[derive(Clone, Debug, Default)]
pub struct Steady {
    /// Steady parts of the dwells. If the motion of more than half of the dwells of a recording still changes, these
    /// dwells are included.
    pub dwells: Vec<Dwell>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// The steady parts of the dwells of all recordings, with Fourier series of `harmonics` harmonics. Warnings count the
/// dwells that are left out.
pub fn steady(recordings: &[Recording], harmonics: usize, settling: Settling) -> Steady {
    let mut steady = Steady::default();
    for recording in recordings {
        let name = recording.path.display();
        let found = dwell_segments(recording);
        if found.is_empty() {
            steady.warnings.push(format!(
                "{name}: no segment of constant frequency was found; a step-sine test is needed"
            ));
        }
        let (mut settled_dwells, mut moving, mut short, mut unsettled) = (Vec::new(), Vec::new(), 0, 0);
        for stretch in found {
            match settled(recording, stretch, harmonics, settling) {
                Some(Settled { dwell, whole, still }) => {
                    unsettled += usize::from(!whole);
                    if still {
                        settled_dwells.push(dwell);
                    } else {
                        moving.push(dwell);
                    }
                }
                None => short += 1,
            }
        }
        let mut dwells = settled_dwells;
        if moving.len() > dwells.len() {
            steady.warnings.push(format!(
                "{name}: the motion of {} dwells still changes at their ends; the transients bias the parameters: dwell longer",
                moving.len()
            ));
            dwells.extend(moving);
        } else if !moving.is_empty() {
            steady.warnings.push(format!(
                "{name}: the motion of {} dwells still changes at their ends, and they are left out; near a jump the motion settles more slowly than elsewhere: dwell longer",
                moving.len()
            ));
        }
        pool_variances(&mut dwells);
        if short > 0 {
            steady.warnings.push(format!(
                "{name}: {short} dwells are too short for {harmonics} harmonics after settling and are left out"
            ));
        }
        if unsettled > 0 {
            steady.warnings.push(format!(
                "{name}: {unsettled} dwells are too short to settle below the noise; the residual transients make intervals too narrow; dwell longer"
            ));
        }
        steady.dwells.extend(dwells);
    }
    steady
}

/// Steady part of a dwell, after its transient.
struct Settled {
    dwell: Dwell,
    /// False if the dwell is too short for a transient of the given decay rate to fall below the noise. Always true if
    /// no decay rate is given.
    whole: bool,
    /// True if the fundamental of every motion channel is nearly the same in both halves of the steady part
    /// ([`is_still`]), or if the user set the length of the transient.
    still: bool,
}

/// The part of a dwell after its transient; `None` if it is too short or cannot be fitted. While the motion still
/// changes in this part, its last half replaces it, as long as that contains at least [`LEAST_DWELL_PERIODS`]
/// excitation periods and can be fitted. A length of the transient that the user set is kept.
fn settled(
    recording: &Recording,
    stretch: DwellSegment,
    harmonics: usize,
    settling: Settling,
) -> Option<Settled> {
    let (dwell, whole) = first_settled(recording, stretch, harmonics, settling)?;
    let least = (LEAST_DWELL_PERIODS * recording.sample_rate_hz / stretch.frequency_hz).ceil() as usize;
    let last = |samples: usize| DwellSegment {
        from: stretch.to - samples,
        ..stretch
    };
    let mut found = dwell;
    loop {
        let still = is_still(recording, last(found.samples), &found);
        // A transient length set by the user is not checked.
        if still || matches!(settling, Settling::Seconds(_)) {
            return Some(Settled {
                dwell: found,
                whole,
                still: true,
            });
        }
        let half = found.samples / 2;
        match (half >= least)
            .then(|| Dwell::fit(recording, last(half), harmonics))
            .flatten()
        {
            Some(shorter) => found = shorter,
            None => {
                return Some(Settled {
                    dwell: found,
                    whole,
                    still: false,
                });
            }
        }
    }
}

/// True if the fundamental of each motion channel changes between the first and the second half of a dwell by less than
/// the share [`STEADY_CHANGE`], or by less than [`STEADY_DEVIATIONS`] standard deviations, from noise and frequency
/// error, of the change's real or imaginary part.
fn is_still(recording: &Recording, part: DwellSegment, dwell: &Dwell) -> bool {
    let middle = (part.from + part.to) / 2;
    let halves = [part.from..middle, middle..part.to];
    dwell.motions.iter().all(|line| {
        let channel = recording.channels.iter().find(|channel| {
            channel.quantity == line.quantity && direction_of(channel) == Some(line.direction)
        });
        let Some(channel) = channel else { return true };
        let phasors = halves
            .clone()
            .map(|half| phasor(&channel.samples, half, dwell.omega / recording.sample_rate_hz));
        let [Some(first), Some(second)] = phasors else {
            return true;
        };
        let change = (second - first).norm();
        // In half of the samples, real and imaginary part of the fundamental each have the variance 4σ²/n, with the
        // noise variance σ² and n samples in the whole dwell; the difference of two halves has twice that.
        let noise = (8.0 * line.variance / dwell.samples as f64).sqrt();
        // Difference of the two halves that one standard deviation of the estimated frequency causes in a steady
        // motion, since it turns the phase between their middles. It adds to the noise that the test allows.
        let turned = line.amplitude(1)
            * dwell.omega_variance.sqrt()
            * (0.5 * dwell.samples as f64 / recording.sample_rate_hz);
        change < (STEADY_CHANGE * line.amplitude(1)).max(STEADY_DEVIATIONS * noise.hypot(turned))
    })
}

/// Complex amplitude X of the least-squares fit Re X e^{iφk} + constant to the samples in `range`; k counts from the
/// first sample of the channel, φ is `radians_per_sample`. `None` if `range` exceeds the samples or the normal
/// equations are singular.
fn phasor(samples: &[f64], range: std::ops::Range<usize>, radians_per_sample: f64) -> Option<Complex64> {
    let mut normal = Matrix3::<f64>::zeros();
    let mut right = Vector3::<f64>::zeros();
    for k in range {
        let (sin, cos) = (radians_per_sample * k as f64).sin_cos();
        let row = Vector3::new(cos, -sin, 1.0);
        normal += row * row.transpose();
        right += row * *samples.get(k)?;
    }
    let solution = solve_normal_equations(
        &DMatrix::from_column_slice(3, 3, normal.as_slice()),
        &DVector::from_column_slice(right.as_slice()),
    )?;
    Some(Complex64::new(solution[0], solution[1]))
}

/// The part of a dwell after its transient, and [`Settled::whole`]; `None` if the part is too short or cannot be
/// fitted.
fn first_settled(
    recording: &Recording,
    stretch: DwellSegment,
    harmonics: usize,
    settling: Settling,
) -> Option<(Dwell, bool)> {
    let count = (stretch.to - stretch.from) as f64;
    let least = LEAST_DWELL_PERIODS * recording.sample_rate_hz / stretch.frequency_hz;
    let from = |seconds: f64| DwellSegment {
        from: stretch.from + (seconds * recording.sample_rate_hz).ceil() as usize,
        ..stretch
    };
    let half = 0.5 * count / recording.sample_rate_hz;
    let last = |seconds: f64| {
        let part = from(seconds);
        let enough = part.to > part.from && (part.to - part.from) as f64 >= least;
        enough.then(|| Dwell::fit(recording, part, harmonics)).flatten()
    };
    match settling {
        Settling::Seconds(seconds) => Some((last(seconds)?, true)),
        Settling::Half => Some((last(half)?, true)),
        Settling::Decay(rate) => {
            let first = last(half)?;
            // The transient is assumed to start as large as the steady motion. It must decay to the noise of a Fourier
            // coefficient, divided by `NOISE_OVER_TRANSIENT`.
            let clearest = first
                .motions
                .iter()
                .map(|line| line.amplitude(1) / (line.variance * first.gram_inverse[(1, 1)]).sqrt())
                .fold(1.0, f64::max);
            let needed = (NOISE_OVER_TRANSIENT * clearest.min(1e8)).ln() / rate;
            match last(needed) {
                Some(dwell) => Some((dwell, true)),
                None => Some((last(0.7 * 2.0 * half).unwrap_or(first), false)),
            }
        }
    }
}

/// Dwells of a record with constant excitation frequency and slowly changing force amplitude: consecutive windows of
/// `periods` excitation periods each. An incomplete window at the end of a segment of constant frequency is left out,
/// and so is a window that cannot be fitted.
pub fn windows(recording: &Recording, harmonics: usize, periods: f64) -> Vec<Dwell> {
    let mut dwells = Vec::new();
    for stretch in dwell_segments(recording) {
        let length = (periods * recording.sample_rate_hz / stretch.frequency_hz).round() as usize;
        let mut from = stretch.from;
        while length > 0 && from + length <= stretch.to {
            let part = DwellSegment {
                from,
                to: from + length,
                ..stretch
            };
            dwells.extend(Dwell::fit(recording, part, harmonics));
            from += length;
        }
    }
    dwells
}

/// Smallest decay rate |c|/(2m) of modes with the given masses, kg, and dampings, N s/m; 1/s. It holds for modes below
/// critical damping and is bounded to the range from 1e-3 to 2000π.
pub fn slowest_decay(masses: &[f64], dampings: &[f64]) -> f64 {
    masses
        .iter()
        .zip(dampings)
        .map(|(mass, damping)| (0.5 * damping / mass).abs())
        .fold(f64::INFINITY, f64::min)
        .clamp(1e-3, TAU * 1e3)
}
