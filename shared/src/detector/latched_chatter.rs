//! Chatter that was found, and is held until it has died down.

use crate::detector::evidence::Evidence;
use crate::detector::finding::{Finding, GrowthKind, Multiplier};
use crate::detector::frequency::frequency;
use crate::detector::tone::Tone;
use crate::detector::{Judgement, Reason, Verdict};
use crate::synchronous::Levels;
use crate::units::Hertz;

/// It ends when its level falls below this part of the largest it had,
const RELEASE: f32 = 0.4;
/// for so many passings or spectra,
const RELEASE_PASSINGS: u8 = 6;
/// or for this time, in s, and at least two of them. The alarm then ends within the second after the vibration, the time of averaging included.
const RELEASE_S: f32 = 0.5;
const RELEASE_PASSINGS_LEAST: u8 = 2;
/// Growth seen within so many passings or spectra is growth still.
pub(super) const LAST_GROWTH: u8 = 16;
/// An angle within this of the held one, in turns, is the same multiplier.
const SAME_ANGLE: f32 = 0.03;
/// A tone within this part of the held frequency is the same, moved on.
const SAME_TONE: f32 = 0.05;

/// Chatter that was found and is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LatchedChatter {
    pub(super) kind: GrowthKind,
    pub(super) band: usize,
    /// True where a tone alone told it, without samples at fixed angles.
    pub(super) by_tone: bool,
    pub(super) multiplier: Option<Multiplier>,
    pub(super) frequency: Option<Hertz>,
    /// The largest level it had, in m/s².
    pub(super) largest: f32,
    /// Passings or spectra since it was last seen growing.
    pub(super) since_growing: u8,
    /// Passings or spectra in which it was below what is held, and the time since, s.
    pub(super) below: u8,
    pub(super) below_s: f32,
    /// The loudest that the band was meanwhile, in the unit of [`Evidence::loudness`].
    pub(super) loudest: f32,
    /// Time since the band became quiet, or since nothing tells its vibration, s.
    pub(super) quiet_s: f32,
    pub(super) confidence: f32,
    pub(super) reason: Reason,
}

impl LatchedChatter {
    /// Chatter that the passings of a band tell.
    pub(super) fn new(
        multiplier: Multiplier,
        reason: Reason,
        finding: &Finding,
        band: usize,
        evidence: &Evidence<'_>,
    ) -> Self {
        Self {
            kind: multiplier.kind,
            band,
            by_tone: false,
            multiplier: Some(multiplier),
            frequency: frequency(&multiplier, finding, band, evidence),
            largest: finding.level_of(multiplier.kind, evidence.teeth, evidence.floors[band]),
            since_growing: 0,
            below: 0,
            below_s: 0.0,
            loudest: evidence.loudness[band],
            quiet_s: 0.0,
            confidence: confidence((multiplier.abs - 1.0).abs(), multiplier.deviation),
            reason,
        }
    }

    /// Its level now; `None` where the conditions have just changed.
    fn level(&self, evidence: &Evidence<'_>) -> Option<f32> {
        if self.by_tone {
            return Some(self.tone(evidence).map_or(0.0, Tone::amplitude));
        }
        let finding = evidence.findings[self.band].filter(|finding| finding.is_valid(evidence.teeth))?;
        Some(finding.level_of(self.kind, evidence.teeth, evidence.floors[self.band]))
    }

    /// Goes on with what is known now. True where it has died down, or nothing is cut any more.
    pub(super) fn is_over(&mut self, evidence: &Evidence<'_>, air: bool) -> bool {
        if self.is_quiet(evidence) {
            return true;
        }
        let Some(level) = self.level(evidence) else {
            return false;
        };
        self.largest = self.largest.max(level);
        let news = if self.by_tone {
            evidence.new_spectra[self.band]
        } else {
            evidence.new_passings[self.band]
        };
        if level < RELEASE * self.largest || air {
            self.below = self.below.saturating_add(u8::from(news));
            self.below_s += evidence.seconds;
        } else {
            (self.below, self.below_s) = (0, 0.0);
        }
        let over = self.below >= RELEASE_PASSINGS
            || self.below >= RELEASE_PASSINGS_LEAST && self.below_s >= RELEASE_S;
        if news && !over {
            self.follow(evidence);
        }
        over
    }

