//! All that is known to one verdict, with hysteresis.
//!
//! A verdict of chatter needs a signal, and growth or persistence; once there it is held until the vibration has died down or
//! the tool has left the material. What each part contributes:
//!
//! | part | says |
//! |---|---|
//! | [`Finding`] of a band | multiplier, levels of forced part, runout and residual |
//! | [`Tone`] of a band | a new tone beside the harmonics, and its frequency |
//! | [`Presence`] | whether anything is cut, against the quietest the machine has been |

use crate::criteria::FLIP_ALARM;
use crate::detector::evidence::{BANDS, Evidence};
use crate::detector::finding::{Finding, Multiplier};
use crate::detector::latched_chatter::{LatchedChatter, confidence};
use crate::detector::lines::LOUD;
use crate::detector::lone_tone::{is_unsampled, tone_alone};
use crate::detector::presence::Presence;
use crate::detector::tone::Tone;
use crate::detector::{Judgement, Reason, Verdict};

/// What grows must stand out of what the idle machine does by this factor.
const OVER_IDLE: f32 = 3.0;
/// What persists must be this part of the forced vibration at least to be called chatter.
const PERSISTENT_SHARE: f32 = 0.7;
/// Runout of more than this part of the forced vibration is worth a word.
const RUNOUT_SHARE: f32 = 1.0;
/// A residual leaks into the means of a few turns: less runout than this many times the residual is none.
const RUNOUT_OVER_RESIDUAL: f32 = 1.5;
/// Time for which a verdict holds at least, s: a machinist reads it, and what changes faster is no state of the cut.
const STEADY_S: f32 = 1.0;
/// Confidence in a stable cut where nothing that could die or grow stands out. What surely dies out leaves no less. A choice.
const NOTHING_SEEN: f32 = 0.8;
/// Passings until a cut is judged stable without anything that could be seen dying.
const SETTLED: u32 = 24;

/// The verdict so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detector {
    presence: [Presence; BANDS],
    held: Option<LatchedChatter>,
    /// Passings since the tool entered, as far as it is known.
    cut_passings: u32,
    /// The alternating part was seen dying, or standing, since the tool entered.
    runout_seen: bool,
    /// What alternates may be a flip, and is too large for the runout of a tool.
    is_large_flip: bool,
    /// Time without tooth periods at a known speed, s.
    unsampled_s: f32,
    judgement: Judgement,
    /// Time since the verdict changed, s.
    since_change_s: f32,
}

impl Default for Detector {
    fn default() -> Self {
        Self::new()
    }
}

const UNKNOWN: Judgement = Judgement {
    verdict: Verdict::Indeterminate,
    reason: Reason::TooShort,
    chatter: None,
    multiplier_abs: None,
    confidence: 0.0,
};

impl Detector {
    /// Knows nothing.
    pub const fn new() -> Self {
        Self {
            presence: [Presence::new(); BANDS],
            held: None,
            cut_passings: 0,
            runout_seen: false,
            is_large_flip: false,
            unsampled_s: 0.0,
            judgement: UNKNOWN,
            since_change_s: f32::INFINITY,
        }
    }

    /// The newest judgement.
    pub fn judgement(&self) -> &Judgement {
        &self.judgement
    }

    /// True while chatter is held, or what may be a flip is too large for runout. It does not wait for the verdict, which holds for a second.
    pub fn is_alarm(&self) -> bool {
        self.held.is_some() || self.is_large_flip
    }

    /// True while chatter is held: what is heard now is no background.
    pub fn is_chatter(&self) -> bool {
        self.held.is_some()
    }

    /// The signal was interrupted: only what the machine is like when it is quiet is still known.
    pub fn interrupt(&mut self) {
        self.held = None;
        self.cut_passings = 0;
        self.runout_seen = false;
        (self.is_large_flip, self.unsampled_s) = (false, 0.0);
        self.judgement = UNKNOWN;
        self.since_change_s = f32::INFINITY;
    }

