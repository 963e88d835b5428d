//! The words of verdicts and advice, for machinists and for scripts; the only place that has them.

use quietcut_core::advice::{Action, Advice, Obstacle, Source};
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::lobes::{self, NotKnown};
use quietcut_core::monitor::Report;
use quietcut_core::units::Rpm;
use quietcut_core::working_point::WorkingPoint;

use super::time::seconds;

/// The word for a verdict in JSON and CSV.
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

/// The word for an action in JSON and CSV.
pub fn action_key(action: Action) -> &'static str {
    match action {
        Action::Keep => "keep",
        Action::Speed => "speed",
        Action::Depth => "depth",
        Action::NotKnown => "not-known",
    }
}

/// The word for the source of advice in JSON and CSV.
pub fn source_key(source: Source) -> &'static str {
    match source {
        Source::Table => "table",
        Source::ToothPassingRule => "tooth-passing-rule",
    }
}

/// A verdict as a machinist would say it: `chatter at 17.4 Hz`.
pub fn verdict(judgement: &Judgement) -> String {
    let at = judgement
        .chatter
        .map(|hertz| format!(" at {:.1} Hz", hertz.0))
        .unwrap_or_default();
    match judgement.verdict {
        Verdict::AirCut => "not cutting".into(),
        Verdict::Stable => "cutting, quiet".into(),
        Verdict::Hopf => format!("CHATTER{at}, not in step with the teeth (Hopf)"),
        Verdict::PeriodDoubling => format!("CHATTER{at}, every second tooth (period doubling)"),
        Verdict::Forced => "strong vibration in step with the teeth: forced, not chatter".into(),
        Verdict::Runout => "strong vibration once per turn: the tool runs out, not chatter".into(),
        Verdict::Indeterminate => format!("cannot tell: {}", reason(judgement.reason)),
    }
}

/// Why a verdict is what it is.
pub fn reason(reason: Reason) -> &'static str {
    match reason {
        Reason::TooShort => "not enough signal yet",
        Reason::NoSignal => "nothing above the noise but what the spindle makes",
        Reason::Decaying => "what is not in step with the teeth dies out",
        Reason::Growing => "what is not in step with the teeth grows",
        Reason::Persistent => "what is not in step with the teeth stays",
        Reason::FlipOrRunout => "with this signal runout and period doubling look the same",
        Reason::SpeedUnknown => {
            "no tachometer and no speed told, so chatter cannot be told from forced vibration"
        }
        Reason::SpeedChanging => "the spindle speed is changing",
        Reason::DamagedSignal => "too many samples are clipped or lost",
    }
}

/// A report on one line: time, speed, verdict, advice.
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

/// A report on one line without its advice.
pub fn state(report: &Report) -> String {
    let speed = report.speed.map_or_else(
        || "      speed ?".into(),
        |speed| format!("{:6.0} rev/min", speed.0),
    );
    let seconds = seconds(report);
    format!("{seconds:9.2} s  {speed}  {}", verdict(&report.judgement))
}

/// What to do: `go to 1480 rev/min`.
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

/// Why the advice is what it is: what it rests on, what it assumes, and why it rests on nothing better. `speed` is the
/// speed the cut had.
pub fn why(advice: &Advice, judgement: &Judgement, speed: Option<Rpm>) -> String {
    let mut parts = vec![ground(advice, judgement, speed)];
    if advice.action != Action::Keep {
        parts.extend(advice.obstacle.as_ref().map(obstacle));
        parts.extend(advice.assumed.as_ref().map(assumed));
    }
    parts.join("; ")
}

fn ground(advice: &Advice, judgement: &Judgement, speed: Option<Rpm>) -> String {
    match (advice.action, advice.source) {
        (Action::Keep, _) => "no chatter is heard".into(),
        (Action::Speed, Source::Table) => {
            let deep = advice
                .depth
                .map(|depth| format!(" {:.2} mm deep", depth.0))
                .unwrap_or_default();
            let from = speed
                .map(|speed| format!(" to {:.0} rev/min", speed.0))
                .unwrap_or_default();
            format!("the nearest speed{from} where the lobe table calls a cut{deep} stable with margin")
        }
        (Action::Depth, Source::Table) => {
            "the lobe table has no speed within the limits of the machine where the present depth is stable; \
             this depth is the largest that is, with margin"
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
            "the tooth-passing rule knows no depths, only that less is quieter".into()
        }
        (Action::NotKnown, Source::Table) => "the lobe table does not help".into(),
        (Action::NotKnown, Source::ToothPassingRule) => "the tooth-passing rule does not help".into(),
    }
}

