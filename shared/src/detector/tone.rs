//! What the spectrum of one band says: a tone that the spindle does not explain, that was not there before, and that lasts.
//!
//! A machine hums: fans, drives, pumps and bearings make tones that are no harmonics of the spindle either. So each bin is
//! compared with its own past ([`Background`]), and only what stands out of that is looked at.

use crate::peaks::{Peak, Rotation, Search};
use crate::spectrum::PowerSpectrum;
use crate::units::Hertz;

/// The usual power of each bin: its median over some seconds, by steps of 1/64 up or down.
#[derive(Clone, Debug)]
pub struct Background<const BINS: usize> {
    /// The upper halves of single precision numbers: 8 bits of precision.
    power: [u16; BINS],
    /// Spectra taken, up to [`LEARNING`].
    learnt: u8,
}

/// Spectra whose plain mean is the first background.
const LEARNING: u8 = 6;
/// What has more than this many times the usual power is new.
const NEW: f32 = 10.0;
/// A spectrum with less than this part of the power of the sensor's noise is that of no sensor. The data sheet's noise is typical: the true
/// one may be half of it.
const DEAD: f32 = 0.25;
/// So many bins beside a tone its Hann window has ended.
const BESIDE: usize = 4;
/// Relative step of the background per spectrum.
const FOLLOWS: f32 = 1.0 / 64.0;

impl<const BINS: usize> Default for Background<BINS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const BINS: usize> Background<BINS> {
    /// Knows nothing.
    pub const fn new() -> Self {
        Self {
            power: [0; BINS],
            learnt: 0,
        }
    }

    /// True once there is a background to compare with.
    pub fn is_learnt(&self) -> bool {
        self.learnt >= LEARNING
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        *self = Self::new();
    }

    /// Takes a spectrum of ordinary operation. `noise` is the power of the sensor's noise in one bin. A spectrum without this noise is that of
    /// a sensor that is not connected: it tells nothing of the machine.
    pub fn learn(&mut self, power: &[f32], noise: f32) {
        if power.iter().sum::<f32>() < DEAD * noise * power.len() as f32 {
            return;
        }
        let weight = 1.0 / (f32::from(self.learnt) + 1.0);
        let learning = !self.is_learnt();
        for (slot, &new) in self.power.iter_mut().zip(power) {
            let old = widen(*slot);
            let usual = if learning {
                old + weight * (new - old)
            } else if new > old {
                old + FOLLOWS * old
            } else {
                old - FOLLOWS * old
            };
            *slot = narrow(usual.max(noise));
        }
        self.learnt = (self.learnt + 1).min(LEARNING);
    }

    /// The power of the bins that stand out of the background around by [`NEW`], and in all others no more than the floor of the
    /// background, so that only what is new is left.
    fn keep_new(&self, power: &[f32], noise: f32, kept: &mut [f32]) {
        for (k, (slot, &now)) in kept.iter_mut().zip(power).enumerate() {
            let near = self
                .power
                .get(k.saturating_sub(2)..(k + 3).min(BINS))
                .unwrap_or_default();
            let usual = near.iter().copied().max().map_or(0.0, widen).max(noise);
            *slot = if now > NEW * usual {
                now
            } else {
                // Tones are narrow: the least of the bins around is none.
                let around = self
                    .power
                    .get(k.saturating_sub(8)..(k + 9).min(BINS))
                    .unwrap_or_default();
                let floor = around.iter().copied().min().map_or(0.0, widen);
                // Beside a tone that is not new, the spectrum may have fallen far below its background since.
                let beside = [k.wrapping_sub(BESIDE), k + BESIDE];
                let beside = beside.iter().filter_map(|&bin| power.get(bin));
                beside.fold(floor.min(now), |least, &power| least.min(power))
            };
        }
    }

