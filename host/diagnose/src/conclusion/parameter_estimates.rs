//! Causes with estimated parameters and their 90 % intervals.

use nalgebra::DMatrix;
use quietcut_numerics::eigenvalues::of_symmetric;

use crate::baseline::direction_of;
use crate::candidates::cause::{LocatedEffect, Location};
use crate::conclusion::answer::{EstimatedCause, Figure, NINETY_PERCENT};
use crate::criteria::{COMMON_FACTOR_CONFIDENCE, EQUIVALENT};
use crate::fit::candidate_model::CandidateModel;
use crate::fit::covariance::covariance;
use crate::fit::library::{Library, OF_DYNAMIC_STIFFNESS};
use crate::fit::regression::{Regression, Subset};
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

/// The causes of a candidate model with their estimated parameters and 90 % intervals. `inflation` is the factor on the
/// variances for unit-variance noise, `confidence` the confidence in every cause. A cause whose parameters are not
/// physical is left out.
pub(crate) fn parameter_estimates(
    study: &Study<'_>,
    library: &Library,
    regression: &mut Regression,
    model: &CandidateModel,
    inflation: f64,
    confidence: f64,
) -> Vec<EstimatedCause> {
    let covariance = match &model.simulated {
        Some(simulated) => simulated.covariance.clone(),
        None => covariance(study, library, regression, model, inflation),
    };
    let mut all = Vec::new();
    for (position, covariance) in covariance.iter().enumerate() {
        let choice = model.choices[position];
        let candidate = &library.candidates[choice.candidate];
        let cause = library.cause(choice.candidate);
        let nonlinear_parameters = &candidate.variants[choice.variant].0;
        let coefficients = library.coefficients(model, position);
        let parts_of = |inner: &[f64]| -> Option<Vec<LocatedEffect>> {
            let (coefficients, nonlinear_parameters) = inner.split_at(coefficients.len());
            let parameters =
                cause.parameters(study, &candidate.location, nonlinear_parameters, coefficients)?;
            let mut parts = cause.located_effects(&candidate.location, &parameters);
            parts[0]
                .parameters
                .extend(cause.also(study, &candidate.location, &parameters));
            Some(parts)
        };
        let values = |inner: &[f64]| -> Option<Vec<f64>> {
            let parts = parts_of(inner)?;
            Some(
                parts
                    .iter()
                    .flat_map(|part| part.parameters.iter().map(|(_, value)| *value))
                    .collect(),
            )
        };
        let inner: Vec<f64> = coefficients.iter().chain(nonlinear_parameters).copied().collect();
        let (Some(parts), Some(center)) = (parts_of(&inner), values(&inner)) else {
            continue;
        };
        let known = cause.known_deviations(study);
        let mut deviations = deviations(&values, &inner, &center, covariance, inflation).into_iter();
        let moved = moved(&parts_of, &inner, covariance, inflation);
        for (index, part) in parts.into_iter().enumerate() {
            let tables = moved
                .iter()
                .map(|ends| ends.each_ref().map(|parts| parts[index].extension.clone()));
            all.push(EstimatedCause {
                choice: position,
                moved: tables.collect(),
                parameters: part
                    .parameters
                    .iter()
                    .map(|(key, value)| {
                        let fitted = deviations.next().unwrap_or(0.0);
                        let known = known.iter().find(|(known, _)| known == key);
                        (
                            *key,
                            figure(*value, known.map_or(fitted, |(_, deviation)| *deviation)),
                        )
                    })
                    .collect(),
                ..empty(part.name, &part.location, confidence, part.extension)
            });
        }
    }
    all
}

