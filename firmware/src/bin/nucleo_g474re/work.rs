//! The signal between the tasks of sensor and link and the main loop.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// Signal that wakes the main loop: a block of samples has arrived, bytes from the host have arrived, or the queue of
/// bytes to the host has room again.
pub(crate) static WORK: Signal<CriticalSectionRawMutex, ()> = Signal::new();
