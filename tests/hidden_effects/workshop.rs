//! Puzzles of cuts in a workshop: the baseline is drawn from its uncertainty, and nothing is drawn again because it is hard.

use quietcut::case::Case;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, EffectKind};
use super::cut::CutBench;
use super::machine::between;
use super::oracle::{Lab, Verdict};
use super::plainness::Plainness;
use super::puzzle::{Family, Hidden, Puzzle, describe, rms};

/// Range of the sensor noise, as a share of the signal.
const NOISE: [f64; 2] = [1e-3, 0.03];
/// Ratio that stands for an effect whose plainness is measured otherwise.
const PLAIN_RATIO: f64 = f64::INFINITY;

/// The puzzle of a seed of any family.
pub(crate) fn draw(family: Family, seed: u64) -> Puzzle {
    if matches!(family, Family::CuttingInWorkshop | Family::NothingInWorkshop) {
        in_workshop(family, seed)
    } else {
        Puzzle::draw(family, seed)
    }
}

/// The puzzle of a seed in a workshop.
///
/// A draw is repeated only if the machine is unstable with its effect, or the effect cannot act on it.
fn in_workshop(family: Family, seed: u64) -> Puzzle {
    (0..)
        .find_map(|again| {
            let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + seed * 1000 + again);
            let mut puzzle = try_draw(family, seed, &mut random)?;
            puzzle.redrawn = again as usize;
            Some(puzzle)
        })
        .unwrap()
}

fn try_draw(family: Family, seed: u64, random: &mut ChaCha8Rng) -> Option<Puzzle> {
    let forces = random.random::<f64>() < 0.6;
    let bench = CutBench::draw(random, forces).in_workshop(random);
    let hidden = if family == Family::NothingInWorkshop {
        Vec::new()
    } else {
        vec![hide(&bench, random)?]
    };
    let disturbed = bench.disturbed(&hidden);
    let is_bounded = |sensed: &Vec<Vec<f64>>| sensed.iter().flatten().all(|value| value.is_finite());
    if !disturbed.iter().all(is_bounded) || bench.grows(&disturbed) {
        return None;
    }
    let sensors = disturbed[0].len() - 1;
    let share = between(random, NOISE[0], NOISE[1]);
    let sigma: Vec<f64> = (0..sensors)
        .map(|sensor| share * rms(disturbed.iter().map(|run| &run[sensor][..])))
        .collect();
    let name = format!("{}-{seed}", family.name());
    let recordings = bench.recordings(&disturbed, &sigma, random, &name);
    let (distance, verdict) = match &hidden[..] {
        [one] if one.kind != EffectKind::SpeedFluctuation => {
            Plainness::new(&bench, &disturbed, &recordings).verdict(one, random)
        }
        [] => (0.0, Verdict::Invisible),
        // The orders do not show it: it is counted by nobody.
        _ => (0.0, Verdict::Borderline),
    };
    let case_text = bench.case_text();
    Some(Puzzle {
        family,
        seed,
        case: Case::parse("baseline.toml".as_ref(), &case_text).unwrap(),
        case_text,
        recordings,
        ratios: hidden.iter().map(|_| PLAIN_RATIO).collect(),
        hidden: hidden
            .iter()
            .map(|cause| Hidden {
                distance,
                ..describe(cause, &bench)
            })
            .collect(),
        verdict,
        redrawn: 0,
    })
}

fn hide(bench: &CutBench, random: &mut ChaCha8Rng) -> Option<Cause> {
    let kind = *bench.kinds().choose(random)?;
    let (axis, sensor) = *bench.places(kind).choose(random)?;
    Some(Cause {
        kind,
        axis,
        sensor,
        shares: kind.draw(random),
    })
}
