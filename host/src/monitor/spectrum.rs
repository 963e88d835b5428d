//! One power spectrum, put together from its chunks.

use quietcut_core::protocol::SpectrumChunk;

/// Newest whole spectrum of a band, and the next one as far as it has arrived.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Spectrum {
    /// Width of a bin, Hz; 0 before the first spectrum.
    pub(crate) bin_hz: f64,
    /// Power of each bin of the newest whole spectrum, (m/s²)²; empty before the first.
    pub(crate) power: Vec<f32>,
    sequence: u32,
    arriving: Vec<f32>,
}

impl Spectrum {
    /// Adds a chunk. A spectrum with a lost chunk is never shown: its gap would look like silence.
    pub(crate) fn take(&mut self, chunk: &SpectrumChunk) {
        if chunk.first == 0 || chunk.sequence != self.sequence {
            self.arriving.clear();
        }
        self.sequence = chunk.sequence;
        if usize::from(chunk.first) != self.arriving.len() {
            return;
        }
        self.arriving.extend_from_slice(&chunk.power);
        if self.arriving.len() >= usize::from(chunk.bins) {
            self.bin_hz = f64::from(chunk.bin.0);
            self.power = std::mem::take(&mut self.arriving);
        }
    }

    /// Upper end of the spectrum, Hz.
    pub(crate) fn end_hz(&self) -> f64 {
        self.bin_hz * self.power.len() as f64
    }

    /// Largest power in each of `columns` equal intervals from 0 to `end_hz`, (m/s²)². An interval without a bin of its
    /// own has the power of the bin at its middle.
    pub(crate) fn columns(&self, columns: usize, end_hz: f64) -> Vec<f32> {
        let width = end_hz / columns as f64 / self.bin_hz;
        let at = |position: f64| (position.max(0.0) as usize).min(self.power.len().saturating_sub(1));
        (0..columns)
            .map(|column| {
                let (from, to) = (column as f64 * width, (column + 1) as f64 * width);
                let first = at(from.ceil());
                let bins = self
                    .power
                    .get(first..at(to.ceil()).max(first))
                    .unwrap_or_default();
                let loudest = bins.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                let middle = || self.power.get(at((from + to) / 2.0)).copied().unwrap_or_default();
                if bins.is_empty() { middle() } else { loudest }
            })
            .collect()
    }
}
