//! Removal of the damping that an exponential window adds to a hammer test.
//!
//! With e^{−t/τ} on force and response the estimate is H(iω + 1/τ): every pole of the structure appears moved by −1/τ.
//! The resonance peaks are then too low, and depth limits computed from them too high. Modes are fitted to the
//! estimate, and each is replaced by the mode with its pole moved back by 1/τ:
//!
//!   H(iω) = H_w(iω) + Σ_r [R_r/(iω − λ_r − 1/τ) − R_r/(iω − λ_r)] + conjugate pairs.
//!
//! The sum runs over the poles λ_r and residues R_r fitted to the windowed estimate H_w, as far as they count as modes.
//! The contribution of modes outside the band is left as it is: it changes little over the distance 1/τ. A relative
//! error of the measured decay rate σ_w is larger by the factor σ_w/σ for the decay rate σ of the mode itself, and so
//! is that of the peak, which is proportional to 1/σ. With |H/H_w| for this factor, the relative standard deviation of
//! a line grows by |H/H_w| and the absolute one by |H/H_w|², if this is above 1.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::criteria::LARGEST_WINDOW_SHARE;
use super::tool_tip::{mode_numbers, modes};
use super::{Frf, FrfError, FrfTable};

/// FRF table without the damping that an exponential window of time constant τ (`exponential_s`, s) on all impacts has
/// added. The standard deviations `deviation`, by entry of the table, then by line, are scaled in place.
///
/// # Errors
/// No mode can be fitted, or no fitted pole counts as a mode; the decay rate of a mode is nearly that of the window
/// alone, so that the damping of the mode is not identifiable; or a corrected receptance is not finite.
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