/// What kept a better source of advice from being used.
pub fn obstacle(obstacle: &Obstacle) -> String {
    match obstacle {
        Obstacle::NoTable => "the device has no lobe table".into(),
        Obstacle::Table(why) => format!("the lobe table does not know this cut: {}", not_known(why)),
        Obstacle::Speed => "the spindle speed is not a positive number".into(),
        Obstacle::Contradicted => {
            "the lobe table calls this cut stable, and yet it chatters: the table is not true here".into()
        }
        Obstacle::NothingStable => {
            "the lobe table has no stable depth at any speed within the limits of the machine".into()
        }
        Obstacle::ChatterFrequency => "the chatter frequency is not known".into(),
        Obstacle::NoSpeedWithinLimits => {
            "the tooth-passing rule has no speed within the limits of the machine".into()
        }
    }
}

/// How stability is lost.
pub fn limit(kind: lobes::IntervalKind) -> &'static str {
    match kind {
        lobes::IntervalKind::Hopf => "chatter at a frequency of its own (Hopf)",
        lobes::IntervalKind::Flip => "chatter at every second tooth (period doubling)",
        lobes::IntervalKind::Fold => "the forced vibration jumps (fold)",
        lobes::IntervalKind::Undecided => "the computation could not decide",
    }
}

/// Why a lobe table has no answer.
pub fn not_known(why: &NotKnown) -> String {
    match why {
        NotKnown::Speed { asked, from, to } => {
            format!(
                "{:.0} rev/min is not within its {:.0} to {:.0} rev/min",
                asked.0, from.0, to.0
            )
        }
        NotKnown::Depth { asked, from, to } => {
            format!(
                "{:.2} mm is not within its {:.2} to {:.2} mm",
                asked.0, from.0, to.0
            )
        }
        NotKnown::Feed { asked, from, to } if from == to => {
            format!("it is for a feed of {from} per tooth, not {asked}")
        }
        NotKnown::Feed { asked, from, to } => {
            format!("a feed of {asked} per tooth is not within its {from} to {to}")
        }
        NotKnown::Immersion { start, exit } => {
            format!("it has nothing for an immersion from {start} to {exit}")
        }
        NotKnown::Posture { asked } => format!("it has nothing for posture {asked}"),
        NotKnown::Teeth { asked, table } => format!("it is for {table} teeth, the tool has {asked}"),
        NotKnown::Undecided => "its computation could not decide here".into(),
        NotKnown::Damaged => "its bytes are damaged".into(),
        NotKnown::FeedDirection { .. } => {
            "it depends on the direction of the feed, and has no layers around that of the cut".into()
        }
        NotKnown::FeedDirectionNotTold => {
            "it depends on the direction of the feed, which was not told (tell it with `quietcut work`, \
             --feed-direction-deg)"
                .into()
        }
    }
}

/// The cut that advice assumed, where the host told none.
fn assumed(point: &WorkingPoint) -> String {
    format!(
        "the working point was not told: assumed is a cut {:.2} mm deep, immersion from {} to {}, {} per tooth (tell it with \
         `quietcut work`)",
        point.axial_depth.0, point.start, point.exit, point.feed_per_tooth
    )
}

#[cfg(test)]
mod tests {
    use quietcut_core::units::{Degrees, Hertz, Millimeters};

    use super::*;

    #[test]
    fn a_machinist_can_read_it() {
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
            "CHATTER at 17.4 Hz, not in step with the teeth (Hopf)"
        );
        assert_eq!(action(&advice), "go to 1480 rev/min");
        assert_eq!(
            why(&advice, &judgement, Some(Rpm(900.2))),
            "the nearest speed to 900 rev/min where the lobe table calls a cut 2.00 mm deep stable with margin; \
             the working point was not told: assumed is a cut 2.00 mm deep, immersion from 90 ° to 180 °, 0.15 mm per \
             tooth (tell it with `quietcut work`)"
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
             the lobe table does not know this cut: it is for 4 teeth, the tool has 2"
        );
    }
}
