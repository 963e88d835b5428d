//! The frequency of chatter: which of all that look alike once per tooth period.

use crate::detector::evidence::{BANDS, Evidence};
use crate::detector::finding::{Finding, GrowthKind, Multiplier};
use crate::math::round;
use crate::spectrum::PowerSpectrum;
use crate::synchronous::SLOTS;
use crate::units::Hertz;

/// A tone within so many bins of a frequency is at it.
const SAME_BINS: f32 = 1.5;
/// A line with so many times the power at the frequency of the shape is the vibration, and the shape an image. A choice.
const STRONGER: f32 = 10.0;
/// Lines of a Hann window whose main lobes, four bins wide, stand apart.
const RESOLVED_BINS: f32 = 4.0;

/// (±arg μ/2π + k)/T, with k from a tone of the spectrum that is new where one fits, else from the shape within the tooth period or a
/// much stronger line.
///
/// The angle of the multiplier tells the frequency more sharply than the spectrum does; the spectrum only says which k carries the power.
pub(super) fn frequency(
    multiplier: &Multiplier,
    finding: &Finding,
    band: usize,
    evidence: &Evidence<'_>,
) -> Option<Hertz> {
    let speed_hz = evidence.speed?.0;
    let passing_hz = speed_hz * f32::from(evidence.teeth);
    for (tone, spectrum) in evidence.tones.iter().zip(&evidence.spectra) {
        let (Some(tone), Some(spectrum)) = (tone, spectrum) else {
            continue;
        };
        let frequency = nearest(tone.frequency.0 / passing_hz, multiplier.angle_turns) * passing_hz;
        if (tone.frequency.0 - frequency).abs() < SAME_BINS * spectrum.bin.0 {
            return Some(Hertz(frequency));
        }
    }
    let by_shape = finding
        .cycles
        .map(|cycles| passing_hz * unfolded(cycles, passing_hz, band, evidence));
    let lines = evidence.spectra.iter().flatten();
    let line = lines
        .filter_map(|spectrum| strongest(spectrum, multiplier, speed_hz, passing_hz))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    // A band whose filter has left little of the vibration shows the shape of an image.
    let frequency_hz = match (by_shape, line) {
        (Some(shape_hz), Some((power, line_hz))) if power > STRONGER * power_near(shape_hz, evidence) => {
            line_hz
        }
        (Some(shape_hz), _) => shape_hz,
        (None, line) => line?.1,
    };
    Some(Hertz(frequency_hz))
}

/// Power at a frequency in the spectrum where it is largest, (m/s²)².
fn power_near(hz: f32, evidence: &Evidence<'_>) -> f32 {
    let spectra = evidence.spectra.iter().flatten();
    spectra
        .map(|spectrum| spectrum.mean_square_near(Hertz(hz)))
        .fold(0.0, f32::max)
}

/// The cycles per tooth period with the most power in the spectrum of the tool band, of those that look alike at the slots.
fn unfolded(cycles: f32, passing_hz: f32, band: usize, evidence: &Evidence<'_>) -> f32 {
    let Some(spectrum) = evidence.spectra[band].filter(|_| band == BANDS - 1) else {
        return cycles;
    };
    let highest = spectrum.power.len() as f32 * spectrum.bin.0 / passing_hz;
    let slots = SLOTS as f32;
    let power = |cycles: f32| spectrum.mean_square_near(Hertz(cycles * passing_hz));
    let mut best = (cycles, power(cycles));
    let mut turn = slots;
    while turn - cycles < highest {
        for candidate in [turn - cycles, turn + cycles] {
            let power = power(candidate);
            if candidate < highest && power > best.1 {
                best = (candidate, power);
            }
        }
        turn += slots;
    }
    best.0
}

/// Power, (m/s²)², and frequency, Hz, of the strongest line that looks like the multiplier once per tooth period, besides the harmonics of
/// the spindle where the spectrum resolves them.
fn strongest(
    spectrum: &PowerSpectrum<'_>,
    multiplier: &Multiplier,
    speed_hz: f32,
    passing_hz: f32,
) -> Option<(f32, f32)> {
    let bin_hz = spectrum.bin.0;
    let is_harmonic = |hz: f32| {
        multiplier.kind == GrowthKind::Hopf
            && speed_hz > RESOLVED_BINS * bin_hz
            && (hz - round(hz / speed_hz) * speed_hz).abs() < SAME_BINS * bin_hz
    };
    let mut best: Option<(f32, f32)> = None;
    for (index, &power) in spectrum.power.iter().enumerate().skip(1) {
        if best.is_some_and(|best| power <= best.0) {
            continue;
        }
        let hz = index as f32 * bin_hz;
        let frequency_hz = nearest(hz / passing_hz, multiplier.angle_turns) * passing_hz;
        if (hz - frequency_hz).abs() < SAME_BINS * bin_hz && !is_harmonic(hz) {
            best = Some((power, frequency_hz));
        }
    }
    best
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
    fn the_strongest_line_at_the_angle_is_taken_and_no_harmonic_of_the_spindle() {
        let mut power = [1e-3_f32; 513];
        // 8 kHz in 1 024 points, two teeth at 6 000 rev/min: chatter at 942 Hz, stronger teeth, and two images.
        let bin_hz = 8000.0 / 1024.0;
        for (hz, line) in [
            (200.0, 90.0),
            (800.0, 70.0),
            (942.0, 9.0),
            (658.0, 2.0),
            (142.0, 1.0),
        ] {
            power[(hz / bin_hz + 0.5) as usize] = line;
        }
        let spectrum = PowerSpectrum {
            power: &power,
            bin: Hertz(bin_hz),
        };
        let multiplier = Multiplier {
            kind: GrowthKind::Hopf,
            abs: 1.2,
            angle_turns: 0.29,
            deviation: 0.01,
            level: 1.0,
        };
        let (_, found_hz) = strongest(&spectrum, &multiplier, 100.0, 200.0).unwrap();
        assert!((found_hz - 942.0).abs() < 1e-3, "{found_hz}");
        // Nothing at this angle but the floor.
        let elsewhere = Multiplier {
            angle_turns: 0.1,
            ..multiplier
        };
        let (floor, _) = strongest(&spectrum, &elsewhere, 100.0, 200.0).unwrap();
        assert!(floor < 1e-2, "{floor}");
    }

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
