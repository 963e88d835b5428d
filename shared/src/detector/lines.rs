//! The lines of the spindle in a spectrum, and a tone beside them: what is heard of a cut without samples at fixed angles.

use crate::detector::tone::Tone;
use crate::peaks::{MIN_SNR, Rotation, Search};
use crate::spectrum::PowerSpectrum;
use crate::units::Hertz;

/// Lines of the spindle in the spectrum of one band, and the strongest tone beside them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lines {
    /// Mean square of the harmonics of the tooth passing, and of the spindle where the spectrum separates them, (m/s²)².
    pub synchronous: f32,
    /// A harmonic of the tooth passing stands out of the noise.
    pub has_teeth: bool,
    /// The strongest tone that is no harmonic of the spindle.
    pub beside: Option<Tone>,
    /// The tone beside comes with a line one or two tooth-passing frequencies away.
    pub is_modulated: bool,
}

/// Forced vibration of more than this, root mean square over a tooth period, is worth a word, in m/s².
pub(super) const LOUD: f32 = 30.0;
/// Largest number of harmonics that are added up. It limits the computing time.
const HARMONICS: u16 = 96;
/// Harmonics of the tooth passing among which one must stand out.
const TEETH_HARMONICS: u16 = 3;
/// Distance of two lines of a Hann spectrum that it separates, in bins: two main lobes and the bins between.
const SEPARATE_BINS: f32 = 6.0;

impl Lines {
    /// The lines of the next spectrum, between two frequencies.
    #[inline(never)]
    pub fn follow(
        before: Option<&Self>,
        spectrum: &PowerSpectrum<'_>,
        rotation: Rotation,
        teeth: u8,
        (from, to): (Hertz, Hertz),
    ) -> Self {
        let spindle = rotation.frequency.0;
        let passing = spindle * f32::from(teeth);
        let step = if spindle > SEPARATE_BINS * spectrum.bin.0 {
            spindle
        } else {
            passing
        };
        let harmonics = |step: f32, count: u16| {
            (1..=count)
                .map(move |order| f32::from(order) * step)
                .take_while(|&hertz| hertz < to.0)
                .filter(|&hertz| hertz > from.0)
        };
        let mut synchronous = 0.0;
        for hertz in harmonics(step, HARMONICS) {
            synchronous += spectrum.mean_square_near(Hertz(hertz));
        }
        let found = match spectrum.dominant_non_harmonic(rotation, from, to) {
            Search::Found(tone) => Some(tone.peak),
            Search::Nothing { .. } | Search::Unresolved => None,
        };
        let beside = Tone::follow(before.and_then(|lines| lines.beside), found, spectrum);
        let stands_out = |hertz: f32| hertz > from.0 && hertz < to.0 && spectrum.has_line(Hertz(hertz));
        let is_modulated = beside.is_some_and(|tone| {
            let away = [-2.0, -1.0, 1.0, 2.0].map(|orders| tone.frequency.0 + orders * passing);
            away.into_iter().any(stands_out)
        });
        Self {
            synchronous,
            has_teeth: harmonics(passing, TEETH_HARMONICS).any(stands_out),
            beside,
            is_modulated,
        }
    }

    /// The tone beside, where it is chatter without its onset having been seen.
    ///
    /// A stable cut vibrates with the harmonics of the spindle. A tone that lasts and has more power than all of them is chatter, or the hum
    /// of another machine. The teeth modulate chatter: f + k·f_teeth (Altintas, Manufacturing Automation, 2012, 3.3). Hum comes without
    /// such lines, and it is not `loud`, an amplitude in m/s².
    pub fn chatter(&self, loud: f32) -> Option<&Tone> {
        self.dominant()
            .filter(|tone| self.has_teeth && tone.lasts() && (self.is_modulated || tone.amplitude() > loud))
    }

    /// The tone beside, where it has more power than the lines of the spindle.
    pub fn dominant(&self) -> Option<&Tone> {
        let tone = self.beside.as_ref()?;
        let square = 0.5 * tone.amplitude() * tone.amplitude();
        (square > self.synchronous).then_some(tone)
    }
}

impl PowerSpectrum<'_> {
    /// True if a line within one bin of a frequency stands out of the noise by [`MIN_SNR`].
    #[inline(never)]
    fn has_line(&self, frequency: Hertz) -> bool {
        let centre = crate::math::round(frequency.0 / self.bin.0).max(0.0) as usize;
        let highest = (centre.saturating_sub(1)..=centre + 1)
            .filter_map(|k| Some((k, *self.power.get(k)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        // The slope of a stronger line beside is none.
        highest.is_some_and(|(k, power)| {
            let at = |k: usize| self.power.get(k).copied().unwrap_or(0.0);
            power > at(k + 1) && k > 0 && power > at(k - 1) && power >= MIN_SNR * self.noise_floor(k)
        })
    }
}
