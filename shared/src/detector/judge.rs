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

use crate::detector::growth::{Finding, Kind, Multiplier};
use crate::detector::tone::Tone;
use crate::detector::{Judgement, Reason, Verdict};
use crate::spectrum::PowerSpectrum;
use crate::synchronous::{Levels, SLOTS};
use crate::units::Hertz;

/// Number of bands: structure, tool.
pub const BANDS: usize = 2;

/// What one step of the pipeline knows.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Revolutions per second; `None` where no one knows.
    pub speed: Option<Hertz>,
    /// The speed is moving too fast for the passings to be compared.
    pub changing: bool,
    /// Too many samples are clipped or lost.
    pub damaged: bool,
    /// Number of teeth.
    pub teeth: u8,
    /// Findings of structure and tool band; `None` where the band cannot be sampled at fixed angles.
    pub findings: [Option<&'a Finding>; BANDS],
    /// New passings since the step before.
    pub new_passings: [bool; BANDS],
    /// Noise of the sensor in one channel of a passing, in m/s².
    pub floors: [f32; BANDS],
    /// The newest spectra.
    pub spectra: [Option<PowerSpectrum<'a>>; BANDS],
    /// The tones that stand out of the background.
    pub tones: [Option<&'a Tone>; BANDS],
    /// A spectrum has a background to stand out of.
    pub heard: bool,
    /// New spectra since the step before.
    pub new_spectra: [bool; BANDS],
}

/// Whether anything is cut, from the levels of one band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Presence {
    /// The quietest this band has been, in m/s²; 0 before it is known.
    quiet: f32,
    /// Residual while it was quiet, in m/s².
    quiet_residual: f32,
    /// Passings well above the quietest, up to [`CONTRAST_PASSINGS`].
    loud: u8,
}

/// Activity this many times the quietest is a cut,
const CUT: f32 = 3.0;
/// below this many times it is none.
const AIR: f32 = 1.8;
/// Activity within this many times the noise of the sensor is none either.
const NOISE: f32 = 2.0;
/// So many passings of a cut and the quietest is known to be none.
const CONTRAST_PASSINGS: u8 = 8;
/// The quietest creeps up by this part per passing: a minute at 30 passings per second makes 10 %.
const CREEP: f32 = 5e-5;

impl Presence {
    fn update(&mut self, finding: &Finding) {
        let levels = &finding.levels;
        let activity = finding.activity;
        if self.quiet == 0.0 || activity < self.quiet {
            self.quiet = activity;
            self.quiet_residual = levels.residual;
        }
        self.quiet *= 1.0 + CREEP;
        if activity > CUT * self.quiet {
            self.loud = (self.loud + 1).min(CONTRAST_PASSINGS);
        } else if self.has_contrast() && activity < AIR * self.quiet {
            self.quiet_residual += 0.05 * (levels.residual - self.quiet_residual);
        }
    }

    fn has_contrast(&self) -> bool {
        self.loud >= CONTRAST_PASSINGS
    }

    fn is_air(&self, finding: &Finding, floor: f32) -> bool {
        let activity = finding.activity;
        activity < NOISE * floor || self.has_contrast() && activity < AIR * self.quiet
    }

    /// Residual of the machine that does not cut; 0 where it is not known.
    fn quiet_residual(&self) -> f32 {
        if self.has_contrast() {
            self.quiet_residual
        } else {
            0.0
        }
    }
}

/// Chatter that was found and is held.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    kind: Kind,
    band: usize,
    /// True where a tone alone told it, without samples at fixed angles.
    by_tone: bool,
    multiplier: Option<Multiplier>,
    frequency: Option<Hertz>,
    /// The largest level it had, in m/s².
    largest: f32,
    /// Passings or spectra since it was last seen growing.
    since_growing: u8,
    /// Passings or spectra in which it was below what is held.
    below: u8,
    confidence: f32,
    reason: Reason,
}

