//! A virtual cut with sensors, shared by tests of the signal chain.
//!
//! Not every test uses all of it.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

pub mod listen;
pub mod milling;
pub mod virtual_sensor;
