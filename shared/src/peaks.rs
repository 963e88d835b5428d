//! Tones in a power spectrum: frequency and amplitude by interpolation, noise floor, harmonics of the spindle.

use heapless::Vec;

use crate::math;
use crate::spectrum::{HANN_NOISE_BINS, PowerSpectrum};
use crate::units::{Hertz, MetersPerSecond2};

/// A tone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Peak {
    /// Frequency of the tone.
    pub frequency: Hertz,
    /// Zero-to-peak amplitude; over several axes the root of the sum of squares.
    pub amplitude: MetersPerSecond2,
    /// Ratio of the highest bin's power to the median power of the bins around it.
    pub snr: f32,
}

/// Rotation of the spindle during a spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotation {
    /// Revolutions per second.
    pub frequency: Hertz,
    /// Largest error or change of that frequency within the spectrum.
    pub uncertainty: Hertz,
}

/// The strongest tone that is no harmonic of the spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NonHarmonic {
    /// The tone.
    pub peak: Peak,
    /// Order of the nearest harmonic of the spindle.
    pub nearest_order: u32,
    /// Signed distance from that harmonic, in revolutions: ½ for a tone halfway between two.
    pub orders_off: f32,
}

/// Result of the search for a tone that is no harmonic of the spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Search {
    /// A tone was found.
    Found(NonHarmonic),
    /// No tone was found up to the given frequency.
    Nothing {
        /// Above this frequency harmonics and other tones cannot be distinguished.
        resolved_to: Hertz,
    },
    /// The harmonics are too close for the resolution of this spectrum.
    Unresolved,
}

/// Number of bins on each side of a peak whose median is the noise floor. Unfounded.
const FLOOR_HALF_WIDTH: usize = 64;
/// Number of bins on each side of a peak that belong to it: the main lobe of the Hann window and one more.
const LOBE_HALF_WIDTH: usize = 3;
/// Smallest ratio of a tone's power to the noise floor: 14 dB. A bin of white noise exceeds it once in 3·10⁷.
pub const MIN_SNR: f32 = 25.0;
/// Distance in bins within which a tone counts as the harmonic: closer main lobes cannot be separated.
const HARMONIC_BINS: f32 = 1.0;
/// Number of local maxima, strongest first, that the search considers. Unfounded.
const CANDIDATES: usize = 32;

impl PowerSpectrum<'_> {
    fn at(&self, k: usize) -> f32 {
        self.power.get(k).copied().unwrap_or(0.0)
    }

    /// Frequency in bins and mean square of the tone whose highest bin is `k`.
    ///
    /// With the amplitudes a, b, c of the bins below, at and above, the Hann window gives the offset δ = 2(c − a)/(a + 2b + c) from
    /// the middle bin and the amplitude (a + 2b + c)·(1 − δ²)(4 − δ²)/12·πδ/sin πδ, both exact for a single tone
    /// (Agrež, IEEE Trans. Instrum. Meas. 51, 2002). Noise of −20 dB against the peak moves δ by 0.05 rms.
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

    /// Noise floor at bin `k`: the median power of the bins around the peak.
    ///
    /// Other tones do not change it while they cover less than half of these bins.
    pub fn noise_floor(&self, k: usize) -> f32 {
        let mut around = [0u32; 2 * FLOOR_HALF_WIDTH];
        let below = k.saturating_sub(FLOOR_HALF_WIDTH)..k.saturating_sub(LOBE_HALF_WIDTH);
        let above = k + LOBE_HALF_WIDTH + 1..k + FLOOR_HALF_WIDTH + 1;
        let bins = below.chain(above).filter_map(|i| self.power.get(i));
        let mut count = 0;
        for (slot, power) in around.iter_mut().zip(bins) {
            // The bit patterns of non-negative floats sort like the floats.
            *slot = power.to_bits();
            count += 1;
        }
        let Some(around) = around.get_mut(..count).filter(|bins| !bins.is_empty()) else {
            return 0.0;
        };
        f32::from_bits(*around.select_nth_unstable(count / 2).1)
    }

    /// The tone whose highest bin is `k`.
    fn peak(&self, k: usize) -> Peak {
        let (bins, mean_square) = self.interpolate(k);
        let floor = self.noise_floor(k).max(f32::MIN_POSITIVE);
        Peak {
            frequency: Hertz(bins * self.bin.0),
            amplitude: MetersPerSecond2(math::sqrt(2.0 * mean_square)),
            snr: (self.at(k) / floor).min(f32::MAX),
        }
    }

    /// Local maxima between two frequencies, strongest first, at most [`CANDIDATES`].
    fn maxima(&self, from: Hertz, to: Hertz) -> Vec<usize, CANDIDATES> {
        let mut found: Vec<usize, CANDIDATES> = Vec::new();
        // Bins 0 and 1 hold the residual of the mean removal.
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
                if found.is_full() && place < CANDIDATES {
                    found.pop();
                }
                // If the list is full, a weaker maximum is dropped.
                let _ = found.insert(place, k);
            }
        }
        found
    }

    /// Mean square in (m/s²)² within the main lobe around a frequency: that of an isolated tone there.
    pub fn mean_square_near(&self, frequency: Hertz) -> f32 {
        let centre = math::round(frequency.0 / self.bin.0).max(0.0) as usize;
        let lobe = centre.saturating_sub(2)..=centre + 2;
        lobe.map(|k| self.at(k)).sum::<f32>() / HANN_NOISE_BINS
    }

    /// The strongest tone between two frequencies, if it exceeds the noise floor by [`MIN_SNR`].
    pub fn dominant(&self, from: Hertz, to: Hertz) -> Option<Peak> {
        let strongest = *self.maxima(from, to).first()?;
        Some(self.peak(strongest)).filter(|peak| peak.snr >= MIN_SNR)
    }

    /// The strongest tone between two frequencies that is no harmonic of the spindle.
    ///
    /// A tone counts as harmonic n of the spindle if it lies within n·uncertainty plus one bin of it. A local maximum is skipped if it
    /// is explained by the window's side lobes of stronger maxima.
    pub fn dominant_non_harmonic(&self, rotation: Rotation, from: Hertz, to: Hertz) -> Search {
        let Rotation {
            frequency,
            uncertainty,
        } = rotation;
        let width = HARMONIC_BINS * self.bin.0;
        // A quarter of the distance between two harmonics must remain outside their tolerances.
        let highest_order = (0.375 * frequency.0 - width) / uncertainty.0.max(1e-6 * frequency.0.abs());
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

    /// True if side lobes of stronger maxima explain at least half of the amplitude in bin `k`.
    fn is_side_lobe(&self, k: usize, stronger: &[usize]) -> bool {
        let leaked: f32 = stronger
            .iter()
            .map(|&other| {
                let (bins, mean_square) = self.interpolate(other);
                let distance = (k as f32 - bins).abs();
                // Envelope of |sinc(d)/(1 − d²)|; within the main lobe it is that of the tone itself.
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
