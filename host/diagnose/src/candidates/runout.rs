//! Runout: the edge of tooth j of N teeth lies on the radius R + e·cos(ψ + 2πj/N) at equal pitch, with the offset e of
//! the tool axis.
//!
//! Shows: lines at the spindle frequency and its multiples other than tooth-passing harmonics, from the first engaged
//! tooth on. Does not show: growth, or lines that are not multiples of the spindle frequency. Flip chatter of constant
//! amplitude of a tool with an even number of teeth has lines at the same frequencies. Fit: linear in e cos ψ and e sin
//! ψ. Source: Kline and DeVor, Int. J. Mach. Tool Des. Res. 23 (1983).

use std::f64::consts::TAU;

use super::process::{added, changed, cutter, everywhere, step};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors, WRONG_PARAMETERS};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Runout;
use quietcut_simulate::Cutter;

pub(super) struct RunoutCause;

/// Offsets e of a runout, other than zero, at which its fit starts, as shares of the feed per tooth.
const SHARES_OF_FEED: [f64; 2] = [0.1, 0.25];
/// Smallest step, in magnitude, of the finite differences of the cutting force with respect to the runout components e
/// cos ψ and e sin ψ, µm.
const LEAST_UM: f64 = 0.01;

/// |sin| of the angle between a tooth and the first one up to which the tooth counts as on the line through the axis
/// and the first tooth: rounding of π gives less.
const ASIDE: f64 = 1e-9;

fn teeth(study: &Study<'_>) -> usize {
    cutter(study).map_or(0, |cutter| cutter.teeth.len())
}

/// True if some tooth lies beside the line through the axis and the first tooth, so that an offset of the tool axis
/// perpendicular to this line changes a radius. Two teeth at equal pitch have no such tooth.
fn has_tooth_aside(study: &Study<'_>) -> bool {
    cutter(study).is_some_and(|cutter| {
        cutter
            .teeth
            .iter()
            .any(|tooth| tooth.angle_rad.sin().abs() > ASIDE)
    })
}

fn offset(along_um: f64, across_um: f64) -> impl Fn(&mut Cutter) {
    move |cutter| {
        cutter.set_runout(Runout {
            offset_um: along_um.hypot(across_um),
            angle_deg: across_um.atan2(along_um).to_degrees(),
        });
    }
}

impl Cause for RunoutCause {
    fn effect(&self) -> EffectName {
        EffectName::Runout
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        let runs_true = study
            .baseline
            .case
            .tool
            .as_ref()
            .is_some_and(|tool| tool.runout.is_none());
        // With one tooth, runout changes no chip: that tooth cuts its own surface.
        if runs_true && teeth(study) > 1 {
            everywhere(study, self.name())
        } else {
            Vec::new()
        }
    }

    /// Start values (e cos ψ, e sin ψ) of the runout in µm: zero, and offsets e of a tenth and a quarter of the feed
    /// per tooth in several directions.
    fn nonlinear_grid(&self, study: &Study<'_>, _: &Location) -> Vec<Vec<f64>> {
        let feed_um = cutter(study).map_or(0.0, |cutter| 1e6 * cutter.feed_per_tooth_m);
        let directions = if has_tooth_aside(study) { 6 } else { 2 };
        let about = SHARES_OF_FEED.into_iter().flat_map(|share| {
            (0..directions).map(move |direction| {
                let angle = TAU * f64::from(direction) / f64::from(directions);
                vec![share * feed_um * angle.cos(), share * feed_um * angle.sin()]
            })
        });
        std::iter::once(vec![0.0, 0.0]).chain(about).collect()
    }

    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        _: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors {
        let &[along, across] = nonlinear_parameters else {
            return Err(WRONG_PARAMETERS.into());
        };
        let (along_step, across_step) = (step(along, LEAST_UM), step(across, LEAST_UM));
        let mut regressors = vec![changed(record, offset(along_step, 0.0), along_step)];
        if has_tooth_aside(study) {
            regressors.push(added(
                record,
                offset(along, 0.0),
                offset(along, across_step),
                across_step,
            ));
        }
        Ok(regressors)
    }

    fn settled(&self, _: &[f64], coefficients: &[f64]) -> Option<Vec<f64>> {
        Some(vec![
            *coefficients.first()?,
            coefficients.get(1).copied().unwrap_or(0.0),
        ])
    }

    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let (along, across) = (
            *coefficients.first()?,
            coefficients.get(1).copied().unwrap_or(0.0),
        );
        Some(vec![
            ("runout_um", along.hypot(across)),
            ("angle_deg", across.atan2(along).to_degrees().rem_euclid(360.0)),
        ])
    }
}
