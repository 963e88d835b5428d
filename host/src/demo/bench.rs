//! The virtual cell with a simulated device at its spindle, and a host at the other end of the serial line.

use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::Band;
use quietcut_core::protocol::{Info, Reports, Subscription};
use quietcut_core::units::Nanoseconds;

use super::trace::Trace;
use super::trial::Trial;
use crate::device::{Client, DeviceError, Event, Pace, Setup, SimulatedDevice, SimulatedPort, VirtualCell};
use crate::simulate::{Heard, VirtualCutError};

/// Why a cut could not be tried.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The device.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The simulation of the cut.
    #[error(transparent)]
    Cut(#[from] VirtualCutError),
    /// The device stopped talking in the middle of a cut.
    #[error("the simulated device said nothing for {} s in the middle of a cut", SILENCE.as_secs())]
    Silent,
}

/// A device that hears a block says something of it long before this.
const SILENCE: Duration = Duration::from_secs(20);

/// How long each cut is.
const CUT_SECONDS: f64 = 16.0;

/// A cell, a device, a serial line, a host.
pub struct Bench {
    cell: VirtualCell,
    cuts: Sender<Heard>,
    client: Client,
    serial_port: String,
    /// Number of the next block and its time, if the spindle goes on at once.
    next_sequence: u32,
    /// Seed of the next cut's noise.
    seed: u64,
}

impl Bench {
    /// Switches the device on and says hello to it over its serial port.
    ///
    /// # Errors
    /// Where the system has no pseudo-terminal.
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

    /// The path of the device's serial port.
    pub fn serial_port(&self) -> &str {
        &self.serial_port
    }

    /// The host's end of the line.
    pub fn client(&mut self) -> &mut Client {
        &mut self.client
    }

    /// Cuts, and listens to what the device says of it.
    ///
    /// # Errors
    /// Where the cut cannot be simulated, or the device stops talking.
    pub fn cut(&mut self, rpm: f64, depth_mm: f64) -> Result<Trial, BenchError> {
        let heard = self.cell.cut(rpm, depth_mm, CUT_SECONDS, self.seed)?;
        let mut trial = Trial {
            rpm,
            depth_mm,
            teeth: self.cell.teeth().map_err(DeviceError::from)?,
            full_cut_s: self.cell.full_cut_s(rpm, depth_mm, CUT_SECONDS)?,
            trace: Trace::of(&heard.blocks, &Sensor::IIS3DWB_16G),
            reports: Vec::with_capacity(heard.blocks.len()),
            spectra: Vec::new(),
            strobes: Vec::new(),
        };
        let blocks = heard.blocks.len() as u32;
        let all = Subscription {
            reports: Reports::All,
            spectra: true,
            strobes: true,
        };
        self.client.subscribe(all)?;
        // The bench keeps the device, and the device takes cuts as long as it lives.
        let _ = self.cuts.send(heard);
        let last = self.next_sequence.wrapping_add(blocks).wrapping_sub(1);
        self.listen(&mut trial, last)?;
        if trial.reports.last().is_none_or(|report| report.sequence != last) {
            return Err(BenchError::Silent);
        }
        self.next_sequence = last.wrapping_add(1);
        self.seed += 1;
        Ok(trial)
    }

    /// Takes what the device says up to block `last`.
    fn listen(&mut self, trial: &mut Trial, last: u32) -> Result<(), DeviceError> {
        let mut is_over = false;
        let mut start = None;
        while !is_over {
            let Some(event) = self.client.next_event(SILENCE)? else {
                return Ok(());
            };
            is_over = matches!(&event, Event::Report(report) if report.sequence == last);
            take(trial, event, &mut start);
        }
        // What the last block made beside its report comes before the answer to the next request.
        self.client.subscribe(Subscription::default())?;
        while let Some(event) = self.client.next_event(Duration::ZERO)? {
            take(trial, event, &mut start);
        }
        Ok(())
    }
}

/// Times of a trial begin with its first report.
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
