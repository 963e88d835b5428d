//! Tones in a power spectrum: frequency and amplitude by interpolation, noise floor, harmonics of the spindle.

use heapless::Vec;

use crate::math;
use crate::spectrum::{HANN_NOISE_BINS, PowerSpectrum};
use crate::units::{Hertz, MetersPerSecond2};

/// A tone.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Peak {
    /// Its frequency.
    pub frequency: Hertz,
    /// Its amplitude, zero to peak; over several axes the root of the sum of squares.
    pub amplitude: MetersPerSecond2,
    /// Power of its highest bin over the median of the bins around: how far it stands out of the noise.
    pub snr: f32,
}

/// What the spindle does while a spectrum is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotation {
    /// Revolutions per second.
    pub frequency: Hertz,
    /// The most by which that may be wrong or may change within a block.
    pub uncertainty: Hertz,
}

/// The strongest tone that the spindle does not explain.
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

/// Answer to the search for a tone that is no harmonic.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Search {
    /// There is one.
    Found(NonHarmonic),
    /// There is none between the limits of the search, up to the given frequency.
    Nothing {
        /// Above it harmonics and other tones cannot be told apart.
        resolved_to: Hertz,
    },
    /// The harmonics lie too close for this spectrum to see anything between them.
    Unresolved,
}

/// Bins on both sides of a peak whose median is the noise floor.
const FLOOR_HALF_WIDTH: usize = 64;
/// Bins on both sides of a peak that belong to it.
const LOBE_HALF_WIDTH: usize = 3;
/// A tone stands out of the noise floor by at least this factor of power, 14 dB: a bin of noise alone does so once in 3·10⁷.
pub const MIN_SNR: f32 = 25.0;
/// A tone within this distance of a harmonic is one: their main lobes cannot be told apart below it.
const HARMONIC_BINS: f32 = 1.0;
/// The search considers this many local maxima, strongest first.
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

    /// Median power of the bins around bin `k` without the bins of the peak itself.
    ///
    /// Tones do not move it while they fill less than half of these bins.
    pub fn noise_floor(&self, k: usize) -> f32 {
        let mut around = [0u32; 2 * FLOOR_HALF_WIDTH];
        let below = k.saturating_sub(FLOOR_HALF_WIDTH)..k.saturating_sub(LOBE_HALF_WIDTH);
        let above = k + LOBE_HALF_WIDTH + 1..k + FLOOR_HALF_WIDTH + 1;
        let bins = below.chain(above).filter_map(|i| self.power.get(i));
        let mut count = 0;
        for (slot, power) in around.iter_mut().zip(bins) {
            // The bits of numbers that are not negative are in the numbers' order.
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
        // Bins 0 and 1 hold what the removal of the mean left.
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
                // Full and weaker than all: not among the strongest.
                let _ = found.insert(place, k);
            }
        }
        found
    }

    /// Mean square in (m/s²)² of what lies within the main lobe around a frequency: of a tone there, as long as it stands alone.
    pub fn mean_square_near(&self, frequency: Hertz) -> f32 {
        let centre = math::round(frequency.0 / self.bin.0).max(0.0) as usize;
        let lobe = centre.saturating_sub(2)..=centre + 2;
        lobe.map(|k| self.at(k)).sum::<f32>() / HANN_NOISE_BINS
    }

    /// The strongest tone between two frequencies, where one stands out by [`MIN_SNR`].
    pub fn dominant(&self, from: Hertz, to: Hertz) -> Option<Peak> {
        let strongest = *self.maxima(from, to).first()?;
        Some(self.peak(strongest)).filter(|peak| peak.snr >= MIN_SNR)
    }

    /// The strongest tone between two frequencies that is no harmonic of the spindle.
    ///
    /// A tone counts as harmonic n of the spindle where it is within n·uncertainty plus one bin of it. A local maximum is passed
    /// over where stronger ones near it explain it by the side lobes of the window.
    pub fn dominant_non_harmonic(&self, rotation: Rotation, from: Hertz, to: Hertz) -> Search {
        let Rotation {
            frequency,
            uncertainty,
        } = rotation;
        let width = HARMONIC_BINS * self.bin.0;
        // Between two harmonics some room must be left: a quarter of their distance.
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

    /// Whether the side lobes of stronger maxima explain half or more of the amplitude in bin `k`.
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
