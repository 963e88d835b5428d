//! Numbers with 90 % intervals, and those of a fitted peak, in the answers of `quietcut frf`.

use std::fmt;

use serde::Serialize;

use crate::frf::FittedPeak;
use crate::report::digits::significant;

/// A number with its 90 % interval.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Figure {
    pub(super) value: f64,
    ci90: [f64; 2],
}

impl Figure {
    /// A number whose interval reaches `half` to each side of it.
    pub(super) fn new(value: f64, half: f64) -> Self {
        Self {
            value,
            ci90: [value - half, value + half],
        }
    }

    /// Half the width of the interval.
    pub(super) fn half(self) -> f64 {
        0.5 * (self.ci90[1] - self.ci90[0])
    }

    /// True if the interval does not hold 0.
    pub(super) fn excludes_zero(self) -> bool {
        self.ci90[0] > 0.0 || self.ci90[1] < 0.0
    }
}

/// Frequency, damping and size of a peak.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct PeakFigures {
    pub(super) frequency_hz: Figure,
    pub(super) damping_ratio: Figure,
    pub(super) receptance_m_per_n: Figure,
}

impl PeakFigures {
    /// The figures of a fitted peak.
    pub(super) fn new(peak: &FittedPeak) -> Self {
        let figure = |value: f64, deviation: f64| Figure::new(value, peak.ninety_percent() * deviation);
        Self {
            frequency_hz: figure(peak.frequency_hz, peak.frequency_std_hz),
            damping_ratio: figure(peak.damping_ratio, peak.damping_ratio_std),
            receptance_m_per_n: figure(peak.receptance, peak.receptance_std),
        }
    }
}

/// The figures of a peak in words.
pub(super) struct PeakText<'a>(pub(super) &'a PeakFigures);

impl fmt::Display for PeakText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = |figure: Figure, factor: f64, digits: usize| {
            format!(
                "{} ± {}",
                significant(factor * figure.value, digits),
                significant(factor * figure.half(), 2)
            )
        };
        write!(
            f,
            "{} Hz, damping ratio {} %, peak {} µm/N",
            part(self.0.frequency_hz, 1.0, 6),
            part(self.0.damping_ratio, 100.0, 4),
            part(self.0.receptance_m_per_n, 1e6, 4)
        )
    }
}
