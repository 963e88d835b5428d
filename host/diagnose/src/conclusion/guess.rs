//! A formula for a residual that no known cause explains.
//!
//! The missing restoring force is Σ cᵢ φᵢ(x, v) with few of many terms in the displacement x and velocity v along one
//! axis each: products of powers x^i v^j, terms with |x|, |v| or the sign of v, and the state z of Bouc–Wen loops with
//! several yield displacements. Forward regression adds the term that reduces χ² most, up to four terms and as long as
//! Schwarz's criterion n ln χ² + k ln n for k terms and n compared values decreases. The quality of the formula is the
//! share of the held-out residual energy that it explains. S. A. Billings, Nonlinear System Identification, 2013, ch. 3
//! (forward regression); S. L. Brunton et al., PNAS 113 (2016) 3932 (sparse regression).

use std::fmt::Write;

use crate::baseline::direction_of;
use crate::candidates::cause::Regressor;
use crate::criteria::LEAST_EXPLAINED_BY_GUESS;
use crate::fit::regression::{Regression, Subset};
use crate::records::study::Study;
use quietcut_simulate::Effects;
use quietcut_simulate::path::{SampledMotion, restoring_along};

/// Largest number of terms of the formula that is guessed for an unexplained restoring force.
const MOST: usize = 4;

/// Exponents (i, j) of the terms x^i·v^j that a guessed restoring force may contain.
const POWERS: [(i32, i32); 16] = [
    (1, 0),
    (0, 1),
    (2, 0),
    (1, 1),
    (0, 2),
    (3, 0),
    (2, 1),
    (1, 2),
    (0, 3),
    (4, 0),
    (2, 2),
    (0, 4),
    (5, 0),
    (4, 1),
    (1, 4),
    (0, 5),
];

/// Yield displacements of the Bouc–Wen loops that a guessed restoring force may contain, as shares of the largest
/// displacement along the axis.
const YIELDS: [f64; 4] = [0.05, 0.15, 0.4, 0.8];

/// One term φ(x, v) of a guessed restoring force along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FormulaTerm {
    Power(i32, i32),
    /// v|v|.
    Drag,
    /// x|x|.
    Bend,
    /// sign v.
    Sign,
    /// |x| sign v.
    Rub,
    /// The state z of a Bouc–Wen loop with this yield displacement, m.
    Loop(f64),
}

/// A guessed formula for the unexplained restoring force, with the share of the held-out residual energy that it
/// explains; `None` if that is less than `LEAST_EXPLAINED_BY_GUESS`, or if no formula is found.
pub(crate) fn guess(study: &Study<'_>, regression: &mut Regression) -> Option<String> {
    let mut all: Vec<(usize, FormulaTerm, usize)> = Vec::new();
    for axis in study.driven_axes() {
        for term in terms(study, axis) {
            if let Some(column) = column(study, axis, term) {
                all.push((axis, term, regression.add(&column)));
            }
        }
    }
    regression.complete();
    let count = regression.count(Subset::Fitted) as f64;
    let price =
        |left: f64, terms: usize| count * left.max(f64::MIN_POSITIVE).ln() + terms as f64 * count.ln();
    let mut chosen: Vec<usize> = Vec::new();
    let mut best = price(regression.residual(Subset::Fitted), 0);
    while chosen.len() < MOST {
        let next = (0..all.len())
            .filter(|index| !chosen.contains(index))
            .filter_map(|index| {
                let columns: Vec<usize> = chosen.iter().chain([&index]).map(|&i| all[i].2).collect();
                Some((index, regression.fit(Subset::Fitted, &columns)?.left))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, left)) = next else { break };
        let new = price(left, chosen.len() + 1);
        if new >= best {
            break;
        }
        best = new;
        chosen.push(index);
    }
    let columns: Vec<usize> = chosen.iter().map(|&index| all[index].2).collect();
    let coefficients = regression.fit(Subset::Fitted, &columns)?.coefficients;
    let left = regression.left(Subset::HeldOut, &columns, coefficients.as_slice());
    let explained = 1.0 - left / regression.residual(Subset::HeldOut).max(f64::MIN_POSITIVE);
    if chosen.is_empty() || explained < LEAST_EXPLAINED_BY_GUESS {
        return None;
    }
    let mut formula = String::new();
    for (index, coefficient) in chosen.iter().zip(coefficients.iter()) {
        let (axis, term, _) = all[*index];
        let name = direction_of(axis).name();
        let sign = if *coefficient < 0.0 { "−" } else { "+" };
        // Writing to a string cannot fail.
        let _ = write!(formula, " {sign} {:.3e}·{}", coefficient.abs(), words(term, name));
    }
    Some(format!(
        "a guess and no cause: a restoring force of{formula} N (x and v in SI) explains {:.0} % of the held-out residual energy",
        100.0 * explained
    ))
}

