//! Simulated device: the device logic of the firmware in a thread of this process, with a pseudo-terminal as serial
//! line and a virtual spindle as sensor.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use quietcut_core::acceleration::Sensor;
use quietcut_core::monitor::{Settings, State};
use quietcut_core::tachometer::Wheel;
use quietcut_core::units::Nanoseconds;
use quietcut_core::working_point::Tool;
use quietcut_firmware::device::{Clock, Device, Identity};

use super::DeviceError;
use super::flash_file::FlashFile;
use super::port::{Port, SIMULATED, SerialLine};
use super::pseudo_terminal::PseudoTerminal;
use super::virtual_spindle::VirtualSpindle;
use crate::simulate::SensedCut;

/// Pace at which the virtual spindle produces samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// The virtual spindle produces samples in real time.
    RealTime,
    /// The virtual spindle produces samples as fast as the host reads the events of the device.
    AsFastAsPossible,
}

/// Settings of the simulated device.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// State file that keeps the flash memory of the simulated device; `None` keeps the flash only in memory.
    pub state: Option<&'a Path>,
    /// Number of teeth of the tool on the virtual spindle.
    pub teeth: u8,
    /// Pace at which the virtual spindle produces samples.
    pub pace: Pace,
}

/// Device without hardware; it runs until this value is dropped.
pub struct SimulatedDevice {
    path: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl SimulatedDevice {
    /// Starts a device whose virtual spindle plays the received cuts.
    ///
    /// # Errors
    /// No pseudo-terminal is free, the state file cannot be used, or the signal chain refuses the number of teeth.
    pub fn start(setup: Setup<'_>, cuts: Receiver<SensedCut>) -> Result<Self, DeviceError> {
        let terminal = PseudoTerminal::new()?;
        let flash = match setup.state {
            Some(path) => FlashFile::open(path)?,
            None => FlashFile::in_memory(),
        };
        let settings = settings(setup.teeth);
        quietcut_core::monitor::Monitor::new(settings).map_err(|error| DeviceError::Settings { error })?;
        let path = terminal.path().to_owned();
        let stop = Arc::new(AtomicBool::new(false));
        let machine = Machine {
            terminal,
            spindle: VirtualSpindle::new(cuts),
            pace: setup.pace,
            stop: stop.clone(),
        };
        let thread = std::thread::spawn(move || machine.run(settings, flash));
        Ok(Self {
            path,
            stop,
            thread: Some(thread),
        })
    }

    /// Path of the serial port of the device.
    pub fn path(&self) -> &str {
        &self.path
    }
}

impl Drop for SimulatedDevice {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The panic hook has already reported a panic of the device's thread.
            let _ = thread.join();
        }
    }
}

/// Port that owns its simulated device.
pub struct SimulatedPort {
    line: SerialLine,
    _device: SimulatedDevice,
}

impl SimulatedPort {
    /// Opens the serial port of the simulated device.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub fn open(device: SimulatedDevice) -> Result<Self, DeviceError> {
        Ok(Self {
            line: SerialLine::open(device.path())?,
            _device: device,
        })
    }
}

impl Port for SimulatedPort {
    fn name(&self) -> &str {
        SIMULATED
    }

    fn send(&mut self, bytes: &[u8], timeout: Duration) -> Result<(), DeviceError> {
        self.line.send(bytes, timeout)
    }

    fn receive(&mut self, into: &mut [u8], timeout: Duration) -> Result<usize, DeviceError> {
        self.line.receive(into, timeout)
    }
}

/// Settings of the signal chain of the simulated device: the sensor of the board, and one tachometer mark per
/// revolution.
fn settings(teeth: u8) -> Settings {
    Settings {
        sensor: Sensor::IIS3DWB_16G,
        tool: Tool { teeth },
        wheel: Some(Wheel {
            positions: 1,
            missing: 0,
        }),
        assumed_speed: None,
        limits: None,
    }
}

/// State of the device thread.
struct Machine {
    terminal: PseudoTerminal,
    spindle: VirtualSpindle,
    pace: Pace,
    stop: Arc<AtomicBool>,
}

/// Clock of the simulated device: the time of its newest sample block. At [`Pace::RealTime`] the time since the start
/// of the device, read before each wait for the serial line, advances it too.
#[derive(Clone)]
struct SharedClock(Arc<AtomicU64>);

impl Clock for SharedClock {
    fn now(&self) -> Nanoseconds {
        Nanoseconds(self.0.load(Ordering::Relaxed))
    }
}

/// Longest wait of the simulated device for the serial line at a time: a choice.
const IDLE: Duration = Duration::from_millis(5);

impl Machine {
    fn run(mut self, settings: Settings, flash: FlashFile) {
        let identity = Identity {
            board: SIMULATED,
            sensor: Some(settings.sensor),
        };
        let clock = SharedClock(Arc::default());
        let mut state = Box::<State>::default();
        let Ok(mut device) = Device::new(identity, settings, &mut state, flash, clock.clone()) else {
            // Invalid settings cannot occur here: they were checked before the thread started.
            return;
        };
        let began = Instant::now();
        let mut pending = Vec::new();
        let mut bytes = [0; 512];
        while !self.stop.load(Ordering::Relaxed) {
            let due = self.step_due(&clock, began);
            let patience = if due || !pending.is_empty() {
                Duration::ZERO
            } else {
                self.patience(&clock, began)
            };
            let Ok(count) = self.terminal.receive(&mut bytes, patience) else {
                return;
            };
            pending.extend_from_slice(bytes.get(..count).unwrap_or_default());
            let taken = device.receive(&pending);
            pending.drain(..taken);
            // The virtual spindle waits while the serial line is full, so that no message of the device is dropped.
            while !device.outgoing().is_empty() && !self.stop.load(Ordering::Relaxed) {
                match self.terminal.send(device.outgoing(), IDLE) {
                    Ok(count) => device.sent(count),
                    Err(_) => return,
                }
            }
            if due && let Some((block, edges)) = self.spindle.take() {
                clock.0.fetch_max(block.time.0, Ordering::Relaxed);
                device.take(&block, &edges);
            }
        }
    }

    /// True if the virtual spindle has a further block of samples that is due: in real time once the time stamp of the
    /// block has passed, else at once.
    fn step_due(&mut self, clock: &SharedClock, began: Instant) -> bool {
        let now = clock.now();
        let Some((block, _)) = self.spindle.peek(now) else {
            return false;
        };
        match self.pace {
            Pace::AsFastAsPossible => true,
            Pace::RealTime => block.time.0 <= began.elapsed().as_nanos() as u64,
        }
    }

    fn patience(&mut self, clock: &SharedClock, began: Instant) -> Duration {
        let elapsed = began.elapsed().as_nanos() as u64;
        if self.pace == Pace::RealTime {
            clock.0.fetch_max(elapsed, Ordering::Relaxed);
        }
        match self.spindle.peek(clock.now()) {
            Some((block, _)) => Duration::from_nanos(block.time.0.saturating_sub(elapsed)).min(IDLE),
            None => IDLE,
        }
    }
}
