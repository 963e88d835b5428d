//! A sensor of motion that does not sit at the tool tip, as the sidecar states: it reads y = Σ ratio_r·u_r with u_r the
//! contribution of mode r at the tool tip, so that its residual is Σ (ratio_r − 1)·u_r.
//!
//! Shows: a ratio for each mode, without phase. Does not show: other frequencies or damping. Fit: linear in the ratios,
//! or in 1 − 1/ratio if there is only one. Source: mode shapes of a rigid or flexible body as in Ewins, Modal Testing
//! (2000), ch. 2.
//!
//! There is only one ratio, equivalent to a gain of the channel, if one mode moves the axis, if the structure is not
//! given by its modes or by more than nine, if all channels share the error, or if a record is of a cut, where the
//! chips are computed along the motion of this sensor.

use super::sensor::one_or_all;
use super::sensor_gain::{SensorGainCause, factor};
use crate::baseline::receptance::{Receptance, response};
use crate::candidates::cause::{Cause, Location, Parameter, Regressor, Regressors};
use crate::criteria::LEAST_RESPONSE_WITH_RATIO;
use crate::records::channel::Observed;
use crate::records::channel::main_axis;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::structure::Form;

pub(super) struct SensorOffsetCause;

/// Keys of the sensor-to-tool-tip ratios of the modes, in the order of the modes in the case. Structures with more
/// modes have one ratio for all.
const RATIOS: [&str; 9] = [
    "ratio_1", "ratio_2", "ratio_3", "ratio_4", "ratio_5", "ratio_6", "ratio_7", "ratio_8", "ratio_9",
];

/// Indices of the modes that have a sensor-to-tool-tip ratio of their own in the channel, and the number of modes of
/// the case; `None` if one ratio holds for all modes.
fn modes(study: &Study<'_>, location: &Location) -> Option<(Vec<usize>, usize)> {
    let name = location.channel()?;
    let Form::Modes(modes) = &study.baseline.structure.form else {
        return None;
    };
    let is_driven = |record: &Record| record.domain == Domain::Response && record.cut.is_none();
    if modes.len() > RATIOS.len() || !study.records.iter().all(is_driven) {
        return None;
    }
    let mut channels = study.records.iter().flat_map(|record| &record.channels);
    let axis = main_axis(channels.find(|channel| channel.pickup.name == name)?)?;
    let directions = &study.baseline.structure.directions;
    let along = directions
        .iter()
        .position(|direction| direction.axis() == Some(axis))?;
    let size = |mode: &quietcut_model::structure::Mode| {
        let driven = mode.left.iter().map(|left| left.norm()).fold(0.0, f64::max);
        mode.right[along].norm() * driven
    };
    let largest = modes.iter().map(size).fold(0.0, f64::max);
    let seen: Vec<usize> = (0..modes.len())
        .filter(|mode| size(&modes[*mode]) > LEAST_RESPONSE_WITH_RATIO * largest)
        .collect();
    (seen.len() > 1).then_some((seen, modes.len()))
}

/// Reading that a channel has of one mode alone under the exciting forces of the record and the restoring forces of the
/// baseline, including the mode's free decay.
fn read_of(study: &Study<'_>, record: &Record, index: usize, mode: usize) -> Vec<f64> {
    let channel: &Observed = &record.channels[index];
    let first_order = &study.baseline.first_order;
    let mut alone = vec![0.0; first_order.order() / 2];
    alone[mode] = 1.0;
    let transfer = response(&Receptance::new(&first_order.at_sensor(&alone)), &record.grid);
    let responses = record.responses_by(channel, &transfer, &study.baseline.axes);
    let mut force = std::array::from_fn(|axis| {
        let force = &record.force_n[axis];
        (!force.is_empty()).then(|| record.grid.spectrum(force))
    });
    record.add_terms(&study.baseline, &mut force);
    let mut read = record.read_by(&force, &responses, index);
    for state in [2 * mode, 2 * mode + 1] {
        let start = record.decays.start[state];
        for (read, decay) in read.iter_mut().zip(record.decays.column(index, state)) {
            *read += start * decay;
        }
    }
    read
}

impl Cause for SensorOffsetCause {
    fn effect(&self) -> EffectName {
        EffectName::SensorOffsetFromToolTip
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        one_or_all(study, self.name())
            .into_iter()
            .filter(|location| study.sits_elsewhere(location.channel()))
            .collect()
    }

    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        let Some((modes, _)) = modes(study, location) else {
            return SensorGainCause.regressors(study, record, location, nonlinear_parameters);
        };
        let of_mode = |mode: &usize| {
            let read = |(index, channel): (usize, &Observed)| {
                if location.channel() == Some(&channel.pickup.name) {
                    read_of(study, record, index, *mode)
                } else {
                    Vec::new()
                }
            };
            Regressor::of_channels(record.channels.iter().enumerate().map(read).collect())
        };
        Ok(modes.iter().map(of_mode).collect())
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let Some((modes, count)) = modes(study, location) else {
            return Some(vec![("ratio", factor(coefficients)?)]);
        };
        let ratio = |mode: usize| {
            let known = modes.iter().position(|known| *known == mode);
            known.map_or(1.0, |index| 1.0 + coefficients[index])
        };
        Some((0..count).map(|mode| (RATIOS[mode], ratio(mode))).collect())
    }

    fn extension(&self, location: &Location, parameters: &[Parameter]) -> toml::Table {
        let mut table = location.table();
        let ratio = match parameters {
            [(_, ratio)] => (*ratio).into(),
            _ => parameters
                .iter()
                .map(|(_, ratio)| toml::Value::from(*ratio))
                .collect::<Vec<_>>()
                .into(),
        };
        table.insert("ratio".into(), ratio);
        table
    }
}
