//! Warnings and refusals by aliasing: content above half the sample rate that folds into a hammer test.

use super::related_lines;
use crate::cli::Error;
use crate::criteria::{FOLDING_OF_NOISE, LARGEST_FOLDING, SMALL_FOLDING};
use crate::frf::{Frf, Measurement};
use crate::recording::{Recording, channel_section};

/// Adds a warning about the receptance whose peak aliasing (content above half the sample rate, folded into the record)
/// may change most, if this relative change is above [`SMALL_FOLDING`]. A change above [`LARGEST_FOLDING`] is an error.
/// Only drive points count, if the measurement has any. `chosen` holds the names of the channels to evaluate.
pub(crate) fn check_folding(
    measurement: &mut Measurement,
    recordings: &[Recording],
    chosen: &[String],
) -> Result<(), Error> {
    // The peak is taken at the line with the largest |H| divided by the relative error by aliasing, among the lines
    // where the force causes the response. |H| alone may be largest where the force spectrum almost vanishes; one term
    // of the error is inversely proportional to that spectrum, so that the quotient is small there.
    // Without coherence, lines of noise cannot be told by it: those count only if no other line does.
    fn at_peak<'a>((entry, folding): (&'a Frf, &'a [f64])) -> (&'a Frf, f64) {
        let is_noise = |line: usize| entry.coherence.is_none() && folding[line] >= FOLDING_OF_NOISE;
        let excited = |line: usize| {
            if is_noise(line) {
                0.0
            } else {
                entry.receptance[line].norm() / folding[line].max(f64::MIN_POSITIVE)
            }
        };
        let peak = related_lines::largest(entry, excited);
        (entry, folding.get(peak).copied().unwrap_or(0.0))
    }
    let entries = measurement.table.entries();
    // Near half the sample rate the response in a weakly coupled direction may be noise of its sensor. The error by
    // aliasing does not tell how much of this noise folds.
    let has_drive_point = entries.iter().any(|entry| entry.response == entry.force);
    let worst = entries
        .iter()
        .filter(|entry| !has_drive_point || entry.response == entry.force)
        .filter_map(|entry| Some((entry, entry.folding.as_deref()?)))
        .map(at_peak)
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((entry, error)) = worst.filter(|(_, error)| *error > 0.0) else {
        return Ok(());
    };
    let name = entry.name();
    let remedy = format!(
        "a softer tip of the hammer, a higher sample rate or an anti-aliasing filter helps; if there was a filter, say anti_aliasing = true \
         under {} in the sidecar",
        sections(entry, recordings, chosen).join(" and ")
    );
    if error > LARGEST_FOLDING {
        return Err(Error::input(format!(
            "{}: content above half the sample rate folds into the record and may change the peak of H{name} by {:.0} %, more than {:.0} %: {remedy}",
            measurement.table.path().display(),
            100.0 * error,
            100.0 * LARGEST_FOLDING
        )));
    }
    if error > SMALL_FOLDING {
        measurement.warnings.push(format!(
            "content above half the sample rate folds into the record: it may change the peak of H{name} by {:.1} %, which is in its interval; {remedy}",
            100.0 * error
        ));
    }
    Ok(())
}

/// Sections of the sidecar that describe the channels of force and response of a receptance, such as `[channels.fx]`.
fn sections(entry: &Frf, recordings: &[Recording], chosen: &[String]) -> Vec<String> {
    let force = format!("f{}", entry.force);
    let recording = recordings
        .iter()
        .find(|recording| recording.channel(&force).is_some());
    let responses = ["", "v", "a"].map(|letter| format!("{letter}{}", entry.response));
    let recorded =
        |name: &&String| recording.is_some_and(|recording| recording.channel(name.as_str()).is_some());
    let response = responses
        .iter()
        .filter(recorded)
        .find(|name| chosen.contains(name))
        .or_else(|| responses.iter().find(recorded));
    let section = |name: &String| {
        let known = recording.and_then(|recording| recording.sidecar.section_of(name));
        channel_section(known.unwrap_or(name))
    };
    std::iter::once(&force).chain(response).map(section).collect()
}