fn terms(study: &Study<'_>, axis: usize) -> Vec<FormulaTerm> {
    let largest_m = study
        .records
        .iter()
        .map(|record| record.motion.largest_m(axis))
        .fold(0.0, f64::max);
    let powers = POWERS.into_iter().map(|(i, j)| FormulaTerm::Power(i, j));
    let others = [
        FormulaTerm::Drag,
        FormulaTerm::Bend,
        FormulaTerm::Sign,
        FormulaTerm::Rub,
    ];
    let loops = YIELDS
        .into_iter()
        .map(|share| FormulaTerm::Loop(share * largest_m));
    powers.chain(others).chain(loops).collect()
}

/// Contribution of a term of the guessed restoring force to the residual, per unit of its coefficient, by record,
/// channel and sample; `None` if the structure cannot have the term, or if a value is not finite.
fn column(study: &Study<'_>, axis: usize, term: FormulaTerm) -> Option<Vec<Vec<Vec<f64>>>> {
    let columns: Vec<Vec<Vec<f64>>> = study
        .records
        .iter()
        .map(|record| {
            let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| Vec::new());
            if !record.motion.x[axis].is_empty() {
                force[axis] = along(study, &record.motion, axis, term)?;
            }
            Some(Regressor::of_force(force).columns(record))
        })
        .collect::<Option<_>>()?;
    let is_finite = columns
        .iter()
        .flatten()
        .flatten()
        .all(|sample| sample.is_finite());
    is_finite.then_some(columns)
}

fn along(study: &Study<'_>, motion: &SampledMotion, axis: usize, term: FormulaTerm) -> Option<Vec<f64>> {
    let of = |f: &dyn Fn(f64, f64) -> f64| {
        let samples = motion.x[axis].iter().zip(&motion.v[axis]);
        samples.map(|(x, v)| f(*x, *v)).collect()
    };
    Some(match term {
        FormulaTerm::Power(i, j) => of(&|x, v| x.powi(i) * v.powi(j)),
        FormulaTerm::Drag => of(&|_, v| v * v.abs()),
        FormulaTerm::Bend => of(&|x, _| x * x.abs()),
        FormulaTerm::Sign => of(&|_, v| v.signum()),
        FormulaTerm::Rub => of(&|x, v| x.abs() * v.signum()),
        FormulaTerm::Loop(yield_m) => {
            let direction = direction_of(axis);
            let texts = [
                "hysteresis=1".to_owned(),
                format!("hysteresis.yield_m={yield_m:e}"),
                format!("hysteresis.direction={direction}"),
            ];
            // An error means that the structure does not move along this axis: the formula has no such term.
            let effects = Effects::parse(texts.iter().map(String::as_str)).ok()?;
            let terms = effects
                .0
                .first()?
                .restoring_forces(study.baseline.structure)
                .ok()?;
            // The restoring force of a Bouc–Wen effect with unit stiffness is z − x; adding the displacement x gives
            // the state z.
            let difference = restoring_along(&**terms.first()?, motion).into_iter().nth(axis)?;
            difference
                .iter()
                .zip(&motion.x[axis])
                .map(|(z, x)| z + x)
                .collect()
        }
    })
}

fn words(term: FormulaTerm, direction: &str) -> String {
    let power = |name: String, power: i32| match power {
        0 => String::new(),
        1 => name,
        _ => format!("{name}^{power}"),
    };
    let (x, v) = (direction.to_owned(), format!("v{direction}"));
    match term {
        FormulaTerm::Power(i, j) => [power(x, i), power(v, j)]
            .into_iter()
            .filter(|word| !word.is_empty())
            .collect::<Vec<_>>()
            .join("·"),
        FormulaTerm::Drag => format!("{v}·|{v}|"),
        FormulaTerm::Bend => format!("{x}·|{x}|"),
        FormulaTerm::Sign => format!("sign({v})"),
        FormulaTerm::Rub => format!("|{x}|·sign({v})"),
        FormulaTerm::Loop(yield_m) => format!("z(Bouc–Wen along {x}, yield {:.3} µm)", 1e6 * yield_m),
    }
}
