//! Input that contradicts itself: a case with another tool or engagement than the record, and channels that are swapped,
//! inverted or in another unit.
//!
//! | file | content |
//! |---|---|
//! | `alternative` | other inputs |
//! | `feed_forces` | orders of the force of the feed, for any engagement |
//! | `screen` | ranks other inputs by linear least squares |
//! | `wide_fit` | fits a record with all that a machine may differ in |
//!
//! A record is refused only if the given input leaves far more than the allowance of its orders although cutting and edge
//! coefficients, runout, structure, gains and delays are free, and another input leaves no more than it. A cause that
//! this freedom lacks leaves much with either.

mod alternative;
mod feed_forces;
mod screen;
#[cfg(test)]
mod tests;
mod wide_fit;

use quietcut_numerics::statistics::chi_squared_quantile;
use quietcut_recording::Recording;

use self::alternative::Alternative;
use self::screen::Screen;
use self::wide_fit::{WideFit, frequency_costs, wide_fit};
use super::record::ReducedCut;
use crate::baseline::Baseline;
use crate::conclusion::answer::EstimatedCause;
use crate::criteria::SPEED_AS_STATED;
use crate::error::{DiagnoseError, FittingInput};
use crate::records::checks;

/// χ² per value above the noise from which on the given input is refused: that of the allowance of its orders.
const REFUSED: f64 = 1.0;
/// Share of the χ² of the given input that another input may leave.
const LEFT: f64 = 0.05;
/// Probability with which the orders of a right input stay below the χ² up to which an input fits.
const FITS: f64 = 0.999;
/// Difference of the costs of two inputs that fit equally well: odds of 1 000.
const AS_GOOD: f64 = 14.0;
/// Decrease of χ² by one free factor up to which a given one is within two standard deviations.
const TWO_DEVIATIONS: f64 = 4.0;
/// Largest gain of a sensor beside another unit, as a logarithm: beyond, neither unit is the right one.
const OTHER_GAIN: f64 = 0.25;

