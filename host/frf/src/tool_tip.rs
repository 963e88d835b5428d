//! Tool-tip calibration: receptances at the tool tip from a sensor on the spindle housing.
//!
//! If spindle, holder and tool move as a rigid body in a mode, the motions of tip T and sensor S have the constant
//! ratio φ_T/φ_S of the mode shape (thesis eqs 7.13 and 7.14). Two hammer tests with impacts at the tip give this ratio
//! for each mode: one with the sensor at its position during the cut, one with a sensor at the tip.

use num_complex::Complex64;

use super::criteria::{LARGEST_DAMPING_RATIO, LEAST_PEAK, RESIDUAL_DECREASE, SAME_MODE, SMALL_RESIDUAL};
use super::rational_fit::{RationalFit, RationalFitError, fit};
use super::{Frf, FrfError, FrfTable};
use quietcut_model::structure::Direction;

/// Largest number of modes that a vector fit tries for the tool-tip calibration and for the removal of an exponential
/// window. A choice; if a band has more modes, it must be narrowed.
const MODES_MAX: usize = 8;

/// Ratio of the mode shape at tool tip and sensor, for one mode and response direction.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeRatio {
    /// Natural frequency of the mode in the calibration tests, Hz.
    pub frequency_hz: f64,
    /// Direction of the response at tip and sensor.
    pub response: Direction,
    /// Mode shape ratio φ_T/φ_S: displacement of the tool tip T over that of the sensor S on the housing.
    pub ratio: f64,
    /// RMS deviation of the residues at the tip from `ratio` times those at the sensor, relative to the RMS of this
    /// product; 0 for a rigid body without noise.
    pub misfit: f64,
}

/// Computes receptances at the tool tip from receptances at a sensor on the housing; returns also the mode shape ratios
/// of the calibration, by mode and then response direction.
///
/// `housing` and `tip` are the calibration: responses at the sensor and at the tip to forces at the tip. `measured` has
/// responses at the same sensor. Each mode r of `measured` is fitted and, for each response direction, scaled with the
/// ratio of the nearest calibrated mode of that direction: H_TT = H_ST + Σ_r (φ_T/φ_S − 1)_r H_ST,r. For one mode this
/// is thesis eq. (7.14).
///
/// # Errors
/// The calibration tables have different frequencies or no common receptance; no mode can be fitted to them or to
/// `measured`; a mode of `measured` has no calibrated mode near it for a response direction; a result is not finite.
pub fn calibrate(
    measured: &FrfTable,
    housing: &FrfTable,
    tip: &FrfTable,
) -> Result<(FrfTable, Vec<ModeRatio>), FrfError> {
    let ratios = ratios(housing, tip)?;
    let refused = |what: String| FrfError::Content {
        path: measured.path().into(),
        what,
    };
    let functions: Vec<&[Complex64]> = measured
        .entries()
        .iter()
        .map(|entry| entry.receptance.as_slice())
        .collect();
    let modes = modes(measured.frequency_hz(), &functions).map_err(|error| {
        refused(format!(
            "no mode can be fitted to it: {error}; a band with a resonance is needed"
        ))
    })?;
    let mut entries: Vec<Frf> = measured.entries().to_vec();
    for mode in mode_numbers(&modes) {
        let hertz = modes.frequency_hz(mode);
        for (function, entry) in entries.iter_mut().enumerate() {
            let ratio = nearest(&ratios, hertz, entry.response).ok_or_else(|| {
                let known: Vec<String> = ratios.iter().map(|ratio| format!("{:.2} ({})", ratio.frequency_hz, ratio.response)).collect();
                refused(format!(
                    "its mode at {hertz:.2} Hz has no counterpart in {} for the response in {}; calibrated are {} Hz",
                    housing.path().display(),
                    entry.response,
                    known.join(", ")
                ))
            })?;
            for (value, &line_hz) in entry.receptance.iter_mut().zip(measured.frequency_hz()) {
                *value += (ratio.ratio - 1.0) * modes.mode_at(function, mode, line_hz);
            }
        }
    }
    Ok((
        FrfTable::new(measured.path(), measured.frequency_hz().to_vec(), entries)?,
        ratios,
    ))
}

fn nearest(ratios: &[ModeRatio], hertz: f64, response: Direction) -> Option<&ModeRatio> {
    let off = |ratio: &ModeRatio| (ratio.frequency_hz / hertz).ln().abs();
    ratios
        .iter()
        .filter(|ratio| ratio.response == response && off(ratio) < SAME_MODE)
        .min_by(|a, b| off(a).total_cmp(&off(b)))
}

