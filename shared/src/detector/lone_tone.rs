//! Chatter as the spectrum alone tells it.

use crate::detector::Reason;
use crate::detector::evidence::{BANDS, Evidence};
use crate::detector::finding::{Finding, GrowthKind};
use crate::detector::latched_chatter::{LAST_GROWTH, LatchedChatter};
use crate::detector::lines::LOUD;
use crate::detector::tone::Tone;

/// A residual of this part of the forced vibration that nothing explains is chatter, where a tone is in it.
const WILD_SHARE: f32 = 1.0;
/// A tone of less than this part of the power of its band is no chatter.
const TONE_SHARE: f32 = 0.1;
/// Passings after which a residual that nothing explains is no transient.
const SETTLED: u32 = 24;

/// Chatter as the spectrum tells it: where nothing can be sampled at fixed angles, or where that sees a residual that no few multipliers
/// explain, as of a cut that is far over the limit.
pub(super) fn tone_alone(evidence: &Evidence<'_>) -> Option<LatchedChatter> {
    evidence.speed?;
    let unsampled = evidence.findings.iter().all(Option::is_none);
    for band in 0..BANDS {
        let lasting = evidence.lines[band]
            .filter(|_| unsampled)
            .and_then(|lines| lines.chatter(LOUD));
        let Some(tone) = evidence.tones[band]
            .filter(|tone| tone.share >= TONE_SHARE)
            .or(lasting)
        else {
            continue;
        };
        let heard = match evidence.findings[band] {
            None => unsampled && (tone.grows() || tone.lasts()),
            Some(finding) => {
                tone.spectra >= 2
                    && is_wild(finding, WILD_SHARE)
                    && finding.levels.residual > 0.2 * tone.amplitude()
            }
        };
        if !heard {
            continue;
        }
        return Some(LatchedChatter {
            kind: kind_of(tone, evidence),
            band,
            by_tone: true,
            multiplier: None,
            frequency: Some(tone.frequency),
            largest: tone.largest,
            since_growing: if tone.grows() { 0 } else { LAST_GROWTH },
            below: 0,
            below_s: 0.0,
            loudest: evidence.loudness[band],
            quiet_s: 0.0,
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
fn kind_of(tone: &Tone, evidence: &Evidence<'_>) -> GrowthKind {
    let Some(speed) = evidence.speed else {
        return GrowthKind::Hopf;
    };
    let halves = 2.0 * tone.frequency.0 / (speed.0 * f32::from(evidence.teeth));
    let nearest = crate::math::round(halves);
    if evidence.teeth % 2 == 1 && nearest as u32 % 2 == 1 && (halves - nearest).abs() < 0.02 {
        GrowthKind::Flip
    } else {
        GrowthKind::Hopf
    }
}
