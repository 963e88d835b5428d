//! The frequency of chatter: which of all that look alike once per tooth period.

use crate::detector::evidence::{BANDS, Evidence};
use crate::detector::finding::{Finding, Multiplier};
use crate::math::round;
use crate::synchronous::SLOTS;
use crate::units::Hertz;

/// A tone within so many bins of a frequency is at it.
const SAME_BINS: f32 = 1.5;

/// (±arg μ/2π + k)/T, with k from a tone of the spectrum where one fits, else from the shape within the tooth period.
///
/// The angle of the multiplier tells the frequency more sharply than the spectrum does; the spectrum only says which k carries the power.
pub(super) fn frequency(
    multiplier: &Multiplier,
    finding: &Finding,
    band: usize,
    evidence: &Evidence<'_>,
) -> Option<Hertz> {
    let passing_hz = evidence.speed?.0 * f32::from(evidence.teeth);
    for (tone, spectrum) in evidence.tones.iter().zip(&evidence.spectra) {
        let (Some(tone), Some(spectrum)) = (tone, spectrum) else {
            continue;
        };
        let cycles = nearest(tone.frequency.0 / passing_hz, multiplier.angle_turns);
        let frequency = Hertz(cycles * passing_hz);
        if (tone.frequency.0 - frequency.0).abs() < SAME_BINS * spectrum.bin.0 {
            return Some(frequency);
        }
    }
    let cycles = finding.cycles?;
    // Samples at the slots cannot tell cycles that differ by the number of slots: the spectrum can.
    let slots = SLOTS as f32;
    let Some(spectrum) = evidence.spectra[band].filter(|_| band == BANDS - 1) else {
        return Some(Hertz(cycles * passing_hz));
    };
    let mut best = (cycles, spectrum.mean_square_near(Hertz(cycles * passing_hz)));
    for turn in [1.0, 2.0] {
        for candidate in [turn * slots - cycles, turn * slots + cycles] {
            let power = spectrum.mean_square_near(Hertz(candidate * passing_hz));
            if power > best.1 {
                best = (candidate, power);
            }
        }
    }
    Some(Hertz(best.0 * passing_hz))
}

/// The k ± angle nearest to `cycles`.
fn nearest(cycles: f32, angle_turns: f32) -> f32 {
    let up = round(cycles - angle_turns) + angle_turns;
    let down = round(cycles + angle_turns) - angle_turns;
    let nearer = if (cycles - up).abs() < (cycles - down).abs() {
        up
    } else {
        down
    };
    nearer.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_alias_is_taken() {
        for (cycles, angle, expected) in [
            (0.35, 0.344, 0.344),
            (0.64, 0.344, 0.656),
            (1.30, 0.344, 1.344),
            (0.1, 0.2, 0.2),
            (2.49, 0.5, 2.5),
        ] {
            let found = nearest(cycles, angle);
            assert!((found - expected).abs() < 1e-6, "{cycles} {angle}: {found}");
        }
    }
}
