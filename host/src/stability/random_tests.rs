//! Random machines: verdicts against motions by Taylor series, and of some against a winding number, without eigenvalues.

use std::time::{Duration, Instant};

use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use super::characteristic::Characteristic;
use super::period::{Period, Resolution};
use super::taylor::{self, Series};
use super::tests::random_case;
use super::*;

/// Whether no multiplier lies outside the unit circle, by the argument principle on the finest period; `None` where that
/// does not tell.
///
/// F = det(Φ − μI) is analytic outside but for a pole of order n at infinity: the mean of μ ∂ ln F/∂μ over the unit circle
/// is n less the number of zeros outside. The pair that was found is taken out of ∂ ln F/∂μ first, so that its neighbourhood
/// does not need many points, and put back as what it is. Where it lies outside, that it is a zero is shown by
/// a small circle around it.
fn is_stable_by_winding(problem: &Problem, rpm: f64, depth_m: f64, found: Complex64) -> Option<bool> {
    let period = Period::new(problem, rpm, 2.0 * depth_m, Resolution::FINE);
    let characteristic = Characteristic::new(&period, 2.0 * depth_m);
    let mut work = characteristic.workspace();
    let mut slope = |multiplier| {
        let logarithmic = characteristic.logarithmic(multiplier, depth_m, &mut work);
        logarithmic.map(|logarithmic| logarithmic.by_multiplier)
    };
    if found.norm() > 1.0 {
        let zeros = winding(&mut |angle| {
            let away = Complex64::cis(angle) * (0.3 * (found.norm() - 1.0).min(0.01 * found.norm()));
            Some((slope(found + away)? * away).re)
        })?;
        return (zeros > 0).then_some(false);
    }
    let pair: &[Complex64] = if found.im == 0.0 {
        &[found]
    } else {
        &[found, found.conj()]
    };
    let inside = winding(&mut |angle| {
        let multiplier = Complex64::cis(angle);
        let rest: Complex64 = pair.iter().map(|known| (multiplier - known).inv()).sum();
        Some(((slope(multiplier)? - rest) * multiplier).re)
    })?;
    // The pair itself lies inside.
    Some(inside + pair.len() as i32 == period.order() as i32)
}

/// The mean over the angles of a circle, by the trapezoidal rule with ever more points until it is a whole number; `None`
/// where 8 192 do not tell.
fn winding(of: &mut dyn FnMut(f64) -> Option<f64>) -> Option<i32> {
    use std::f64::consts::TAU;
    let mut count = 24_u32;
    let mut over = |count: u32, shift: f64| -> Option<f64> {
        // Not at angle 0, where a real zero would be met.
        (0..count)
            .map(|i| of(TAU * (f64::from(i) + 0.25 + shift) / f64::from(count)))
            .sum()
    };
    let mut sum = over(count, 0.0)?;
    let (mut last, mut before) = (f64::INFINITY, f64::INFINITY);
    while count <= 4096 {
        let mean = sum / f64::from(count);
        let whole = mean.round();
        // Errors fall as a power of the number of points: three rounds near the same whole number have arrived.
        if (mean - whole).abs() < 0.02 && (last - whole).abs() < 0.1 && (before - whole).abs() < 0.4 {
            return Some(whole as i32);
        }
        (before, last) = (last, mean);
        sum += over(count, 0.5)?;
        count *= 2;
    }
    None
}

/// What came of one random machine at one speed and depth.
struct Outcome {
    verdict: Option<Verdict>,
    /// What the reference says; `None` where it cannot tell.
    reference: Option<Reference>,
    /// What the winding number says, where it was asked and could tell.
    stable_by_winding: Option<bool>,
    /// Distance from the reference, over the sum of both errors.
    error_ratio: f64,
    /// Change of the reference with finer series over its error, where that was asked for.
    reference_ratio: f64,
    time: Duration,
    reference_time: Duration,
    words: String,
}

/// The size of the largest multiplier by Taylor series.
#[derive(Clone, Copy, Debug)]
struct Reference {
    multiplier_abs: f64,
    error: f64,
}

impl Reference {
    /// What both of its resolutions keep to, relative to max(1, |μ|); every machine of [`BY_FINER_SERIES`] tests it.
    const COARSE: f64 = 3e-8;
    const FINE: f64 = 1e-9;

    /// Fine series are for multipliers that coarse ones leave near 1.
    fn new(problem: &Problem, rpm: f64, depth_m: f64) -> Option<Self> {
        Self::at(problem, rpm, depth_m, Series::COARSE, Self::COARSE)
            .filter(|coarse| (coarse.multiplier_abs - 1.0).abs() > 100.0 * coarse.error)
            .or_else(|| Self::at(problem, rpm, depth_m, Series::FINE, Self::FINE))
    }