/// Mode shape ratios of a calibration, by mode and then response direction; without those whose residues at the sensor
/// are zero.
fn ratios(housing: &FrfTable, tip: &FrfTable) -> Result<Vec<ModeRatio>, FrfError> {
    let refused = |what: String| FrfError::Content {
        path: tip.path().into(),
        what,
    };
    if housing.frequency_hz() != tip.frequency_hz() {
        return Err(refused(format!(
            "other frequencies than {}; measure both with one resolution and band",
            housing.path().display()
        )));
    }
    let pairs: Vec<(&Frf, &Frf)> = tip
        .entries()
        .iter()
        .filter_map(|at_tip| Some((housing.entry(at_tip.response, at_tip.force)?, at_tip)))
        .collect();
    if pairs.is_empty() {
        return Err(refused(format!(
            "no receptance in common with {}",
            housing.path().display()
        )));
    }
    let functions: Vec<&[Complex64]> = pairs
        .iter()
        .flat_map(|(at_sensor, at_tip)| [at_sensor.receptance.as_slice(), at_tip.receptance.as_slice()])
        .collect();
    let modes = modes(tip.frequency_hz(), &functions).map_err(|error| {
        refused(format!(
            "no mode can be fitted to it: {error}; a band with a resonance is needed"
        ))
    })?;
    let mut ratios = Vec::new();
    for mode in mode_numbers(&modes) {
        for response in [Direction::X, Direction::Y, Direction::Z] {
            let residues: Vec<(Complex64, Complex64)> = pairs
                .iter()
                .enumerate()
                .filter(|(_, (at_tip, _))| at_tip.response == response)
                .map(|(index, _)| {
                    (
                        modes.residues[2 * index][mode],
                        modes.residues[2 * index + 1][mode],
                    )
                })
                .collect();
            let power: f64 = residues.iter().map(|(s, _)| s.norm_sqr()).sum();
            if power == 0.0 {
                continue;
            }
            let ratio = residues.iter().map(|(s, t)| (t * s.conj()).re).sum::<f64>() / power;
            let residual: f64 = residues.iter().map(|(s, t)| (t - s * ratio).norm_sqr()).sum();
            ratios.push(ModeRatio {
                frequency_hz: modes.frequency_hz(mode),
                response,
                ratio,
                misfit: (residual / power).sqrt() / ratio.abs(),
            });
        }
    }
    Ok(ratios)
}

/// Fits receptances with 1, 2, … modes, up to [`MODES_MAX`], until the residual is small or two more fits hardly
/// decrease it; returns the last fit that did decrease it. If no fit succeeds, the error of the first is returned.
pub(super) fn modes(
    frequency_hz: &[f64],
    functions: &[&[Complex64]],
) -> Result<RationalFit, RationalFitError> {
    let mut best: Option<RationalFit> = None;
    let mut refused = None;
    // Number of successive fits that hardly decrease the residual. The search stops after two, since a further mode
    // may help only with the next.
    let mut without_improvement = 0;
    for count in 1..=MODES_MAX {
        let next = match fit(frequency_hz, functions, count) {
            Ok(next) => next,
            Err(error) => {
                // If no number of modes can be fitted, the error of the smallest number is reported: it is the easiest
                // to remedy.
                refused.get_or_insert(error);
                continue;
            }
        };
        match &best {
            Some(before) if next.residual > (1.0 - RESIDUAL_DECREASE) * before.residual => {
                without_improvement += 1
            }
            _ => {
                best = Some(next);
                without_improvement = 0;
            }
        }
        if without_improvement == 2 || best.as_ref().is_some_and(|best| best.residual < SMALL_RESIDUAL) {
            break;
        }
    }
    best.ok_or_else(|| refused.unwrap_or(RationalFitError::NoOrder))
}

