//! The tooth-passing rule: advises a spindle speed from the chatter frequency alone.

use crate::criteria::{MAX_LOBE, SPEED_BAND};
use crate::units::{Hertz, Rpm};
use crate::working_point::Tool;

/// The admissible speed, with the smallest relative change, at which the chatter frequency is a multiple of the
/// tooth-passing frequency: n = 60·f_c/(N·k) rev/min, k = 1, 2, … [`MAX_LOBE`], with N teeth and f_c in Hz.
///
/// *Principle.* With a whole number of vibrations per tooth period, successive surface waves are in phase and the
/// chip thickness does not vary. For a mode with natural frequency f_n, lobe k covers the tooth-passing frequencies
/// from f_n/(k + 1), where it is steep and f_c = f_n, to f_n/k, where lobe k − 1 begins; its minimum is near
/// f_n/(k + 3/4). The stable pocket lies just above f_n/k. The measured f_c is slightly above f_n, so f_c/k lies in
/// the pocket. High on the right flank of a lobe f_c is far above f_n, and f_c/k is too fast. At that speed f_c is
/// closer to f_n, and a second step of the rule corrects the speed.
///
/// *Hopf.* If the present speed is a speed of the rule (within the speed band) and the cut still chatters, the depth
/// exceeds this pocket. Pockets at lower speeds are shallower, so only faster speeds are candidates.
///
/// *Flip.* f_c is an odd multiple of half the tooth-passing frequency, f_c = (m + 1/2)·f_t. Each candidate changes the
/// speed by the factor (m + 1/2)/k, which differs from 1 by at least 1/(2m + 2): the candidates are as far as
/// possible from the flip lobes. For m = 0 all candidates are slower, at half the present speed or less. The rule
/// cannot find the stable speeds above a flip lobe.
///
/// `None` if no candidate is admissible. The frequency must be positive and finite.
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

/// Ratio of two spindle speeds, the larger over the smaller, hence at least 1.
pub(super) fn ratio(a: Rpm, b: Rpm) -> f32 {
    f32::max(a.0 / b.0, b.0 / a.0)
}
