//! Chatter as the spectrum alone tells it.

use crate::detector::Reason;
use crate::detector::evidence::{BANDS, Evidence};
use crate::detector::finding::GrowthKind;
use crate::detector::latched_chatter::{LAST_GROWTH, LatchedChatter};
use crate::detector::lines::LOUD;
use crate::detector::tone::Tone;

/// A tone of less than this part of the power of its band is no chatter.
const TONE_SHARE: f32 = 0.1;
/// Time without tooth periods at a known speed after which tones alone tell, s, and the least number of revolutions. A tachometer that has just
/// locked gives tooth periods within two revolutions, and while the speed was not known any line was new. A choice.
const UNSAMPLED_S: f32 = 1.0;
/// See [`UNSAMPLED_S`].
const UNSAMPLED_REVOLUTIONS: f32 = 3.0;

/// Chatter as the spectrum tells it, where nothing can be sampled at fixed angles: with a nominal speed, or with a measured one for
/// `unsampled_s` already, as at more tooth periods than the band has samples for.
///
/// Beside tooth periods tones are no evidence: a tone that is new is also that of another force (an entry, a hard spot) on a structure that
/// rings. In 210 sessions of the campaign of detection they raised 39 of 44 false alarms, and one of 81 growing cuts was heard in time by them alone.
pub(super) fn tone_alone(evidence: &Evidence<'_>, unsampled_s: f32) -> Option<LatchedChatter> {
    let speed = evidence.speed?;
    let is_nominal = evidence.lines.iter().any(Option::is_some);
    let is_lasting = unsampled_s >= UNSAMPLED_S.max(UNSAMPLED_REVOLUTIONS / speed.0);
    let unsampled = is_unsampled(evidence) && (is_nominal || is_lasting);
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
        let heard = unsampled && (tone.grows() || tone.lasts());
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

/// True where no band is sampled at fixed angles.
pub(super) fn is_unsampled(evidence: &Evidence<'_>) -> bool {
    evidence.findings.iter().all(Option::is_none)
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
