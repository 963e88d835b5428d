//! What quietcut does with pins: device logic, generic over embedded-hal, embedded-io and embedded-storage.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