/// Indices of the fitted poles that count as modes: lightly damped, and with a significant peak in at least one
/// receptance.
pub(super) fn mode_numbers(modes: &RationalFit) -> Vec<usize> {
    // Height of the resonance peak of a mode in a receptance, m/N: |residue| / decay rate.
    let height =
        |function: usize, mode: usize| modes.residues[function][mode].norm() / modes.poles[mode].re.abs();
    let functions = 0..modes.residues.len();
    let highest: Vec<f64> = functions
        .clone()
        .map(|function| {
            (0..modes.poles.len())
                .map(|mode| height(function, mode))
                .fold(0.0, f64::max)
        })
        .collect();
    (0..modes.poles.len())
        .filter(|&mode| {
            let pole = modes.poles[mode];
            pole.re.abs() < LARGEST_DAMPING_RATIO * pole.norm()
                && functions
                    .clone()
                    .any(|function| height(function, mode) > LEAST_PEAK * highest[function])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::path::Path;

    use rand::{RngExt, SeedableRng};

    use super::*;

    /// FRF table at the tip, or at the sensor if `ratios` are given. Each mode: natural frequency (Hz), damping ratio,
    /// mode shape in x and y.
    fn table(modes: &[(f64, f64, [f64; 2])], ratios: Option<&[f64]>, noise: f64, seed: u64) -> FrfTable {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let frequency_hz: Vec<f64> = (0..400).map(|k| 8.0 + 0.05 * f64::from(k)).collect();
        let directions = [Direction::X, Direction::Y];
        let mut entries = Vec::new();
        for (p, &response) in directions.iter().enumerate() {
            for (q, &force) in directions.iter().enumerate() {
                let value = |hertz: &f64| -> Complex64 {
                    modes
                        .iter()
                        .enumerate()
                        .map(|(r, &(own, damping, shape))| {
                            let (omega, own) = (TAU * hertz, TAU * own);
                            // φ_S = ratio φ_T.
                            let at = shape[p] * ratios.map_or(1.0, |ratios| ratios[r]);
                            at * shape[q]
                                / Complex64::new(own * own - omega * omega, 2.0 * damping * own * omega)
                        })
                        .sum()
                };
                let clean: Vec<Complex64> = frequency_hz.iter().map(value).collect();
                let peak = clean.iter().map(|h| h.norm()).fold(0.0, f64::max);
                let mut jitter = || noise * peak * random.random_range(-1.0..1.0);
                let receptance = clean
                    .iter()
                    .map(|h| h + Complex64::new(jitter(), jitter()))
                    .collect();
                entries.push(Frf {
                    response,
                    force,
                    receptance,
                    coherence: None,
                    folding: None,
                });
            }
        }
        FrfTable::new(Path::new("a.csv"), frequency_hz, entries).unwrap()
    }

    #[test]
    fn tool_tip_frfs_come_from_the_housing_within_two_percent_at_the_peaks() {
        for seed in 0..20 {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let modes = [
                (11.0, 0.02, [1.0, 0.2]),
                (17.5, 0.025, [0.3, 1.0]),
                (19.8, 0.03, [1.0, -0.5]),
            ];
            let ratios: Vec<f64> = modes.iter().map(|_| random.random_range(0.6..0.9)).collect();
            let housing = table(&modes, Some(&ratios), 0.002, 100 + seed);
            let tip = table(&modes, None, 0.002, 200 + seed);
            // During the cut the natural frequencies shift and the damping increases.
            let in_cut = modes.map(|(hertz, damping, shape)| (0.97 * hertz, 1.4 * damping, shape));
            let measured = table(&in_cut, Some(&ratios), 0.002, 300 + seed);
            let truth = table(&in_cut, None, 0.0, 0);
            let (calibrated, found) = calibrate(&measured, &housing, &tip).unwrap();
            for ratio in &found {
                let mode = modes
                    .iter()
                    .position(|mode| (mode.0 / ratio.frequency_hz - 1.0).abs() < 0.01)
                    .unwrap();
                // Expected error below 0.5 %: noise of 0.2 % of the peak, averaged over the lines of a peak.
                assert!(
                    (ratio.ratio * ratios[mode] - 1.0).abs() < 0.01,
                    "seed {seed}: {ratio:?} {ratios:?}"
                );
            }
            for (entry, expected) in calibrated.entries().iter().zip(truth.entries()) {
                for (mode, _) in modes.iter().enumerate() {
                    let hertz = in_cut[mode].0;
                    let at = truth.frequency_hz().partition_point(|&f| f < hertz);
                    let (h, truth) = (entry.receptance[at].norm(), expected.receptance[at].norm());
                    let highest = expected.receptance.iter().map(|h| h.norm()).fold(0.0, f64::max);
                    // Only peaks above a fifth of the largest are compared.
                    if truth > 0.2 * highest {
                        assert!(
                            (h / truth - 1.0).abs() < 0.02,
                            "seed {seed}: {} {hertz}: {h} {truth}",
                            entry.name()
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn incompatible_calibration_tables_are_refused() {
        let modes = [(11.0, 0.02, [1.0, 0.2])];
        let (housing, tip) = (table(&modes, Some(&[0.7]), 0.0, 1), table(&modes, None, 0.0, 1));
        let elsewhere = table(&[(16.0, 0.02, [1.0, 0.2])], Some(&[0.7]), 0.0, 1);
        let said = calibrate(&elsewhere, &housing, &tip).unwrap_err().to_string();
        assert!(
            said.contains("16.00 Hz has no counterpart") && said.contains("11.00 (x)"),
            "{said}"
        );
        let shorter = FrfTable::new(
            Path::new("b.csv"),
            vec![1.0],
            vec![Frf {
                receptance: vec![Complex64::ONE],
                ..tip.entries()[0].clone()
            }],
        )
        .unwrap();
        assert!(
            calibrate(&housing, &housing, &shorter)
                .unwrap_err()
                .to_string()
                .contains("other frequencies")
        );
    }
}
