//! Receptances of a step-sine test: one frequency line per frequency step.

use super::recording_group::{MeasuredGroup, RecordingGroup, receptances};
use crate::criteria::{SAME_FORCE, SUBSEGMENT_SAMPLES_MIN};
use crate::error::FrfError;
use crate::estimate::FrfLine;
use crate::measurement_settings::MeasurementSettings;
use crate::step_sine::{ForceLevel, step_sine};
use crate::test_channels::TestChannels;

/// Measures the receptances of one force level of a step-sine test, one frequency line per step within the band to
/// evaluate.
pub(super) fn stepped(
    mut group: RecordingGroup,
    members: &[TestChannels<'_>],
    settings: &MeasurementSettings,
    mut warnings: Vec<String>,
) -> Result<MeasuredGroup, FrfError> {
    let first = &members[0];
    if let [_, second, ..] = members {
        return Err(FrfError::Content {
            path: second.recording.path.clone(),
            what:
                "two step-sine tests of the same force; measure them one by one, as their frequencies differ"
                    .into(),
        });
    }
    let step_sine = step_sine(first)?;
    let listed = |frequencies_hz: Vec<f64>, digits: usize| {
        let listed = frequencies_hz.iter().map(|hertz| format!("{hertz:.digits$}"));
        listed.collect::<Vec<_>>().join(", ")
    };
    if !step_sine.unresolved_hz.is_empty() {
        warnings.push(format!(
            "frequency steps with fewer than {SUBSEGMENT_SAMPLES_MIN} samples per period are left out: at about {} Hz; a higher sampling rate is needed",
            listed(step_sine.unresolved_hz, 0)
        ));
    }
    let steps = level(first, step_sine.levels, settings.force_n)?.steps;
    let unsettled: Vec<f64> = steps
        .iter()
        .filter(|step| !step.is_settled)
        .map(|step| step.frequency_hz)
        .collect();
    if !unsettled.is_empty() {
        warnings.push(format!(
            "the response had not settled at {} Hz; stay longer at each frequency",
            listed(unsettled, 3)
        ));
    }
    let (least, most) = steps
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(least, most), step| {
            (least.min(step.force_n), most.max(step.force_n))
        });
    if most > SAME_FORCE * least {
        warnings.push(format!(
            "the force goes from {least:.3} to {most:.3} N: the FRF of a nonlinear structure is another for each"
        ));
    }
    let (low, high) = settings.band_hz.unwrap_or((0.0, f64::INFINITY));
    let lines: Vec<FrfLine> = steps
        .iter()
        .filter(|step| (low..=high).contains(&step.frequency_hz))
        .map(|step| {
            let mut line = FrfLine {
                frequency_hz: step.frequency_hz,
                h: crate::small_matrix::ZERO,
                coherence: [0.0; 3],
                deviation: [[0.0; 3]; 3],
                folding: [0.0; 3],
                singular: (1.0, 1.0),
            };
            for p in 0..step.h.len() {
                line.h[p][0] = step.h[p];
                line.coherence[p] = step.coherence[p];
                line.deviation[p][0] = step.deviation[p];
            }
            line
        })
        .collect();
    group.averages = 1.0;
    Ok(receptances(group, &lines, first, warnings))
}

/// Force level of a step-sine test to evaluate: without `force_n` (N) the only level of the test, otherwise the level
/// whose ratio to `force_n` is nearest to 1, if it is within the factor [`SAME_FORCE`]. An error if there is no such
/// level.
fn level(
    channels: &TestChannels<'_>,
    mut levels: Vec<ForceLevel>,
    force_n: Option<f64>,
) -> Result<ForceLevel, FrfError> {
    let all: Vec<String> = levels
        .iter()
        .map(|level| format!("{:.4}", level.force_n))
        .collect();
    let off = |level: &ForceLevel, wanted: f64| (level.force_n / wanted).ln().abs();
    let found = match force_n {
        None if levels.len() == 1 => Some(0),
        None => None,
        Some(wanted) => (0..levels.len())
            .min_by(|&a, &b| off(&levels[a], wanted).total_cmp(&off(&levels[b], wanted)))
            .filter(|&index| off(&levels[index], wanted) < SAME_FORCE.ln()),
    };
    match found {
        Some(index) => Ok(levels.swap_remove(index)),
        None => Err(FrfError::Content {
            path: channels.recording.path.clone(),
            what: format!(
                "a step-sine test at {} N; say by --force-n which of these is meant",
                all.join(", ")
            ),
        }),
    }
}