/// The causes mass, stiffness and damping, all changed by one factor, if that explains the records as well as the
/// sensor gain or sensor offset that is the only cause of `best`; otherwise empty.
pub(crate) fn by_common_factor(
    study: &Study<'_>,
    library: &Library,
    regression: &Regression,
    best: &CandidateModel,
    inflation: f64,
) -> Vec<EstimatedCause> {
    let [choice] = best.choices[..] else {
        return Vec::new();
    };
    let of_reading = [EffectName::SensorGain, EffectName::SensorOffsetFromToolTip];
    if !of_reading.contains(&library.cause(choice.candidate).effect()) {
        return Vec::new();
    }
    // For a fair comparison with the common factor on mass, damping and stiffness, χ² of the sensor gain comes from the
    // linear regression along the measured motion too.
    let along = match regression.fit(Subset::Whole, &library.columns_of(best)) {
        Some(fit) => fit.left,
        None => best.fit.left,
    };
    let locations: Vec<Location> = if study.has_modes() {
        vec![Location::Everywhere]
    } else {
        study.driven_axes().into_iter().map(Location::Axis).collect()
    };
    for location in locations {
        let Some((left, change)) = library.common_factor(regression, &location) else {
            continue;
        };
        if (left - along) / inflation > EQUIVALENT {
            continue;
        }
        // The common relative change of mass, damping and stiffness is taken to have the standard deviation of the
        // fitted coefficient of the equivalent sensor gain.
        let deviation = best.fit.covariance[(0, 0)].max(0.0).sqrt() * inflation.sqrt();
        return library
            .candidates
            .iter()
            .filter(|known| known.location == location)
            .filter_map(|known| {
                let cause = &*library.causes[known.cause];
                if !OF_DYNAMIC_STIFFNESS.contains(&cause.effect()) {
                    return None;
                }
                let of = |change: f64| cause.parameters(study, &known.location, &[], &[change]);
                let parameters = of(change)?;
                let (key, value) = *parameters.first()?;
                // Each reported parameter of mass, stiffness and damping is linear in the relative change, so one slope
                // converts the standard deviation of the change into that of the parameter.
                let (_, beyond) = *of(change + 1.0)?.first()?;
                let scale = beyond - value;
                let extension = cause.extension(&known.location, &parameters);
                Some(EstimatedCause {
                    parameters: [(key, figure(value, scale * deviation))].into(),
                    ..empty(cause.name(), &known.location, COMMON_FACTOR_CONFIDENCE, extension)
                })
            })
            .collect();
    }
    Vec::new()
}

fn empty(name: &'static str, location: &Location, confidence: f64, extension: toml::Table) -> EstimatedCause {
    EstimatedCause {
        name,
        confidence,
        direction: location.direction().map(|direction| direction.name()),
        directions: match location {
            Location::Axes(a, b) => Some([direction_of(*a).name(), direction_of(*b).name()]),
            _ => None,
        },
        channel: location.channel().map(String::from),
        parameters: std::collections::BTreeMap::new(),
        extension,
        choice: 0,
        moved: Vec::new(),
    }
}

fn figure(value: f64, deviation: f64) -> Figure {
    Figure {
        value,
        ci90: [
            value - NINETY_PERCENT * deviation,
            value + NINETY_PERCENT * deviation,
        ],
    }
}

/// The effects of a cause with their parameters at both ends of the 90 % interval along each principal direction of the
/// correlation of the fitted parameters `inner`. Parameters that are not physical there are replaced by the estimate.
fn moved(
    parts_of: &dyn Fn(&[f64]) -> Option<Vec<LocatedEffect>>,
    inner: &[f64],
    covariance: &DMatrix<f64>,
    inflation: f64,
) -> Vec<[Vec<LocatedEffect>; 2]> {
    // The principal directions are those of the correlation matrix, not of the covariance, because the fitted
    // parameters have different units.
    let scales: Vec<f64> = covariance
        .diagonal()
        .iter()
        .map(|variance| variance.max(0.0).sqrt())
        .collect();
    let of = |i: usize, j: usize| match scales[i] * scales[j] {
        0.0 => 0.0,
        scale => covariance[(i, j)] / scale,
    };
    let correlation = DMatrix::from_fn(scales.len(), scales.len(), of);
    let (Some(center), Ok(correlation)) = (parts_of(inner), of_symmetric(correlation)) else {
        return Vec::new();
    };
    correlation
        .eigenvalues
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > 0.0)
        .map(|(direction, value)| {
            [-1.0, 1.0].map(|sign| {
                let size = sign * NINETY_PERCENT * (inflation * value).sqrt();
                let along = correlation.eigenvectors.column(direction);
                let moves = inner.iter().zip(along.iter().zip(&scales));
                let moved: Vec<f64> = moves
                    .map(|(inner, (along, scale))| inner + size * along * scale)
                    .collect();
                parts_of(&moved)
                    .filter(|parts| parts.len() == center.len())
                    .unwrap_or_else(|| center.clone())
            })
        })
        .collect()
}

/// Standard deviations of the reported parameters `values`, from the covariance of the fitted parameters `inner` and
/// numerical derivatives of the former by the latter.
fn deviations(
    values: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
    inner: &[f64],
    center: &[f64],
    covariance: &DMatrix<f64>,
    inflation: f64,
) -> Vec<f64> {
    let mut gradient = vec![vec![0.0; inner.len()]; center.len()];
    for index in 0..inner.len() {
        let step = 1e-6 * inner[index].abs().max(1e-300);
        let mut moved = inner.to_vec();
        moved[index] += step;
        if let Some(moved) = values(&moved) {
            for (parameter, value) in moved.iter().enumerate() {
                gradient[parameter][index] = (value - center[parameter]) / step;
            }
        }
    }
    gradient
        .iter()
        .map(|gradient| {
            let mut variance = 0.0;
            for i in 0..covariance.nrows() {
                for j in 0..covariance.nrows() {
                    variance += gradient[i] * gradient[j] * covariance[(i, j)];
                }
            }
            (variance.max(0.0) * inflation).sqrt()
        })
        .collect()
}
