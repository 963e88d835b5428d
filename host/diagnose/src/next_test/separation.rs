//! The distance between the readings that two candidate models predict in an experiment.

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::least_squares::LinearProblem;

use super::bench::Bench;
use super::experiment::Experiment;
use super::reading::{Sensors, SimulatedReading};
use crate::candidates::extension_tables::joined;
use crate::conclusion::answer::{EstimatedCause, Figure, NINETY_PERCENT};
use quietcut_model::case::Case;

/// Smallest step of the finite difference by which simulated readings are differentiated by a parameter, relative to
/// the parameter.
const LEAST_STEP: f64 = 1e-4;

/// A candidate model in a comparison: the causes that act together.
pub(super) struct Rival<'a> {
    pub(super) causes: &'a [EstimatedCause],
}

/// Readings of an experiment under a candidate model.
pub(super) struct Predicted {
    readings: Vec<SimulatedReading>,
    /// For each uncertain parameter whose step can be simulated: readings with the parameter changed by the step, and
    /// the step in standard deviations of the parameter.
    moved: Vec<(Vec<SimulatedReading>, f64)>,
}

/// Distance between the readings that two candidate models predict in an experiment, in standard deviations of the
/// noise, after the parameters of one model are fitted to the readings of the other within their uncertainty.
#[derive(Clone, Debug)]
pub(super) struct Difference {
    /// min over δ of ‖y_A − y_B − J_B δ‖² + ‖δ‖², or the same with A and B exchanged if that is smaller. Readings y are
    /// in standard deviations of their noise, the difference without its mean in each channel; δ is in standard
    /// deviations of the parameters.
    pub(super) squared: f64,
    /// The channel in which the readings of the two candidate models differ most after the fit, in units of its noise.
    pub(super) channel: String,
    /// Root mean square of the two models' difference in that channel after the fit, in standard deviations of the
    /// channel's noise.
    pub(super) times_noise: f64,
}

