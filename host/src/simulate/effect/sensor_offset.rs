//! The sensor sits away from the tool tip: it reads a share of its motion, that of a rigid body between the two.
//!
//! One ratio for all modes; with several modes of different shapes each would have its own.

use std::sync::Arc;

use super::sensor_gain::meant;
use super::{Effect, Kind, Pickup};

pub(super) const KIND: Kind = Kind {
    name: "sensor-offset-from-tool-tip",
    keys: "ratio and channel",
    build: |parameters| {
        Ok(Arc::new(SensorOffset {
            ratio: parameters.main("ratio")?,
            channel: parameters.text("channel")?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorOffset {
    ratio: f64,
    channel: Option<String>,
}

impl Effect for SensorOffset {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if meant(self.channel.as_deref(), channel) {
            for weight in &mut channel.weights {
                *weight *= self.ratio;
            }
        }
    }
}
