//! Receptances measured separately at each force level: those of a nonlinear structure differ from level to level.

use super::criteria::SAME_FORCE;
use super::error::FrfError;
use super::excitation::Excitation;
use super::force_level::force_level;
use super::measurement::{Measurement, measure};
use super::measurement_settings::MeasurementSettings;
use super::step_sine::step_sine;
use super::test_channels::TestChannels;
use quietcut_recording::Recording;

/// Receptances measured at one force level.
#[derive(Clone, Debug)]
pub struct LevelMeasurement {
    /// Force level, N. Step-sine test: median of the amplitudes of the frequency steps in the first pass at this level.
    /// Otherwise the mean over the recordings of the level: of the median peak of the impacts of a hammer, or of the
    /// root mean square of any other force. Several forces are combined as the root of the sum of their squares.
    pub force_n: f64,
    /// True for a step-sine test: the level is the amplitude of a sine, and |H| times the level is that of the
    /// response.
    pub is_amplitude: bool,
    /// Indices of the recordings of this level among those that were measured.
    pub recordings: Vec<usize>,
    /// The receptances at this level.
    pub measurement: Measurement,
}

/// Measures the receptances of each force level of the recordings, in ascending order of the level. The levels of a
/// step-sine record are evaluated one by one; other recordings are measured together if their levels are within the
/// factor `SAME_FORCE` of the lowest of them.
///
/// # Errors
/// As [`measure`].
pub fn measure_levels(
    recordings: &[Recording],
    settings: &MeasurementSettings,
) -> Result<Vec<LevelMeasurement>, FrfError> {
    let mut found = Vec::new();
    let mut others: Vec<(f64, usize)> = Vec::new();
    for (at, recording) in recordings.iter().enumerate() {
        let channels = TestChannels::of(recording, &settings.channels)?;
        let excitation = settings
            .excitation
            .unwrap_or_else(|| Excitation::of_recording(recording));
        if excitation != Excitation::StepSine {
            others.push((force_level(&channels, excitation), at));
            continue;
        }
        for level in step_sine(&channels)?.levels {
            let one = MeasurementSettings {
                force_n: Some(level.force_n),
                ..settings.clone()
            };
            found.push(LevelMeasurement {
                force_n: level.force_n,
                is_amplitude: true,
                recordings: vec![at],
                measurement: measure(std::slice::from_ref(recording), &one)?,
            });
        }
    }
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut rest = others.as_slice();
    while let Some(&(lowest, _)) = rest.first() {
        let count = rest.partition_point(|(level, _)| *level <= SAME_FORCE * lowest);
        let (same, higher) = rest.split_at(count.max(1));
        let together: Vec<Recording> = same.iter().map(|(_, at)| recordings[*at].clone()).collect();
        found.push(LevelMeasurement {
            force_n: same.iter().map(|(level, _)| level).sum::<f64>() / same.len() as f64,
            is_amplitude: false,
            recordings: same.iter().map(|(_, at)| *at).collect(),
            measurement: measure(&together, settings)?,
        });
        rest = higher;
    }
    found.sort_by(|a, b| a.force_n.total_cmp(&b.force_n));
    Ok(found)
}
