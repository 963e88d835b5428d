//! The tooth-passing rule: a quiet speed from nothing but the chatter frequency.

use super::margins::SPEED_BAND;
use crate::units::{Hertz, Rpm};
use crate::working_point::Tool;

/// The largest number of vibrations per tooth that the rule looks at. Pockets k and k + 1 are 1/k apart: beyond 20 that
/// is under 5 %, most of it lobe, and no pocket holds the ±1 % of the speed band any more.
pub const MAX_LOBE: u16 = 20;

/// The admissible speed nearest in relative change at which the chatter frequency is a multiple of the tooth
/// passing: n = 60·f_c/(N·k), k = 1, 2, … [`MAX_LOBE`].
///
/// *Why.* With whole vibrations from tooth to tooth successive waves are in phase and the chip thickness does not vary.
/// Of a mode with natural frequency f_n, lobe k reaches from f_n/(k + 1), where it is steep and f_c = f_n, over
/// its lowest point near f_n/(k + 3/4), to where lobe k − 1 begins, at f_n/k; the pocket is the notch just right of that.
/// The heard f_c lies a little above f_n, so the rule lands a little right of f_n/k: in the notch. High on the right
/// flank of a lobe f_c is well above f_n and the rule lands too far right; heard again from there, f_c is
/// closer to f_n, and a second step of the rule corrects it.
///
/// *Hopf.* Where the present speed is already one of the rule's (within the speed band) and it still chatters, the
/// pocket is not deep enough; lower ones are shallower still, so that only faster speeds count then.
///
/// *Flip.* Then f_c is an odd multiple of half the tooth passing, f_c = (m + 1/2)·f_t, and every speed of the rule
/// changes the present one by a factor (m + 1/2)/k, at least 1/(2m + 2) away from 1: the flip lobes sit at
/// half-odd multiples, the speeds of the rule as far as can be from them. For m = 0 there is only the slower
/// speed at which the tooth passing is f_c (half the present one or less); what may lie above the flip lobe the rule cannot
/// know.
///
/// `None` where no such speed is admissible. The frequency must be positive and finite.
///
/// Source: Y. Altintas, *Manufacturing Automation*, on selecting spindle speed from the chatter frequency; S. Smith and
/// J. Tlusty on regulating the speed to the chatter frequency.
pub fn tooth_passing_speed(
    speed: Rpm,
    chatter: Hertz,
    tool: &Tool,
    is_admissible: impl Fn(Rpm) -> bool,
) -> Option<Rpm> {
    let speed_of = |lobe: u16| Rpm(chatter.to_rpm().0 / (f32::from(tool.teeth) * f32::from(lobe)));
    let is_here = |candidate: Rpm| ratio(candidate, speed) <= 1.0 + SPEED_BAND;
    let here = (1..=MAX_LOBE).find(|&lobe| is_here(speed_of(lobe)));
    let lobes = match here {
        Some(lobe) => 1..lobe,
        None => 1..MAX_LOBE + 1,
    };
    lobes
        .map(speed_of)
        .filter(|&candidate| is_admissible(candidate))
        .min_by(|&a, &b| f32::total_cmp(&ratio(a, speed), &ratio(b, speed)))
}

/// The relative change between two speeds, as the larger over the smaller.
pub(super) fn ratio(a: Rpm, b: Rpm) -> f32 {
    f32::max(a.0 / b.0, b.0 / a.0)
}
