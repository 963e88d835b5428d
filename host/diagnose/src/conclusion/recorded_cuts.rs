//! Recorded cuts as trial cuts. The signal chain of the chatter monitor determines the outcome of each.

use crate::criteria::{SAME_FEED, SAME_IMMERSION_DEG};
use quietcut_core::detector::Verdict;
use quietcut_core::monitor::{Monitor, State};

use quietcut_model::case::Case;
use quietcut_recording::{RecordedCut, Recording, Sensed, SpindleSettings, TestKind};
use quietcut_stability::trial_cuts::{Outcome, TrialCut};

/// The recorded cuts that belong to the stability chart of a case, as trial cuts: those whose sidecar gives one spindle
/// speed and an axial depth, and whose immersion and feed, if the sidecar gives them, agree with those of the case. The
/// second value holds one warning, with the reason, for each cut whose outcome cannot be determined and which therefore
/// counts as marginal.
pub fn recorded_cuts(case: &Case, recordings: &[Recording]) -> (Vec<TrialCut>, Vec<String>) {
    let mut warnings = Vec::new();
    let cuts = recordings
        .iter()
        .filter(|recording| recording.sidecar.kind == Some(TestKind::Cutting))
        .filter_map(|recording| {
            let given = recording.sidecar.cut?;
            let rpm = given.spindle_rpm.filter(|_| is_on_chart(case, &given))?;
            let depth_mm = given.axial_depth_mm?;
            let outcome = outcome(recording, case.tool.as_ref().map(|tool| tool.teeth));
            Some(TrialCut {
                rpm,
                depth_mm,
                outcome: outcome.unwrap_or_else(|reason| {
                    warnings.push(format!("a recorded cut counts as marginal: {reason}"));
                    Outcome::Marginal
                }),
                chatter_hz: None,
            })
        })
        .collect();
    (cuts, warnings)
}

fn is_on_chart(case: &Case, given: &RecordedCut) -> bool {
    let Some(baseline) = case.cut else { return false };
    let near = |given: Option<f64>, baseline: f64, apart: f64| {
        given.is_none_or(|given| (given - baseline).abs() <= apart)
    };
    given.last_rpm.is_none()
        && near(given.start_deg, baseline.start_deg, SAME_IMMERSION_DEG)
        && near(given.exit_deg, baseline.exit_deg, SAME_IMMERSION_DEG)
        && near(
            given.feed_per_tooth_mm,
            baseline.feed_per_tooth_mm,
            SAME_FEED * baseline.feed_per_tooth_mm,
        )
}

/// Outcome of a recorded cut: chatter if the chatter monitor detects it at any time; stable if the monitor reports a
/// stable cut, forced vibration or runout, and no chatter; marginal otherwise.
///
/// # Errors
/// The chatter monitor cannot evaluate the recording; the error is a sentence.
fn outcome(recording: &Recording, teeth: Option<usize>) -> Result<Outcome, String> {
    let recorded = recording.sidecar.cut.and_then(|cut| cut.teeth);
    let speed = SpindleSettings {
        rpm: None,
        teeth: teeth
            .filter(|_| recorded.is_none())
            .and_then(|teeth| teeth.try_into().ok()),
    };
    let sensed = Sensed::new(recording, speed).map_err(|error| error.to_string())?;
    let monitor =
        Monitor::new(sensed.settings).map_err(|error| format!("{}: {error}", recording.path.display()))?;
    let mut state = State::default();
    let mut detected = Outcome::Marginal;
    for (block, edges) in sensed.steps() {
        let report = monitor.step(&mut state, block, edges, None, None);
        match report.judgement.verdict {
            verdict if verdict.is_chatter() => return Ok(Outcome::Chatter),
            Verdict::Stable | Verdict::Forced | Verdict::Runout => detected = Outcome::Stable,
            // An air cut and an indeterminate verdict say nothing about the stability of the cut.
            _ => {}
        }
    }
    Ok(detected)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use quietcut_simulate::{Accelerometer, Entry, Recorder, TachometerModel, VirtualCut};
    use quietcut_stability::{CubicTerms, Problem, line};

    #[test]
    fn the_outcome_of_a_recorded_cut_is_that_of_the_signal_chain() {
        let case = quietcut_testkit::case("kuka-kr90-acetal");
        let problem = Problem::new(&case, CubicTerms::Refuse).unwrap();
        let limit_mm = line(&problem, 900.0, 8.0, 80)
            .unwrap()
            .first_limit
            .unwrap()
            .depth_mm;
        let record = |depth_mm| {
            let cut = VirtualCut {
                entry: Entry::Ramp { seconds: 0.2 },
                ..VirtualCut::new(900.0, depth_mm, 4.0)
            };
            let recorder = Recorder::Sensor {
                accelerometer: Accelerometer::IIS3DWB_16G,
                seed: 7,
            };
            let path = Path::new("cut.csv");
            cut.record(&case, recorder, TachometerModel::ONE_MARK, path)
                .unwrap()
                .0
        };
        let shallow = record(0.5 * limit_mm);
        let mut silent = shallow.clone();
        silent.channels.retain(|channel| !channel.name.starts_with('a'));
        let mut elsewhere = shallow.clone();
        elsewhere.sidecar.cut.as_mut().unwrap().exit_deg = Some(150.0);
        let (cuts, warnings) = recorded_cuts(&case, &[shallow, record(1.8 * limit_mm), silent, elsewhere]);
        let outcomes: Vec<Outcome> = cuts.iter().map(|cut| cut.outcome).collect();
        // The device evaluates no recording without acceleration.
        assert!(
            warnings.len() == 1 && warnings[0].contains("a recorded cut counts as marginal: "),
            "{warnings:?}"
        );
        // A cut of another immersion belongs to another chart.
        assert_eq!(outcomes, [Outcome::Stable, Outcome::Chatter, Outcome::Marginal]);
        assert_eq!((cuts[1].rpm, cuts[1].depth_mm), (900.0, 1.8 * limit_mm));
    }
}
