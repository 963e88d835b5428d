//! Tones in a power spectrum: frequency and amplitude by interpolation, noise floor, harmonics of the spindle.
//!
//! Both bands and several searches call the functions of this file. They are not inlined, because flash is scarce.

use heapless::Vec;

use crate::criteria::{
    FLOOR_HALF_WIDTH, HARMONIC_BINS, HARMONIC_TOLERANCE_MAX, LOBE_HALF_WIDTH, MAXIMA_SEARCHED,
};
use crate::math;
use crate::spectrum::{HANN_NOISE_BINS, PowerSpectrum};
use crate::units::{Hertz, MetersPerSecond2};

pub use crate::criteria::MIN_SNR;

/// A tone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Peak {
    /// Frequency of the tone.
    pub frequency: Hertz,
    /// Zero-to-peak amplitude of the tone; over several axes the root of the sum of squares.
    pub amplitude: MetersPerSecond2,
    /// Ratio of the power in the tone's highest bin to the noise floor, the median power of the bins around it.
    pub snr: f32,
}

/// Rotational speed of the spindle during a spectrum, with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotation {
    /// Rotational frequency of the spindle, revolutions per second.
    pub frequency: Hertz,
    /// Largest error or change of the spindle frequency within the duration of the spectrum.
    pub uncertainty: Hertz,
}

/// The strongest tone of a spectrum that is no harmonic of the spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NonHarmonic {
    /// The tone.
    pub peak: Peak,
    /// Order of the spindle harmonic nearest to the tone.
    pub nearest_order: u32,
    /// Signed distance of the tone from the nearest spindle harmonic, in spindle orders: ½ for a tone halfway between
    /// two harmonics.
    pub orders_off: f32,
}

/// Result of the search for a tone that is no harmonic of the spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Search {
    /// A tone was found.
    Found(NonHarmonic),
    /// No tone other than harmonics of the spindle was found below the given frequency.
    Nothing {
        /// Upper end of the range in which harmonics of the spindle and other tones can be distinguished.
        resolved_to: Hertz,
    },
    /// Nowhere in the range can harmonics of the spindle and other tones be distinguished, because of the uncertainty
    /// of the spindle speed and the resolution of the spectrum.
    Unresolved,
}

