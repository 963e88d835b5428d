//! Error of hammer tests by aliasing: an analog-to-digital converter without an anti-aliasing filter folds content
//! above half the sample rate into the record.
//!
//! A sample rate f_s folds the contents at k f_s − f and k f_s + f, k = 1, 2, …, onto the line f. The record does not
//! show them, but allows an estimate: at half the sample rate the contents of both sides of f_s/2 add up, so that the
//! level A(f_s/2) of the record is up to twice the true one, and is taken as twice the true one. The force of an impact
//! begins and ends at zero without a jump, and the spectrum of such a pulse falls as 1/f² (Bracewell, The Fourier
//! Transform and Its Applications, chapter 8). At k f_s ± f, with f far below f_s/2, it is therefore estimated as
//! A(f_s/2)/(8 k²), and all k and both sides together fold at most
//!
//!   A(f_s/2)/4 · Σ 1/k² = π²/24 · A(f_s/2)
//!
//! onto the line. The same holds for the response, even as an acceleration, which follows a force without jumps. The
//! estimates for force and response, each relative to the level of its channel at the line, add up to the largest
//! relative error of the frequency response function.

use crate::cross_spectra::{CrossSpectra, Segments, averaged};
use crate::test_channels::TestChannels;

/// Width of the band below half the sample rate from which the level there is estimated, as a fraction of half the
/// sample rate. The largest level of the band, scaled to half the sample rate by 1/f², is used. The spectrum of a pulse
/// of n samples has zeros at about every n-th part of the sample rate: an eighth of the sample rate, the width of the
/// band, holds a maximum between zeros for pulses of more than 8 samples.
const TOP: f64 = 0.25;

/// Largest spectral level that aliasing adds to a frequency line far below half the sample rate, as a fraction of the
/// level at half the sample rate: π²/24.
const FOLDED: f64 = std::f64::consts::PI * std::f64::consts::PI / 24.0;

/// Largest power near half the sample rate of every channel of a hammer test, by channel, forces first. Each power is
/// scaled to half the sample rate by 1/f⁴ and at the scale of the cross-spectra; it is 0 for a channel for which the
/// sidecar states an anti-aliasing filter.
pub(super) fn top_powers(
    channels: &TestChannels<'_>,
    signals: &[&[f64]],
    rate: f64,
    segments: &Segments,
) -> Vec<f64> {
    let half = segments.weights.len() / 2;
    let first = half - (TOP * half as f64) as usize;
    let top = averaged(signals, rate, segments, first..half + 1);
    let is_filtered = |name: &str| {
        let described = channels.recording.sidecar.channel(name);
        described
            .and_then(|channel| channel.anti_aliasing)
            .unwrap_or(false)
    };
    let forces = channels.forces.iter().map(|(_, channel)| channel.name.as_str());
    let responses = channels
        .responses
        .iter()
        .map(|response| response.channel.name.as_str());
    forces
        .chain(responses)
        .enumerate()
        .map(|(index, name)| {
            if is_filtered(name) {
                return 0.0;
            }
            let half_hz = 0.5 * rate;
            // The level of a channel at each line is scaled to half the sample rate by 1/f², its power by 1/f⁴.
            let powers = (0..top.frequency_hz.len())
                .map(|line| top.at(line, index, index).re * (top.frequency_hz[line] / half_hz).powi(4));
            powers.fold(0.0, f64::max)
        })
        .collect()
}

/// Estimate of the largest relative error by aliasing of the frequency response function of one response at one line,
/// with one force; `tops` are the [`top_powers`] of the test.
pub(super) fn relative_error(spectra: &CrossSpectra, tops: &[f64], line: usize, response: usize) -> f64 {
    let share = |channel: usize| {
        let power = spectra.at(line, channel, channel).re;
        if tops[channel] > 0.0 {
            FOLDED * (tops[channel] / power.max(f64::MIN_POSITIVE)).sqrt()
        } else {
            0.0
        }
    };
    share(0) + share(1 + response)
}
