//! Test bench of the demonstration: virtual cell, simulated device at its spindle, and client at the other end of the
//! serial line.

use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::Band;
use quietcut_core::protocol::{Info, Reports, Subscription};
use quietcut_core::units::Nanoseconds;

use super::trace::Trace;
use super::trial::Trial;
use crate::device::{Client, DeviceError, Event, Pace, Setup, SimulatedDevice, SimulatedPort, VirtualCell};
use crate::simulate::{SensedCut, VirtualCutError};

/// Failure of a cut on the test bench.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// Starting the device, or a request to it, failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The cut cannot be simulated.
    #[error(transparent)]
    Cut(#[from] VirtualCutError),
    /// The report of the last block of a cut did not arrive in time.
    #[error("the simulated device sent nothing for {} s during a cut", REPORT_TIMEOUT.as_secs())]
    Silent,
}

/// Longest wait for the next event of the device during a cut: a choice far above the computing time of a block.
const REPORT_TIMEOUT: Duration = Duration::from_secs(20);

/// Duration of each cut, s: a choice, long enough for detection and for the stationary vibration after it.
const CUT_SECONDS: f64 = 16.0;

/// Test bench with a virtual cell, a simulated device and its client.
pub struct Bench {
    cell: VirtualCell,
    cuts: Sender<SensedCut>,
    client: Client,
    serial_port: String,
    /// Sequence number of the first block of the next simulated cut; the numbering continues from cut to cut.
    next_sequence: u32,
    /// Seed of the simulated sensor noise of the next cut.
    seed: u64,
}

impl Bench {
    /// Starts the device and connects to it over its serial port.
    ///
    /// # Errors
    /// For example: the case of the cell is invalid, the operating system has no free pseudo-terminal, or the device
    /// does not answer.
    pub fn new(cell: VirtualCell) -> Result<(Self, Info), DeviceError> {
        let (cuts, queue) = channel();
        let setup = Setup {
            state: None,
            teeth: cell.teeth()?,
            pace: Pace::AsFastAsPossible,
        };
        let device = SimulatedDevice::start(setup, queue)?;
        let serial_port = device.path().to_owned();
        let (client, info) = Client::connect(Box::new(SimulatedPort::open(device)?))?;
        Ok((
            Self {
                cell,
                cuts,
                client,
                serial_port,
                next_sequence: 0,
                seed: 1,
            },
            info,
        ))
    }

    /// Path of the serial port of the device.
    pub fn serial_port(&self) -> &str {
        &self.serial_port
    }

    /// Client at the host end of the serial line.
    pub fn client(&mut self) -> &mut Client {
        &mut self.client
    }

    /// Simulates one cut, which the device monitors, and collects the reports, spectra and stroboscopic samples of the
    /// device.
    ///
    /// # Errors
    /// The cut cannot be simulated, the device refuses a request or does not answer, or the report of the last block
    /// does not arrive.
    pub fn cut(&mut self, rpm: f64, depth_mm: f64) -> Result<Trial, BenchError> {
        let recorded = self.cell.cut(rpm, depth_mm, CUT_SECONDS, self.seed)?;
        let mut trial = Trial {
            rpm,
            depth_mm,
            teeth: self.cell.teeth().map_err(DeviceError::from)?,
            full_cut_s: self.cell.full_cut_s(rpm, depth_mm, CUT_SECONDS)?,
            trace: Trace::of(&recorded.blocks, &Sensor::IIS3DWB_16G),
            reports: Vec::with_capacity(recorded.blocks.len()),
            spectra: Vec::new(),
            strobes: Vec::new(),
        };
        let blocks = recorded.blocks.len() as u32;
        let all = Subscription {
            reports: Reports::All,
            spectra: true,
            strobes: true,
        };
        self.client.subscribe(all)?;
        // A failure to send is not handled here: no report of the last block then arrives, which is an error below.
        let _ = self.cuts.send(recorded);
        let last = self.next_sequence.wrapping_add(blocks).wrapping_sub(1);
        self.collect(&mut trial, last)?;
        if trial.reports.last().is_none_or(|report| report.sequence != last) {
            return Err(BenchError::Silent);
        }
        self.next_sequence = last.wrapping_add(1);
        self.seed += 1;
        Ok(trial)
    }

    /// Collects the events of the device into the trial, up to the report of block `last` and the spectra and
    /// stroboscopic samples that follow it; ends early if no event arrives within [`REPORT_TIMEOUT`].
    fn collect(&mut self, trial: &mut Trial, last: u32) -> Result<(), DeviceError> {
        let mut is_over = false;
        let mut start = None;
        while !is_over {
            let Some(event) = self.client.next_event(REPORT_TIMEOUT)? else {
                return Ok(());
            };
            is_over = matches!(&event, Event::Report(report) if report.sequence == last);
            take(trial, event, &mut start);
        }
        // Spectra and stroboscopic samples of the last block arrive before the reply to the next request.
        self.client.subscribe(Subscription::default())?;
        while let Some(event) = self.client.next_event(Duration::ZERO)? {
            take(trial, event, &mut start);
        }
        Ok(())
    }
}

/// Adds one event of the device to the trial; of spectra and stroboscopic samples only those of the structure band.
/// Report times are counted from the first report of the cut.
fn take(trial: &mut Trial, event: Event, start: &mut Option<Nanoseconds>) {
    match event {
        Event::Spectrum(chunk) => trial.take_spectrum(&chunk),
        Event::Strobes(chunk) => {
            let slow = chunk
                .strobes
                .iter()
                .filter(|strobe| strobe.band == Band::Structure);
            trial.strobes.extend(slow.map(|&strobe| (chunk.sequence, strobe)));
        }
        Event::Report(mut report) => {
            let start = start.get_or_insert(report.time);
            report.time = Nanoseconds(report.time.0.saturating_sub(start.0));
            trial.reports.push(report);
        }
    }
}