impl PowerSpectrum<'_> {
    fn at(&self, k: usize) -> f32 {
        self.power.get(k).copied().unwrap_or(0.0)
    }

    /// Frequency (in bins) and mean square of a tone of the spectrum whose highest bin is `k`.
    ///
    /// With the amplitudes a, b, c of the bins below, at and above, the Hann window gives the offset δ = 2(c − a)/(a +
    /// 2b + c) from the middle bin and the amplitude (a + 2b + c)·(1 − δ²)(4 − δ²)/12·πδ/sin πδ, both for a single
    /// tone (Agrež, IEEE Trans. Instrum. Meas. 51, 2002). Noise 20 dB below the peak in its bin gives δ an error
    /// of 0.065 rms.
    fn interpolate(&self, k: usize) -> (f32, f32) {
        let [below, middle, above] = [k.wrapping_sub(1), k, k + 1].map(|i| math::sqrt(self.at(i)));
        let sum = below + 2.0 * middle + above;
        if sum <= 0.0 {
            return (k as f32, 0.0);
        }
        let offset = (2.0 * (above - below) / sum).clamp(-1.0, 1.0);
        let square = offset * offset;
        let inverse_sinc = if square > 1e-6 {
            core::f32::consts::PI * offset / math::sin_turns(0.5 * offset)
        } else {
            1.0
        };
        let root = sum * (1.0 - square) * (4.0 - square) / 12.0 * inverse_sinc;
        (k as f32 + offset, root * root)
    }

    /// Noise floor of the spectrum at bin `k`: the median power of the bins around the peak there; 0 if there are
    /// none.
    ///
    /// Other tones change it little while they cover much less than half of these bins.
    #[inline(never)]
    pub fn noise_floor(&self, k: usize) -> f32 {
        let mut around = [0u32; 2 * FLOOR_HALF_WIDTH];
        let below = k.saturating_sub(FLOOR_HALF_WIDTH)..k.saturating_sub(LOBE_HALF_WIDTH);
        let above = k + LOBE_HALF_WIDTH + 1..k + FLOOR_HALF_WIDTH + 1;
        let bins = below.chain(above).filter_map(|i| self.power.get(i));
        let mut count = 0;
        for (slot, power) in around.iter_mut().zip(bins) {
            // Non-negative floats have the same order as their bit patterns, which can be sorted as integers.
            *slot = power.to_bits();
            count += 1;
        }
        let Some(around) = around.get_mut(..count).filter(|bins| !bins.is_empty()) else {
            return 0.0;
        };
        f32::from_bits(*around.select_nth_unstable(count / 2).1)
    }

    /// Frequency, amplitude and signal-to-noise ratio of the tone whose highest bin is `k`.
    #[inline(never)]
    fn peak(&self, k: usize) -> Peak {
        let (bins, mean_square) = self.interpolate(k);
        let floor = self.noise_floor(k).max(f32::MIN_POSITIVE);
        Peak {
            frequency: Hertz(bins * self.bin.0),
            amplitude: MetersPerSecond2(math::sqrt(2.0 * mean_square)),
            snr: (self.at(k) / floor).min(f32::MAX),
        }
    }

    /// Bins of the local maxima of the spectrum between two frequencies, or in the next bin outside, strongest first,
    /// at most [`MAXIMA_SEARCHED`].
    #[inline(never)]
    fn maxima(&self, from: Hertz, to: Hertz) -> Vec<usize, MAXIMA_SEARCHED> {
        let mut found: Vec<usize, MAXIMA_SEARCHED> = Vec::new();
        // The rounded mean of the samples was subtracted; its rounding error remains in bins 0 and 1, so these are
        // skipped.
        let first = ((from.0 / self.bin.0) as usize).max(2);
        let end = ((to.0 / self.bin.0) as usize)
            .saturating_add(2)
            .min(self.power.len().saturating_sub(1));
        for k in first..end {
            let power = self.at(k);
            if power > self.at(k - 1) && power >= self.at(k + 1) {
                let place = found
                    .iter()
                    .position(|&other| power > self.at(other))
                    .unwrap_or(found.len());
                if found.is_full() && place < MAXIMA_SEARCHED {
                    found.pop();
                }
                // If the list of maxima is full, the weakest is dropped.
                let _ = found.insert(place, k);
            }
        }
        found
    }

    /// Sum of the powers of the five bins around a frequency divided by [`HANN_NOISE_BINS`], in (m/s²)². It is
    /// about the mean square of a tone at this frequency, if no other tone is within the main lobe of the window.
    pub fn mean_square_near(&self, frequency: Hertz) -> f32 {
        let centre = math::round(frequency.0 / self.bin.0).max(0.0) as usize;
        let lobe = centre.saturating_sub(2)..=centre + 2;
        lobe.map(|k| self.at(k)).sum::<f32>() / HANN_NOISE_BINS
    }

    /// The strongest tone of the spectrum between two frequencies, if its power is at least [`MIN_SNR`] times the noise
    /// floor.
    #[inline(never)]
    pub fn dominant(&self, from: Hertz, to: Hertz) -> Option<Peak> {
        let strongest = *self.maxima(from, to).first()?;
        Some(self.peak(strongest)).filter(|peak| peak.snr >= MIN_SNR)
    }

    /// The strongest tone between two frequencies that is no harmonic of the spindle.
    ///
    /// A tone counts as harmonic n of the spindle if it lies within n·uncertainty plus one bin of it. A local maximum
    /// is skipped if it is explained by the window's side lobes of stronger maxima.
    #[inline(never)]
    pub fn dominant_non_harmonic(&self, rotation: Rotation, from: Hertz, to: Hertz) -> Search {
        let Rotation {
            frequency,
            uncertainty,
        } = rotation;
        let width = HARMONIC_BINS * self.bin.0;
        // At this spindle order the tolerance around a harmonic reaches its largest allowed share of the distance
        // between two harmonics.
        let highest_order =
            (HARMONIC_TOLERANCE_MAX * frequency.0 - width) / uncertainty.0.max(1e-6 * frequency.0.abs());
        let resolved_to = Hertz((highest_order * frequency.0).min(to.0));
        if !(highest_order >= 1.0 && resolved_to.0 > from.0) {
            return Search::Unresolved;
        }
        let maxima = self.maxima(from, to);
        for (rank, &k) in maxima.iter().enumerate() {
            let hertz = self.interpolate(k).0 * self.bin.0;
            let orders = hertz / frequency.0;
            let nearest = math::round(orders);
            let tolerance = nearest * uncertainty.0 + width;
            let harmonic = (hertz - nearest * frequency.0).abs() <= tolerance;
            let stronger = maxima.get(..rank).unwrap_or_default();
            if harmonic || hertz > resolved_to.0 || self.is_side_lobe(k, stronger) {
                continue;
            }
            let peak = self.peak(k);
            if peak.snr >= MIN_SNR {
                let orders_off = orders - nearest;
                return Search::Found(NonHarmonic {
                    peak,
                    nearest_order: nearest as u32,
                    orders_off,
                });
            }
        }
        Search::Nothing { resolved_to }
    }

    /// True if the leakage of the stronger maxima through the Hann window amounts to at least half of the amplitude in
    /// bin `k`.
    fn is_side_lobe(&self, k: usize, stronger: &[usize]) -> bool {
        let leaked: f32 = stronger
            .iter()
            .map(|&other| {
                let (bins, mean_square) = self.interpolate(other);
                let distance = (k as f32 - bins).abs();
                // Envelope of the Hann window's transform |sinc(d)/(1 − d²)| at a distance of d bins. Within the main
                // lobe it is taken as 1.
                let envelope = if distance < 2.0 {
                    1.0
                } else {
                    1.0 / (core::f32::consts::PI * distance * (distance * distance - 1.0))
                };
                math::sqrt(mean_square) * envelope
            })
            .sum();
        2.0 * leaked >= math::sqrt(self.at(k))
    }
}
