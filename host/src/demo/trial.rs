//! One cut on the virtual cell, and what the device said of it.

use quietcut_core::monitor::{Band, Report, Strobe};
use quietcut_core::protocol::SpectrumChunk;

use super::trace::Trace;

/// A spectrum that the device has sent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Sequence number of the block that completed it.
    pub sequence: u32,
    /// Width of a bin.
    pub bin_hz: f64,
    /// Power per bin, in (m/s²)².
    pub power: Vec<f64>,
}

/// One cut.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Spindle speed.
    pub rpm: f64,
    /// Axial depth of cut.
    pub depth_mm: f64,
    /// Number of teeth.
    pub teeth: u8,
    /// From the end of the entry to the beginning of the exit, in seconds since the first sample.
    pub full_cut_s: [f64; 2],
    /// What the sensor felt.
    pub trace: Trace,
    /// What the device said, block by block, its times beginning with the cut.
    pub reports: Vec<Report>,
    /// Spectra of the structure band.
    pub spectra: Vec<Spectrum>,
    /// Samples once per tooth in the structure band, with the number of the block that made them.
    pub strobes: Vec<(u32, Strobe)>,
}

impl Trial {
    /// The first time that the device called chatter.
    pub fn alarm(&self) -> Option<&Report> {
        self.reports
            .iter()
            .find(|report| report.judgement.verdict.is_chatter())
    }

    /// What the device said last before the tool began to leave the workpiece.
    pub fn last_in_cut(&self) -> Option<&Report> {
        let end = self
            .reports
            .partition_point(|report| seconds(report) < self.full_cut_s[1]);
        end.checked_sub(1).and_then(|index| self.reports.get(index))
    }

    /// True where the device never called chatter.
    pub fn is_quiet(&self) -> bool {
        self.alarm().is_none()
    }

    /// The tooth-passing frequency.
    pub fn tooth_passing_hz(&self) -> f64 {
        self.rpm / 60.0 * f64::from(self.teeth)
    }

    /// Tooth passes from the beginning of the full cut to a time.
    pub fn teeth_since_entry(&self, t_s: f64) -> f64 {
        (t_s - self.full_cut_s[0]) * self.tooth_passing_hz()
    }

    /// Vibration in the structure band over the last quarter of the full cut, rms of each axis.
    pub fn vibration(&self) -> [f64; 3] {
        let [from_s, to_s] = self.full_cut_s;
        self.trace.rms([to_s - 0.25 * (to_s - from_s), to_s])
    }

    /// Samples once per tooth of the full cut along one axis: number of the tooth pass, and acceleration in m/s².
    pub fn strobes_in_cut(&self, axis: usize) -> Vec<(u32, f64)> {
        let in_cut = |sequence: u32| {
            let report = self.reports.partition_point(|report| report.sequence < sequence);
            let t_s = self.reports.get(report).map_or(0.0, seconds);
            (self.full_cut_s[0]..self.full_cut_s[1]).contains(&t_s)
        };
        let strobes = self.strobes.iter().filter(|(sequence, _)| in_cut(*sequence));
        strobes
            .filter_map(|(_, strobe)| Some((strobe.tooth, f64::from(*strobe.meters_per_second2.get(axis)?))))
            .collect()
    }

    /// The newest spectrum of the full cut.
    pub fn spectrum_in_cut(&self) -> Option<&Spectrum> {
        let last = self.last_in_cut()?.sequence;
        self.spectra
            .iter()
            .rev()
            .find(|spectrum| spectrum.sequence <= last)
    }

    /// Takes a piece of a spectrum; pieces come in order.
    pub(super) fn take_spectrum(&mut self, chunk: &SpectrumChunk) {
        if chunk.band != Band::Structure {
            return;
        }
        if chunk.first == 0 {
            self.spectra.push(Spectrum {
                sequence: chunk.sequence,
                bin_hz: f64::from(chunk.bin.0),
                power: Vec::with_capacity(chunk.bins.into()),
            });
        }
        if let Some(spectrum) = self.spectra.last_mut()
            && spectrum.power.len() == usize::from(chunk.first)
        {
            spectrum
                .power
                .extend(chunk.power.iter().map(|&power| f64::from(power)));
        }
    }
}

/// The time of a report in seconds.
pub(super) fn seconds(report: &Report) -> f64 {
    crate::report::time::seconds(report)
}
