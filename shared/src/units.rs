//! Physical units as types, for interfaces between modules and in messages.
//!
//! Inside a computation, plain `f32` is used with the unit at the end of the name; `.0` converts in both directions.

use serde::{Deserialize, Serialize};

macro_rules! unit {
    ($(#[$doc:meta])* $name:ident, $symbol:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[serde(transparent)]
        pub struct $name(pub f32);

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Display::fmt(&self.0, f)?;
                f.write_str(concat!(" ", $symbol))
            }
        }
    };
}

unit!(
    /// Frequency in hertz.
    Hertz, "Hz"
);
unit!(
    /// Rotational speed of the spindle in revolutions per minute.
    Rpm, "rev/min"
);
unit!(
    /// Length in millimeters: depth of cut, feed per tooth.
    Millimeters, "mm"
);
unit!(
    /// Acceleration in meters per second squared.
    MetersPerSecond2, "m/s²"
);
unit!(
    /// Angle in degrees. Immersion is measured clockwise from +y, the normal to the feed.
    Degrees, "°"
);
unit!(
    /// Duration in seconds.
    Seconds, "s"
);

impl Rpm {
    /// Revolutions per second.
    pub fn to_hertz(self) -> Hertz {
        Hertz(self.0 / 60.0)
    }
}

impl Hertz {
    /// The spindle speed in rev/min of a rotation with this frequency.
    pub fn to_rpm(self) -> Rpm {
        Rpm(self.0 * 60.0)
    }
}

/// A point in time on the clock of the device that took the samples, in nanoseconds since its start.
///
/// Samples and tachometer edges are stamped by the same clock. The sensor's own clock deviates by up to a few
/// percent, so its rate is fitted to this one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(transparent)]
pub struct Nanoseconds(pub u64);

impl Nanoseconds {
    /// Seconds from `earlier` to `self`; negative if `self` is earlier.
    ///
    /// The subtraction is done in integers, so that the result keeps its resolution after days of running.
    pub fn seconds_since(self, earlier: Self) -> f32 {
        if self.0 >= earlier.0 {
            (self.0 - earlier.0) as f32 * 1e-9
        } else {
            -((earlier.0 - self.0) as f32 * 1e-9)
        }
    }
}
