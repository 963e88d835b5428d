//! A channel, or with no channel named every channel of motion, is g times the truth.

use std::sync::Arc;

use super::{Effect, Kind, Pickup};
use quietcut_recording::Quantity;

pub(super) const KIND: Kind = Kind {
    name: "sensor-gain",
    keys: "gain and channel",
    build: |parameters| {
        Ok(Arc::new(SensorGain {
            gain: parameters.main("gain")?,
            channel: parameters.text("channel")?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorGain {
    gain: f64,
    channel: Option<String>,
}

impl Effect for SensorGain {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if meant(self.channel.as_deref(), channel) {
            for weight in &mut channel.weights {
                *weight *= self.gain;
            }
        }
    }
}

/// The named channel; without a name those of motion, not those of force.
pub(super) fn meant(name: Option<&str>, channel: &Pickup) -> bool {
    match name {
        Some(name) => channel.name == name,
        None => channel.quantity != Quantity::Force,
    }
}
