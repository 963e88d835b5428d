//! Stated errors of limits: against multipliers from Taylor series, and for discretizations against the default method.

use num_complex::Complex64;

use crate::error::{Breakdown, NO_SOLUTION};
use crate::limits::line::line_of;
use crate::spectrum::along_depth::Spectrum;
use crate::spectrum::collocated::Collocated;
use crate::spectrum::crossing::Crossing;
use crate::tests::taylor::{Series, largest_abs};
use crate::tests::{problem, random_case, rpm_of};
use crate::*;

/// Absolute value |μ| of the largest multiplier from Taylor series, with an error of 1e-9.
fn reference(problem: &Problem, rpm: f64, depth_mm: f64) -> f64 {
    largest_abs(problem, rpm, depth_mm * 1e-3, Series::FINE)
        .unwrap()
        .0
}

/// Checks that limits lie within their stated errors: at the distance of the error |μ| from Taylor series is below 1 on
/// the stable side and above 1 on the other. Returns the number of switches.
fn check(problem: &Problem, rpm: f64, depth_mm: f64) -> usize {
    let found = line(problem, rpm, depth_mm, 40).unwrap();
    for [from, to] in &found.stable_mm {
        for (end, outward) in [(*from, -1.0), (*to, 1.0)] {
            let Some(switch) = found.switches.iter().find(|switch| switch.depth_mm == end) else {
                continue;
            };
            let error_mm = switch.error_mm.unwrap();
            let inside = reference(problem, rpm, end - outward * error_mm);
            let outside = reference(problem, rpm, end + outward * error_mm);
            assert!(
                inside < 1.0 && outside > 1.0,
                "{inside} {outside} {switch:?} {rpm}"
            );
            let band = found.undecided_mm.iter();
            let mut around = band.filter(|band| band[0] < end && end < band[1]);
            assert!(around.next().is_some(), "{found:?}");
        }
    }
    found.switches.len()
}

#[test]
fn the_limits_of_the_thesis_lie_within_their_errors() {
    let full = problem("kuka-kr90-full");
    for tau in [1.34, 2.0, 2.7, 2.9, 3.13, 4.0, 6.0, 6.4] {
        assert!(check(&full, rpm_of(tau), 12.0) > 0);
    }
    let acetal = problem("kuka-kr90-acetal");
    for rpm in [
        600.0, 800.0, 900.0, 1036.0, 1050.0, 1100.0, 1200.0, 1600.0, 2000.0, 2400.0,
    ] {
        assert!(check(&acetal, rpm, 6.0) > 0);
    }
    assert!(check(&problem("staubli-tx200"), 500.0, 2.0) > 0);
    let limit = line(&acetal, 1200.0, 6.0, 40).unwrap().first_limit.unwrap();
    // Stated errors are small enough to be useful: with d|μ|/dw of about 0.1/mm an error of 1e-7 of |μ| is 1e-6 mm.
    assert!(limit.error_mm.unwrap() < 1e-5, "{limit:?}");
}

/// Fig. 6.4: at half immersion there is an island of period doubling near 1/τ = 0.11, which contains (τ, w) = (8.7,
/// 0.16).
#[test]
fn the_flip_island_of_half_immersion_is_found_and_closed() {
    /// Dimensionless depth w of chapter 6 per mm of axial depth.
    const PER_MM: f64 = 0.033_628;
    let half = problem("kuka-kr90-half");
    let flips_mm = |tau: f64| -> Vec<f64> {
        let found = line(&half, rpm_of(tau), 12.0, 40).unwrap();
        let flips = found
            .switches
            .iter()
            .filter(|switch| switch.kind == StabilityLoss::Flip);
        flips.map(|switch| switch.depth_mm).collect()
    };
    let reaches: Vec<(f64, [f64; 2])> = (0..60)
        .map(|i| 0.105 + 0.0003 * f64::from(i))
        .filter_map(|inverse| match flips_mm(inverse.recip())[..] {
            [] => None,
            [from, to] => Some((inverse, [from, to])),
            ref other => panic!("1/τ = {inverse}: {other:?}"),
        })
        .collect();
    // The island covers one interval of speeds and is lower at both tips than in its middle.
    let (first, last) = (reaches[0], reaches[reaches.len() - 1]);
    assert!(0.1105 < first.0 && first.0 < 0.1120 && 0.1160 < last.0 && last.0 < 0.1180);
    assert!(((last.0 - first.0) / 0.0003 - (reaches.len() - 1) as f64).abs() < 0.5);
    let height = |(_, [from, to]): &(f64, [f64; 2])| to - from;
    let highest = reaches.iter().map(height).fold(0.0, f64::max);
    assert!(
        height(&first) < 0.7 * highest && height(&last) < 0.7 * highest,
        "{reaches:?}"
    );
    for (inverse, [from, to]) in reaches {
        let rpm = rpm_of(inverse.recip());
        // The oracle of Taylor series finds the cut unstable within the island and stable below it.
        let inside = reference(&half, rpm, 0.5 * (from + to));
        let below = reference(&half, rpm, from - 0.01);
        assert!(inside > 1.0 && below < 1.0, "1/τ = {inverse}: {inside} {below}");
    }
    let [from, to] = flips_mm(8.7)[..] else {
        panic!("no island at τ = 8.7")
    };
    assert!((from * PER_MM - 0.14861).abs() < 1e-5 && from < 0.16 / PER_MM && 0.16 / PER_MM < to);
    let inside = point(&half, rpm_of(8.7), 0.16 / PER_MM).unwrap();
    assert_eq!(
        (inside.verdict, inside.kind),
        (Verdict::Unstable, StabilityLoss::Flip)
    );
}

