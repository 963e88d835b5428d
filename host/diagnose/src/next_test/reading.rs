//! The simulated readings of the sensors in a proposed test.

/// A set of sensors in a proposed test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sensors {
    /// The sensors of the records.
    Mounted,
    /// The sensors of the records, and at the tool a second one next to each sensor of motion.
    Second,
    /// The sensors of the records, and a dynamometer for the cutting force.
    Force,
}

/// Which sensor a reading is of: one of the records, a second one next to it, or the dynamometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SensorOf {
    Mounted,
    Second,
    Force,
}

/// Simulated samples of one sensor.
pub(super) struct SimulatedReading {
    pub(super) name: String,
    pub(super) of: SensorOf,
    pub(super) samples: Vec<f64>,
}

impl Sensors {
    pub(super) fn effort(self) -> f64 {
        match self {
            Self::Mounted => 0.0,
            Self::Second => 1.0,
            Self::Force => 1.5,
        }
    }

    pub(super) fn described(self) -> Option<&'static str> {
        match self {
            Self::Mounted => None,
            Self::Second => Some("a second sensor at the tool beside each that is mounted"),
            Self::Force => Some("the cutting force, with a dynamometer"),
        }
    }
}

impl SimulatedReading {
    pub(super) fn is_read_by(&self, sensors: Sensors) -> bool {
        match self.of {
            SensorOf::Mounted => true,
            SensorOf::Second => sensors == Sensors::Second,
            SensorOf::Force => sensors == Sensors::Force,
        }
    }

    pub(super) fn described(&self) -> String {
        match self.of {
            SensorOf::Second => format!("a second sensor of {}", self.name),
            SensorOf::Mounted | SensorOf::Force => self.name.clone(),
        }
    }
}
