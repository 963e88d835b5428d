//! Verdicts and advice as JSON objects: the output of `quietcut replay` and `quietcut monitor`.

use crate::criteria::SAME_SPEED;
use std::fmt;

use quietcut_core::advice::Advice;
use quietcut_core::monitor::Report;
use serde::Serialize;

use super::time::seconds;
use super::words;

/// Verdict of the chatter detector after one block of samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerdictAnswer {
    /// Time of the last sample of the block to which the verdict belongs, s, on the clock of the samples.
    pub t_s: f64,
    /// Key of the verdict, see [`words::verdict_key`].
    pub verdict: &'static str,
    /// True if the machine should be stopped or slowed: chatter, or "flip or runout" that is too large for runout. A device with version 1 of the
    /// protocol tells the former only.
    pub alarm: bool,
    /// Chatter frequency, Hz; `None` without chatter.
    pub chatter_hz: Option<f64>,
    /// Probability that the verdict is correct, 0 to 1, as the device estimates it.
    pub confidence: f64,
    /// Spindle speed, rev/min; `None` if it is unknown.
    pub spindle_rpm: Option<f64>,
    /// Advice of the device on speed and depth; `None` if there is none.
    pub advice: Option<AdviceAnswer>,
}

/// Advice on spindle speed and axial depth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AdviceAnswer {
    /// Key of the advised action, see [`words::action_key`].
    pub action: &'static str,
    /// Advised spindle speed, rev/min.
    pub rpm: f64,
    /// Advised axial depth, mm; `None` if the advice states no depth, for example without a working point.
    pub depth_mm: Option<f64>,
    /// Key of the source of the advice, see [`words::source_key`].
    pub source: &'static str,
    /// Whether the advice assumes a working point because none is set.
    pub assumed_working_point: bool,
    /// Reason for the advice, as text for the user.
    pub why: String,
}

impl VerdictAnswer {
    /// Converts the report of the signal chain on one block of samples.
    pub fn new(report: &Report) -> Self {
        let judgement = &report.judgement;
        Self {
            t_s: seconds(report),
            verdict: words::verdict_key(judgement.verdict),
            alarm: report.alarm || judgement.verdict.is_chatter(),
            chatter_hz: judgement.chatter.map(|chatter| number(chatter.0)),
            confidence: number(judgement.confidence),
            spindle_rpm: report.speed.map(|speed| number(speed.0)),
            advice: report
                .advice
                .as_ref()
                .map(|advice| AdviceAnswer::new(advice, report)),
        }
    }
}

impl AdviceAnswer {
    /// Converts the advice of `report`.
    pub fn new(advice: &Advice, report: &Report) -> Self {
        Self {
            action: words::action_key(advice.action),
            rpm: number(advice.speed.0),
            depth_mm: advice.depth.map(|depth| number(depth.0)),
            source: words::source_key(advice.source),
            assumed_working_point: advice.assumed.is_some(),
            why: words::why(advice, &report.judgement, report.speed),
        }
    }
}

/// Log of the changes in a sequence of reports: the output of `replay` and `monitor`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VerdictLog {
    /// The first verdict of the sequence, and every later one that differs from the entry before it in verdict or
    /// advice. A change of the advised speed by at most 1 % does not count, nor any change of speed or depth while the
    /// advice is to keep cutting.
    pub verdicts: Vec<VerdictAnswer>,
    /// Summary over all reports.
    pub summary: Summary,
}

/// Summary of a sequence of reports: main verdict, counts of blocks, clipped samples and gaps, and an assumption of the
/// advice.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Last verdict of a sequence of reports. `None` without any report.
    pub verdict: Option<&'static str>,
    /// Time of the report since which the last verdict holds, s, on the clock of the samples.
    pub since_s: Option<f64>,
    /// Chatter that was detected; `None` if there was none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chatter: Option<ChatterSummary>,
    /// Number of evaluated blocks.
    pub blocks: u64,
    /// Number of clipped acceleration samples since the signal chain was started or reset.
    pub clipped: u32,
    /// Number of gaps in the sequence of samples: reports that count more lost samples than the report before.
    pub gaps: u32,
    /// True if some advice is to change the speed while the speed limits of the spindle are not known, so that the
    /// advice assumes that every speed is possible. Only [`VerdictLog::assume_every_speed`] sets it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub assumes_every_speed: bool,
    #[serde(skip)]
    lost: u32,
}

/// Chatter in a sequence of reports.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ChatterSummary {
    /// First kind of chatter, see [`words::verdict_key`].
    pub verdict: &'static str,
    /// Time of the first report of chatter, s, on the clock of the samples.
    pub from_s: f64,
    /// Time of the last report of chatter, s, on the clock of the samples.
    pub to_s: f64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.verdict, self.since_s) {
            (Some(verdict), Some(since)) => write!(f, "{verdict} since {since:.2} s")?,
            _ => write!(f, "no verdict")?,
        }
        if let Some(ChatterSummary {
            verdict,
            from_s,
            to_s,
        }) = &self.chatter
        {
            write!(f, "; chatter ({verdict}) from {from_s:.2} to {to_s:.2} s")?;
        }
        write!(
            f,
            "; {} blocks, {} clipped samples, {} gaps",
            self.blocks, self.clipped, self.gaps
        )?;
        if self.assumes_every_speed {
            write!(
                f,
                "; the speed limits of the spindle are not known, and the advice assumes that every speed is possible: the table of a \
                 case with [limits] keeps it within them"
            )?;
        }
        Ok(())
    }
}

