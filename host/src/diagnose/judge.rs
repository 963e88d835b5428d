//! From evidence to an answer.

use super::Options;
use super::answer::{Diagnosis, Figure, Gain, NamedCause, Outcome, Quality, Unexplained};
use super::cause::Place;
use super::evidence::{Choice, Explanation, Library, gain};
use super::regression::{Regression, Share};
use super::scene::{Scene, direction_of};

/// A normal deviate is within this many deviations with 90 %.
const NINETY_PERCENT: f64 = 1.644_853_626_951_472_6;
/// What a cause must gain to be believed (twice the logarithm of the likelihood, less the price of its parameters).
const BELIEVED: f64 = 20.0;
/// Two explanations whose gains differ by less are not told apart.
const APART: f64 = 12.0;
/// Share of the residual that may be left by a right explanation for reasons of sampling alone.
const SAMPLING: f64 = 1e-3;

pub(super) fn judge(scene: &Scene<'_>, _options: &Options) -> Diagnosis {
    let mut regression = Regression::new(scene);
    let mut library = Library::new(scene, &mut regression);
    let inflation = inflation(&regression);
    let found = select(scene, &mut library, &mut regression, inflation);
    tracing::debug!(inflation, "evidence");
    answer(scene, &library, &regression, inflation, &found)
}

/// How much what the whole library leaves is above the noise.
fn inflation(regression: &Regression) -> f64 {
    let count = regression
        .count(Share::Fitted)
        .saturating_sub(regression.columns())
        .max(1);
    (regression.left_by_all() / count as f64).max(1.0)
}

/// What was selected: the best explanation, and those that are as good with as many causes.
struct Selection {
    best: Option<Explanation>,
    others: Vec<Explanation>,
}

fn select(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    inflation: f64,
) -> Selection {
    let mut selection = Selection {
        best: None,
        others: Vec::new(),
    };
    let mut reached = 0.0;
    let whole = regression.residual(Share::Fitted) / inflation;
    let noise = regression.count(Share::Fitted) as f64;
    let mut pairs = Vec::new();
    for size in 1..=3 {
        let excess = (whole - noise).max(0.0);
        let left = selection
            .best
            .as_ref()
            .map_or(whole, |best| best.fit.left / inflation);
        // What is left is noise, or so little of what there was that sampling alone may leave it.
        if left - noise < 4.0 * (2.0 * noise).sqrt() || (size > 1 && left - noise < SAMPLING * excess) {
            // A residual within the noise may still have a known shape: one cause is always tried.
            if size > 1 {
                break;
            }
        }
        let mut found = match size {
            1 => library.singles(scene, regression),
            2 => library.pairs(scene, regression),
            _ => library.triples(scene, regression, &pairs),
        };
        refine(scene, library, regression, &mut found);
        if size == 2 {
            pairs = found.clone();
        }
        let Some(best) = found.first() else { break };
        let gained = gain(regression, best, inflation);
        if gained < reached + BELIEVED {
            continue;
        }
        reached = gained;
        selection.others = found[1..]
            .iter()
            .filter(|other| gained - gain(regression, other, inflation) < APART)
            .cloned()
            .collect();
        selection.best = Some(best.clone());
    }
    selection
}

/// Refines the shapes of the best few explanations by a search along each of their parameters.
fn refine(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    found: &mut Vec<Explanation>,
) {
    let Some(best) = found.first().map(|best| best.fit.left) else {
        return;
    };
    let whole = regression.residual(Share::Fitted);
    let worth: Vec<usize> = (0..found.len())
        .filter(|index| whole - found[*index].fit.left > 0.5 * (whole - best))
        .take(6)
        .collect();
    for index in worth {
        let mut explanation = found[index].clone();
        for place in 0..explanation.choices.len() {
            explanation = refine_one(scene, library, regression, explanation, place);
        }
        found[index] = explanation;
    }
    found.sort_by(|a, b| a.fit.left.total_cmp(&b.fit.left));
}

fn refine_one(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    mut explanation: Explanation,
    place: usize,
) -> Explanation {
    let candidate = explanation.choices[place].candidate;
    let bounds = library
        .cause(candidate)
        .bounds(scene, &library.candidates[candidate].place);
    let mut steps: Vec<f64> = bounds.iter().map(|_| 0.25).collect();
    for _ in 0..7 {
        for parameter in 0..bounds.len() {
            let [low, high] = bounds[parameter];
            let shape = library.candidates[candidate].shapes[explanation.choices[place].shape]
                .0
                .clone();
            let mut improved = false;
            for sign in [1.0, -1.0] {
                let mut moved = shape.clone();
                let step = sign * steps[parameter];
                // Sizes are moved by factors, what may be zero by shares of its range.
                moved[parameter] = if low > 0.0 {
                    shape[parameter] * (1.0 + step)
                } else {
                    shape[parameter] + step * (high - low)
                }
                .clamp(low, high);
                let Some(choice) = library.add_shape(scene, regression, candidate, moved) else {
                    continue;
                };
                let mut choices = explanation.choices.clone();
                choices[place] = choice;
                if let Some(better) = library
                    .explain(scene, regression, &choices)
                    .filter(|tried| tried.fit.left < explanation.fit.left)
                {
                    explanation = better;
                    improved = true;
                    break;
                }
            }
            if !improved {
                steps[parameter] *= 0.4;
            }
        }
    }
    explanation
}

