//! Configuration of the sensor.

use quietcut_core::acceleration::MAX_BLOCK_SAMPLES;

/// Measuring range of the sensor: the acceleration at which an axis clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Range {
    /// ±2 g; one count is 0.061 mg.
    G2,
    /// ±4 g; one count is 0.122 mg.
    G4,
    /// ±8 g; one count is 0.244 mg.
    G8,
    /// ±16 g; one count is 0.488 mg.
    #[default]
    G16,
}

impl Range {
    pub(super) fn code(self) -> u8 {
        match self {
            Self::G2 => 0b00,
            Self::G16 => 0b01,
            Self::G4 => 0b10,
            Self::G8 => 0b11,
        }
    }

    pub(super) fn milli_g_per_count(self) -> f32 {
        match self {
            Self::G2 => 0.061,
            Self::G4 => 0.122,
            Self::G8 => 0.244,
            Self::G16 => 0.488,
        }
    }
}

/// Low-pass filters in the signal path of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Filter {
    /// Only the first low-pass filter of the sensor: flat from DC to 6 kHz.
    #[default]
    Wide,
    /// Also the second low-pass filter of the sensor; its corner frequency is the sampling rate divided by this
    /// divisor.
    LowPass(Divisor),
}

/// Divisor of the sampling rate that gives the corner frequency of the second low-pass filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Divisor {
    /// 6.7 kHz.
    By4 = 0,
    /// 2.7 kHz.
    By10 = 1,
    /// 1.3 kHz.
    By20 = 2,
    /// 593 Hz.
    By45 = 3,
    /// 267 Hz.
    By100 = 4,
    /// 133 Hz.
    By200 = 5,
    /// 67 Hz.
    By400 = 6,
    /// 33 Hz.
    By800 = 7,
}

/// Configuration of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Configuration {
    /// Measuring range.
    pub range: Range,
    /// Filters in the signal path.
    pub filter: Filter,
    /// Level of the sensor's queue, in samples, at which pin INT1 rises: 1 to 511.
    pub watermark: u16,
}

impl Default for Configuration {
    /// The largest range and the full band. Pin INT1 rises when 64 samples are in the sensor's queue; 17 ms remain
    /// from then until the queue is full.
    fn default() -> Self {
        Self {
            range: Range::default(),
            filter: Filter::default(),
            watermark: MAX_BLOCK_SAMPLES as u16,
        }
    }
}