    /// Takes what is known now.
    pub fn step(&mut self, evidence: &Evidence<'_>) -> Judgement {
        for band in 0..BANDS {
            self.presence[band].wait(evidence.seconds);
            if let Some(finding) = evidence.findings[band]
                && evidence.new_passings[band]
                && finding.is_valid(evidence.teeth)
            {
                self.presence[band].update(finding, evidence.speed, evidence.floors[band]);
            }
        }
        let air = self.is_air(evidence);
        if air == Some(false) {
            let passed = evidence.new_passings.contains(&true);
            self.cut_passings = self.cut_passings.saturating_add(u32::from(passed));
        } else if air == Some(true) {
            self.cut_passings = 0;
        }
        if let Some(held) = &mut self.held
            && held.is_over(evidence, air == Some(true))
        {
            self.held = None;
        }
        self.unsampled_s = if evidence.speed.is_some() && is_unsampled(evidence) {
            self.unsampled_s + evidence.seconds
        } else {
            0.0
        };
        if air != Some(true) && !evidence.changing {
            self.catch(evidence);
        }
        self.is_large_flip = false;
        let next = match &self.held {
            Some(held) => held.judgement(),
            None => self.judge(evidence, air),
        };
        self.change(next, evidence.seconds);
        self.judgement
    }

    /// Changes the verdict at most once in [`STEADY_S`], but for the onset of an alarm, which is never late, and before the first decision.
    fn change(&mut self, next: Judgement, seconds: f32) {
        self.since_change_s += seconds;
        let now = &self.judgement;
        let is_onset = next.verdict.is_chatter() && !now.verdict.is_chatter();
        let was_undecided = now.verdict == Verdict::Indeterminate;
        let is_undecided = next.verdict == Verdict::Indeterminate;
        let is_same = next.verdict == now.verdict && (!is_undecided || next.reason == now.reason);
        // A speed that has become known leaves no reason to wait.
        let is_refuted = now.reason == Reason::SpeedUnknown && next.reason != Reason::SpeedUnknown;
        if is_same || is_onset || is_refuted || self.since_change_s >= STEADY_S {
            if !(is_same || was_undecided && is_undecided) {
                self.since_change_s = 0.0;
            }
            self.judgement = next;
        }
    }

    /// True where nothing is cut, `None` where no band can tell yet.
    fn is_air(&self, evidence: &Evidence<'_>) -> Option<bool> {
        let mut air = None;
        for band in 0..BANDS {
            if let Some(finding) = evidence.findings[band]
                && finding.is_valid(evidence.teeth)
            {
                let quiet = self.presence[band].is_air(finding, evidence.speed, evidence.floors[band]);
                // A cut is heard in one band at least.
                air = Some(air.unwrap_or(true) && quiet);
            }
        }
        air
    }

    /// Looks for chatter that is not held yet.
    fn catch(&mut self, evidence: &Evidence<'_>) {
        for band in 0..BANDS {
            if let Some(finding) = evidence.findings[band]
                && evidence.new_passings[band]
                && finding.is_valid(evidence.teeth)
                && let Some((multiplier, reason)) = self.chatter_in(band, finding, evidence)
            {
                let newly = self
                    .held
                    .is_none_or(|held| held.by_tone || held.is_other(&multiplier, reason, finding));
                if newly {
                    self.held = Some(LatchedChatter::new(multiplier, reason, finding, band, evidence));
                }
            }
        }
        if self.held.is_none() {
            self.held = tone_alone(evidence, self.unsampled_s);
        }
    }

    /// Chatter as the passings of one band tell it.
    fn chatter_in(
        &self,
        band: usize,
        finding: &Finding,
        evidence: &Evidence<'_>,
    ) -> Option<(Multiplier, Reason)> {
        let idle = OVER_IDLE * self.presence[band].idle(evidence.speed, evidence.floors[band]);
        if let Some(growing) = finding.growing {
            return (growing.level > idle).then_some((growing, Reason::Growing));
        }
        let persistent = finding.persistent?;
        let level = finding.level_of(persistent.kind, evidence.teeth, evidence.floors[band]);
        let large = level > PERSISTENT_SHARE * finding.levels.forced && level > idle;
        large.then_some((persistent, Reason::Persistent))
    }

