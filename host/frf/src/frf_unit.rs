//! Unit of a frequency response function, response per force, and the directions in the name of one.

use std::f64::consts::TAU;

use num_complex::Complex64;

use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, Unit};

/// Direction of the displacement and direction of the force of a receptance.
pub(super) type DirectionPair = (Direction, Direction);

/// Unit of an FRF: conversion factor to SI, and order of the time derivative of displacement (0 receptance, 1 mobility,
/// 2 accelerance).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrfUnit {
    pub(super) factor: f64,
    pub(super) derivatives: i32,
}

/// Parses two of the letters x, y and z, such as `xy`: displacement in x, force in y. `None` for any other text.
pub(super) fn pair_of(text: &str) -> Option<DirectionPair> {
    let axis = |text: &str| {
        let direction: Direction = text.parse().ok()?;
        direction.axis().map(|_| direction)
    };
    let (response, force) = text.split_at_checked(1)?;
    Some((axis(response)?, axis(force)?))
}

impl FrfUnit {
    pub(super) const SI: Self = Self {
        factor: 1.0,
        derivatives: 0,
    };

    /// Name of the kind of FRF in this unit: receptance, mobility or accelerance.
    pub(super) fn word(self) -> &'static str {
        match self.derivatives {
            0 => "receptance",
            1 => "mobility",
            _ => "accelerance",
        }
    }

    /// Converts an FRF value in this unit to receptance, m/N; `None` if the receptance is not finite, as for mobility
    /// and accelerance at 0 Hz.
    pub(super) fn receptance(self, value: Complex64, frequency_hz: f64) -> Option<Complex64> {
        let rate = Complex64::new(0.0, TAU * frequency_hz).powi(self.derivatives);
        let receptance = value * self.factor / rate;
        receptance.is_finite().then_some(receptance)
    }
}

/// Parses the unit of an FRF, such as `um/N`, `m/s^2/N`, `g/N` or `1/kg`. An error if the text is no unit of a
/// displacement, velocity or acceleration per unit of force.
pub(super) fn frf_unit(text: &str) -> Result<FrfUnit, String> {
    let wrong = || {
        format!(
            "\"{text}\" is no unit of it; a displacement, velocity or acceleration per force such as m/N, um/N or \
             (m/s^2)/N is needed"
        )
    };
    // kg⁻¹ is (m/s²)/N.
    let text = if text.trim() == "1/kg" { "m/s^2/N" } else { text };
    let (response, force) = text.rsplit_once('/').ok_or_else(wrong)?;
    let response = response
        .strip_prefix('(')
        .and_then(|inner| inner.strip_suffix(')'))
        .unwrap_or(response);
    let response: Unit = response.parse().map_err(|_| wrong())?;
    let force: Unit = force.parse().map_err(|_| wrong())?;
    let derivatives = match response.quantity {
        Quantity::Displacement => 0,
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
        _ => return Err(wrong()),
    };
    if force.quantity != Quantity::Force {
        return Err(wrong());
    }
    Ok(FrfUnit {
        factor: response.factor / force.factor,
        derivatives,
    })
}
