//! What quietcut does with samples: the signal chain from raw acceleration counts to advice.
//!
//! The same code, to the bit, runs on the spindle, in the emulator and on the host. It never
//! allocates, never panics on input and uses only IEEE basic operations and the functions of
//! [`math`], so that every target computes the same bits.
//!
//! ```text
//! acceleration ─► decimation ─► spectrum ────────┐
//! tachometer ───► phase ─► synchronous samples ──┴► stroboscope, detector ─► lobes ─► advice
//! ```
//!
//! [`monitor`] is the pipeline that all callers use; [`protocol`] carries its results to the host.
#![cfg_attr(not(test), no_std)]

pub mod acceleration;
pub mod advice;
pub mod checksum;
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
