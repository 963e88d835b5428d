//! Derivatives of the stability limits in the entries of a layer of a lobe table.

use std::f64::consts::TAU;

use quietcut_core::lobes::{IntervalSlopes, LayerMode, MODES_MAX, Slopes};
use quietcut_core::units::Hertz;
use rayon::prelude::*;

use super::entries::Entry;
use super::error::BuildError;
use super::layers::TableLayer;
use crate::error::StabilityError;
use crate::limits::sensitivity::{Sensitivity, Tangent, no_derivative};
use crate::limits::speed_line::{SpeedLine, Switch};
use quietcut_model::structure::ModalPart;

/// Derivatives of the stability limits in the entries of one layer, with respect to modes and cutting force.
pub(super) struct Derivatives {
    /// Modes with respect to which the limits are differentiated, by ascending frequency.
    pub(super) modes: Vec<LayerMode>,
    pub(super) by_speed: Vec<SlopesOfLine>,
    /// Warning about limits for which no derivative exists, so that their entries state 0; `None` if every limit has
    /// derivatives.
    pub(super) warning: Option<String>,
}

/// Derivatives of the limits at one speed with respect to modes and cutting force, each with the depth of its limit,
/// mm.
pub(super) struct SlopesOfLine(Vec<(f64, Slopes)>);

impl SlopesOfLine {
    /// Derivatives of the depths at both ends of an entry (an unstable depth interval); 0 for an end that is no limit
    /// or has no derivative.
    pub(super) fn of(&self, entry: &Entry) -> IntervalSlopes {
        let at = |depth_mm: f64| {
            let found = self.0.iter().find(|(switch_mm, _)| *switch_mm == depth_mm);
            found.map_or_else(Slopes::default, |(_, slopes)| *slopes)
        };
        IntervalSlopes {
            from: at(entry.from_mm),
            to: at(entry.to_mm),
        }
    }
}

/// Number of modes with respect to which every layer of the table is differentiated: the least number of oscillatory
/// modes of a layer, at most [`MODES_MAX`].
pub(super) fn mode_count(table_layers: &[TableLayer]) -> Result<usize, BuildError> {
    let counts = table_layers
        .iter()
        .map(|table_layer| table_layer.linear.structure.modal_parts().len());
    let count = counts.min().unwrap_or(0).min(MODES_MAX);
    match table_layers.first() {
        Some(table_layer) if count == 0 => Err(BuildError::NotPossible {
            path: table_layer.path().into(),
            what: "--derivatives are those by modes, and the structure has no mode that vibrates",
        }),
        _ => Ok(count),
    }
}

/// Derivatives of one limiting depth with respect to natural frequency and damping ratio of each mode, and to the cutting
/// coefficient K_tc at constant ratios K_rc/K_tc and K_ac/K_tc and constant edge coefficients, mm per relative change.
struct SwitchDerivatives {
    depth_mm: f64,
    by_mode: Vec<[f64; 2]>,
    by_force: f64,
}

impl Derivatives {
    /// Derivatives of all limits of a layer, for the `count` modes with the largest influence on limits.
    pub(super) fn new(
        table_layer: &TableLayer,
        lines: &[SpeedLine],
        count: usize,
    ) -> Result<Self, BuildError> {
        let parts = table_layer.linear.structure.modal_parts();
        let found: Vec<Vec<Result<SwitchDerivatives, StabilityError>>> = lines
            .par_iter()
            .map(|line| {
                let switches = line.switches.iter();
                switches
                    .map(|switch| of_switch(table_layer, &parts, line.rpm, switch))
                    .collect()
            })
            .collect();
        let warning = warning(table_layer, &found);
        let all: Vec<Vec<SwitchDerivatives>> = found
            .into_iter()
            .map(|line| line.into_iter().filter_map(Result::ok).collect())
            .collect();
        let influence = |mode: usize| {
            let switches = all.iter().flatten();
            // Influence of a mode: the sum of the absolute derivatives of all limits with respect to its natural
            // frequency. A median would miss a mode that governs one lobe only.
            switches.map(|switch| switch.by_mode[mode][0].abs()).sum::<f64>()
        };
        let mut chosen: Vec<usize> = (0..parts.len()).collect();
        chosen.sort_by(|&a, &b| influence(b).total_cmp(&influence(a)).then(a.cmp(&b)));
        chosen.truncate(count);
        chosen.sort_unstable();
        let by_speed = all.iter().map(|switches| {
            let slopes = switches
                .iter()
                .map(|switch| (switch.depth_mm, switch.of_modes(&chosen)));
            SlopesOfLine(slopes.collect())
        });
        Ok(Self {
            by_speed: by_speed.collect(),
            warning,
            modes: chosen
                .iter()
                .map(|&index| LayerMode {
                    frequency: Hertz((parts[index].omega() / TAU) as f32),
                    damping_ratio: parts[index].damping_ratio() as f32,
                })
                .collect(),
        })
    }
}

impl SwitchDerivatives {
    fn of_modes(&self, chosen: &[usize]) -> Slopes {
        let mut slopes = Slopes {
            by_cutting_force: self.by_force as f32,
            ..Slopes::default()
        };
        for (slot, &mode) in chosen.iter().enumerate() {
            let [frequency, damping] = self.by_mode[mode];
            slopes.by_frequency[slot] = frequency as f32;
            slopes.by_damping_ratio[slot] = damping as f32;
        }
        slopes
    }
}

/// Warning that counts the limits without derivatives and gives the reason of the first; `None` if every limit has
/// them.
fn warning(
    table_layer: &TableLayer,
    found: &[Vec<Result<SwitchDerivatives, StabilityError>>],
) -> Option<String> {
    let reasons: Vec<&StabilityError> = found
        .iter()
        .flatten()
        .filter_map(|switch| switch.as_ref().err())
        .collect();
    let first = reasons.first()?;
    Some(format!(
        "{}: {} of {} limits have no derivatives, for which the table states 0; the first one: {first}",
        table_layer.path().display(),
        reasons.len(),
        found.iter().flatten().count()
    ))
}

/// Derivatives of one limiting depth with respect to modes and cutting force.
///
/// # Errors
/// The limit has no Floquet mode, or is not differentiable (the tip of an island).
fn of_switch(
    table_layer: &TableLayer,
    parts: &[ModalPart],
    rpm: f64,
    switch: &Switch,
) -> Result<SwitchDerivatives, StabilityError> {
    let problem = &table_layer.linear;
    let sensitivity = Sensitivity::new(problem, rpm, switch)?;
    let slope = |tangent: &Tangent| {
        sensitivity
            .slope(tangent)
            .ok_or_else(|| no_derivative(rpm, switch))
    };
    let by_mode = parts.iter().map(|part| {
        let by_omega = slope(&Tangent::omega(problem, part))?;
        let by_damping = slope(&Tangent::damping_ratio(problem, part))?;
        Ok([
            by_omega.depth_mm * part.omega(),
            by_damping.depth_mm * part.damping_ratio(),
        ])
    });
    Ok(SwitchDerivatives {
        depth_mm: switch.depth_mm,
        by_mode: by_mode.collect::<Result<_, StabilityError>>()?,
        by_force: slope(&Tangent::cutting_force(problem))?.depth_mm,
    })
}
