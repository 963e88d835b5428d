//! The device: acquisition of samples, table slots in flash, and the link to the host.
//!
//! A board is one folder in `src/bin`. All other code accesses hardware through embedded-hal, embedded-io and
//! embedded-storage only.
//!
//! Main types:
//! - [`Acquisition`](acquisition::Acquisition): blocks with time stamps from an
//!   [`Accelerometer`](accelerometer::Accelerometer).
//! - [`Storage`](storage::Storage): two slots for lobe tables in flash.
//! - [`Device`](device::Device): signal chain, storage and link together. Boards, emulator and the simulated device
//!   of the host all use it.
//!
//! ```
//! use quietcut_core::acceleration::{Block, Sensor};
//! use quietcut_core::monitor::State;
//! use quietcut_core::protocol::{MAX_FRAME, Request, encode};
//! use quietcut_core::units::Nanoseconds;
//! use quietcut_firmware::defaults;
//! use quietcut_firmware::device::{Clock, Device, Identity};
//! use quietcut_firmware::flash_model::FlashModel;
//!
//! struct StoppedClock;
//! impl Clock for StoppedClock {
//!     fn now(&self) -> Nanoseconds {
//!         Nanoseconds(0)
//!     }
//! }
//!
//! let sensor = Sensor::IIS3DWB_16G;
//! let identity = Identity { board: "example", sensor: Some(sensor) };
//! // Flash of 8-byte words and 2 KiB pages, erased.
//! let flash = FlashModel::<_, 8, 2048>::new(vec![0xFF; 64 * 1024]);
//! let mut state = Box::new(State::new());
//! let mut device = Device::new(identity, defaults::settings(sensor), &mut state, flash, StoppedClock).unwrap();
//!
//! // A block of the sensor, then the first request of a host.
//! let mut block = Block::default();
//! block.counts.extend([[0, 0, 2049]; 64]);
//! device.take(&block, &[]);
//! let mut buffer = [0; MAX_FRAME];
//! let frame = encode(&Request::Hello, 1, &mut buffer).unwrap();
//! assert_eq!(device.receive(frame), frame.len());
//! assert!(!device.outgoing().is_empty());
//! ```
//!
//! This crate must not know pins or peripherals outside `src/bin`, nor any mathematics of vibration: that is
//! `quietcut-core`.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod accelerometer;
pub mod acquisition;
mod criteria;
pub mod defaults;
pub mod device;
pub mod flash_model;
pub mod link;
pub mod stimulus;
pub mod storage;
