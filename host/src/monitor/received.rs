//! Everything that the device has sent so far.

use std::collections::VecDeque;

use quietcut_core::detector::Verdict;
use quietcut_core::monitor::{Band, Report, Strobe};
use quietcut_core::working_point::WorkingPoint;

use super::lobes::LobeMap;
use super::spectrum::Spectrum;
use crate::device::Event;
use crate::report::answer::VerdictLog;
use crate::report::words;

/// Number of points of the stroboscopic map that are kept: a choice; some ten seconds of a slow tool, in which a
/// closed curve of Hopf chatter fills.
const STROBES: usize = 300;

/// Number of lines of the history that are kept: a choice, more than any terminal shows.
const LINES: usize = 200;

/// Time that one cell of the strip of verdicts stands for, s: a choice, so that a strip of 100 cells shows a minute.
pub(crate) const STRIP_S: f64 = 0.5;

/// Number of cells of the strip of verdicts that are kept: a choice, more than any terminal shows.
const STRIP: usize = 600;

/// Number of tooth-passing harmonics that the fitted frequency scale shows: a choice.
const HARMONICS: f64 = 8.0;

/// State of the connection to the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Connection {
    /// The first connection is being made.
    #[default]
    Connecting,
    /// The device answers.
    Up,
    /// The device is gone, for the given reason; the port is tried again and again.
    Gone(String),
}

/// Identity and settings of the device that the view uses.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Identity {
    /// Board and version of the firmware.
    pub(crate) name: String,
    /// Number of teeth of the tool.
    pub(crate) teeth: u8,
    /// Name of the lobe table that the device uses.
    pub(crate) table: Option<String>,
    /// Working point that is set on the device.
    pub(crate) working_point: Option<WorkingPoint>,
}

/// Everything that the device has sent so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Received {
    /// Name of the port.
    pub(crate) port: String,
    pub(crate) connection: Connection,
    /// The device; `None` before the first connection.
    pub(crate) identity: Option<Identity>,
    /// Newest report; `None` before the first, and again after a loss of the connection.
    pub(crate) report: Option<Report>,
    /// Changes of verdict and advice, and the summary.
    pub(crate) log: VerdictLog,
    /// Lines of the history, oldest first.
    pub(crate) lines: VecDeque<String>,
    /// Number of all lines so far, those included that the history no longer keeps.
    pub(crate) line_count: usize,
    /// Most serious verdict of each [`STRIP_S`], oldest first; `None` while the device was gone.
    pub(crate) strip: VecDeque<Option<Verdict>>,
    /// The lobes of the table for the working point.
    pub(crate) lobes: Option<LobeMap>,
    spectra: [Spectrum; 2],
    strobes: [VecDeque<Strobe>; 2],
    strip_end_s: f64,
}

impl Received {
    /// Nothing is received yet from the device at `port`.
    pub(crate) fn new(port: &str) -> Self {
        Self {
            port: port.into(),
            ..Self::default()
        }
    }

    /// The connection is made, for the first time or again.
    pub(crate) fn connected(&mut self, identity: Identity) {
        if let Connection::Gone(_) = self.connection {
            self.line(format!("{}: the device is back", self.port));
        }
        self.connection = Connection::Up;
        self.identity = Some(identity);
    }

    /// The device is gone. What it sent last is no longer true: only the history stays.
    pub(crate) fn gone(&mut self, reason: String) {
        if !matches!(self.connection, Connection::Gone(_)) {
            self.line(format!("{}: the device is gone", self.port));
            push(&mut self.strip, None, STRIP);
        }
        self.connection = Connection::Gone(reason);
        self.report = None;
        self.spectra = Default::default();
        self.strobes = Default::default();
        self.strip_end_s = 0.0;
    }

    /// Takes an event of the device.
    pub(crate) fn take(&mut self, event: &Event) {
        match event {
            Event::Report(report) => self.take_report(report),
            Event::Spectrum(chunk) => self.spectra[index(chunk.band)].take(chunk),
            Event::Strobes(chunk) => {
                for strobe in &chunk.strobes {
                    push(&mut self.strobes[index(strobe.band)], *strobe, STROBES);
                }
            }
        }
    }

    fn take_report(&mut self, report: &Report) {
        self.report = Some(*report);
        if self.log.take(report).is_some() {
            self.line(words::line(report));
        }
        let (verdict, t_s) = (report.judgement.verdict, report.time.0 as f64 / 1e9);
        match self.strip.back_mut() {
            Some(Some(last)) if t_s < self.strip_end_s => {
                if seriousness(verdict) > seriousness(*last) {
                    *last = verdict;
                }
            }
            _ => {
                push(&mut self.strip, Some(verdict), STRIP);
                self.strip_end_s = t_s + STRIP_S;
            }
        }
    }

    /// Adds a line to the history.
    pub(crate) fn line(&mut self, text: String) {
        push(&mut self.lines, text, LINES);
        self.line_count += 1;
    }

    /// Newest spectrum of a band.
    pub(crate) fn spectrum(&self, band: Band) -> &Spectrum {
        &self.spectra[index(band)]
    }

    /// Points of the stroboscopic map of a band, oldest first.
    pub(crate) fn strobes(&self, band: Band) -> &VecDeque<Strobe> {
        &self.strobes[index(band)]
    }

    /// Forgets the points of the stroboscopic map.
    pub(crate) fn clear_map(&mut self) {
        self.strobes = Default::default();
    }

    /// Spindle speed, rev/min.
    pub(crate) fn rpm(&self) -> Option<f64> {
        Some(f64::from(self.report?.speed?.0))
    }

    /// Chatter frequency, Hz.
    pub(crate) fn chatter_hz(&self) -> Option<f64> {
        Some(f64::from(self.report?.judgement.chatter?.0))
    }

    /// Tooth-passing frequency, Hz; `None` while the speed is unknown.
    pub(crate) fn tooth_hz(&self) -> Option<f64> {
        let teeth = f64::from(self.identity.as_ref()?.teeth);
        Some(self.rpm()? / 60.0 * teeth)
    }

    /// End of a frequency scale that shows tooth passing and chatter, Hz, within the spectrum of the band.
    pub(crate) fn fitted_end_hz(&self, band: Band) -> f64 {
        let whole = self.spectrum(band).end_hz();
        let tooth = self.tooth_hz().unwrap_or(whole);
        let chatter = self.chatter_hz().unwrap_or_default();
        (HARMONICS * tooth).max(2.0 * chatter).min(whole)
    }
}

fn index(band: Band) -> usize {
    match band {
        Band::Structure => 0,
        Band::Tool => 1,
    }
}

/// Rank of a verdict in the strip: of several verdicts within one cell the highest is shown.
fn seriousness(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Indeterminate => 0,
        Verdict::AirCut => 1,
        Verdict::Stable => 2,
        Verdict::Runout => 3,
        Verdict::Forced => 4,
        Verdict::Hopf | Verdict::PeriodDoubling => 5,
    }
}

/// Adds to the end of a queue, and removes from its front what is more than `most`.
fn push<T>(queue: &mut VecDeque<T>, item: T, most: usize) {
    if queue.len() >= most {
        queue.pop_front();
    }
    queue.push_back(item);
}
