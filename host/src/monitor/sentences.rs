//! The received state in words: the same on the terminal and on the page.

use quietcut_core::detector::Verdict;

use super::lobes::Margin;
use super::received::{Connection, Received};
use crate::report::words;

impl Received {
    /// Verdict of the newest report.
    pub(crate) fn verdict(&self) -> Option<Verdict> {
        Some(self.report?.judgement.verdict)
    }

    /// State of the connection.
    pub(crate) fn connection_text(&self) -> String {
        match &self.connection {
            Connection::Connecting => "connecting".into(),
            Connection::Up if self.report.is_none() => "connected, no report yet".into(),
            Connection::Up => "live".into(),
            Connection::Gone(_) => format!("CABLE PULLED, WAITING FOR {}", self.port),
        }
    }

    /// Board, firmware, tool and table of the device; empty before the first connection.
    pub(crate) fn device_text(&self) -> String {
        self.identity.as_ref().map_or_else(String::new, |identity| {
            let table = identity.table.as_deref().unwrap_or("no table");
            format!("{}, {} teeth, {table}", identity.name, identity.teeth)
        })
    }

    /// Verdict in one word for large letters.
    pub(crate) fn word(&self) -> &'static str {
        match (&self.connection, self.verdict()) {
            (Connection::Gone(_), _) => "GONE",
            (_, None) => "?",
            (_, Some(verdict)) => match verdict {
                Verdict::AirCut => "IN AIR",
                Verdict::Stable => "QUIET",
                Verdict::Hopf | Verdict::PeriodDoubling => "CHATTER",
                Verdict::Forced => "FORCED",
                Verdict::Runout => "RUNOUT",
                Verdict::Indeterminate => "UNSURE",
            },
        }
    }

    /// Spindle speed in rev/min, without the unit.
    pub(crate) fn speed_text(&self) -> String {
        self.rpm().map_or_else(|| "?".into(), |rpm| format!("{rpm:.0}"))
    }

    /// Verdict, or state of a connection without one, as a sentence.
    pub(crate) fn sentence(&self) -> String {
        match (&self.connection, &self.report) {
            (Connection::Gone(reason), _) => reason.clone(),
            (_, Some(report)) => words::verdict(&report.judgement),
            (Connection::Connecting, None) => format!("connecting to {}", self.port),
            (Connection::Up, None) => "the device is connected and has sent no report yet".into(),
        }
    }

    /// Advised action; `none` without advice.
    pub(crate) fn advice_text(&self) -> String {
        match self.report.and_then(|report| report.advice) {
            Some(advice) => words::action(&advice),
            None => "none".into(),
        }
    }

    /// Reason of the advice; empty without advice.
    pub(crate) fn reason_text(&self) -> String {
        let why = self.report.and_then(|report| {
            let advice = report.advice?;
            Some(words::why(&advice, &report.judgement, report.speed))
        });
        why.unwrap_or_default()
    }

    /// Margin of the cut in the lobe table, and the counts of damaged samples if there are any.
    pub(crate) fn margin_text(&self) -> String {
        let counts = match self.report {
            Some(report) if report.clipped > 0 || report.lost > 0 => {
                format!("; {} samples clipped, {} lost", report.clipped, report.lost)
            }
            _ => String::new(),
        };
        let margin = match (&self.lobes, self.rpm()) {
            (None, _) => "not known without --table FILE.qct".into(),
            (_, None) => "not known without a speed".into(),
            (Some(lobes), Some(rpm)) => match lobes.margin(rpm) {
                margin @ (Margin::Below { .. } | Margin::Unlimited { .. }) if self.chatter_hz().is_some() => {
                    format!("{margin}; but it chatters: table or depth is wrong")
                }
                margin => margin.to_string(),
            },
        };
        margin + &counts
    }
}

/// Letter of a verdict in the strip of verdicts; `None` is that of a device that is gone.
pub(crate) fn letter(verdict: Option<Verdict>) -> char {
    match verdict {
        Some(Verdict::AirCut) => '.',
        Some(Verdict::Stable) => 'q',
        Some(Verdict::Hopf) => 'H',
        Some(Verdict::PeriodDoubling) => 'D',
        Some(Verdict::Forced) => 'F',
        Some(Verdict::Runout) => 'R',
        Some(Verdict::Indeterminate) => '?',
        None => '|',
    }
}
