//! `--method backbone`: natural frequency and damping ratio over the amplitude, from free decays and from force tests at several levels.

use super::Error;
use super::answer::IdentifyOutput;
use super::args::Args;
use super::backbone_answer::{Backbone, Decay, Levels, is_free_decay};
use super::written::wants_picture;
use crate::cli::frf::levels_without_peak;
use crate::frf::{MeasurementSettings, level_peaks, measure_levels};
use crate::recording::Recording;
use crate::report::backbone_chart::backbone_chart;

/// Frequency and damping over the amplitude, from all recordings.
pub(super) fn backbone(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let (decays, forced): (Vec<&Recording>, Vec<&Recording>) =
        recordings.iter().partition(|recording| is_free_decay(recording));
    let mut found = Backbone::default();
    let mut warnings = Vec::new();
    for recording in decays {
        let decay = Decay::of(recording, args.band_hz)?;
        warnings.extend(decay.warnings());
        found.decays.push(decay);
    }
    if !forced.is_empty() {
        let forced: Vec<Recording> = forced.into_iter().cloned().collect();
        let settings = MeasurementSettings {
            band_hz: args.band_hz.map(|[low, high]| (low, high)),
            resolution_hz: args.modes.resolution_hz,
            ..MeasurementSettings::default()
        };
        let levels = measure_levels(&forced, &settings)?;
        for warning in levels.iter().flat_map(|level| &level.measurement.warnings) {
            if !warnings.contains(warning) {
                warnings.push(warning.clone());
            }
        }
        let peaks = level_peaks(&forced, &settings, &levels)?;
        if peaks.is_empty() && found.decays.is_empty() {
            // Often the reason: too few periods or clipped samples.
            let reasons: String = warnings.iter().map(|warning| format!("; {warning}")).collect();
            return Err(Error::input(format!(
                "{}: at no force level does a receptance have a peak with eight lines that falls to half its power on both sides; take a finer \
                 resolution by --resolution-hz, or a wider --band-hz{reasons}",
                forced[0].path.display()
            )));
        }
        warnings.extend(levels_without_peak(&levels, &peaks));
        found.levels = peaks.iter().map(|of| Levels::new(&levels, of)).collect();
        warnings.extend(found.levels.iter().filter_map(Levels::warning));
    }
    let messages = found.lines();
    let picture = wants_picture(&args.out)
        .then(|| backbone_chart(&found.drawn()))
        .transpose()
        .map_err(|error| Error::other(error.to_string()))?
        .map(|svg| (svg, CAPTION));
    Ok(IdentifyOutput {
        backbone: Some(found),
        warnings,
        messages,
        picture,
        ..IdentifyOutput::of("backbone", Vec::new(), Vec::new())
    })
}

const CAPTION: &str =
    "Natural frequency and damping ratio over the amplitude of the displacement, with 90 % intervals.";
