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

/// True for a unit of force per motion, such as `N/um`, `N·s/m` or `kg`.
pub(super) fn is_force_per_motion(text: &str) -> bool {
    let text = text.trim();
    let is = |text: &str, of: &[Quantity]| text.parse::<Unit>().is_ok_and(|unit| of.contains(&unit.quantity));
    let motions = [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration];
    let over_motion = text.split_once('/').is_some_and(|(force, motion)| {
        let force = force
            .trim_start_matches('(')
            .trim_end_matches(['s', 'S', ')', '·', '*', ' ']);
        is(force, &[Quantity::Force]) && is(motion, &motions)
    });
    over_motion || text == "kg" || text == "kg/s"
}

/// Usual spelling of the unit of an FRF: `(m/s^2)/N` for `1/kg`, `(m/s)/N` for `s/kg`, `m/(N·s)`, `m/Ns` and `m/N/s`.
fn respelled(text: &str) -> String {
    let text = text.trim();
    match text {
        "1/kg" => return "(m/s^2)/N".into(),
        "s/kg" => return "(m/s)/N".into(),
        _ => {}
    }
    let endings = ["/(N·s)", "/(N⋅s)", "/(N*s)", "/(N s)", "/(Ns)", "/Ns", "/N/s"];
    endings
        .iter()
        .find_map(|ending| text.strip_suffix(ending))
        .map_or_else(|| text.to_owned(), |length| format!("({length}/s)/N"))
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
    if is_force_per_motion(text) {
        return Err(format!(
            "\"{text}\" is force per motion: dynamic stiffness, mechanical impedance or apparent mass, whose matrix is the inverse of that of receptance, \
             mobility or accelerance; export one of these, in a unit such as m/N"
        ));
    }
    let text = &respelled(text);
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
