//! The words of verdicts and advice, for machinists and for scripts; the only place that has them.

use quietcut_core::advice::{Action, Advice, Source};
use quietcut_core::detector::{Judgement, Reason, Verdict};
use quietcut_core::units::Rpm;

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

/// What to do: `go to 1480 rev/min`.
pub fn action(advice: &Advice) -> String {
    match advice.action {
        Action::Keep => "keep cutting".into(),
        Action::Speed => format!("go to {:.0} rev/min", advice.speed.0),
        Action::Depth => match advice.depth {
            Some(depth) => format!("reduce the depth to {:.2} mm", depth.0),
            None => "reduce the depth".into(),
        },
        Action::NotKnown => "no advice".into(),
    }
}

/// Why the advice is what it is, with what it assumes; `speed` is the speed the cut had.
pub fn why(advice: &Advice, judgement: &Judgement, speed: Option<Rpm>) -> String {
    let mut why = match (advice.action, advice.source) {
        (Action::Keep, Source::Table) => "the lobe table calls this cut stable".into(),
        (Action::Keep, Source::ToothPassingRule) => "no chatter is heard".into(),
        (Action::Speed, Source::Table) => {
            let depth = advice
                .depth
                .map(|depth| format!(" {:.2} mm deep", depth.0))
                .unwrap_or_default();
            let from = speed
                .map(|speed| format!(" to {:.0} rev/min", speed.0))
                .unwrap_or_default();
            format!("the nearest speed{from} that the lobe table calls stable{depth} with margin")
        }
        (Action::Depth, Source::Table) => {
            "no speed within the limits of the machine is stable this deep in the lobe table; this depth is"
                .into()
        }
        (Action::Speed, Source::ToothPassingRule) => match judgement.chatter {
            Some(chatter) => format!(
                "tooth-passing rule: at this speed the chatter frequency {:.1} Hz is a multiple of the tooth passing",
                chatter.0
            ),
            None => "tooth-passing rule: the tooth passing meets the chatter frequency".into(),
        },
        (Action::Depth, Source::ToothPassingRule) => {
            "no speed by the tooth-passing rule lies within the limits of the machine".into()
        }
        (Action::NotKnown, Source::Table) => "the lobe table does not know this cut".into(),
        (Action::NotKnown, Source::ToothPassingRule) => {
            "there is no lobe table, and the chatter frequency or the number of teeth is not known".to_owned()
        }
    };
    if advice.assumed.is_some() && advice.source == Source::Table {
        why.push_str("; the working point was not told, so the first layer of the table is assumed");
    }
    why
}

#[cfg(test)]
mod tests {
    use quietcut_core::units::{Degrees, Hertz, Millimeters};
    use quietcut_core::working_point::WorkingPoint;

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
            "the nearest speed to 900 rev/min that the lobe table calls stable 2.00 mm deep with margin; \
             the working point was not told, so the first layer of the table is assumed"
        );
    }
}
