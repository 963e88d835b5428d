//! The readings of the sensors in an experiment.

/// A set of sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sensors {
    /// The sensors of the records.
    Mounted,
    /// These, and a second one at the tool beside each.
    Second,
    /// These, and a dynamometer.
    Force,
}

/// The sensor of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    Mounted,
    Second,
    Force,
}

/// Samples of one sensor.
pub(super) struct Reading {
    pub(super) name: String,
    pub(super) of: Of,
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

impl Reading {
    pub(super) fn is_read_by(&self, sensors: Sensors) -> bool {
        match self.of {
            Of::Mounted => true,
            Of::Second => sensors == Sensors::Second,
            Of::Force => sensors == Sensors::Force,
        }
    }

    pub(super) fn described(&self) -> String {
        match self.of {
            Of::Second => format!("a second sensor of {}", self.name),
            Of::Mounted | Of::Force => self.name.clone(),
        }
    }
}
