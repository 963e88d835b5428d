//! Mass of the accelerometers of a test: removed if it is given; otherwise its possible effect is estimated for a
//! warning.

use super::measured::Measurement;
use crate::accelerometer_mass::{peak_shift, without_accelerometer_mass};
use crate::criteria::{ASSUMED_ACCELEROMETER_KG, LEAST_PEAK_SHIFT};
use crate::error::FrfError;
use crate::test_channels::TestChannels;
use quietcut_model::structure::Direction;
use quietcut_numerics::statistics::NINETY_PERCENT;

/// Directions whose response is an acceleration in at least one of the `recordings`.
pub(super) fn accelerated(recordings: &[TestChannels<'_>]) -> Vec<Direction> {
    let mut directions = Vec::new();
    for response in recordings.iter().flat_map(|channels| &channels.responses) {
        if response.derivatives == 2 && !directions.contains(&response.direction) {
            directions.push(response.direction);
        }
    }
    directions
}

/// Warning that the accelerometers were at different positions, by the key `at` of their channels in the sidecars;
/// `None` if these state at most one position.
pub(super) fn roving(recordings: &[TestChannels<'_>]) -> Option<String> {
    let mut positions: Vec<&str> = Vec::new();
    for channels in recordings {
        for response in channels
            .responses
            .iter()
            .filter(|response| response.derivatives == 2)
        {
            let described = channels.recording.sidecar.channel(&response.channel.name);
            if let Some(at) = described.and_then(|channel| channel.at.as_deref())
                && !positions.contains(&at)
            {
                positions.push(at);
            }
        }
    }
    (positions.len() > 1).then(|| {
        format!(
            "the accelerometers were at {}: the mass of a sensor that is moved makes another structure at each position, so that the columns do \
             not belong to one; leave it in place and move the hammer",
            positions.join(", ")
        )
    })
}

/// Removes the mass `mass_kg` of the accelerometer from the receptances of a measurement, and warns of directions in
/// which a mass above 0 cannot be removed.
///
/// If `mass_kg` is `None`, nothing is removed. A warning then names each of the directions `accelerated` in which a
/// mass of [`ASSUMED_ACCELEROMETER_KG`] would shift the drive-point peak by more than [`LEAST_PEAK_SHIFT`] and by more
/// than half the 90 % interval of its frequency.
///
/// # Errors
/// A mass is given, and there is no drive-point receptance or a corrected receptance is not finite.
pub(super) fn sensor_mass(
    measurement: &mut Measurement,
    mass_kg: Option<f64>,
    accelerated: &[Direction],
) -> Result<(), FrfError> {
    let Some(mass_kg) = mass_kg else {
        let shifts = accelerated
            .iter()
            .filter_map(|&direction| {
                Some((
                    direction,
                    peak_shift(&measurement.table, direction, ASSUMED_ACCELEROMETER_KG)?,
                ))
            })
            .filter(|(_, shift)| {
                shift.relative > (NINETY_PERCENT * shift.resonance_std).max(LEAST_PEAK_SHIFT)
            });
        measurement.warnings.extend(shifts.map(|(direction, shift)| {
            format!(
                "the mass of the accelerometer is not known: one of {} g would shift the peak of H{direction}{direction} at {:.1} Hz by −{:.2} %, \
                 more than its interval; say its mass by --accelerometer-mass-g, or 0 for a sensor without contact",
                1e3 * ASSUMED_ACCELEROMETER_KG,
                shift.peak_hz,
                100.0 * shift.relative
            )
        }));
        return Ok(());
    };
    let (table, loaded) =
        without_accelerometer_mass(&measurement.table, &mut measurement.deviation, mass_kg)?;
    measurement.table = table;
    if !loaded.is_empty() && mass_kg > 0.0 {
        let names: Vec<&str> = loaded.iter().map(|direction| direction.name()).collect();
        measurement.warnings.push(format!(
            "the mass of the accelerometer is not removed in {}, where no drive-point receptance was measured: excite that direction too",
            names.join(", ")
        ));
    }
    Ok(())
}
