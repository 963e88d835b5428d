//! What the tests of the signal chain share: a virtual cut and the sensors on it.
//!
//! Not every test uses all of it.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

pub mod listen;
pub mod milling;
pub mod virtual_sensor;
