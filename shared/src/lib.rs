//! The signal chain of the chatter monitor: from raw acceleration counts to verdict and advice.
//!
//! The same code runs on the spindle, in the emulator and on the host, with results that are equal to the bit. It
//! never allocates and never panics on input. It uses only IEEE basic operations and the functions of [`math`], so
//! that every target computes the same bits.
//!
//! ```text
//! acceleration ─► decimation ─► spectrum ────────┐
//! tachometer ───► phase ─► synchronous samples ──┴► stroboscope, detector ─► lobes ─► advice
//! ```
//!
//! Main types:
//! - [`Monitor`](monitor::Monitor): the configured signal chain. One [`step`](monitor::Monitor::step) takes a
//!   [`Block`](acceleration::Block) of samples and returns a [`Report`](monitor::Report).
//! - [`Judgement`](detector::Judgement): the verdict (air cut, stable, chatter, forced vibration, runout, or
//!   indeterminate) with reason and confidence.
//! - [`LobeTable`](lobes::LobeTable): the stability lobes of a machine, read in place from the bytes of a `.qct` file.
//! - [`Advice`](advice::Advice): the next spindle speed or axial depth.
//!
//! [`protocol`] carries the results to the host.
//!
//! ```
//! use quietcut_core::acceleration::{Block, Sensor};
//! use quietcut_core::monitor::{Monitor, Settings, State};
//! use quietcut_core::units::Rpm;
//! use quietcut_core::working_point::Tool;
//!
//! let monitor = Monitor::new(Settings {
//!     sensor: Sensor::IIS3DWB_16G,
//!     tool: Tool { teeth: 4 },
//!     wheel: None, // no tachometer
//!     assumed_speed: Some(Rpm(6000.0)),
//!     limits: None,
//! })?;
//! let mut state = Box::new(State::new());
//!
//! // One block of samples at rest: 1 g along z, 0.488 mg per count.
//! let mut block = Block::default();
//! block.counts.extend([[0, 0, 2049]; 64]);
//! let report = monitor.step(&mut state, &block, &[], None, None);
//! assert!(!report.judgement.verdict.is_chatter());
//! assert_eq!(report.speed, Some(Rpm(6000.0)));
//! # Ok::<(), quietcut_core::monitor::SettingsError>(())
//! ```
//!
//! This crate knows no pins, buses, files or heap memory, and it computes no stability lobes: it only reads the table
//! that the host computed.
#![cfg_attr(not(test), no_std)]

pub mod acceleration;
pub mod advice;
pub mod checksum;
mod criteria;
pub mod decimation;
pub mod detector;
pub mod event_clock;
pub mod fft;
pub mod lobes;
pub mod math;
pub mod monitor;
pub mod peaks;
pub mod protocol;
pub mod spectrum;
pub mod stroboscope;
pub mod synchronous;
pub mod tachometer;
pub mod units;
pub mod working_point;
