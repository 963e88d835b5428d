//! Texts of verdicts and advice for machinists, and the short texts that stand for them in JSON and CSV.

use quietcut_core::advice::{Action, Advice, Obstacle, Source};
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{self, NotKnown};
use quietcut_core::monitor::Report;
use quietcut_core::units::Rpm;
use quietcut_core::working_point::WorkingPoint;

use super::time::seconds;

/// Text that stands for a verdict in JSON and CSV outputs.
pub fn verdict_key(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::AirCut => "air-cut",
        Verdict::Stable => "stable",
        Verdict::Hopf => "hopf",
        Verdict::PeriodDoubling => "period-doubling",
        Verdict::Forced => "forced",
        Verdict::Runout => "runout",
        Verdict::Indeterminate => "indeterminate",
    }
}

/// Text that stands for an advised action in JSON and CSV outputs.
pub fn action_key(action: Action) -> &'static str {
    match action {
        Action::Keep => "keep",
        Action::Speed => "speed",
        Action::Depth => "depth",
        Action::NotKnown => "not-known",
    }
}

/// Text that stands for the source of advice in JSON and CSV outputs.
pub fn source_key(source: Source) -> &'static str {
    match source {
        Source::Table => "table",
        Source::ToothPassingRule => "tooth-passing-rule",
    }
}

/// Verdict as a text for machinists, such as `CHATTER at 17.4 Hz, not synchronous with the teeth (Hopf)`.
pub fn verdict(judgement: &Judgement) -> String {
    let at = judgement
        .chatter
        .map(|hertz| format!(" at {:.1} Hz", hertz.0))
        .unwrap_or_default();
    match judgement.verdict {
        Verdict::AirCut => "not cutting".into(),
        Verdict::Stable => "cutting, quiet".into(),
        Verdict::Hopf => format!("CHATTER{at}, not synchronous with the teeth (Hopf)"),
        Verdict::PeriodDoubling => format!("CHATTER{at}, every second tooth (period doubling)"),
        Verdict::Forced => {
            "strong vibration synchronous with the teeth: forced vibration, not chatter".into()
        }
        Verdict::Runout => "strong vibration once per revolution: runout of the tool, not chatter".into(),
        Verdict::Indeterminate => format!("no decision: {}", reason(judgement.reason)),
    }
}

/// Reason of a verdict.
pub fn reason(reason: Reason) -> &'static str {
    match reason {
        Reason::TooShort => "not enough signal yet",
        Reason::NoSignal => "no vibration above the noise except that of the spindle",
        Reason::Decaying => "the vibration not synchronous with the teeth decays",
        Reason::Growing => "the vibration not synchronous with the teeth grows",
        Reason::Persistent => "the vibration not synchronous with the teeth persists",
        Reason::FlipOrRunout => "runout and period doubling cannot be separated in this signal",
        Reason::SpeedUnknown => {
            "no tachometer and no spindle speed set: chatter cannot be separated from forced vibration"
        }
        Reason::SpeedChanging => "the spindle speed is changing",
        Reason::DamagedSignal => "too many samples are clipped or lost",
    }
}

/// One line of text for a report: time, spindle speed, verdict; also the advice with its reason, unless there is none
/// or it is to keep cutting.
pub fn line(report: &Report) -> String {
    match &report.advice {
        Some(advice) if advice.action != Action::Keep => format!(
            "{}: {} ({})",
            state(report),
            action(advice),
            why(advice, &report.judgement, report.speed)
        ),
        _ => state(report),
    }
}

/// One line of text for a report without its advice: time, spindle speed, verdict.
pub fn state(report: &Report) -> String {
    let speed = report.speed.map_or_else(
        || "      speed ?".into(),
        |speed| format!("{:6.0} rev/min", speed.0),
    );
    let seconds = seconds(report);
    format!("{seconds:9.2} s  {speed}  {}", verdict(&report.judgement))
}