/// The first record of air, or the contradiction of the first record that another input fits and the given one does not;
/// `None` without any.
pub(super) fn contradiction(
    baseline: &Baseline<'_>,
    records: &[ReducedCut],
    recordings: &[Recording],
) -> Option<DiagnoseError> {
    let screens: Vec<Option<Screen<'_>>> = records
        .iter()
        .map(|record| Screen::new(baseline, record))
        .collect();
    let is_air = |screen: &Option<Screen<'_>>| screen.as_ref().is_some_and(Screen::is_air);
    if let Some(index) = screens.iter().position(is_air) {
        return Some(DiagnoseError::record(
            &recordings[index].path,
            "is a record of air: no channel shows an order of the tooth passing above its noise, and a tenth of those \
             of the case would be plain. Was the tool in the cut, and are the channels those of this cut?",
        ));
    }
    let of_clock =
        |(screen, recording): (&Option<Screen<'_>>, &Recording)| clock(screen.as_ref()?, recording);
    if let Some(error) = screens.iter().zip(recordings).find_map(of_clock) {
        return Some(error);
    }
    let found: Vec<Option<Found>> = screens.iter().map(|screen| found(screen.as_ref()?)).collect();
    let (index, first) = found
        .iter()
        .enumerate()
        .find_map(|(index, found)| Some((index, found.as_ref()?)))?;
    let (best, _) = first.alternatives.first()?;
    // A tool that fits some records only is that of those records.
    let others = found
        .iter()
        .zip(recordings)
        .filter(|(found, _)| best.is_of_tool() && found.is_none());
    Some(DiagnoseError::Contradiction {
        path: recordings[index].path.clone(),
        given: first.given,
        of_given_tool: others.map(|(_, recording)| recording.path.clone()).collect(),
        fitting: first
            .alternatives
            .iter()
            .map(|(alternative, left)| FittingInput {
                what: alternative.to_string(),
                left: *left,
            })
            .collect(),
    })
}

/// A channel whose only explanation is the gain of another unit: no sensor errs by as much.
pub(super) fn unit_of_gain(causes: &[EstimatedCause], recordings: &[Recording]) -> Option<DiagnoseError> {
    causes.iter().find_map(|cause| {
        let gain = cause.parameters.get("gain")?.value;
        let words = checks::unit_of_gain(gain)?;
        let channel = cause.channel.as_deref()?;
        let recording = recordings.iter().find(|recording| recording.channel(channel).is_some())?;
        Some(DiagnoseError::record(
            &recording.path,
            format!(
                "{channel} fits the case if it reads {gain:.3} times the true value, which is about {words}: its unit, \
                 or that of the case, is wrong; give units in the header as name [unit]"
            ),
        ))
    })
}

/// A sample clock that is off: the tachometer differs from the stated speed, and the natural frequencies from those of
/// the case by the same factor. Either alone is no contradiction: a spindle slips, and a stiffness changes.
fn clock(screen: &Screen<'_>, recording: &Recording) -> Option<DiagnoseError> {
    let stated_rpm = recording.sidecar.cut?.spindle_rpm?;
    let ratio = 60.0 * screen.record.conditions.spindle_hz / stated_rpm;
    if (ratio - 1.0).abs() < SPEED_AS_STATED {
        return None;
    }
    let [given, by_clock, by_any] = frequency_costs(screen, ratio)?;
    let is_clock = given - by_clock > AS_GOOD && by_clock - by_any < TWO_DEVIATIONS;
    is_clock.then(|| {
        DiagnoseError::record(
            &recording.path,
            format!(
                "the sample clock seems off by {:.1} %: the tachometer gives {:.1} rev/min where the sidecar states \
                 {stated_rpm}, and the natural frequencies differ from the case by the same factor. Both fit a sample \
                 rate of {:.1} Hz instead of {:.1} Hz. State the true one (--rate, sample_rate_hz), or correct \
                 spindle_rpm if it is not the speed of the spindle",
                100.0 * (ratio - 1.0),
                ratio * stated_rpm,
                recording.sample_rate_hz / ratio,
                recording.sample_rate_hz
            ),
        )
    })
}

/// What fits a record instead of the given input.
struct Found {
    /// χ² per value with the given input.
    given: f64,
    /// Other inputs with theirs, the best first.
    alternatives: Vec<(Alternative, f64)>,
}

fn found(screen: &Screen<'_>) -> Option<Found> {
    let suspects = screen.suspects();
    if suspects.is_empty() {
        return None;
    }
    let count = screen.count() as f64;
    let fits = chi_squared_quantile(FITS, count);
    let refused = REFUSED * screen.seen();
    let given = wide_fit(screen, None, false)?;
    let of = |alternative: Alternative| {
        let fit = wide_fit(screen, Some(&alternative), false)?;
        Some((alternative.fitted(fit.engagement_deg), fit))
    };
    if given.cost < refused {
        return None;
    }
    let is_possible = |(alternative, fit): &(Alternative, WideFit)| {
        let is_of_unit = matches!(alternative, Alternative::Unit(..));
        fit.cost < fits.min(LEFT * given.cost) && (!is_of_unit || fit.largest_gain < OTHER_GAIN)
    };
    let mut fitting: Vec<(Alternative, WideFit)> =
        suspects.into_iter().filter_map(of).filter(is_possible).collect();
    fitting.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    let least = fitting.first()?.1.cost;
    fitting.retain(|(_, fit)| fit.cost < least + AS_GOOD);
    // Far from the baseline another start may fit the given input.
    let is_refused = |given: &WideFit| given.cost >= refused.max(fitting[0].1.cost / LEFT);
    let given = wide_fit(screen, None, true).filter(is_refused)?;
    Some(Found {
        given: given.cost / count,
        alternatives: fitting
            .into_iter()
            .map(|(alternative, fit)| (alternative, fit.cost / count))
            .collect(),
    })
}