impl Rival<'_> {
    /// Simulated readings of an experiment if this candidate model is the true machine. A parameter whose changed value
    /// cannot be simulated counts as known.
    ///
    /// # Errors
    /// The experiment cannot be simulated with this candidate model; the error is a sentence.
    pub(super) fn simulated(&self, bench: &Bench<'_>, experiment: &Experiment) -> Result<Predicted, String> {
        let readings = experiment.readings(bench, &self.case(bench.case, None))?;
        let moved = self
            .steps()
            .into_iter()
            .filter_map(|(cause, key, step, deviations)| {
                let case = self.case(bench.case, Some((cause, key, step)));
                Some((experiment.readings(bench, &case).ok()?, deviations))
            })
            .collect();
        Ok(Predicted { readings, moved })
    }

    /// Steps for the uncertain parameters of a candidate model: index of the cause, key of the parameter, step in the
    /// parameter's unit, and step in the parameter's standard deviations.
    fn steps(&self) -> Vec<(usize, &'static str, f64, f64)> {
        let of = |(index, cause): (usize, &EstimatedCause)| {
            let figures: Vec<(&'static str, Figure)> = cause
                .parameters
                .iter()
                .map(|(key, figure)| (*key, *figure))
                .collect();
            figures.into_iter().filter_map(
                move |(
                    key,
                    Figure {
                        value,
                        ci90: [low, high],
                    },
                )| {
                    let deviation = 0.5 * (high - low) / NINETY_PERCENT;
                    let step = deviation.max(LEAST_STEP * value.abs());
                    (deviation > 0.0 && step.is_finite()).then(|| (index, key, step, step / deviation))
                },
            )
        };
        self.causes.iter().enumerate().flat_map(of).collect()
    }

    /// The case extended by these causes. `moved` changes one parameter: index of its cause, key, and step.
    fn case(&self, case: &Case, moved: Option<(usize, &'static str, f64)>) -> Case {
        let tables: Vec<(&str, toml::Table)> = self
            .causes
            .iter()
            .enumerate()
            .map(|(index, cause)| {
                let mut table = cause.extension.clone();
                if let Some((_, key, step)) = moved.filter(|(of, ..)| *of == index) {
                    move_by(&mut table, key, step);
                }
                (cause.name, table)
            })
            .collect();
        let mut extended = case.clone();
        extended
            .extensions
            .extend(joined(tables.iter().map(|(name, table)| (*name, table))));
        extended
    }
}

/// Adds `step` to the number `key` of a table, or to an element of a list (`ratio_2` is the second of `ratio`). A key
/// that restates another parameter is not in the table and changes nothing.
fn move_by(table: &mut toml::Table, key: &str, step: f64) {
    let add = |value: &mut toml::Value| {
        if let toml::Value::Float(number) = value {
            *number += step;
        }
    };
    if let Some(value) = table.get_mut(key) {
        add(value);
        return;
    }
    let numbered = key
        .rsplit_once('_')
        .and_then(|(list, number)| Some((list, number.parse::<usize>().ok()?.checked_sub(1)?)));
    if let Some((list, index)) = numbered
        && let Some(toml::Value::Array(list)) = table.get_mut(list)
        && let Some(value) = list.get_mut(index)
    {
        add(value);
    }
}

/// Distance between the readings of `sensors` that the candidate models `one` and `other` predict: the smaller one of
/// fitting the parameters of either model.
pub(super) fn between(bench: &Bench<'_>, one: &Predicted, other: &Predicted, sensors: Sensors) -> Difference {
    let there = difference(bench, one, other, sensors);
    let back = difference(bench, other, one, sensors);
    if there.squared <= back.squared {
        there
    } else {
        back
    }
}

/// Difference between the readings that the candidate model `truth` and the candidate model `model` predict, after the
/// parameters of `model` are fitted to the readings of `truth` within their uncertainty.
fn difference(bench: &Bench<'_>, truth: &Predicted, model: &Predicted, sensors: Sensors) -> Difference {
    let deviations = bench.deviations(&truth.readings);
    let compared: Vec<usize> = (0..truth.readings.len())
        .filter(|index| truth.readings[*index].is_read_by(sensors))
        .collect();
    let stacked = |a: &[SimulatedReading], b: &[SimulatedReading]| -> DVector<f64> {
        let values = compared.iter().flat_map(|&index| {
            let pairs = a[index].samples.iter().zip(&b[index].samples);
            let difference: Vec<f64> = pairs.map(|(a, b)| (a - b) / deviations[index]).collect();
            // The offsets of sensors are unknown, so the means of the readings are not compared.
            let mean = difference.iter().sum::<f64>() / difference.len().max(1) as f64;
            difference.into_iter().map(move |value| value - mean)
        });
        DVector::from_vec(values.collect())
    };
    let apart = stacked(&truth.readings, &model.readings);
    let columns: Vec<DVector<f64>> = model
        .moved
        .iter()
        .map(|(moved, _)| stacked(moved, &model.readings))
        .collect();
    let steps: Vec<f64> = model.moved.iter().map(|(_, step)| *step).collect();
    let (left, squared) = least(&apart, &columns, &steps);
    let mut from = 0;
    let sizes = compared.iter().map(|&index| {
        let count = truth.readings[index].samples.len();
        let rms = left.rows(from, count).norm() / (count.max(1) as f64).sqrt();
        from += count;
        (index, rms)
    });
    let (index, times_noise) = sizes.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    Difference {
        squared,
        channel: truth
            .readings
            .get(index)
            .map_or_else(String::new, SimulatedReading::described),
        times_noise,
    }
}

/// Difference `apart` − Jδ at the δ that minimizes ‖apart − Jδ‖² + Σ (step·δ)², and that minimum. `columns` are the
/// columns of J. If the fit fails, δ is 0.
pub(super) fn least(apart: &DVector<f64>, columns: &[DVector<f64>], steps: &[f64]) -> (DVector<f64>, f64) {
    if columns.is_empty() {
        return (apart.clone(), apart.norm_squared());
    }
    let jacobian = DMatrix::from_columns(columns);
    let inverse_variances = DVector::from_iterator(steps.len(), steps.iter().map(|step| step * step));
    let fit = LinearProblem::new(&jacobian, apart)
        .with_prior(&DVector::zeros(steps.len()), &inverse_variances)
        .solve();
    let Ok(fit) = fit else {
        return (apart.clone(), apart.norm_squared());
    };
    let step = &fit.parameters;
    let squared = fit.sum_of_squares + step.component_mul(step).dot(&inverse_variances);
    (apart - &jacobian * step, squared)
}
