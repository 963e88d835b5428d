//! One cut on the virtual cell with the reports of the device.

use quietcut_core::monitor::{Band, Report, Strobe};
use quietcut_core::protocol::SpectrumChunk;

use super::trace::Trace;

/// Power spectrum of the acceleration in the structure band, as the device sent it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Sequence number of the block of samples that completed this power spectrum.
    pub sequence: u32,
    /// Distance between two lines of the power spectrum, Hz.
    pub bin_hz: f64,
    /// Mean square of the acceleration in each line of the power spectrum, (m/s²)².
    pub power: Vec<f64>,
}

/// One cut with its acceleration and all data from the device.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Number of teeth of the tool.
    pub teeth: u8,
    /// Start and end of full engagement, s since the first sample.
    pub full_cut_s: [f64; 2],
    /// Acceleration at the sensor during the cut, low-pass filtered to the structure band.
    pub trace: Trace,
    /// Reports of the device, one for each block; times are counted from the first report.
    pub reports: Vec<Report>,
    /// Power spectra of the acceleration in the structure band, as the device sent them.
    pub spectra: Vec<Spectrum>,
    /// Stroboscopic samples of the acceleration in the structure band, one per tooth passing, each with the sequence
    /// number of its block.
    pub strobes: Vec<(u32, Strobe)>,
}

impl Trial {
    /// First report of the device that states chatter in this cut; `None` for a quiet cut.
    pub fn alarm(&self) -> Option<&Report> {
        self.reports
            .iter()
            .find(|report| report.judgement.verdict.is_chatter())
    }

    /// Last report of the device before the end of full engagement; `None` if there is none.
    pub fn last_in_cut(&self) -> Option<&Report> {
        let end = self
            .reports
            .partition_point(|report| seconds(report) < self.full_cut_s[1]);
        end.checked_sub(1).and_then(|index| self.reports.get(index))
    }

    /// Whether the device reported no chatter during the whole cut.
    pub fn is_quiet(&self) -> bool {
        self.alarm().is_none()
    }

    /// Tooth-passing frequency, Hz.
    pub fn tooth_passing_hz(&self) -> f64 {
        self.rpm / 60.0 * f64::from(self.teeth)
    }

    /// Number of tooth passings, not rounded, from the start of full engagement to the time `t_s`; negative if `t_s` is
    /// earlier.
    pub fn teeth_since_entry(&self, t_s: f64) -> f64 {
        (t_s - self.full_cut_s[0]) * self.tooth_passing_hz()
    }

    /// Standard deviation of the acceleration along each axis over the last quarter of full engagement, m/s².
    pub fn vibration(&self) -> [f64; 3] {
        let [from_s, to_s] = self.full_cut_s;
        self.trace.rms([to_s - 0.25 * (to_s - from_s), to_s])
    }

    /// Stroboscopic samples of full engagement along one axis: number of the tooth passing and acceleration in m/s².
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

    /// Latest power spectrum that the device completed before the end of full engagement; `None` if there is none.
    pub fn spectrum_in_cut(&self) -> Option<&Spectrum> {
        let last = self.last_in_cut()?.sequence;
        self.spectra
            .iter()
            .rev()
            .find(|spectrum| spectrum.sequence <= last)
    }

    /// Appends a chunk of a power spectrum of the structure band; chunks of another band, and chunks of a spectrum
    /// after a gap, are ignored.
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

/// Time of a report, s.
pub(super) fn seconds(report: &Report) -> f64 {
    crate::report::time::seconds(report)
}