impl VerdictLog {
    /// Notes that the speed limits of the spindle are not known; the summary says so if an entry of the log so far
    /// advises a change of speed.
    pub fn assume_every_speed(&mut self) {
        self.summary.assumes_every_speed = self
            .verdicts
            .iter()
            .filter_map(|verdict| verdict.advice.as_ref())
            .any(|advice| advice.action == "speed");
    }

    /// Adds the next report to the log; returns its entry in [`VerdictLog::verdicts`], or `None` if it gets none.
    pub fn take(&mut self, report: &Report) -> Option<&VerdictAnswer> {
        let next = VerdictAnswer::new(report);
        let summary = &mut self.summary;
        summary.blocks += 1;
        summary.clipped = report.clipped;
        summary.gaps += u32::from(report.lost > summary.lost);
        summary.lost = report.lost;
        if summary.verdict != Some(next.verdict) {
            summary.verdict = Some(next.verdict);
            summary.since_s = Some(next.t_s);
        }
        if report.judgement.verdict.is_chatter() {
            let chatter = summary.chatter.get_or_insert(ChatterSummary {
                verdict: next.verdict,
                from_s: next.t_s,
                to_s: next.t_s,
            });
            chatter.to_s = next.t_s;
        }
        let is_new = self.verdicts.last().is_none_or(|last| {
            last.verdict != next.verdict
                || last.alarm != next.alarm
                || !is_same_advice(last.advice.as_ref(), next.advice.as_ref())
        });
        if !is_new {
            return None;
        }
        self.verdicts.push(next);
        self.verdicts.last()
    }
}

fn is_same_advice(a: Option<&AdviceAnswer>, b: Option<&AdviceAnswer>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            let near = (a.rpm - b.rpm).abs() <= SAME_SPEED * a.rpm;
            // With the same action and source, two pieces of advice are equal if both are to keep cutting, or if their
            // speeds are near each other and their depths are equal.
            let same_target = a.action == "keep" || (near && a.depth_mm == b.depth_mm);
            a.action == b.action && a.source == b.source && same_target
        }
        _ => false,
    }
}

/// Converts an `f32` to the `f64` with the same shortest decimal form: 900.1, not 900.0999755859375.
pub fn number(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

#[cfg(test)]
mod tests {
    use quietcut_core::detector::{Judgement, Reason, Verdict};
    use quietcut_core::units::{Hertz, Nanoseconds, Rpm};

    use super::*;

    fn report(t_ms: u64, verdict: Verdict, lost: u32) -> Report {
        Report {
            sequence: 7,
            time: Nanoseconds(t_ms * 1_000_000),
            speed: Some(Rpm(900.1)),
            judgement: Judgement {
                verdict,
                reason: Reason::Growing,
                chatter: Some(Hertz(17.9)),
                multiplier_abs: None,
                confidence: 0.98,
            },
            alarm: false,
            advice: None,
            clipped: 3,
            lost,
        }
    }

    #[test]
    fn the_log_holds_changes_and_counts_all() {
        let mut log = VerdictLog::default();
        assert!(log.take(&report(100, Verdict::Stable, 0)).is_some());
        assert!(log.take(&report(200, Verdict::Stable, 5)).is_none());
        assert!(log.take(&report(300, Verdict::Hopf, 5)).is_some());
        assert!(log.take(&report(400, Verdict::Hopf, 9)).is_none());
        assert_eq!(
            serde_json::to_value(&log.summary).unwrap(),
            serde_json::json!({
                "verdict": "hopf", "since_s": 0.3, "chatter": {"verdict": "hopf", "from_s": 0.3, "to_s": 0.4},
                "blocks": 4, "clipped": 3, "gaps": 2
            })
        );
        assert_eq!(log.verdicts.len(), 2);
    }

    #[test]
    fn a_recording_that_ended_in_air_is_not_summed_up_as_chatter() {
        let mut log = VerdictLog::default();
        for (t_ms, verdict) in [
            (100, Verdict::Stable),
            (200, Verdict::Hopf),
            (300, Verdict::Hopf),
            (400, Verdict::AirCut),
        ] {
            log.take(&report(t_ms, verdict, 0));
        }
        assert_eq!(
            (log.summary.verdict, log.summary.since_s),
            (Some("air-cut"), Some(0.4))
        );
        assert_eq!(
            log.summary.to_string(),
            "air-cut since 0.40 s; chatter (hopf) from 0.20 to 0.30 s; 4 blocks, 3 clipped samples, 0 gaps"
        );
    }

    #[test]
    fn a_small_change_of_the_advised_speed_is_the_same_advice() {
        let advice = |rpm| AdviceAnswer {
            action: "speed",
            rpm,
            depth_mm: None,
            source: "tooth-passing-rule",
            assumed_working_point: false,
            why: String::new(),
        };
        assert!(is_same_advice(Some(&advice(1000.0)), Some(&advice(1009.0))));
        assert!(!is_same_advice(Some(&advice(1000.0)), Some(&advice(1011.0))));
        assert!(!is_same_advice(None, Some(&advice(1000.0))));
    }

    #[test]
    fn the_object_has_the_names_that_scripts_rely_on() {
        let report = report(1250, Verdict::PeriodDoubling, 0);
        assert_eq!(
            serde_json::to_string(&VerdictAnswer::new(&report)).unwrap(),
            r#"{"t_s":1.25,"verdict":"period-doubling","alarm":true,"chatter_hz":17.9,"confidence":0.98,"spindle_rpm":900.1,"advice":null}"#
        );
    }
}