    fn at(problem: &Problem, rpm: f64, depth_m: f64, series: Series, error: f64) -> Option<Self> {
        let (multiplier_abs, unsettled) = taylor::largest_abs(problem, rpm, depth_m, series)?;
        Some(Self {
            multiplier_abs,
            error: error * multiplier_abs.max(1.0) + 10.0 * unsettled,
        })
    }

    fn verdict(&self) -> Verdict {
        Verdict::of(self.multiplier_abs, self.error)
    }
}

/// Of larger multipliers verdicts alone are compared: the digits of the reference are lost in such growth.
const COMPARED: f64 = 1e6;

/// Of so many machines one is computed with finer series too.
const BY_FINER_SERIES: usize = 50;

impl Outcome {
    fn is_wrong(&self) -> bool {
        let reference = self.reference.map(|reference| reference.verdict());
        let by_winding = match self.stable_by_winding {
            Some(true) => Some(Verdict::Stable),
            Some(false) => Some(Verdict::Unstable),
            None => None,
        };
        [reference, by_winding].into_iter().flatten().any(|truth| {
            [self.verdict, reference].into_iter().flatten().any(|said| {
                matches!(
                    (said, truth),
                    (Verdict::Stable, Verdict::Unstable) | (Verdict::Unstable, Verdict::Stable)
                )
            })
        })
    }

    fn is_silent(&self) -> bool {
        self.reference
            .is_none_or(|reference| reference.verdict() == Verdict::Undecided)
    }

    fn is_undecided(&self) -> bool {
        self.verdict.is_none_or(|verdict| verdict == Verdict::Undecided)
    }

    /// Says on stderr what is out of the ordinary.
    fn tell(&self) {
        let Self { words, .. } = self;
        if self.is_wrong() || self.error_ratio > 1.0 || self.reference_ratio > 1.0 {
            let ratios = (self.error_ratio, self.reference_ratio);
            eprintln!(
                "WRONG {:?} {:?} {ratios:?} {words}",
                self.reference, self.stable_by_winding
            );
        }
        if self.is_undecided() {
            eprintln!("undecided {:?} {words}", self.reference);
        }
        if self.is_silent() {
            eprintln!("silent {:?}, {:.2?} {words}", self.reference, self.reference_time);
        }
        if self.time.max(self.reference_time) > Duration::from_secs(2) {
            eprintln!("slow {:.2?} {:.2?} {words}", self.time, self.reference_time);
        }
    }
}

/// The machine with this index: 0.3 to 40 vibrations of its fastest mode in a tooth period, 0 to 10 mm.
fn random_point(seed: u64, index: usize, ports_max: usize) -> Outcome {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index as u64);
    let problem = Problem::new(&random_case(&mut rng), CubicTerms::Refuse).unwrap();
    let poles = problem.structure.poles();
    let fastest = poles.iter().map(|pole| pole.im).fold(0.0, f64::max);
    let vibrations = 10.0_f64.powf(rng.random_range(-0.5..40.0_f64.log10()));
    let rpm = 60.0 / problem.teeth as f64 * fastest / std::f64::consts::TAU / vibrations;
    let depth_mm: f64 = rng.random_range(0.0..10.0);
    let began = Instant::now();
    let found = point(&problem, rpm, depth_mm);
    let time = began.elapsed();
    let depth_m = depth_mm * 1e-3;
    let known = found.as_ref().ok();
    let between = |a: f64, b: f64, error: f64| (a - b).abs() / error;
    let miss = |reference: Option<Reference>| {
        let near = reference.filter(|reference| reference.multiplier_abs < COMPARED);
        known.zip(near).map_or(0.0, |(found, reference)| {
            let error = found.error + reference.error;
            between(found.multiplier_abs, reference.multiplier_abs, error)
        })
    };
    let fine = || Reference::at(&problem, rpm, depth_m, Series::FINE, Reference::FINE);
    let began = Instant::now();
    let mut reference = Reference::new(&problem, rpm, depth_m);
    if miss(reference) > 0.5 {
        reference = fine();
    }
    let reference_time = began.elapsed();
    let finer = index.is_multiple_of(BY_FINER_SERIES).then(fine).flatten();
    Outcome {
        verdict: known.map(|found| found.verdict),
        stable_by_winding: known
            .filter(|_| Period::new(&problem, rpm, 2.0 * depth_m, Resolution::FINE).ports() <= ports_max)
            .and_then(|found| is_stable_by_winding(&problem, rpm, depth_m, found.multiplier)),
        error_ratio: miss(reference),
        reference_ratio: reference
            .zip(finer.filter(|finer| finer.multiplier_abs < COMPARED))
            .map_or(0.0, |(reference, finer)| {
                between(reference.multiplier_abs, finer.multiplier_abs, reference.error)
            }),
        reference,
        time,
        reference_time,
        words: format!(
            "machine {index} of seed {seed}: {} states, {} teeth, {vibrations:.2} vibrations, {rpm} rev/min, \
             {depth_mm} mm: {found:?}",
            problem.structure.order(),
            problem.teeth,
        ),
    }
}