fn answer(
    scene: &Scene<'_>,
    library: &Library,
    regression: &Regression,
    inflation: f64,
    selection: &Selection,
) -> Diagnosis {
    let held_out = regression.residual(Share::HeldOut);
    let count = regression.count(Share::HeldOut) as f64;
    let size = measured_size(scene, regression);
    let quality = |left: f64| Quality {
        nrmse_heldout: (left / count).sqrt() / size,
    };
    let mut diagnosis = Diagnosis {
        outcome: Outcome::None,
        baseline: quality(held_out),
        causes: Vec::new(),
        equivalent: Vec::new(),
        extended: None,
        gain: None,
        unexplained: Unexplained {
            fraction: 0.0,
            place: "none above noise".into(),
            guess: None,
        },
        next_test: None,
        warnings: Vec::new(),
        acting: 0,
    };
    let Some(best) = &selection.best else {
        return diagnosis;
    };
    diagnosis.outcome = if selection.others.is_empty() {
        Outcome::Cause
    } else {
        Outcome::Confounded
    };
    diagnosis.causes = named(scene, library, best, inflation);
    diagnosis.acting = diagnosis.causes.len();
    for other in &selection.others {
        for cause in named(scene, library, other, inflation) {
            if !diagnosis.causes.iter().any(|known| known.name == cause.name) {
                diagnosis.causes.push(cause);
            }
        }
    }
    diagnosis.extended = Some(quality(best.fit.left_held_out));
    let excess = (held_out - count).max(1e-9 * held_out);
    let left = best.fit.left_held_out - count;
    diagnosis.gain = Some(Gain {
        residual_energy_removed: (1.0 - left / excess).min(1.0),
    });
    diagnosis.unexplained.fraction = (left / excess).max(0.0);
    diagnosis
}

/// Root mean square of the measured channels in units of their noise.
fn measured_size(scene: &Scene<'_>, _: &Regression) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for record in &scene.records {
        for channel in &record.channels {
            sum += channel
                .measured
                .iter()
                .map(|x| (x / channel.deviation).powi(2))
                .sum::<f64>();
            count += channel.measured.len();
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

fn named(scene: &Scene<'_>, library: &Library, explanation: &Explanation, inflation: f64) -> Vec<NamedCause> {
    let Some(parameters) = library.parameters(scene, explanation) else {
        return Vec::new();
    };
    let mut from = 0;
    explanation
        .choices
        .iter()
        .zip(parameters)
        .map(|(choice, parameters)| {
            let candidate = &library.candidates[choice.candidate];
            let cause = library.cause(choice.candidate);
            let coefficients = candidate.shapes[choice.shape].1.len();
            let range = from..from + coefficients;
            from += coefficients;
            let deviations = deviations(scene, library, explanation, *choice, range, inflation);
            let place = &candidate.place;
            let figure = |value: f64, deviation: f64| Figure {
                value,
                ci90: [
                    value - NINETY_PERCENT * deviation,
                    value + NINETY_PERCENT * deviation,
                ],
            };
            NamedCause {
                name: cause.name(),
                confidence: 0.95,
                direction: place.direction().map(|direction| direction.name()),
                directions: match place {
                    Place::Axes(a, b) => Some([direction_of(*a).name(), direction_of(*b).name()]),
                    _ => None,
                },
                channel: place.channel().map(String::from),
                parameters: parameters
                    .iter()
                    .zip(&deviations)
                    .map(|((key, value), deviation)| (*key, figure(*value, *deviation)))
                    .collect(),
                extension: cause.extension(place, &parameters),
            }
        })
        .collect()
}

/// Standard deviations of the parameters of a choice, by differences.
fn deviations(
    scene: &Scene<'_>,
    library: &Library,
    explanation: &Explanation,
    choice: Choice,
    range: std::ops::Range<usize>,
    inflation: f64,
) -> Vec<f64> {
    let candidate = &library.candidates[choice.candidate];
    let cause = library.cause(choice.candidate);
    let shape = &candidate.shapes[choice.shape].0;
    let coefficients = &explanation.fit.coefficients[range.clone()];
    let values = |coefficients: &[f64]| cause.parameters(scene, &candidate.place, shape, coefficients);
    let Some(center) = values(coefficients) else {
        return Vec::new();
    };
    let mut gradient = vec![vec![0.0; coefficients.len()]; center.len()];
    for index in 0..coefficients.len() {
        let step = 1e-6 * coefficients[index].abs().max(1e-300);
        let mut moved = coefficients.to_vec();
        moved[index] += step;
        if let Some(moved) = values(&moved) {
            for (parameter, (_, value)) in moved.iter().enumerate() {
                gradient[parameter][index] = (value - center[parameter].1) / step;
            }
        }
    }
    gradient
        .iter()
        .map(|gradient| {
            let mut variance = 0.0;
            for (i, a) in gradient.iter().enumerate() {
                for (j, b) in gradient.iter().enumerate() {
                    variance += a * b * explanation.fit.covariance[(range.start + i, range.start + j)];
                }
            }
            (variance.max(0.0) * inflation).sqrt()
        })
        .collect()
}
