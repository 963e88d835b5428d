//! From recordings of harmonic tests to steady periodic motions.

use std::f64::consts::TAU;

use super::dwell::{Dwell, Stretch, pool_variances, stretches};
use crate::recording::Recording;

/// How much of each dwell is transient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Settling {
    /// So many seconds, the user says.
    Seconds(f64),
    /// The first half.
    Half,
    /// What a motion that decays like e^{−σt} needs until it is below the noise; σ in 1/s.
    Decay(f64),
}

/// Steady motions, and what was wrong with the rest.
#[derive(Clone, Debug, Default)]
pub struct Steady {
    /// The dwells.
    pub dwells: Vec<Dwell>,
    /// For people.
    pub warnings: Vec<String>,
}

/// Fewest periods of a dwell.
const PERIODS: f64 = 10.0;

/// Every dwell of every recording, with `harmonics` harmonics.
pub fn steady(recordings: &[Recording], harmonics: usize, settling: Settling) -> Steady {
    let mut steady = Steady::default();
    for recording in recordings {
        let name = recording.path.display();
        let found = stretches(recording);
        if found.is_empty() {
            steady.warnings.push(format!(
                "{name}: no frequency is held; a step-sine test is needed"
            ));
        }
        let (mut dwells, mut short, mut unsettled) = (Vec::new(), 0, 0);
        for stretch in found {
            match settled(recording, stretch, harmonics, settling) {
                Some((dwell, whole)) => {
                    unsettled += usize::from(!whole);
                    dwells.push(dwell);
                }
                None => short += 1,
            }
        }
        pool_variances(&mut dwells);
        if short > 0 {
            steady.warnings.push(format!(
                "{name}: {short} dwells are too short for {harmonics} harmonics after settling and are left out"
            ));
        }
        if unsettled > 0 {
            steady.warnings.push(format!(
                "{name}: {unsettled} dwells are too short to settle below the noise; what is left of their transients makes intervals too narrow: dwell longer"
            ));
        }
        steady.dwells.extend(dwells);
    }
    steady
}

/// The settled part of a stretch, and whether it is long enough to have settled.
fn settled(
    recording: &Recording,
    stretch: Stretch,
    harmonics: usize,
    settling: Settling,
) -> Option<(Dwell, bool)> {
    let count = (stretch.to - stretch.from) as f64;
    let least = PERIODS * recording.sample_rate_hz / stretch.frequency_hz;
    let from = |seconds: f64| Stretch {
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
            // Transient and steady motion begin equally large; a fifth of the noise of a coefficient may be left.
            let clearest = first
                .motions
                .iter()
                .map(|line| line.amplitude(1) / (line.variance * first.gram_inverse[(1, 1)]).sqrt())
                .fold(1.0, f64::max);
            let needed = (5.0 * clearest.min(1e8)).ln() / rate;
            match last(needed) {
                Some(dwell) => Some((dwell, true)),
                None => Some((last(0.7 * 2.0 * half).unwrap_or(first), false)),
            }
        }
    }
}

/// Windows of a tone whose force changes slowly: each is a dwell of its own, of `periods` periods.
pub fn windows(recording: &Recording, harmonics: usize, periods: f64) -> Vec<Dwell> {
    let mut dwells = Vec::new();
    for stretch in stretches(recording) {
        let length = (periods * recording.sample_rate_hz / stretch.frequency_hz).round() as usize;
        let mut from = stretch.from;
        while length > 0 && from + length <= stretch.to {
            let part = Stretch {
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

/// The slowest decay of mass, damping and stiffness with these values, 1/s: c/(2m) below critical damping.
pub fn slowest_decay(masses: &[f64], dampings: &[f64]) -> f64 {
    masses
        .iter()
        .zip(dampings)
        .map(|(mass, damping)| (0.5 * damping / mass).abs())
        .fold(f64::INFINITY, f64::min)
        .clamp(1e-3, TAU * 1e3)
}
