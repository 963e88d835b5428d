//! Modes from chatter: trial cuts of a random machine, with the oracle of semi-discretization.

use std::f64::consts::TAU;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::cutting::inverse_stability::{CutErrors, InverseMode, PriorFactors, modes};
use crate::cutting::observed_cut::ObservedCut;
use quietcut_model::case::Case;
use quietcut_stability::{CubicTerms, Method, Pitched, Problem, Sdm, SdmOrder, SemiDiscretization};
use quietcut_testkit::rates::assert_share;
use quietcut_testkit::results::Campaign;
use quietcut_testkit::slice;

const ERRORS: CutErrors = CutErrors {
    depth: 0.02,
    frequency: 0.003,
};

/// A tool that is flexible in x, at half immersion.
fn case(hz: f64, damping: f64, stiffness: f64) -> Case {
    let mass = stiffness / (TAU * hz).powi(2);
    let text = format!(
        "[structure]\nkind = \"matrices\"\ndirections = [\"x\"]\nmass = [[{mass:e}]]\ndamping = [[{:e}]]\nstiffness = [[{stiffness:e}]]\n\
         [tool]\nteeth = 2\nedge_angle_deg = 90.0\n[material]\nktc_mpa = 600.0\nkrc_mpa = 200.0\nkac_mpa = 0.0\n\
         [cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n",
        2.0 * damping * (stiffness * mass).sqrt()
    );
    Case::parse(Path::new("machine.toml"), &text).unwrap()
}

const GUESS: (f64, f64, f64) = (900.0, 0.02, 1.5e6);

/// True frequency, damping ratio and stiffness, drawn by a seed within the prior.
fn truth(random: &mut ChaCha8Rng) -> (f64, f64, f64) {
    let PriorFactors {
        frequency,
        damping,
        stiffness,
    } = PriorFactors::default();
    let mut around = |value: f64, factor: f64| value * factor.powf(random.random_range(-0.9..0.9));
    (
        around(GUESS.0, frequency),
        around(GUESS.1, damping),
        around(GUESS.2, stiffness),
    )
}

/// Trial cuts: at each speed the depth grows by an eighth until the cut chatters, and the last two cuts are recorded. Depths and
/// frequencies have errors.
fn cuts(
    (hz, damping, stiffness): (f64, f64, f64),
    speeds: &[f64],
    random: &mut ChaCha8Rng,
) -> Vec<ObservedCut> {
    let case = case(hz, damping, stiffness);
    let machine = Sdm {
        pitched: Pitched::new(&case, CubicTerms::LeaveOut).unwrap(),
        discretization: SemiDiscretization(SdmOrder::First),
        steps: 120,
    };
    let mut cuts = Vec::new();
    for &rpm in speeds {
        let mut last = None;
        // The first depth is random.
        let mut depth_mm = 0.02 * random.random_range(1.0..1.125);
        while depth_mm < 30.0 {
            let error: f64 = StandardNormal.sample(random);
            let real_mm = depth_mm * (1.0 + ERRORS.depth * error);
            let multiplier = machine.multiplier(rpm, real_mm).unwrap();
            let mut cut = ObservedCut {
                rpm,
                depth_mm,
                chatters: multiplier.norm() > 1.0,
                chatter_hz: None,
            };
            if cut.chatters {
                let error: f64 = StandardNormal.sample(random);
                let chatter_hz = machine.point(rpm, real_mm).unwrap().chatter_hz;
                cut.chatter_hz = chatter_hz.map(|hz| hz * (1.0 + ERRORS.frequency * error));
                cuts.extend(last);
                cuts.push(cut);
                break;
            }
            last = Some(cut);
            depth_mm *= 1.125;
        }
    }
    cuts
}

fn posteriors(cuts: &[ObservedCut], seed: u64) -> InverseMode {
    let start = Problem::new(&case(GUESS.0, GUESS.1, GUESS.2), CubicTerms::Refuse).unwrap();
    modes(&start, cuts, ERRORS, PriorFactors::default(), seed).unwrap()[0]
}

const SPEEDS: [f64; 5] = [9000.0, 11_000.0, 13_500.0, 17_000.0, 22_000.0];

/// For frequency, damping and stiffness: share of seeds whose interval contains the truth, and mean width of the interval.
fn coverage(speeds: &[f64], seeds: u64) -> [(f64, f64); 3] {
    let of_seed = |seed: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let truth = truth(&mut random);
        let mode = posteriors(&cuts(truth, speeds, &mut random), seed);
        [
            (truth.0, mode.frequency_hz),
            (truth.1, mode.damping_ratio),
            (truth.2, mode.stiffness_n_per_m),
        ]
        .map(|(truth, spread)| {
            let [low, high] = spread.ci90;
            (low <= truth && truth <= high, (high / low).ln())
        })
    };
    let all: Vec<[(bool, f64); 3]> = (0..seeds).into_par_iter().map(of_seed).collect();
    std::array::from_fn(|index| {
        let held = all.iter().filter(|posterior| posterior[index].0).count() as f64;
        let width: f64 = all.iter().map(|posterior| posterior[index].1).sum();
        (held / seeds as f64, width / seeds as f64)
    })
}

