//! What several tests share: where the binary, the cases and the measured data are.
// A helper that cannot do its work fails the test that called it.
#![allow(clippy::expect_used, clippy::panic)]

pub mod command;