    /// Whether the samples alone tell that the vibration is down, or neither passings nor spectra can tell anything of it: at standstill, and
    /// beyond the speed up to which the band is sampled at fixed angles.
    fn is_quiet(&mut self, evidence: &Evidence<'_>) -> bool {
        let loudness = evidence.loudness[self.band];
        self.loudest = self.loudest.max(loudness);
        let is_blind = if self.by_tone {
            evidence.speed.is_none()
        } else {
            evidence.findings[self.band].is_none()
        };
        if is_blind || loudness < RELEASE * self.loudest {
            self.quiet_s += evidence.seconds;
        } else {
            self.quiet_s = 0.0;
        }
        self.quiet_s >= RELEASE_S
    }

    /// Whether what grows now is chatter of the other kind, and larger than what is held.
    pub(super) fn is_other(&self, multiplier: &Multiplier, reason: Reason, finding: &Finding) -> bool {
        let Levels {
            alternating,
            residual,
            ..
        } = finding.levels;
        let larger = match multiplier.kind {
            GrowthKind::Hopf => residual > alternating,
            GrowthKind::Flip => alternating > residual,
        };
        multiplier.kind != self.kind && reason == Reason::Growing && larger
    }

    /// The tone that is held, where it is still the strongest.
    fn tone<'a>(&self, evidence: &Evidence<'a>) -> Option<&'a Tone> {
        let held = self.frequency?.0;
        let beside = evidence.lines[self.band].and_then(|lines| lines.beside.as_ref());
        let mut tones = [evidence.tones[self.band], beside].into_iter().flatten();
        tones.find(|tone| (tone.frequency.0 - held).abs() < SAME_TONE * held)
    }

    /// Keeps multiplier, frequency and reason up to date.
    fn follow(&mut self, evidence: &Evidence<'_>) {
        self.since_growing = self.since_growing.saturating_add(1);
        if self.by_tone {
            let Some(tone) = self.tone(evidence) else { return };
            self.frequency = Some(tone.frequency);
            if tone.grows() {
                self.since_growing = 0;
            }
        } else if let Some(finding) = evidence.findings[self.band] {
            self.follow_multiplier(finding, evidence);
        }
        self.reason = if self.since_growing < LAST_GROWTH {
            Reason::Growing
        } else {
            Reason::Persistent
        };
    }

    fn follow_multiplier(&mut self, finding: &Finding, evidence: &Evidence<'_>) {
        let held = self.multiplier.map_or(0.0, |m| m.angle_turns);
        // Modes that grow and die beside it are not it.
        let same = |m: &Multiplier| m.kind == self.kind && (m.angle_turns - held).abs() < SAME_ANGLE;
        if let Some(growing) = finding.growing.filter(same) {
            self.multiplier = Some(growing);
            self.since_growing = 0;
            self.frequency = frequency(&growing, finding, self.band, evidence).or(self.frequency);
            self.confidence = confidence(growing.abs - 1.0, growing.deviation).max(self.confidence);
        } else if let Some(multiplier) = finding.multiplier.filter(same) {
            self.multiplier = Some(multiplier);
        }
    }

    /// The verdict that it is.
    pub(super) fn judgement(&self) -> Judgement {
        Judgement {
            verdict: match self.kind {
                GrowthKind::Hopf => Verdict::Hopf,
                GrowthKind::Flip => Verdict::PeriodDoubling,
            },
            reason: self.reason,
            chatter: self.frequency,
            multiplier_abs: self.multiplier.map(|m| m.abs),
            confidence: self.confidence,
        }
    }
}

/// Probability that an estimate lies on the right side, at least: 1 − 1/(1 + z²) by Cantelli's inequality.
pub(super) fn confidence(distance: f32, deviation: f32) -> f32 {
    if !(deviation > 0.0 && distance > 0.0) {
        return 0.5;
    }
    let z = distance / deviation;
    let square = z * z;
    if square.is_finite() {
        square / (1.0 + square)
    } else {
        1.0
    }
}