const PARAMETERS: [&str; 3] = ["frequency", "damping ratio", "stiffness"];

/// Prints the coverage and mean relative width of the intervals of each parameter. Returns them, with the mean coverage.
fn measured(speeds: &[f64], seeds: u64) -> ([(f64, f64); 3], f64) {
    let found = coverage(speeds, seeds);
    for (name, (held, width)) in PARAMETERS.iter().zip(found) {
        println!(
            "seeds 0 to {}, {} speeds: {name} held {:.0} %, interval {:.1} % wide",
            seeds - 1,
            speeds.len(),
            100.0 * held,
            100.0 * width
        );
    }
    let mean = found.iter().map(|(held, _)| held).sum::<f64>() / 3.0;
    println!("all {:.1} %", 100.0 * mean);
    (found, mean)
}

/// Asserts for each parameter that its 90 % interval contains the truth as often as it claims.
fn check(found: [(f64, f64); 3], seeds: u64) {
    for (name, (held, _)) in PARAMETERS.iter().zip(found) {
        let hits = (held * seeds as f64).round() as usize;
        assert_share(
            &format!("seeds 0 to {}: {name}", seeds - 1),
            0.9,
            hits,
            seeds as usize,
        );
    }
}

#[test]
fn a_few_cuts_identify_the_mode_and_one_does_not() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let truth = (922.0, 0.011, 1.34e6);
    let all = cuts(truth, &SPEEDS, &mut random);
    let mode = posteriors(&all, 7);
    for (truth, spread) in [
        (truth.0, mode.frequency_hz),
        (truth.1, mode.damping_ratio),
        (truth.2, mode.stiffness_n_per_m),
    ] {
        // Twice the half-width: a correct interval misses the truth once in a thousand times.
        let [low, high] = spread.ci90;
        let (middle, half) = ((low * high).sqrt(), (high / low).sqrt());
        assert!(
            (truth / middle).ln().abs() < 2.0 * half.ln(),
            "{truth} {spread:?}"
        );
    }
    assert!(
        !mode.frequency_hz.is_vague() && !mode.damping_ratio.is_vague(),
        "{mode:?}"
    );
    // One stable cut carries little information, and the answer reports vague parameters.
    let one = posteriors(&all[..1], 7);
    assert!(
        one.damping_ratio.is_vague() && one.stiffness_n_per_m.is_vague(),
        "{one:?}"
    );
}

/// A seeded slice of the campaign: the claimed coverage of 90 % lies in the 99.9 % binomial interval of each share.
#[test]
fn intervals_of_a_few_machines_hold_the_truth_as_often_as_they_say() {
    let seeds = slice(3, 10);
    check(coverage(&SPEEDS, seeds), seeds);
}

#[test]
#[ignore = "a campaign: QUIETCUT_SEEDS seeds, a hundred without it"]
fn coverage_of_inverse_stability() {
    let seeds = std::env::var("QUIETCUT_SEEDS")
        .ok()
        .and_then(|seeds| seeds.parse().ok())
        .unwrap_or(100);
    let (many, mean_of_many) = measured(&SPEEDS, seeds);
    let (few, mean_of_few) = measured(&SPEEDS[1..2], seeds);
    let mut figures = Vec::new();
    for (speeds, found) in [(SPEEDS.len(), many), (1, few)] {
        for (name, (held, width)) in PARAMETERS.iter().zip(found) {
            figures.push((
                format!("90 % interval of the {name} from trial cuts, speeds: {speeds}"),
                format!(
                    "holds the truth in {:.0} %, {:.1} % wide in the mean",
                    100.0 * held,
                    100.0 * width
                ),
            ));
        }
    }
    Campaign {
        name: "inverse-stability",
        title: "A mode from trial cuts with and without chatter",
        command: &format!(
            "QUIETCUT_SEEDS={seeds} cargo test --release -p quietcut-identify --lib -- --ignored --nocapture coverage_of_inverse_stability"
        ),
        seeds: &format!("0 to {}", seeds - 1),
    }
    .record(&figures);
    check(many, seeds);
    check(few, seeds);
    for mean in [mean_of_many, mean_of_few] {
        assert!((0.85..=0.95).contains(&mean), "{mean}");
    }
    for (many, few) in many.iter().zip(few) {
        assert!(few.1 > many.1, "{many:?} {few:?}");
    }
}
