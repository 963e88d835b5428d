//! Encoding of the content of a lobe table as bytes.

use quietcut_core::lobes::{
    Additions, Content, InterpolationError, IntervalSlopes, Layer, LayerMode, LobeTable, encode_with,
    encoded_length_with, format::NAME_CAPACITY,
};
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::Limits;

use super::derivatives::Derivatives;
use super::entries::Entry;
use super::error::BuildError;
use super::layers::TableLayer;
use quietcut_model::case::Case;

/// The lobe table for cuts in the feed direction `direction_deg`, degrees; unchanged if that is `None`.
pub(super) fn towards<'a>(table: &LobeTable<'a>, direction_deg: Option<f64>) -> LobeTable<'a> {
    match direction_deg {
        Some(degrees) => table.towards(Degrees(degrees as f32)),
        None => *table,
    }
}

/// Content of a table.
pub(super) struct Table<'a> {
    pub(super) first: &'a Case,
    pub(super) table_layers: &'a [TableLayer],
    pub(super) speeds: &'a [f64],
    /// Entries by layer and speed.
    pub(super) entries: &'a [Vec<Vec<Entry>>],
    /// Derivatives of the limits, by layer; empty if not requested.
    pub(super) derivatives: &'a [Derivatives],
    pub(super) depth_mm: f64,
}

impl Table<'_> {
    pub(super) fn bytes(&self, error: Option<InterpolationError>) -> Result<Vec<u8>, BuildError> {
        let intervals: Vec<Vec<Vec<_>>> = self
            .entries
            .iter()
            .map(|layer| {
                let columns = layer.iter();
                columns
                    .map(|column| column.iter().map(|entry| entry.interval).collect())
                    .collect()
            })
            .collect();
        let columns: Vec<Vec<&[_]>> = intervals
            .iter()
            .map(|layer| layer.iter().map(Vec::as_slice).collect())
            .collect();
        let layers: Vec<Layer<'_>> = self
            .table_layers
            .iter()
            .zip(&columns)
            .map(|(table_layer, columns)| Layer {
                validity: table_layer.validity,
                columns,
            })
            .collect();
        let speeds: Vec<Rpm> = self.speeds.iter().map(|&rpm| Rpm(rpm as f32)).collect();
        let mut end = self.first.name.len().min(NAME_CAPACITY);
        while !self.first.name.is_char_boundary(end) {
            end -= 1;
        }
        let content = Content {
            name: &self.first.name[..end],
            // A tool has at most 64 teeth, so that the number of teeth fits.
            teeth: self
                .table_layers
                .first()
                .map_or(0, |table_layer| table_layer.teeth as u8),
            limits: self.first.limits.as_ref().map(|limits| Limits {
                rpm_min: Rpm(limits.rpm_min as f32),
                rpm_max: Rpm(limits.rpm_max as f32),
            }),
            depth_from: Millimeters(0.0),
            depth_to: Millimeters(self.depth_mm as f32),
            speeds: &speeds,
            layers: &layers,
        };
        let directions: Vec<Option<Degrees>> = self
            .table_layers
            .iter()
            .map(|table_layer| table_layer.direction_deg.map(|degrees| Degrees(degrees as f32)))
            .collect();
        let modes: Vec<&[LayerMode]> = self
            .derivatives
            .iter()
            .map(|layer| layer.modes.as_slice())
            .collect();
        let slopes: Vec<IntervalSlopes> = self
            .entries
            .iter()
            .zip(self.derivatives)
            .flat_map(|(columns, derivatives)| {
                columns
                    .iter()
                    .zip(&derivatives.by_speed)
                    .flat_map(|(column, slopes)| column.iter().map(|entry| slopes.of(entry)))
            })
            .collect();
        let additions = Additions {
            interpolation_error: error,
            feed_directions: &directions,
            modes: &modes,
            slopes: &slopes,
        };
        let mut buffer = vec![0; encoded_length_with(&content, &additions) as usize];
        let bytes = encode_with(&content, &additions, &mut buffer).map_err(BuildError::Format)?;
        Ok(bytes.to_vec())
    }
}