    /// The strongest tone between two frequencies that is no harmonic of the spindle (where its speed is known) and stands out of the background.
    /// `noise` is the power of the sensor's noise in one bin, `work` scratch memory for as many bins.
    pub fn new_tone(
        &self,
        spectrum: &PowerSpectrum<'_>,
        rotation: Option<Rotation>,
        (from, to): (Hertz, Hertz),
        noise: f32,
        work: &mut [f32],
    ) -> Option<Peak> {
        let work = work.get_mut(..spectrum.power.len())?;
        self.keep_new(spectrum.power, noise, work);
        let new = PowerSpectrum {
            power: work,
            bin: spectrum.bin,
        };
        let found = match rotation {
            None => new.dominant(from, to)?,
            Some(rotation) => match new.dominant_non_harmonic(rotation, from, to) {
                Search::Found(tone) => tone.peak,
                Search::Nothing { .. } | Search::Unresolved => return None,
            },
        };
        // Frequency and amplitude are those of the spectrum itself.
        let reach = 0.5 * spectrum.bin.0;
        spectrum.dominant(Hertz(found.frequency.0 - reach), Hertz(found.frequency.0 + reach))
    }
}

fn widen(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

/// Rounds to the nearest; never up from below the smallest step, so that a median can fall to any level.
fn narrow(power: f32) -> u16 {
    (power.max(0.0).to_bits().saturating_add(0x7FFF) >> 16) as u16
}

/// A tone followed from spectrum to spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Its frequency, in the newest spectrum.
    pub frequency: Hertz,
    /// Its amplitude, in m/s², in the last spectra, newest first.
    amplitudes: [f32; Tone::HISTORY],
    /// Spectra in which it was seen one after another.
    pub spectra: u16,
    /// Its part of the power of the band.
    pub share: f32,
    /// The largest amplitude it had, in m/s².
    pub largest: f32,
}

/// A tone may move by this fraction of its frequency from one spectrum to the next,
const MOVES: f32 = 0.03;
/// or by so many bins.
const MOVES_BINS: f32 = 2.0;

impl Tone {
    /// Spectra that are compared with each other.
    pub const HISTORY: usize = 6;

    /// Goes on with the tone found in the next spectrum.
    #[inline(never)]
    pub fn follow(before: Option<Self>, found: Option<Peak>, spectrum: &PowerSpectrum<'_>) -> Option<Self> {
        let peak = found?;
        let total: f32 = spectrum.power.iter().skip(2).sum::<f32>() / crate::spectrum::HANN_NOISE_BINS;
        let amplitude = peak.amplitude.0;
        let share = if total > 0.0 {
            0.5 * amplitude * amplitude / total
        } else {
            0.0
        };
        let reach = (MOVES * peak.frequency.0).max(MOVES_BINS * spectrum.bin.0);
        let mut tone = before
            .filter(|tone| (tone.frequency.0 - peak.frequency.0).abs() <= reach)
            .unwrap_or(Self {
                frequency: peak.frequency,
                amplitudes: [0.0; Self::HISTORY],
                spectra: 0,
                share,
                largest: 0.0,
            });
        tone.amplitudes.rotate_right(1);
        tone.amplitudes[0] = amplitude;
        tone.largest = tone.largest.max(amplitude);
        (tone.frequency, tone.share) = (peak.frequency, share);
        tone.spectra = tone.spectra.saturating_add(1);
        Some(tone)
    }

    /// Its amplitude in the newest spectrum, in m/s².
    pub fn amplitude(&self) -> f32 {
        self.amplitudes[0]
    }

    /// True where it has grown in every one of the last spectra but one, and by half or more over all of them.
    pub fn grows(&self) -> bool {
        let seen = usize::from(self.spectra).min(Self::HISTORY);
        let seen = self.amplitudes.get(..seen).unwrap_or_default();
        let falls = seen.windows(2).filter(|pair| pair[0] <= pair[1]).count();
        let first = seen.last().copied().unwrap_or(0.0);
        seen.len() >= 4 && falls <= 1 && self.amplitude() > 1.5 * first
    }

