//! The baseline nearest to the records within what its case states as uncertain: where candidate models start.

use nalgebra::DVector;

use crate::baseline::uncertain::Uncertain;
use crate::criteria::NOISE_TOLERANCE;
use crate::fit::regression::{Regression, Subset};
use crate::records::study::Study;
use quietcut_model::case::Case;
use quietcut_recording::Recording;

/// Farthest start, in standard deviations, if uncertain parameters alone do not explain the records: causes may then draw them
/// anywhere.
const FARTHEST: f64 = 3.0;

/// Largest number of steps.
const STEPS: usize = 8;

/// Decrease of χ² by a step that ends the search: a tenth of a standard deviation of one parameter.
const SETTLED: f64 = 0.01;

/// Shares of a step that are tried.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// χ² at a point, and the step that a linear fit promises.
struct Point {
    left: f64,
    promised: f64,
    step: DVector<f64>,
    /// Number of compared values.
    count: usize,
}

/// The case near the most probable values of its uncertain parameters if it has no cause, and these values. If they do not explain
/// the records, it is no farther than [`FARTHEST`] from what it states. Gauss and Newton's method, with the prediction of the records computed anew in each step.
pub(crate) fn nearest_baseline(
    case: &Case,
    recordings: &[Recording],
    uncertain: Uncertain,
) -> (Case, Uncertain) {
    let mut there = uncertain.clone();
    let mut nearest = case.clone();
    let mut point = point(&nearest, recordings, &there);
    for _ in 0..STEPS {
        let Some(now) = point.as_ref().filter(|now| now.promised > SETTLED) else {
            break;
        };
        let next = SHARES.into_iter().find_map(|share| {
            let at = &there.at + share * &now.step;
            let moved = there.moved(&nearest, &at)?;
            let further = Uncertain { at, ..there.clone() };
            let next = self::point(&moved, recordings, &further)?;
            (next.left < now.left).then_some((moved, further, next))
        });
        let Some((moved, further, next)) = next else { break };
        (nearest, there, point) = (moved, further, Some(next));
    }
    let explains = point.is_some_and(|point| {
        point.left - there.at.norm_squared() < (1.0 + NOISE_TOLERANCE) * point.count as f64
    });
    let farthest = if explains { f64::INFINITY } else { FARTHEST };
    let at = there.at.map(|z| z.clamp(-farthest, farthest));
    let started = there.moved(&nearest, &at);
    let start = Uncertain {
        at,
        nearest: there.at,
        ..uncertain.clone()
    };
    match started {
        Some(case) => (case, start),
        None => (case.clone(), uncertain),
    }
}

fn point(case: &Case, recordings: &[Recording], uncertain: &Uncertain) -> Option<Point> {
    let study = Study::uncertain(case, recordings, uncertain.clone()).ok()?;
    let regression = Regression::new(&study);
    let (left, promised) = regression.at_baseline();
    let (step, _) = regression.after(&[], None)?;
    Some(Point {
        left,
        promised,
        step,
        count: regression.count(Subset::Whole),
    })
}
