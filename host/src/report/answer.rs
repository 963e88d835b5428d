//! Verdicts and advice as JSON objects: what `replay` and `monitor` answer with.

use quietcut_core::advice::Advice;
use quietcut_core::monitor::Report;
use serde::Serialize;

use super::words;

/// One verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerdictAnswer {
    /// End of the block it was given for, in seconds on the clock of the samples.
    pub t_s: f64,
    /// The word for it, see [`words::verdict_key`].
    pub verdict: &'static str,
    /// Chatter frequency, where there is chatter.
    pub chatter_hz: Option<f64>,
    /// Probability that it is right, 0 to 1.
    pub confidence: f64,
    /// Spindle speed, where it is known.
    pub spindle_rpm: Option<f64>,
    /// What to do, where there is something to do.
    pub advice: Option<AdviceAnswer>,
}

/// One piece of advice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AdviceAnswer {
    /// The word for it, see [`words::action_key`].
    pub action: &'static str,
    /// The speed to cut with.
    pub rpm: f64,
    /// The depth to cut with, where the working point was told.
    pub depth_mm: Option<f64>,
    /// The word for what it rests on, see [`words::source_key`].
    pub source: &'static str,
    /// True where the working point was not told.
    pub assumed_working_point: bool,
    /// A sentence for people.
    pub why: String,
}

impl VerdictAnswer {
    /// The answer for what the pipeline said after a block.
    pub fn new(report: &Report) -> Self {
        let judgement = &report.judgement;
        Self {
            t_s: seconds(report),
            verdict: words::verdict_key(judgement.verdict),
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
    /// The answer for advice that came with `report`.
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

/// The time of a report in seconds: whole nanoseconds of the first 104 days are exact in an `f64`.
pub fn seconds(report: &Report) -> f64 {
    report.time.0 as f64 * 1e-9
}

/// The shortest decimal number that is this `f32`: 900.1, not 900.0999755859375.
pub fn number(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

#[cfg(test)]
mod tests {
    use quietcut_core::detector::{Judgement, Reason, Verdict};
    use quietcut_core::units::{Hertz, Nanoseconds, Rpm};

    use super::*;

    #[test]
    fn the_object_has_the_names_that_scripts_rely_on() {
        let report = Report {
            sequence: 7,
            time: Nanoseconds(1_250_000_000),
            speed: Some(Rpm(900.1)),
            judgement: Judgement {
                verdict: Verdict::PeriodDoubling,
                reason: Reason::Growing,
                chatter: Some(Hertz(17.9)),
                multiplier_abs: None,
                confidence: 0.98,
            },
            advice: None,
            clipped: 0,
            lost: 0,
        };
        assert_eq!(
            serde_json::to_string(&VerdictAnswer::new(&report)).unwrap(),
            r#"{"t_s":1.25,"verdict":"period-doubling","chatter_hz":17.9,"confidence":0.98,"spindle_rpm":900.1,"advice":null}"#
        );
    }
}
