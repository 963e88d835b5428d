//! What quietcut does with pins: device logic, generic over embedded-hal, embedded-io and embedded-storage.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod accelerometer;
pub mod acquisition;
pub mod defaults;
pub mod device;
pub mod flash_model;
pub mod link;
pub mod stimulus;
pub mod storage;