    /// True where it neither dies out nor comes and goes: in the last spectra the smallest is more than 0.6 of the largest, and the newest not the smallest of all.
    ///
    /// The amplitude of a mode that noise drives is that of Rayleigh: it falls below 0.6 of its largest within a few independent spectra.
    pub fn lasts(&self) -> bool {
        if usize::from(self.spectra) < Self::HISTORY {
            return false;
        }
        let largest = self.amplitudes.iter().copied().fold(0.0, f32::max);
        let smallest = self.amplitudes.iter().copied().fold(f32::INFINITY, f32::min);
        smallest > 0.6 * largest && self.amplitude() > 0.7 * self.largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::MetersPerSecond2;

    const BINS: usize = 256;
    const NOISE: f32 = 0.1;

    #[test]
    fn silence_of_a_dead_sensor_is_no_background() {
        let mut background = Background::<BINS>::new();
        for _ in 0..50 {
            background.learn(&[0.0; BINS], NOISE);
        }
        assert!(!background.is_learnt());
        for seed in 0..20 {
            background.learn(&spectrum(seed, &[(60, 5000.0)]), NOISE);
        }
        let power = spectrum(99, &[(60, 5000.0)]);
        let spectrum = PowerSpectrum {
            power: &power,
            bin: Hertz(2.0),
        };
        let mut work = [0.0; BINS];
        let hum = background.new_tone(&spectrum, None, (Hertz(10.0), Hertz(500.0)), NOISE, &mut work);
        assert_eq!(hum, None);
    }

    #[test]
    fn the_background_comes_back_from_a_level_below_the_noise() {
        let mut background = Background::<BINS>::new();
        for seed in 0..6 {
            background.learn(&spectrum(seed, &[]).map(|power| 0.01 * power), 0.01);
        }
        // The tone grows by steps of 1/64 from the noise on: 20 dB in 300 spectra.
        for seed in 0..400 {
            background.learn(&spectrum(seed, &[(60, 1.0)]).map(|power| 0.01 * power), 0.01);
        }
        assert!(widen(background.power[60]) > 0.005);
    }

    /// Noise of about power 1, with the three bins of a Hann window for each tone (bin, power).
    fn spectrum(seed: u32, tones: &[(usize, f32)]) -> [f32; BINS] {
        let mut power: [f32; BINS] = std::array::from_fn(|k| {
            0.5 + ((k as u32 + seed).wrapping_mul(2_654_435_761) % 1000) as f32 / 1000.0
        });
        for &(bin, height) in tones {
            for (k, share) in [(bin - 1, 0.25), (bin, 1.0), (bin + 1, 0.25)] {
                power[k] += share * height;
            }
        }
        power
    }

    #[test]
    fn only_what_is_new_is_a_tone() {
        let mut background = Background::<BINS>::new();
        for seed in 0..20 {
            background.learn(&spectrum(seed, &[(60, 5000.0)]), NOISE);
        }
        let power = spectrum(99, &[(60, 5000.0), (150, 300.0)]);
        let spectrum = PowerSpectrum {
            power: &power,
            bin: Hertz(2.0),
        };
        let mut work = [0.0; BINS];
        let mut find =
            |from, to| background.new_tone(&spectrum, None, (Hertz(from), Hertz(to)), NOISE, &mut work);
        // The hum at 120 Hz is far louder than the new tone at 300 Hz.
        let found = find(10.0, 500.0).unwrap();
        assert!((found.frequency.0 - 300.0).abs() < 0.2, "{found:?}");
        assert_eq!(find(10.0, 280.0), None);
    }

    #[test]
    fn tones_grow_last_or_fade() {
        let power = [1.0; BINS];
        let spectrum = PowerSpectrum {
            power: &power,
            bin: Hertz(2.0),
        };
        let follow = |amplitudes: &[f32]| {
            let peaks = amplitudes.iter().map(|&amplitude| Peak {
                frequency: Hertz(300.0),
                amplitude: MetersPerSecond2(amplitude),
                snr: 100.0,
            });
            let tone = peaks.fold(None, |tone, peak| Tone::follow(tone, Some(peak), &spectrum));
            tone.unwrap()
        };
        let grows = follow(&[1.0, 1.2, 1.5, 1.8]);
        assert!(grows.grows() && !grows.lasts());
        let lasts = follow(&[1.0, 0.95, 1.02, 0.98, 1.0, 1.01]);
        assert!(lasts.lasts() && !lasts.grows());
        let fades = follow(&[1.0, 0.9, 0.8, 0.7, 0.6, 0.5]);
        assert!(!fades.lasts() && !fades.grows());
        // Another frequency is another tone.
        let other = Peak {
            frequency: Hertz(340.0),
            amplitude: MetersPerSecond2(1.0),
            snr: 100.0,
        };
        assert_eq!(
            Tone::follow(Some(lasts), Some(other), &spectrum).unwrap().spectra,
            1
        );
    }
}
