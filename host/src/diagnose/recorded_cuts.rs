//! The cuts among recordings as cuts that were tried: what came of each is what the signal chain of the device hears in it.

use quietcut_core::detector::Verdict;
use quietcut_core::monitor::{Monitor, State};

use crate::case::Case;
use crate::recording::{Kind, RecordedCut, Recording, Sensed, Speed};
use crate::test_cuts::{Outcome, TestCut};

/// Immersion angles and feeds that are no further apart are those of the same chart.
const SAME_DEG: f64 = 0.5;
const SAME_FEED: f64 = 1e-3;

/// The recorded cuts that are on the chart of a case: with its immersion and feed, at one speed and one depth, both said.
pub fn recorded_cuts(case: &Case, recordings: &[Recording]) -> Vec<TestCut> {
    recordings
        .iter()
        .filter(|recording| recording.sidecar.kind == Some(Kind::Cutting))
        .filter_map(|recording| {
            let said = recording.sidecar.cut?;
            Some(TestCut {
                rpm: said.spindle_rpm.filter(|_| is_on_chart(case, &said))?,
                depth_mm: said.axial_depth_mm?,
                outcome: outcome(recording, case.tool.as_ref().map(|tool| tool.teeth)),
            })
        })
        .collect()
}

fn is_on_chart(case: &Case, said: &RecordedCut) -> bool {
    let Some(believed) = case.cut else { return false };
    let near = |said: Option<f64>, believed: f64, apart: f64| {
        said.is_none_or(|said| (said - believed).abs() <= apart)
    };
    said.last_rpm.is_none()
        && near(said.start_deg, believed.start_deg, SAME_DEG)
        && near(said.exit_deg, believed.exit_deg, SAME_DEG)
        && near(
            said.feed_per_tooth_mm,
            believed.feed_per_tooth_mm,
            SAME_FEED * believed.feed_per_tooth_mm,
        )
}

/// Chatter where it is heard at any time, else the last verdict; marginal where none is given, or the recording has nothing that the
/// device could hear.
fn outcome(recording: &Recording, teeth: Option<usize>) -> Outcome {
    let recorded = recording.sidecar.cut.and_then(|cut| cut.teeth);
    let speed = Speed {
        rpm: None,
        teeth: teeth
            .filter(|_| recorded.is_none())
            .and_then(|teeth| teeth.try_into().ok()),
    };
    let Ok(sensed) = Sensed::new(recording, speed) else {
        return Outcome::Marginal;
    };
    let Ok(monitor) = Monitor::new(sensed.settings) else {
        return Outcome::Marginal;
    };
    let mut state = State::default();
    let mut last = Outcome::Marginal;
    for (block, edges) in sensed.steps() {
        let report = monitor.step(&mut state, block, edges, None, None);
        last = match report.judgement.verdict {
            verdict if verdict.is_chatter() => return Outcome::Chatter,
            Verdict::Stable | Verdict::Forced | Verdict::Runout => Outcome::Stable,
            _ => Outcome::Marginal,
        };
    }
    last
}
