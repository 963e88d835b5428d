//! Spindle speeds and largest depth of a lobe table.

use super::layers::TableLayer;
use super::spindle_limit::SpindleLimit;
use crate::error::StabilityError;
use crate::limits::chart::{Refinement, chart};
use crate::limits::speed_line::SpeedLine;
use crate::limits::speeds::spaced;

/// Default largest axial depth of a table, mm: four times the lowest first limit of all layers at 24 speeds, or 500 mm
/// if no limit lies below about 330 mm. The search doubles the depth, from 0.01 mm, until a limit appears. The factor
/// of four is a choice: stable pockets beyond it are narrow in speed.
pub(super) fn default_depth(
    table_layers: &[TableLayer],
    from_rpm: f64,
    to_rpm: f64,
) -> Result<f64, StabilityError> {
    const SHALLOWEST_MM: f64 = 0.01;
    const DEEPEST_MM: f64 = 500.0;
    let speeds = spaced(from_rpm, to_rpm, 24);
    let mut depth_mm = SHALLOWEST_MM;
    while depth_mm < DEEPEST_MM {
        let mut lowest_mm = f64::INFINITY;
        for table_layer in table_layers {
            for line in table_layer.lines(&speeds, depth_mm)? {
                lowest_mm = line
                    .first_limit
                    .map_or(lowest_mm, |limit| lowest_mm.min(limit.depth_mm));
            }
        }
        if lowest_mm.is_finite() {
            return Ok(4.0 * lowest_mm);
        }
        depth_mm *= 2.0;
    }
    Ok(DEEPEST_MM)
}

/// Union of the refined spindle speeds of all layers, ascending, with the limits by layer and speed.
pub(super) fn lines_of_all(
    table_layers: &[TableLayer],
    coarse: &[f64],
    depth_mm: f64,
    refinement: Refinement,
) -> Result<(Vec<f64>, Vec<Vec<SpeedLine>>), StabilityError> {
    let mut known = Vec::with_capacity(table_layers.len());
    for table_layer in table_layers {
        let method = table_layer.method.as_ref();
        known.push(
            chart(method, coarse, depth_mm, 0)?
                .refined(method, depth_mm, refinement)?
                .speeds,
        );
    }
    let mut speeds: Vec<f64> = known.iter().flatten().map(|line| line.rpm).collect();
    if let (Some(&first), Some(&last)) = (coarse.first(), coarse.last()) {
        let ends = table_layers.iter().filter_map(|layer| layer.spindle.as_ref());
        let ends = ends.flat_map(SpindleLimit::speeds_rpm);
        speeds.extend(ends.filter(|rpm| (first..=last).contains(rpm)));
    }
    speeds.sort_by(f64::total_cmp);
    // The table stores speeds in single precision: speeds that become equal are merged.
    speeds.dedup_by_key(|rpm| *rpm as f32);
    let lines = table_layers.iter().zip(known);
    let lines = lines
        .map(|(table_layer, known)| table_layer.lines_with_known(known, &speeds, depth_mm))
        .collect::<Result<_, _>>()?;
    Ok((speeds, lines))
}