/// Advised action as a text, such as `go to 1480 rev/min`.
pub fn action(advice: &Advice) -> String {
    match advice.action {
        Action::Keep => "keep cutting".into(),
        Action::Speed => format!("go to {:.0} rev/min", advice.speed.0),
        Action::Depth => match advice.depth {
            Some(depth) => format!(
                "reduce the depth to {:.2} mm at {:.0} rev/min",
                depth.0, advice.speed.0
            ),
            None => "reduce the depth".into(),
        },
        Action::NotKnown => "no advice".into(),
    }
}

/// Reason for the advice: its source, then the obstacle and the assumed working point that it states, if any; for the
/// advice to keep cutting only that no chatter is detected. `speed` is the spindle speed of the report.
pub fn why(advice: &Advice, judgement: &Judgement, speed: Option<Rpm>) -> String {
    let mut parts = vec![source_reason(advice, judgement, speed)];
    if advice.action != Action::Keep {
        parts.extend(advice.obstacle.as_ref().map(obstacle));
        parts.extend(advice.assumed.as_ref().map(assumed));
    }
    parts.join("; ")
}

fn source_reason(advice: &Advice, judgement: &Judgement, speed: Option<Rpm>) -> String {
    match (advice.action, advice.source) {
        (Action::Keep, _) => "no chatter is detected".into(),
        (Action::Speed, Source::Table) => {
            let deep = advice
                .depth
                .map(|depth| format!(" {:.2} mm deep", depth.0))
                .unwrap_or_default();
            let from = speed
                .map(|speed| format!(" to {:.0} rev/min", speed.0))
                .unwrap_or_default();
            format!("the nearest speed{from} where a cut{deep} is stable with margin in the lobe table")
        }
        (Action::Depth, Source::Table) => {
            "the lobe table has no speed within the limits of the machine where the present depth is stable; \
             the advised depth is the largest stable depth with margin"
                .into()
        }
        (Action::Speed, Source::ToothPassingRule) => {
            let chatter = judgement
                .chatter
                .map(|chatter| format!(" of {:.1} Hz", chatter.0))
                .unwrap_or_default();
            format!(
                "tooth-passing rule: at this speed the chatter frequency{chatter} is a multiple of the tooth passing"
            )
        }
        (Action::Depth, Source::ToothPassingRule) => {
            "the tooth-passing rule gives no stable depth; a smaller depth is more stable".into()
        }
        (Action::NotKnown, Source::Table) => "the lobe table gives no stable cut".into(),
        (Action::NotKnown, Source::ToothPassingRule) => "the tooth-passing rule gives no speed".into(),
    }
}

/// Text of the reason why advice does not come from a better source, such as the lobe table, or proposes no speed.
pub fn obstacle(obstacle: &Obstacle) -> String {
    match obstacle {
        Obstacle::NoTable => "the device has no lobe table".into(),
        Obstacle::Table(why) => format!("the lobe table does not cover this cut: {}", not_known(why)),
        Obstacle::Speed => "the spindle speed is not a positive number".into(),
        Obstacle::Contradicted => {
            "this cut is stable in the lobe table and yet it chatters: the table is wrong here".into()
        }
        Obstacle::NothingStable => {
            "the lobe table has no stable depth at any speed within the limits of the machine".into()
        }
        Obstacle::ChatterFrequency => "the chatter frequency is unknown".into(),
        Obstacle::NoSpeedWithinLimits => {
            "the tooth-passing rule has no speed within the limits of the machine".into()
        }
    }
}

/// Text of the reason why a lobe table does not call an interval of axial depths stable: Hopf, period doubling, fold,
/// an undecided computation, or a second stable vibration.
pub fn limit(kind: lobes::IntervalKind) -> &'static str {
    match kind {
        lobes::IntervalKind::Hopf => "chatter at a frequency not synchronous with the teeth (Hopf)",
        lobes::IntervalKind::Flip => "chatter with the period of two teeth (period doubling)",
        lobes::IntervalKind::Fold => "the forced vibration jumps (fold)",
        lobes::IntervalKind::Undecided => "the computation could not decide",
        lobes::IntervalKind::Bistable => {
            "stable unless something knocks the tool, then a larger vibration stays (bistable)"
        }
    }
}

