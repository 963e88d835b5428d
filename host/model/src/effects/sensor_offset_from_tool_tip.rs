//! The sensor sits away from the tool tip, so that it reads each mode with the ratio of the mode shape at the sensor to
//! that at the tool.
//!
//! y = Σ ratio_r·u_r with u_r the motion of the tool in mode r. A structure that is not given by modes has one ratio
//! for all motion.

use std::sync::Arc;

use super::sensor_gain::acts_on;
use super::{
    Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Pickup, Treatment, ValueKind,
};
use crate::structure::{Form, Structure};

/// The specification.
pub(super) const SENSOR_OFFSET_FROM_TOOL_TIP: EffectSpec = EffectSpec {
    id: EffectName::SensorOffsetFromToolTip,
    name: "sensor-offset-from-tool-tip",
    class: Class::Sensor,
    locations: Locations::Channels,
    parameters: &[Parameter::number(
        "ratio",
        "",
        "ratio of the motion of the sensor to that of the tool",
    )
    .of_kind(ValueKind::NumberPerMode)
    .linear()
    .main()],
    treatment: Treatment::Sensor,
    candidates: &["one ratio for each mode that moves the channel, or one for all"],
    shares_term_with: &[EffectName::SensorGain],
    summary: "the sensor sits away from the tool tip",
    equation: "y = Σ ratio_r·u_r, u_r the motion of the tool in mode r",
    shows: "each mode larger or smaller by a ratio of its own, without a phase, in the receptance of the tool tip beside that of the sensor",
    hidden_by: "one mode, where it is a sensor gain",
    source: "Ewins, Modal Testing (2000), ch. 2",
    example: "ratio = 0.8\nchannel = \"x\"",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(SensorOffset {
            ratios: values.main_numbers("ratio")?,
            channel: values.channel()?,
        }))
    },
};

#[derive(Clone, Debug)]
struct SensorOffset {
    /// Ratios of the motion at the sensor to that at the tool tip: one for all modes, or one for each mode in their
    /// order.
    ratios: Vec<f64>,
    channel: Option<String>,
}

impl Effect for SensorOffset {
    fn id(&self) -> EffectName {
        EffectName::SensorOffsetFromToolTip
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
            name: self.name(),
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
        if !acts_on(self.channel.as_deref(), channel) {
            return;
        }
        if let [ratio] = self.ratios[..] {
            channel.weights.iter_mut().for_each(|weight| *weight *= ratio);
        } else {
            channel.modes.clone_from(&self.ratios);
        }
    }
}
