//! A channel, or without a name every channel of motion, reads g times the true value: y = g·y_t.

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Pickup, Treatment};
use quietcut_recording::Quantity;

/// The specification.
pub(super) const SENSOR_GAIN: EffectSpec = EffectSpec {
    id: EffectName::SensorGain,
    name: "sensor-gain",
    class: Class::Sensor,
    locations: Locations::Channels,
    parameters: &[
        Parameter::number("gain", "", "ratio of the reading to the true value")
            .linear()
            .main(),
    ],
    treatment: Treatment::Sensor,
    candidates: &[
        "one channel, or all channels of motion",
        "measured forces of a cut",
    ],
    shares_term_with: &[EffectName::SensorOffsetFromToolTip],
    summary: "a channel reads a multiple of the true value",
    equation: "y = g·y_t",
    shows: "one factor at all frequencies and amplitudes, of one channel",
    hidden_by: "the only channel under a measured force: mass, damping and stiffness by one factor; all channels of a steady cut without measured force: a factor of the cutting force",
    source: "the calibration factor of ISO 16063",
    example: "gain = 1.1\nchannel = \"x\"",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(SensorGain {
            gain: values.main("gain")?,
            channel: values.channel()?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorGain {
    gain: f64,
    channel: Option<String>,
}

impl Effect for SensorGain {
    fn id(&self) -> EffectName {
        EffectName::SensorGain
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if acts_on(self.channel.as_deref(), channel) {
            for weight in &mut channel.weights {
                *weight *= self.gain;
            }
        }
    }
}

/// True if a sensor effect acts on `channel`: if it has the name `name`, or, where that is `None`, if it does not
/// measure a force.
pub(super) fn acts_on(name: Option<&str>, channel: &Pickup) -> bool {
    match name {
        Some(name) => channel.name == name,
        None => channel.quantity != Quantity::Force,
    }
}