/// Held chatter ends when its level falls below this part of the largest it had,
const RELEASE: f32 = 0.4;
/// for so many passings or spectra.
const RELEASE_PASSINGS: u8 = 6;
/// The residual must stand out of that of the idle machine by this factor.
const OVER_IDLE: f32 = 3.0;
/// Growth seen within so many passings or spectra is growth still.
const LAST_GROWTH: u8 = 16;
/// An angle within this of the held one, in turns, is the same multiplier.
const SAME_ANGLE: f32 = 0.03;
/// A tone within this part of the held frequency is the same, moved on.
const SAME_TONE: f32 = 0.05;
/// What persists must be this part of the forced vibration at least to be called chatter.
const PERSISTENT_SHARE: f32 = 0.7;
/// A residual of this part of the forced vibration that nothing explains is chatter, where a tone is in it.
const WILD_SHARE: f32 = 1.0;
/// A tone of less than this part of the power of its band is no chatter.
const TONE_SHARE: f32 = 0.1;
/// Forced vibration of more than this, root mean square over a tooth period, is worth a word, in m/s².
const LOUD: f32 = 30.0;
/// Runout of more than this part of the forced vibration is worth a word.
const RUNOUT_SHARE: f32 = 1.0;
/// A residual leaks into the means of a few turns: less runout than this many times the residual is none.
const RUNOUT_OVER_RESIDUAL: f32 = 1.5;
/// Passings until a cut is judged stable without anything that could be seen dying.
const SETTLED: u32 = 24;

/// The verdict so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detector {
    presence: [Presence; BANDS],
    held: Option<Held>,
    /// Passings since the tool entered, as far as it is known.
    cut_passings: u32,
    /// The alternating part was seen dying, or standing, since the tool entered.
    runout_seen: bool,
    judgement: Judgement,
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
        const SILENT: Presence = Presence {
            quiet: 0.0,
            quiet_residual: 0.0,
            loud: 0,
        };
        Self {
            presence: [SILENT; BANDS],
            held: None,
            cut_passings: 0,
            runout_seen: false,
            judgement: UNKNOWN,
        }
    }

    /// The newest judgement.
    pub fn judgement(&self) -> &Judgement {
        &self.judgement
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
        self.judgement = UNKNOWN;
    }

    /// Takes what is known now.
    pub fn step(&mut self, evidence: &Evidence<'_>) -> Judgement {
        for band in 0..BANDS {
            if let Some(finding) = evidence.findings[band]
                && evidence.new_passings[band]
                && is_valid(finding, evidence.teeth)
            {
                self.presence[band].update(finding);
            }
        }
        let air = self.is_air(evidence);
        if air == Some(false) {
            let passed = evidence.new_passings.contains(&true);
            self.cut_passings = self.cut_passings.saturating_add(u32::from(passed));
        } else if air == Some(true) {
            self.cut_passings = 0;
        }
        self.release(evidence, air);
        if air != Some(true) && !evidence.changing {
            self.catch(evidence);
        }
        self.judgement = match &self.held {
            Some(held) => judge_held(held),
            None => self.judge(evidence, air),
        };
        self.judgement
    }

    /// True where nothing is cut, `None` where no band can tell yet.
    fn is_air(&self, evidence: &Evidence<'_>) -> Option<bool> {
        let mut air = None;
        for band in 0..BANDS {
            if let Some(finding) = evidence.findings[band]
                && is_valid(finding, evidence.teeth)
            {
                let quiet = self.presence[band].is_air(finding, evidence.floors[band]);
                // A cut is heard in one band at least.
                air = Some(air.unwrap_or(true) && quiet);
            }
        }
        air
    }

    /// Lets held chatter go when it has died down.
    fn release(&mut self, evidence: &Evidence<'_>, air: Option<bool>) {
        let Some(held) = &mut self.held else { return };
        let level = if held.by_tone {
            held.tone(evidence).map_or(0.0, Tone::amplitude)
        } else {
            match evidence.findings[held.band] {
                Some(finding) if is_valid(finding, evidence.teeth) => {
                    level_of(held.kind, finding, evidence.teeth)
                }
                // Conditions have just changed: wait for the first turns.
                _ => return,
            }
        };
        held.largest = held.largest.max(level);
        let news = if held.by_tone {
            evidence.new_spectra[held.band]
        } else {
            evidence.new_passings[held.band]
        };
        if level < RELEASE * held.largest || air == Some(true) {
            held.below = held.below.saturating_add(u8::from(news));
        } else {
            held.below = 0;
        }
        if held.below >= RELEASE_PASSINGS {
            self.held = None;
        } else if news {
            held.follow(evidence);
        }
    }

    /// Looks for chatter that is not held yet.
    fn catch(&mut self, evidence: &Evidence<'_>) {
        for band in 0..BANDS {
            if let Some(finding) = evidence.findings[band]
                && evidence.new_passings[band]
                && is_valid(finding, evidence.teeth)
                && let Some((multiplier, reason)) = self.chatter_in(band, finding, evidence)
            {
                let newly = self
                    .held
                    .is_none_or(|held| held.by_tone || held.is_other(&multiplier, reason, finding));
                if newly {
                    self.held = Some(Held {
                        kind: multiplier.kind,
                        band,
                        by_tone: false,
                        multiplier: Some(multiplier),
                        frequency: frequency(&multiplier, finding, band, evidence),
                        largest: level_of(multiplier.kind, finding, evidence.teeth),
                        since_growing: 0,
                        below: 0,
                        confidence: confidence((multiplier.abs - 1.0).abs(), multiplier.deviation),
                        reason,
                    });
                }
            }
        }
        if self.held.is_none() {
            self.held = tone_alone(evidence);
        }
    }

    /// Chatter as the passings of one band tell it.
    fn chatter_in(
        &self,
        band: usize,
        finding: &Finding,
        evidence: &Evidence<'_>,
    ) -> Option<(Multiplier, Reason)> {
        let residual = finding.levels.residual;
        let idle = self.presence[band].quiet_residual();
        if let Some(growing) = finding.growing {
            let level = level_of(growing.kind, finding, evidence.teeth);
            return (level > OVER_IDLE * idle).then_some((growing, Reason::Growing));
        }
        let persistent = finding.persistent?;
        let large = residual > PERSISTENT_SHARE * finding.levels.forced && residual > OVER_IDLE * idle;
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
            // Without samples at fixed angles the spectrum alone speaks, and it has nothing to say.
            let by_spectrum = evidence.findings.iter().all(Option::is_none) && evidence.heard;
            return unknown(if by_spectrum {
                Reason::NoSignal
            } else {
                Reason::TooShort
            });
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
            Some(m) if finding.decaying || was_stable && m.abs < 1.0 => (
                Verdict::Stable,
                Reason::Decaying,
                confidence(1.0 - m.abs, m.deviation),
            ),
            Some(_) => (Verdict::Indeterminate, Reason::Persistent, 0.0),
            None => (Verdict::Stable, Reason::Decaying, 0.8),
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
            } else {
                judgement.verdict = Verdict::Runout;
            }
        } else if levels.forced > LOUD {
            judgement.verdict = Verdict::Forced;
        }
        judgement
    }
}

