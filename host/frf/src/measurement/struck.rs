//! Spectra of hammer tests.

use super::folding::top_powers;
use super::recording_group::RecordingGroup;
use crate::criteria::{END_AMPLITUDE, IMPACTS_MIN};
use crate::cross_spectra::{CrossSpectra, Segments, averaged};
use crate::error::FrfError;
use crate::excitation::Excitation;
use crate::hammer::{self, HammerWindows, MeasuredImpact};
use crate::measurement_settings::{MeasurementSettings, band};
use crate::test_channels::TestChannels;
use crate::test_plausibility;

/// Length of the segments of all hammer tests, s, if they form several groups: the shortest of the lengths that
/// [`hammer::segments`] selects for the recordings by default. With segments of different lengths, taps in x and in y
/// would have different frequency lines. `None` with fewer than two groups of hammer tests.
///
/// # Errors
/// As [`hammer::segments`].
pub(super) fn common_segment_s(
    groups: &[(Excitation, Vec<TestChannels<'_>>)],
) -> Result<Option<f64>, FrfError> {
    let tests: Vec<&Vec<TestChannels<'_>>> = groups
        .iter()
        .filter(|(excitation, _)| *excitation == Excitation::Hammer)
        .map(|(_, members)| members)
        .collect();
    if tests.len() < 2 {
        return Ok(None);
    }
    let mut shortest_s = f64::INFINITY;
    for channels in tests.into_iter().flatten() {
        let cut = hammer::segments(channels, HammerWindows::default())?;
        shortest_s = shortest_s.min(cut.length as f64 / channels.recording.sample_rate_hz);
    }
    Ok(Some(shortest_s))
}

/// Auto- and cross-spectra of hammer tests with one segment for each used impact, and the [`top_powers`] of the
/// channels; one result for each recording. Sets the impacts of `group`.
pub(super) fn struck(
    group: &mut RecordingGroup,
    members: &[TestChannels<'_>],
    settings: &MeasurementSettings,
    warnings: &mut Vec<String>,
) -> Result<Vec<(CrossSpectra, Vec<f64>)>, FrfError> {
    let mut windows = settings.hammer;
    if windows.segment_s.is_none() {
        windows.segment_s = settings.resolution_hz.map(|hertz| 1.0 / hertz);
    }
    let mut cuts = members
        .iter()
        .map(|channels| hammer::segments(channels, windows))
        .collect::<Result<Vec<_>, _>>()?;
    let rate = members[0].recording.sample_rate_hz;
    let length = cuts.iter().map(|cut| cut.length).min().unwrap_or(0);
    if cuts.iter().any(|cut| cut.length != length) {
        // All recordings use the segment length of the one with the shortest segments, so that their frequency lines
        // agree.
        windows.segment_s = Some(length as f64 / rate);
        cuts = members
            .iter()
            .map(|channels| hammer::segments(channels, windows))
            .collect::<Result<Vec<_>, _>>()?;
    }
    let (mut used, mut double, mut cut_short, mut clipped) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut end_amplitude = 0.0_f64;
    let spectra = cuts
        .into_iter()
        .zip(members)
        .map(|(cut, channels)| {
            let segments = Segments {
                weights: vec![1.0; cut.length],
                starts: (0..cut.used.len()).map(|impact| impact * cut.length).collect(),
                without_mean: false,
                averages: cut.used.len() as f64,
            };
            let signals: Vec<&[f64]> = cut.signals.iter().map(Vec::as_slice).collect();
            let spectra = averaged(&signals, rate, &segments, band(settings, rate, cut.length));
            let tops = top_powers(channels, &signals, rate, &segments);
            used.extend(cut.used);
            double.extend(cut.double);
            cut_short.extend(cut.cut_short);
            clipped.extend(cut.clipped);
            end_amplitude = end_amplitude.max(cut.end_amplitude);
            (spectra, tops)
        })
        .collect();
    let times = |impacts: &[MeasuredImpact]| {
        let times: Vec<String> = impacts
            .iter()
            .map(|impact| format!("{:.3}", impact.time_s))
            .collect();
        times.join(", ")
    };
    if !double.is_empty() {
        warnings.push(format!("double impacts are left out: at {} s", times(&double)));
    }
    if !clipped.is_empty() {
        warnings.push(format!(
            "impacts with clipped samples are left out: at {} s; strike softer, or take a larger range of the sensor",
            times(&clipped)
        ));
    }
    if !cut_short.is_empty() {
        warnings.push(format!(
            "impacts without a whole segment of {:.3} s in the record are left out: at {} s",
            length as f64 / rate,
            times(&cut_short)
        ));
    }
    let hardest_n = used
        .iter()
        .fold(0.0_f64, |hardest, impact| hardest.max(impact.peak_n.abs()));
    if let [(_, force)] = members[0].forces[..] {
        warnings.extend(test_plausibility::impact(force, hardest_n));
    }
    if used.len() < IMPACTS_MIN {
        warnings.push(format!(
            "{} impacts: there is no coherence and no interval with fewer than {IMPACTS_MIN}; strike {IMPACTS_MIN} times or more",
            used.len()
        ));
    }
    if end_amplitude > END_AMPLITUDE {
        warnings.push(format!(
            "the response still is {:.0} % of its peak where segments end, which biases resonances; longer segments or an exponential window help",
            100.0 * end_amplitude
        ));
    }
    group.impacts = Some((used, double));
    Ok(spectra)
}