/// What came of many machines.
#[derive(Default)]
struct Counts {
    machines: usize,
    wrong: usize,
    undecided: usize,
    refused: usize,
    stable: usize,
    silent: usize,
    by_winding: usize,
    error_ratio: f64,
    reference_ratio: f64,
    time: Duration,
    reference_time: Duration,
    slowest: Duration,
    slowest_reference: Duration,
}

impl Counts {
    fn add(&mut self, outcome: &Outcome) {
        self.machines += 1;
        self.wrong += usize::from(outcome.is_wrong());
        self.undecided += usize::from(outcome.is_undecided());
        self.refused += usize::from(outcome.verdict.is_none());
        self.stable += usize::from(outcome.verdict == Some(Verdict::Stable));
        self.silent += usize::from(outcome.is_silent());
        self.by_winding += usize::from(outcome.stable_by_winding.is_some());
        self.error_ratio = self.error_ratio.max(outcome.error_ratio);
        self.reference_ratio = self.reference_ratio.max(outcome.reference_ratio);
        self.time += outcome.time;
        self.reference_time += outcome.reference_time;
        self.slowest = self.slowest.max(outcome.time);
        self.slowest_reference = self.slowest_reference.max(outcome.reference_time);
    }

    fn check(&self) {
        assert_eq!(self.wrong, 0);
        assert!(self.error_ratio <= 1.0, "{}", self.error_ratio);
        assert!(self.reference_ratio <= 1.0, "{}", self.reference_ratio);
        // Asked for is less than 1 % each; some hundred machines may hold a few more by chance.
        let most = 0.01 * self.machines as f64 + 0.2 * (self.machines as f64).sqrt();
        assert!((self.undecided as f64) < most && (self.silent as f64) < most);
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let percent = |count: usize| 100.0 * count as f64 / self.machines as f64;
        let mean_ms = |time: Duration| 1e3 * time.as_secs_f64() / self.machines as f64;
        write!(
            f,
            "{} machines: {} wrong, {} undecided ({} refused), reference silent at {}, {} also by winding number; stable \
             {:.1} %; largest error over both stated {:.2}, of the reference {:.2}; mean {:.2} ms, slowest {:.2?}; reference \
             {:.2} ms, {:.2?}",
            self.machines,
            self.wrong,
            self.undecided,
            self.refused,
            self.silent,
            self.by_winding,
            percent(self.stable),
            self.error_ratio,
            self.reference_ratio,
            mean_ms(self.time),
            self.slowest,
            mean_ms(self.reference_time),
            self.slowest_reference,
        )
    }
}

/// Machines of which counts are printed together.
const CHUNK: usize = 1000;

/// Runs machines, says what came of them, and panics where a verdict is wrong or an error larger than stated.
///
/// The winding number is asked where the finest map has at most `ports_max` ports.
fn run(seed: u64, first: usize, count: usize, ports_max: usize) {
    let mut all = Counts::default();
    for from in (first..first + count).step_by(CHUNK) {
        let until = (from + CHUNK).min(first + count);
        let outcomes: Vec<Outcome> = (from..until)
            .into_par_iter()
            .map(|index| {
                let outcome = random_point(seed, index, ports_max);
                outcome.tell();
                outcome
            })
            .collect();
        let mut counts = Counts::default();
        for outcome in &outcomes {
            counts.add(outcome);
            all.add(outcome);
        }
        println!("seed {seed}, from {from}: {counts}");
    }
    println!("seed {seed}, all: {all}");
    all.check();
}

fn number(name: &str, default: usize) -> usize {
    std::env::var(name)
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(default)
}

#[test]
fn verdicts_of_some_random_machines_are_right() {
    run(20_261_121, 0, 500, 0);
    // The winding number takes much longer.
    run(20_261_122, 0, 40, 150);
}

/// All of them; counts of every thousand go to stdout, whatever is undecided or slow to stderr:
///
/// ```text
/// RAYON_NUM_THREADS=1 cargo test --release -p quietcut --lib -- --ignored --nocapture verdicts_of_a_hundred_thousand
/// ```
///
/// `QUIETCUT_RANDOM_CASES` sets how many, `QUIETCUT_RANDOM_FIRST` the first, `QUIETCUT_SEED` the seed, `QUIETCUT_WINDING_PORTS` up to
/// which size the winding number is asked too.
#[test]
#[ignore = "hours; the command stands above"]
fn verdicts_of_a_hundred_thousand_random_machines_are_right() {
    run(
        number("QUIETCUT_SEED", 20_261_121) as u64,
        number("QUIETCUT_RANDOM_FIRST", 0),
        number("QUIETCUT_RANDOM_CASES", 100_000),
        number("QUIETCUT_WINDING_PORTS", 0),
    );
}
