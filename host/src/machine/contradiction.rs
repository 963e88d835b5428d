//! Tried cuts that contradict the stability limits of a case beyond their intervals.

use crate::case::Case;
use crate::criteria::{CONTRADICTED_BEYOND, CONTRADICTION_BY_CHANCE};
use crate::orbit::collocation_of;
use crate::stability::{Method, SpeedLine, Uncertainty};
use crate::trial_cuts::{Call, Outcome, TrialCut, call};

/// Share of the drawn machines whose first limit lies below the 5 % percentile, and of those above the 95 % percentile.
const OUTSIDE: f64 = 0.05;

/// Number of equal steps in axial depth at the speed of a tried cut, as [`Method::line`] takes it.
const SAMPLES: usize = 60;

/// Tried cuts that contradict the limits of a case: more of them than chance explains.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contradiction {
    /// Number of all compared cuts: the tried cuts that were stable or chattered, but not the marginal ones.
    pub(super) cuts: usize,
    /// Tried cuts that contradict the limit, in the order of the table, each with the limit:
    /// `9000 rev/min, 3.20 mm: stable, limit 2.44 mm`.
    pub(super) contradicted: Vec<String>,
}

/// Compares the outcomes of tried cuts with the limits of a case. `None` if no more cuts contradict them than chance
/// explains, or if the stability method refuses the case.
///
/// A cut contradicts the limit at its speed if the case predicts the other outcome, and if the cut chattered at a depth
/// below the 5 % percentile of the first limit, or was stable above the 95 % percentile, by more than
/// [`CONTRADICTED_BEYOND`]. A cut whose limit cannot be computed does not contradict it. If the case is right, a cut
/// contradicts the limit with a probability of at most 5 %, and k or more of n independent cuts do with at most the
/// tail probability of the binomial distribution; `Some` if this is below [`CONTRADICTION_BY_CHANCE`].
pub(super) fn contradiction(case: &Case, cuts: &[TrialCut]) -> Option<Contradiction> {
    let method_of = |case: &Case| collocation_of(case).map_err(|error| error.to_string());
    let method = method_of(case).ok()?;
    let uncertainty = Uncertainty::new(case, &method_of, 1);
    let decided: Vec<&TrialCut> = cuts
        .iter()
        .filter(|cut| cut.outcome != Outcome::Marginal)
        .collect();
    let contradicted: Vec<String> = decided
        .iter()
        .filter_map(|cut| against(method.as_ref(), uncertainty.as_ref(), cut))
        .collect();
    let cuts = decided.len();
    (tail(cuts, contradicted.len()) < CONTRADICTION_BY_CHANCE).then_some(Contradiction { cuts, contradicted })
}

/// The cut and the limit that it contradicts, in words; `None` if it contradicts none, or if the limit or its interval
/// cannot be computed.
fn against(method: &dyn Method, uncertainty: Option<&Uncertainty<'_>>, cut: &TrialCut) -> Option<String> {
    // Limits at larger depths than that of the cut are needed too: a cut with chatter contradicts them.
    let deepest_mm = 2.0 * cut.depth_mm;
    let line = method.line(cut.rpm, deepest_mm, SAMPLES).ok()?;
    if !call(std::slice::from_ref(&line), cut).is_wrong() {
        return None;
    }
    let [low_mm, high_mm] = interval(uncertainty, &line, deepest_mm)?;
    let is_beyond = match call(std::slice::from_ref(&line), cut) {
        Call::MissedChatter => cut.depth_mm * (1.0 + CONTRADICTED_BEYOND) < low_mm,
        _ => cut.depth_mm > high_mm * (1.0 + CONTRADICTED_BEYOND),
    };
    let outcome = match cut.outcome {
        Outcome::Chatter => "chatter",
        _ => "stable",
    };
    let limit = line.first_limit.map_or_else(
        || format!("no limit up to {deepest_mm:.2} mm"),
        |limit| format!("limit {:.2} mm", limit.depth_mm),
    );
    is_beyond.then(|| {
        format!(
            "{:.0} rev/min, {:.2} mm: {outcome}, {limit}",
            cut.rpm, cut.depth_mm
        )
    })
}

/// The 5 % and the 95 % percentile of the first limit, mm; the limit of the case itself twice without `uncertainty`. A
/// value beyond the depth `deepest_mm` is infinite. `None` if the percentiles cannot be computed.
fn interval(uncertainty: Option<&Uncertainty<'_>>, line: &SpeedLine, deepest_mm: f64) -> Option<[f64; 2]> {
    let beyond = |depth_mm: Option<f64>| depth_mm.unwrap_or(f64::INFINITY);
    match uncertainty {
        Some(uncertainty) => {
            let spread = uncertainty.spread(line, deepest_mm, &[]).ok()?;
            let percentiles = spread.limit_percentiles_mm;
            Some([percentiles.low, percentiles.high].map(beyond))
        }
        None => Some([beyond(line.first_limit.map(|limit| limit.depth_mm)); 2]),
    }
}

/// Probability that `least` or more of `cuts` independent cuts contradict their limits, if each does with the
/// probability [`OUTSIDE`].
fn tail(cuts: usize, least: usize) -> f64 {
    let (mut term, mut below) = ((1.0 - OUTSIDE).powf(cuts as f64), 0.0);
    for k in 0..least.min(cuts) {
        below += term;
        term *= (cuts - k) as f64 / (k + 1) as f64 * OUTSIDE / (1.0 - OUTSIDE);
    }
    1.0 - below
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_that_of_the_binomial_distribution() {
        // 1 − 0.95⁵ and 1 − 0.95⁵ − 5·0.05·0.95⁴.
        assert!((tail(5, 1) - 0.226_219).abs() < 1e-6);
        assert!((tail(5, 2) - 0.022_593).abs() < 1e-6);
        assert_eq!(tail(5, 0), 1.0);
        assert_eq!(tail(0, 0), 1.0);
    }

    #[test]
    fn cuts_of_another_machine_contradict_and_cuts_of_this_one_do_not() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/cases/kuka-kr90-acetal.toml"
        );
        let case = Case::read(path).unwrap();
        // Chapter 7: the limit is 3.174 mm at 600 rev/min; 1.664 mm at 800 and 2.041 mm at 1200 rev/min.
        let cut = |rpm, depth_mm, outcome| TrialCut {
            rpm,
            depth_mm,
            outcome,
            chatter_hz: None,
        };
        let agreeing = [
            cut(600.0, 2.5, Outcome::Stable),
            cut(800.0, 2.5, Outcome::Chatter),
            cut(1200.0, 2.1, Outcome::Stable),
            cut(1200.0, 1.0, Outcome::Marginal),
        ];
        assert_eq!(contradiction(&case, &agreeing), None);
        let contradicting = [
            cut(600.0, 1.5, Outcome::Chatter),
            cut(800.0, 2.5, Outcome::Stable),
            cut(1200.0, 1.0, Outcome::Stable),
        ];
        let found = contradiction(&case, &contradicting).unwrap();
        assert_eq!((found.cuts, found.contradicted.len()), (3, 2), "{found:?}");
        assert!(found.contradicted[1].contains("800 rev/min"), "{found:?}");
    }
}