/// Text of the reason why a lobe table does not say whether a cut is stable.
pub fn not_known(why: &NotKnown) -> String {
    match why {
        NotKnown::Speed { asked, from, to } => {
            format!(
                "{:.0} rev/min is outside its range of {:.0} to {:.0} rev/min",
                asked.0, from.0, to.0
            )
        }
        NotKnown::Depth { asked, from, to } => {
            format!(
                "{:.2} mm is outside its range of {:.2} to {:.2} mm",
                asked.0, from.0, to.0
            )
        }
        NotKnown::Feed { asked, from, to } if from == to => {
            format!("it is for a feed of {from} per tooth, not {asked}")
        }
        NotKnown::Feed { asked, from, to } => {
            format!("a feed of {asked} per tooth is outside its range of {from} to {to}")
        }
        NotKnown::Immersion { start, exit } => {
            format!("it has no layer for an immersion from {start} to {exit}")
        }
        NotKnown::Posture { asked } => format!("it has no layer for posture {asked}"),
        NotKnown::Teeth { asked, table } => format!("it is for {table} teeth, the tool has {asked}"),
        NotKnown::Undecided => "its stability computation is undecided here".into(),
        NotKnown::Damaged => "its data are damaged".into(),
        NotKnown::FeedDirection { .. } => {
            "it depends on the feed direction, and has no layers near that of the cut".into()
        }
        NotKnown::FeedDirectionNotTold => {
            "it depends on the feed direction, which is not set (set it with `quietcut working-point`, \
             --feed-direction-deg)"
                .into()
        }
    }
}

/// Text that states the working point (depth, immersion, feed) that the advice assumes because none is set on the
/// device.
fn assumed(point: &WorkingPoint) -> String {
    format!(
        "no working point is set; assuming an axial depth of {:.2} mm, immersion from {} to {}, {} per tooth (set it with \
         `quietcut working-point`)",
        point.axial_depth.0, point.start, point.exit, point.feed_per_tooth
    )
}

#[cfg(test)]
mod tests {
    use quietcut_core::units::{Degrees, Hertz, Millimeters};

    use super::*;

    #[test]
    fn verdict_action_and_reason_are_whole_sentences() {
        let judgement = Judgement {
            verdict: Verdict::Hopf,
            reason: Reason::Growing,
            chatter: Some(Hertz(17.44)),
            multiplier_abs: Some(1.02),
            confidence: 0.98,
        };
        let advice = Advice {
            action: Action::Speed,
            speed: Rpm(1480.0),
            depth: Some(Millimeters(2.0)),
            source: Source::Table,
            assumed: Some(WorkingPoint {
                axial_depth: Millimeters(2.0),
                start: Degrees(90.0),
                exit: Degrees(180.0),
                feed_per_tooth: Millimeters(0.15),
                posture: 0,
            }),
            obstacle: None,
        };
        assert_eq!(
            verdict(&judgement),
            "CHATTER at 17.4 Hz, not synchronous with the teeth (Hopf)"
        );
        assert_eq!(action(&advice), "go to 1480 rev/min");
        assert_eq!(
            why(&advice, &judgement, Some(Rpm(900.2))),
            "the nearest speed to 900 rev/min where a cut 2.00 mm deep is stable with margin in the lobe table; \
             no working point is set; assuming an axial depth of 2.00 mm, immersion from 90 ° to 180 °, 0.15 mm per \
             tooth (set it with `quietcut working-point`)"
        );
        let by_rule = Advice {
            source: Source::ToothPassingRule,
            assumed: None,
            obstacle: Some(Obstacle::Table(NotKnown::Teeth { asked: 2, table: 4 })),
            ..advice
        };
        assert_eq!(
            why(&by_rule, &judgement, Some(Rpm(900.2))),
            "tooth-passing rule: at this speed the chatter frequency of 17.4 Hz is a multiple of the tooth passing; \
             the lobe table does not cover this cut: it is for 4 teeth, the tool has 2"
        );
    }
}
