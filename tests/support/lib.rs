//! Shared code of the integration tests: paths of command, cases and measured data, firmware images, emulator.
//!
//! It has no examples, and doc tests are off: only the tests of this package use it.
// A helper function that fails must fail the test that calls it.
#![allow(clippy::expect_used, clippy::panic)]

pub mod acceptance;
pub mod browser;
pub mod campaign;
pub mod chain_bits;
pub mod command;
pub mod cut;
pub mod device_log;
pub mod documents;
pub mod emulator;
pub mod firmware_image;
pub mod monitor_page;
pub mod outputs;
pub mod pty;
pub mod raw_host;
pub mod scenario;
pub mod shaking;
pub mod small_table;
pub mod table_bits;
pub mod virtual_cut;