    /// The verdict where there is no chatter.
    fn judge(&mut self, evidence: &Evidence<'_>, air: Option<bool>) -> Judgement {
        let say = |verdict, reason, confidence| Judgement {
            verdict,
            reason,
            chatter: None,
            multiplier_abs: None,
            confidence,
        };
        let unknown = |reason| say(Verdict::Indeterminate, reason, 0.0);
        if evidence.damaged {
            return unknown(Reason::DamagedSignal);
        }
        if evidence.speed.is_none() {
            return unknown(Reason::SpeedUnknown);
        }
        if evidence.changing {
            return unknown(Reason::SpeedChanging);
        }
        let Some(air) = air else {
            return judge_lines(evidence).unwrap_or(UNKNOWN);
        };
        if air {
            self.runout_seen = false;
            return say(Verdict::AirCut, Reason::NoSignal, 0.9);
        }
        // The band in which more is going on speaks for both.
        let loudest = evidence
            .findings
            .iter()
            .flatten()
            .max_by(|a, b| a.activity.total_cmp(&b.activity));
        let Some(finding) = loudest else {
            return unknown(Reason::TooShort);
        };
        self.judge_cut(finding, evidence)
    }

    fn judge_cut(&mut self, finding: &Finding, evidence: &Evidence<'_>) -> Judgement {
        let levels = &finding.levels;
        let passings = finding.passings.min(self.cut_passings);
        let settled = passings >= SETTLED.max(3 * u32::from(evidence.teeth));
        let was_stable = matches!(
            self.judgement.verdict,
            Verdict::Stable | Verdict::Runout | Verdict::Forced
        );
        let (verdict, reason, confidence) = match finding.multiplier {
            _ if !settled => (Verdict::Indeterminate, Reason::TooShort, 0.0),
            Some(m) if finding.decaying || was_stable && m.abs < 1.0 => {
                let least = if finding.decaying { NOTHING_SEEN } else { 0.0 };
                let confidence = confidence(1.0 - m.abs, m.deviation).max(least);
                (Verdict::Stable, Reason::Decaying, confidence)
            }
            Some(_) => (Verdict::Indeterminate, Reason::Persistent, 0.0),
            None => (Verdict::Stable, Reason::Decaying, NOTHING_SEEN),
        };
        if let Some((_, most)) = finding.alternating
            && most < 1.0
        {
            self.runout_seen = true;
        }
        let mut judgement = Judgement {
            verdict,
            reason,
            chatter: None,
            multiplier_abs: finding.multiplier.map(|m| m.abs),
            confidence,
        };
        if verdict != Verdict::Stable {
            return judgement;
        }
        if levels.runout > RUNOUT_SHARE * levels.forced
            && levels.runout > RUNOUT_OVER_RESIDUAL * levels.residual
        {
            let ambiguous = evidence.teeth.is_multiple_of(2) && levels.alternating > 0.5 * levels.runout;
            if ambiguous && !self.runout_seen {
                (judgement.verdict, judgement.reason) = (Verdict::Indeterminate, Reason::FlipOrRunout);
                judgement.confidence = 0.0;
                self.is_large_flip = levels.alternating > FLIP_ALARM * levels.forced;
            } else {
                judgement.verdict = Verdict::Runout;
            }
        } else if levels.forced > LOUD {
            judgement.verdict = Verdict::Forced;
        }
        judgement
    }
}

/// The verdict of the spectra alone, where there is no chatter; `None` before the first, and while the tool is sampled at fixed angles. They do not
/// show slow growth, nor a period doubling of an even number of teeth beside runout: hence the confidence of one half.
fn judge_lines(evidence: &Evidence<'_>) -> Option<Judgement> {
    if !evidence.findings.iter().all(Option::is_none) {
        return None;
    }
    let mut lines = evidence.lines.iter().copied().flatten().peekable();
    lines.peek()?;
    let (mut has_teeth, mut lasts, mut synchronous) = (false, false, 0.0);
    for lines in lines {
        has_teeth |= lines.has_teeth;
        lasts |= lines.dominant().is_some_and(Tone::lasts);
        synchronous += lines.synchronous;
    }
    let (verdict, reason, confidence) = if !has_teeth {
        (Verdict::AirCut, Reason::NoSignal, 0.5)
    } else if lasts {
        (Verdict::Indeterminate, Reason::Persistent, 0.0)
    } else if synchronous > LOUD * LOUD {
        (Verdict::Forced, Reason::NoSignal, 0.5)
    } else {
        (Verdict::Stable, Reason::NoSignal, 0.5)
    };
    Some(Judgement {
        verdict,
        reason,
        chatter: None,
        multiplier_abs: None,
        confidence,
    })
}
