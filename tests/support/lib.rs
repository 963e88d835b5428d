//! What several tests share: where the binary, the cases and the measured data are, the firmware
//! images and the emulator that runs them.
// A helper that cannot do its work fails the test that called it.
#![allow(clippy::expect_used, clippy::panic)]

pub mod acceptance;
pub mod campaign;
pub mod chain_bits;
pub mod command;
pub mod cut;
pub mod device_log;
pub mod documents;
pub mod emulator;
pub mod firmware_image;
pub mod pty;
pub mod raw_host;
pub mod said;
pub mod scenario;
pub mod shaking;
pub mod small_table;
pub mod table_bits;
pub mod virtual_cut;
