//! The sensor sits away from the tool tip: of each mode it reads a share, that of a rigid body between the two.
//!
//! y = Σ ratio_r·u_r with u_r what mode r moves the tool. Of a structure that is not given by its modes there is one ratio for all.

use std::sync::Arc;

use super::sensor_gain::meant;
use super::{Effect, EffectError, Kind, Pickup};
use crate::structure::{Form, Structure};

pub(super) const KIND: Kind = Kind {
    name: "sensor-offset-from-tool-tip",
    keys: "ratio (one, or one for each mode) and channel",
    build: |parameters| {
        Ok(Arc::new(SensorOffset {
            ratios: parameters.main_numbers("ratio")?,
            channel: parameters.text("channel")?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorOffset {
    /// One for all modes, or one for each.
    ratios: Vec<f64>,
    channel: Option<String>,
}

impl Effect for SensorOffset {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn alter_structure(&self, structure: &mut Structure) -> Result<(), EffectError> {
        let modes = match &structure.form {
            Form::Modes(modes) => modes.len(),
            _ => 1,
        };
        if self.ratios.len() == 1 || self.ratios.len() == modes {
            return Ok(());
        }
        Err(EffectError::Structure {
            name: KIND.name,
            what: match structure.form {
                Form::Modes(_) => format!(
                    "{} ratios are given; one, or one for each of the {modes} modes of the structure is needed",
                    self.ratios.len()
                ),
                _ => format!(
                    "{} ratios are given, but the structure is not given by its modes: one is needed",
                    self.ratios.len()
                ),
            },
        })
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if !meant(self.channel.as_deref(), channel) {
            return;
        }
        if let [ratio] = self.ratios[..] {
            channel.weights.iter_mut().for_each(|weight| *weight *= ratio);
        } else {
            channel.modes.clone_from(&self.ratios);
        }
    }
}