#[test]
fn limits_of_random_machines_lie_within_their_errors() {
    use rand::{RngExt, SeedableRng};

    let seed = 20_261_123;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut switches = 0;
    for _ in 0..60 {
        let problem = Problem::new(&random_case(&mut rng), CubicTerms::Refuse).unwrap();
        let poles = problem.structure.poles();
        let fastest = poles.iter().map(|pole| pole.im).fold(0.0, f64::max);
        let vibrations = rng.random_range(0.3..8.0);
        let rpm = 60.0 / problem.teeth as f64 * fastest / std::f64::consts::TAU / vibrations;
        switches += check(&problem, rpm, 5.0);
    }
    assert!(switches > 60, "{switches}");
}

#[test]
fn limits_of_few_steps_err_by_less_than_they_state() {
    for (name, rpm, depth_mm) in [
        ("kuka-kr90-acetal", 1200.0, 4.0),
        ("kuka-kr90-acetal", 1036.0, 4.0),
        ("insperger-1dof-ad1", 5000.0, 1.0),
        ("insperger-2dof-ad0.5", 9100.0, 4.0),
    ] {
        let problem = problem(name);
        let exact = line(&problem, rpm, depth_mm, 40).unwrap();
        let pitched = Pitched::from(problem);
        let methods: [&dyn Method; 2] = [
            &Sdm {
                pitched: pitched.clone(),
                discretization: SemiDiscretization(SdmOrder::First),
                steps: 60,
            },
            &Fdm {
                pitched: pitched.clone(),
                discretization: FullDiscretization,
                steps: 60,
            },
        ];
        for method in methods {
            let found = method.line(rpm, depth_mm, 40).unwrap();
            assert_eq!(
                found.stable_mm.len(),
                exact.stable_mm.len(),
                "{found:?} {exact:?}"
            );
            for (found, exact) in found.switches.iter().zip(&exact.switches) {
                let error_mm = (found.depth_mm - exact.depth_mm).abs();
                assert!(
                    error_mm < found.error_mm.unwrap(),
                    "{} {name} {rpm}: {error_mm} {found:?}",
                    method.name()
                );
            }
        }
    }
}

#[test]
fn errors_leave_depths_undecided_only_at_the_ends_of_stable_intervals() {
    let switch = |depth_mm: f64, kind, gain| Switch {
        depth_mm,
        error_mm: Some(0.2),
        kind,
        gain,
        chatter_hz: None,
    };
    let switches = vec![
        switch(0.1, StabilityLoss::Flip, false),
        switch(1.0, StabilityLoss::Hopf, false),
        switch(2.0, StabilityLoss::Hopf, true),
        switch(3.0, StabilityLoss::Flip, true),
        switch(3.3, StabilityLoss::Hopf, false),
    ];
    let line = SpeedLine::of_switches(1000.0, 4.0, 0, switches);
    assert_eq!(line.stable_mm, [[0.0, 0.1], [3.0, 3.3]]);
    // The Hopf pair crosses at 1 and 2 mm, where the flip has already made the cut unstable: those errors leave nothing
    // undecided.
    assert_eq!(line.undecided_mm, [[0.0, 0.1 + 0.2], [3.0 - 0.2, 3.3 + 0.2]]);
}

/// Spectrum whose finer mesh always fails.
struct WithoutFinerMesh<'a>(Collocated<'a>);

impl Spectrum for WithoutFinerMesh<'_> {
    fn multipliers(&mut self, depth_m: f64) -> Result<Vec<Complex64>, Breakdown> {
        self.0.multipliers(depth_m)
    }

    fn multiplier_near(&mut self, guess: Complex64, depth_m: f64, reach: f64) -> Option<Complex64> {
        self.0.multiplier_near(guess, depth_m, reach)
    }

    fn sensitivity(&mut self, multiplier: Complex64, depth_m: f64) -> Option<Complex64> {
        self.0.sensitivity(multiplier, depth_m)
    }

    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing> {
        self.0.crossing_near(guess, low_m, high_m)
    }

    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64> {
        self.0.chatter_hz(crossing)
    }

    fn error(&mut self, crossing: &Crossing) -> Result<f64, StabilityError> {
        Err(Breakdown::TooManyMultipliers.at(1200.0, 1e3 * crossing.depth_m, NO_SOLUTION))
    }
}

#[test]
fn a_limit_without_an_error_keeps_the_reason() {
    let problem = problem("kuka-kr90-acetal");
    let known = line(&problem, 1200.0, 6.0, 40).unwrap();
    assert!(!known.switches.is_empty() && known.without_error.is_empty());
    let found = line_of(1200.0, 6.0, 40, |deepest_m| {
        WithoutFinerMesh(Collocated::new(&problem, 1200.0, deepest_m))
    })
    .unwrap();
    assert_eq!(found.switches.len(), known.switches.len());
    assert_eq!(found.without_error.len(), found.switches.len());
    for (switch, reason) in found.switches.iter().zip(&found.without_error) {
        assert_eq!(switch.error_mm, Some(6.0));
        assert!(
            reason.contains("1200 rev/min") && reason.contains("nearly one size"),
            "{reason}"
        );
    }
}