impl Held {
    /// Whether what grows now is chatter of the other kind, and larger than what is held.
    fn is_other(&self, multiplier: &Multiplier, reason: Reason, finding: &Finding) -> bool {
        let Levels {
            alternating,
            residual,
            ..
        } = finding.levels;
        let larger = match multiplier.kind {
            Kind::Hopf => residual > alternating,
            Kind::Flip => alternating > residual,
        };
        multiplier.kind != self.kind && reason == Reason::Growing && larger
    }

    /// The tone that is held, where it is still the strongest.
    fn tone<'a>(&self, evidence: &Evidence<'a>) -> Option<&'a Tone> {
        let held = self.frequency?.0;
        evidence.tones[self.band].filter(|tone| (tone.frequency.0 - held).abs() < SAME_TONE * held)
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
}

fn judge_held(held: &Held) -> Judgement {
    Judgement {
        verdict: match held.kind {
            Kind::Hopf => Verdict::Hopf,
            Kind::Flip => Verdict::PeriodDoubling,
        },
        reason: held.reason,
        chatter: held.frequency,
        multiplier_abs: held.multiplier.map(|m| m.abs),
        confidence: held.confidence,
    }
}

/// Two turns are needed before levels mean anything.
fn is_valid(finding: &Finding, teeth: u8) -> bool {
    finding.passings > 2 * u32::from(teeth)
}

