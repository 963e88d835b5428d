//! Spectra of records with continuous excitation: random, cuts and sweeps.

use crate::clipping::Clipping;
use crate::cross_spectra::{CrossSpectra, Segments, averaged, smoothed};
use crate::error::FrfError;
use crate::excitation::Excitation;
use crate::measurement_settings::{MeasurementSettings, band};
use crate::test_channels::TestChannels;
use crate::window::fast_length;

/// Auto- and cross-spectra of the record `channels` within the band to evaluate: of a sweep over groups of neighbouring
/// lines, of random excitation over the segments without clipped samples. If the settings have no resolution, the
/// shortest of the records `members` determines the length of the segments.
pub(super) fn steady(
    excitation: Excitation,
    channels: &TestChannels<'_>,
    members: &[TestChannels<'_>],
    settings: &MeasurementSettings,
    warnings: &mut Vec<String>,
) -> Result<CrossSpectra, FrfError> {
    let rate = channels.recording.sample_rate_hz;
    let samples = members
        .iter()
        .map(|member| member.recording.len())
        .min()
        .unwrap_or(0);
    let forces = channels.forces.len();
    let too_short = |needed: usize| FrfError::Content {
        path: channels.recording.path.clone(),
        what: match settings.resolution_hz {
            Some(hertz) => format!(
                "{samples} samples ({:.3} s), but a resolution of {hertz} Hz needs {needed}",
                samples as f64 / rate
            ),
            None => format!(
                "{samples} samples ({:.3} s) are too few for {SEGMENTS_PER_FORCE} segments per force of 16 samples or more; a longer record is needed",
                samples as f64 / rate
            ),
        },
    };
    if excitation == Excitation::Sweep {
        let length = fast_length(channels.recording.len());
        let width = match settings.resolution_hz {
            Some(hertz) => (hertz * length as f64 / rate).round() as usize,
            None => LINES_PER_FORCE * forces,
        };
        if width == 0 {
            return Err(too_short((rate / settings.resolution_hz.unwrap_or(1.0)) as usize));
        }
        let band = band(settings, rate, length);
        return Ok(smoothed(&channels.signals(), rate, TAPER, width, band));
    }
    let length = match settings.resolution_hz {
        Some(hertz) => (rate / hertz).round() as usize,
        None => 2 * samples / (SEGMENTS_PER_FORCE * forces + 1),
    };
    let length = fast_length(length);
    if length > samples || length < 16 {
        return Err(too_short(length));
    }
    let mut segments = Segments::overlapping(
        settings.window.weights(length),
        settings.overlap,
        channels.recording.len(),
    );
    let clipping = Clipping::of(channels);
    let count = segments.starts.len();
    let clipped = segments.leave_out(|samples| clipping.holds(samples));
    let warning = clipping.warning(clipped, count, "segments");
    warnings.extend(warning.map_err(|what| FrfError::Content {
        path: channels.recording.path.clone(),
        what,
    })?);
    Ok(averaged(
        &channels.signals(),
        rate,
        &segments,
        band(settings, rate, length),
    ))
}

/// Number of segments for each force into which half overlap divides the shortest random record if no frequency
/// resolution is set, before the segment length is rounded up for the FFT. A choice between random error and
/// resolution.
const SEGMENTS_PER_FORCE: usize = 8;

/// Number of neighbouring frequency lines averaged in a sweep for each force if no frequency resolution is set. A
/// choice between random error and resolution.
const LINES_PER_FORCE: usize = 8;

/// Length of the taper at each end of the record of a sweep, as a fraction of the record. A choice: the taper reduces
/// leakage from vibration at the ends of the record.
const TAPER: f64 = 0.01;
