//! A machine in one cut, with its channels.

use super::conditions::{Conditions, cut_model};
use super::reading::Reading;
use crate::baseline::Baseline;
use quietcut_stability::cut_orbit::CutModel;

/// A machine in one cut, with its channels.
pub(crate) struct Machine {
    pub model: CutModel,
    pub reading: Reading,
}

impl Machine {
    /// The baseline with the channels `names`, for orders up to `highest`; `None` if the case has no orbits, or an
    /// undamped mode at an order.
    pub(crate) fn of_baseline(
        baseline: &Baseline<'_>,
        conditions: &Conditions,
        names: &[String],
        highest: usize,
        rate_hz: f64,
    ) -> Option<Self> {
        let model = cut_model(baseline.case, &baseline.effects, conditions).ok()?;
        let pickups: Option<Vec<_>> = names.iter().map(|name| baseline.pickup(name)).collect();
        let reading = Reading::new(
            &model.structure,
            pickups?,
            conditions.spindle_hz,
            highest,
            rate_hz,
        )?;
        Some(Self { model, reading })
    }
}
