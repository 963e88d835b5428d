//! Removal of the damping that an exponential window adds to a hammer test.
//!
//! With e^{−t/τ} on force and response the estimate is H(iω + 1/τ): every pole λ appears at λ − 1/τ, so that resonances are lower
//! and limits computed from them deeper than they are. Modes are fitted to the estimate, and each is replaced by the one with its
//! pole moved back:
//!
//!   H(iω) = H_w(iω) + Σ_r [R_r/(iω − λ_r − 1/τ) − R_r/(iω − λ_r)] + conjugate pairs.
//!
//! Modes outside the band change little over the distance 1/τ and stay. A relative error of the measured decay rate σ_w
//! becomes σ_w/σ times as large for the true one, and so does that of the peak 1/σ: the standard deviation of a line grows by
//! |H/H_w|².

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::criteria::LARGEST_WINDOW_SHARE;
use super::tool_tip::{mode_numbers, modes};
use super::{Frf, FrfError, FrfTable};

/// The table without the damping of an exponential window of time constant τ (`exponential_s`, s) on all its impacts; the
/// standard deviations of its entries follow.
///
/// # Errors
/// No mode can be fitted, or the decay of a mode is that of the window, so that its own cannot be told.
pub(super) fn without_exponential_window(
    table: &FrfTable,
    deviation: &mut [Vec<f64>],
    exponential_s: f64,
) -> Result<FrfTable, FrfError> {
    let refused = |what: String| FrfError::Content {
        path: table.path().into(),
        what,
    };
    let functions: Vec<&[Complex64]> = table
        .entries()
        .iter()
        .map(|entry| entry.receptance.as_slice())
        .collect();
    let fitted = modes(table.frequency_hz(), &functions).map_err(|error| {
        refused(format!(
            "the damping of the exponential window cannot be taken off, since no mode can be fitted: {error}; a band with a resonance is needed"
        ))
    })?;
    let found = mode_numbers(&fitted);
    if found.is_empty() {
        return Err(refused(format!(
            "no resonance stands out under the exponential window of {exponential_s} s, whose damping therefore cannot be taken off; \
             take a longer time constant, or no window"
        )));
    }
    let mut entries: Vec<Frf> = table.entries().to_vec();
    for mode in found {
        let pole = fitted.poles[mode];
        let own = pole + 1.0 / exponential_s;
        if -own.re < (1.0 - LARGEST_WINDOW_SHARE) * -pole.re {
            return Err(refused(format!(
                "the mode at {:.2} Hz decays with {:.3} 1/s, of which the exponential window makes {:.3} 1/s: its own damping cannot be told; \
                 take a longer time constant than {exponential_s} s, or no window",
                pole.norm() / TAU,
                -pole.re,
                1.0 / exponential_s
            )));
        }
        for (function, entry) in entries.iter_mut().enumerate() {
            let residue = fitted.residues[function][mode];
            for (value, &hertz) in entry.receptance.iter_mut().zip(table.frequency_hz()) {
                let s = Complex64::new(0.0, TAU * hertz);
                let pair = |pole: Complex64| residue / (s - pole) + residue.conj() / (s - pole.conj());
                *value += pair(own) - pair(pole);
            }
        }
    }
    for ((entry, before), deviation) in entries.iter().zip(table.entries()).zip(deviation) {
        for ((h, windowed), deviation) in entry.receptance.iter().zip(&before.receptance).zip(deviation) {
            *deviation *= (h.norm_sqr() / windowed.norm_sqr().max(f64::MIN_POSITIVE)).max(1.0);
        }
    }
    FrfTable::new(table.path(), table.frequency_hz().to_vec(), entries)
}
