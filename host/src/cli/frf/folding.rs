//! Warnings and refusals by aliasing: content above half the sample rate that folds into a hammer test.

use super::related_lines;
use crate::cli::Error;
use crate::criteria::{FOLDING_OF_NOISE, LARGEST_FOLDING, SMALL_FOLDING};
use crate::frf::{Frf, Measurement};
use crate::recording::{Recording, channel_section};

/// Adds a warning about the receptance whose peak aliasing (content above half the sample rate, folded into the record)
/// may change most, as [`warn_of_folding`]; a change above [`LARGEST_FOLDING`] is an error.
pub(super) fn check_folding(
    measurement: &mut Measurement,
    recordings: &[Recording],
    chosen: &[String],
) -> Result<(), Error> {
    if let Some(worst) = Folding::worst(measurement, recordings, chosen) {
        if worst.error > LARGEST_FOLDING {
            return Err(Error::input(format!(
                "{}: content above half the sample rate folds into the record and may change the peak of H{} by {:.0} %, more than {:.0} %: {}",
                measurement.table.path().display(),
                worst.name,
                100.0 * worst.error,
                100.0 * LARGEST_FOLDING,
                worst.remedy
            )));
        }
        worst.warn(measurement);
    }
    Ok(())
}

/// Adds a warning about the receptance whose peak aliasing may change most, if this relative change is above
/// [`SMALL_FOLDING`]. Only drive points count, if the measurement has any. Modes have the error in their intervals, however
/// large it is.
pub(crate) fn warn_of_folding(measurement: &mut Measurement, recordings: &[Recording]) {
    if let Some(worst) = Folding::worst(measurement, recordings, &[]) {
        worst.warn(measurement);
    }
}

/// Largest relative error of the peak of a receptance by aliasing.
struct Folding {
    name: String,
    error: f64,
    remedy: String,
}

impl Folding {
    fn warn(&self, measurement: &mut Measurement) {
        if self.error > SMALL_FOLDING {
            measurement.warnings.push(format!(
                "content above half the sample rate folds into the record: it may change the peak of H{} by {:.1} %, which is in its interval; {}",
                self.name,
                100.0 * self.error,
                self.remedy
            ));
        }
    }

    /// That of the drive point with the largest error, or of all receptances without drive points; `None` without any error.
    /// `chosen` holds the names of the channels to evaluate.
    fn worst(measurement: &Measurement, recordings: &[Recording], chosen: &[String]) -> Option<Self> {
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
        let (entry, error) = worst.filter(|(_, error)| *error > 0.0)?;
        Some(Self {
            name: entry.name(),
            error,
            remedy: format!(
                "a softer tip of the hammer, a higher sample rate or an anti-aliasing filter helps; if there was a filter, say anti_aliasing = true \
             under {} in the sidecar",
                sections(entry, recordings, chosen).join(" and ")
            ),
        })
    }
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