/// Level of what chatters, in m/s². A flip of an even number of teeth comes back with each turn.
fn level_of(kind: Kind, finding: &Finding, teeth: u8) -> f32 {
    if kind == Kind::Flip && teeth.is_multiple_of(2) {
        finding.levels.alternating
    } else {
        finding.levels.residual
    }
}

/// Probability that an estimate lies on the right side, at least: 1 − 1/(1 + z²) by Cantelli's inequality.
fn confidence(distance: f32, deviation: f32) -> f32 {
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

/// Chatter frequency: (±arg μ/2π + k)/T, with k from a tone of the spectrum where one fits, else from the shape within the tooth period.
fn frequency(
    multiplier: &Multiplier,
    finding: &Finding,
    band: usize,
    evidence: &Evidence<'_>,
) -> Option<Hertz> {
    let passing_hz = evidence.speed?.0 * f32::from(evidence.teeth);
    for tone in evidence.tones.iter().flatten() {
        let cycles = tone.frequency.0 / passing_hz;
        let fraction = (cycles - crate::math::round(cycles)).abs();
        if (fraction - multiplier.angle_turns).abs() < 0.03 {
            return Some(tone.frequency);
        }
    }
    let cycles = finding.cycles?;
    // Samples at the slots cannot tell cycles that differ by the number of slots: the spectrum can.
    let slots = SLOTS as f32;
    let Some(spectrum) = evidence.spectra[band] else {
        return Some(Hertz(cycles * passing_hz));
    };
    let mut best = (cycles, spectrum.mean_square_near(Hertz(cycles * passing_hz)));
    for turn in [1.0, 2.0] {
        for candidate in [turn * slots - cycles, turn * slots + cycles] {
            let power = spectrum.mean_square_near(Hertz(candidate * passing_hz));
            if band == BANDS - 1 && power > best.1 {
                best = (candidate, power);
            }
        }
    }
    Some(Hertz(best.0 * passing_hz))
}

/// Chatter as the spectrum tells it: where nothing can be sampled at fixed angles, or where that sees a residual that no few multipliers
/// explain, as of a cut that is far over the limit.
fn tone_alone(evidence: &Evidence<'_>) -> Option<Held> {
    evidence.speed?;
    for band in 0..BANDS {
        let Some(tone) = evidence.tones[band].filter(|tone| tone.share >= TONE_SHARE) else {
            continue;
        };
        let heard = match evidence.findings[band] {
            None => evidence.findings.iter().all(Option::is_none) && (tone.grows() || tone.lasts()),
            Some(finding) => {
                tone.spectra >= 2
                    && is_wild(finding, WILD_SHARE)
                    && finding.levels.residual > 0.2 * tone.amplitude()
            }
        };
        if !heard {
            continue;
        }
        return Some(Held {
            kind: kind_of(tone, evidence),
            band,
            by_tone: true,
            multiplier: None,
            frequency: Some(tone.frequency),
            largest: tone.largest,
            since_growing: if tone.grows() { 0 } else { LAST_GROWTH },
            below: 0,
            confidence: 0.8,
            reason: if tone.grows() {
                Reason::Growing
            } else {
                Reason::Persistent
            },
        });
    }
    None
}

/// Whether the passings have a residual of this part of the forced vibration that neither dies nor can be predicted.
fn is_wild(finding: &Finding, share: f32) -> bool {
    let residual = finding.levels.residual;
    // The residual is a mean over some turns: the activity tells whether it is still there.
    finding.passings >= SETTLED
        && finding.multiplier.is_none()
        && residual > share * finding.levels.forced
        && finding.activity > residual
}

/// With an odd number of teeth the frequencies of a flip, odd multiples of half the tooth passing, are no harmonics of the spindle.
fn kind_of(tone: &Tone, evidence: &Evidence<'_>) -> Kind {
    let Some(speed) = evidence.speed else {
        return Kind::Hopf;
    };
    let halves = 2.0 * tone.frequency.0 / (speed.0 * f32::from(evidence.teeth));
    let nearest = crate::math::round(halves);
    if evidence.teeth % 2 == 1 && nearest as u32 % 2 == 1 && (halves - nearest).abs() < 0.02 {
        Kind::Flip
    } else {
        Kind::Hopf
    }
}
