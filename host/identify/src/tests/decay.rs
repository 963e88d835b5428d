//! Force laws from free decays: intervals against the truth of decays integrated here, filters of the sensor included.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::nonlinear::restoring_force::{ForceTerm, Options, Record, Surface, SurfaceError};
use quietcut_recording::Quantity;
use quietcut_testkit::rates::{assert_least_share, assert_share};
use quietcut_testkit::results::Campaign;

const TERMS: [ForceTerm; 4] = [
    ForceTerm::Damping,
    ForceTerm::Stiffness,
    ForceTerm::CubicStiffness,
    ForceTerm::CubicDamping,
];
/// Samples per second of the records.
const RATE_HZ: f64 = 1024.0;
/// Steps of integration per sample.
const OVER: usize = 8;

/// m q̈ + c q̇ + k q + k3 q³ + c3 q̇³ = 0, and the sensor.
#[derive(Clone, Copy, Debug)]
struct Decay {
    mass: f64,
    damping: f64,
    stiffness: f64,
    k3: f64,
    c3: f64,
    x0: f64,
    seconds: f64,
    begin_s: f64,
    high_pass_hz: f64,
    low_pass_hz: f64,
    noise: f64,
    quantity: Quantity,
}

impl Decay {
    fn acceleration(&self, x: f64, v: f64) -> f64 {
        -(self.damping * v + self.stiffness * x + self.k3 * x * x * x + self.c3 * v * v * v) / self.mass
    }

    /// Samples by the Runge–Kutta method of fourth order, through a first-order high pass and a second-order low pass.
    fn record(&self, random: &mut ChaCha8Rng) -> Vec<f64> {
        let h = 1.0 / (RATE_HZ * OVER as f64);
        let (mut x, mut v) = (self.x0, 0.0);
        let steps = ((self.begin_s + self.seconds) * RATE_HZ) as usize * OVER;
        let skipped = (self.begin_s * RATE_HZ) as usize;
        let of = |x: f64, v: f64| match self.quantity {
            Quantity::Acceleration => self.acceleration(x, v),
            Quantity::Velocity => v,
            _ => x,
        };
        // The sensor has rested at the static displacement.
        let rest = if self.quantity == Quantity::Displacement {
            x
        } else {
            0.0
        };
        let (mut low, mut slow) = ([rest, 0.0], rest);
        let omega = std::f64::consts::TAU * self.low_pass_hz;
        let corner = std::f64::consts::TAU * self.high_pass_hz;
        let mut samples = Vec::new();
        for step in 0..steps {
            let value = of(x, v);
            for _ in 0..4 {
                let h = 0.25 * h;
                low[1] += h * omega * (omega * (value - low[0]) - std::f64::consts::SQRT_2 * low[1]);
                low[0] += h * low[1];
            }
            let read = if self.low_pass_hz > 0.0 { low[0] } else { value };
            slow += h * corner * (read - slow);
            if step % OVER == 0 && step / OVER >= skipped {
                samples.push(if self.high_pass_hz > 0.0 {
                    read - slow
                } else {
                    read
                });
            }
            let a = |x, v| self.acceleration(x, v);
            let (k1, l1) = (v, a(x, v));
            let (k2, l2) = (v + 0.5 * h * l1, a(x + 0.5 * h * k1, v + 0.5 * h * l1));
            let (k3, l3) = (v + 0.5 * h * l2, a(x + 0.5 * h * k2, v + 0.5 * h * l2));
            let (k4, l4) = (v + h * l3, a(x + h * k3, v + h * l3));
            x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
        }
        let rms = (samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64).sqrt();
        for sample in &mut samples {
            let normal: f64 = StandardNormal.sample(random);
            *sample += self.noise * rms * normal;
        }
        samples
    }

    fn surface(&self, samples: &[f64]) -> Result<Surface, SurfaceError> {
        let force = vec![0.0; samples.len()];
        Record {
            force: &force,
            motion: samples,
            quantity: self.quantity,
            rate_hz: RATE_HZ,
        }
        .surface(&Options {
            terms: TERMS.to_vec(),
            mass_kg: Some(self.mass),
            band_hz: None,
            trim_s: 0.1,
        })
    }

    fn truth(&self) -> [f64; 4] {
        [self.damping, self.stiffness, self.k3, self.c3]
    }
}

/// Random decays of the thesis's mode at 17.5 Hz and its like.
fn decay(random: &mut ChaCha8Rng) -> Decay {
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let hertz = between(10.0, 60.0);
    let mass = 188.0;
    let stiffness = mass * (std::f64::consts::TAU * hertz).powi(2);
    let zeta = between(0.005, 0.02);
    let x0 = 1e-4;
    let hardening = between(-0.03, 0.03);
    Decay {
        mass,
        damping: 2.0 * zeta * (mass * stiffness).sqrt(),
        stiffness,
        k3: hardening * stiffness / (x0 * x0),
        c3: between(0.0, 0.3) * 2.0 * zeta * mass / (x0 * x0 * std::f64::consts::TAU * hertz),
        x0,
        seconds: between(3.0, 8.0),
        begin_s: between(0.0, 0.3),
        high_pass_hz: if between(0.0, 1.0) < 0.5 {
            between(0.1, 1.0)
        } else {
            0.0
        },
        low_pass_hz: if between(0.0, 1.0) < 0.5 {
            between(200.0, 400.0)
        } else {
            0.0
        },
        noise: 10f64.powf(between(-3.5, -2.0)),
        quantity: if between(0.0, 1.0) < 0.5 {
            Quantity::Displacement
        } else {
            Quantity::Acceleration
        },
    }
}

/// Number of `trials` whose 90 % interval holds the truth, for each term. Each trial draws machine, beginning of the record, filters and noise.
fn held(trials: u64) -> [usize; 4] {
    let of_trial = |seed: u64| -> [usize; 4] {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let decay = decay(&mut random);
        let samples = decay.record(&mut random);
        let surface = decay
            .surface(&samples)
            .unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let truth = decay.truth();
        std::array::from_fn(|term| {
            usize::from((surface.theta[term] - truth[term]).abs() <= surface.half_width(term))
        })
    };
    (0..trials)
        .into_par_iter()
        .map(of_trial)
        .reduce(|| [0; 4], |a, b| std::array::from_fn(|term| a[term] + b[term]))
}

fn check(held: [usize; 4], trials: usize) {
    for (term, held) in TERMS.iter().zip(held) {
        println!("{}: {held} of {trials}", term.key());
        // The noise of the weak form has no power at the resonance itself, which the jackknife does not know: intervals of the linear
        // terms, accurate to 1e-5, are too wide.
        assert_least_share(term.key(), 0.9, held, trials);
    }
    assert_share("k3", 0.9, held[2], trials);
}

/// A seeded slice of the campaign; its seeds are 0 to 59.
#[test]
fn intervals_of_a_filtered_decay_hold_the_truth_as_often_as_they_say() {
    check(held(60), 60);
}

#[test]
#[ignore = "a campaign: 400 decays"]
fn coverage_of_free_decays() {
    let found = held(400);
    let figures: Vec<_> = TERMS
        .iter()
        .zip(found)
        .map(|(term, held)| {
            (
                format!("90 % intervals of {} that hold the truth", term.key()),
                format!("{:.1} %", held as f64 / 4.0),
            )
        })
        .collect();
    Campaign {
        name: "free-decays",
        title: "Force laws from filtered free decays",
        command: "cargo test --release -p quietcut-identify --lib -- --ignored --nocapture coverage_of_free_decays",
        seeds: "0 to 399; 10 to 60 Hz, noise of 0.03 to 1 %, high and low passes of the sensor, random beginnings",
    }
    .record(&figures);
    check(found, 400);
}

/// Intervals of k3 from different beginnings of one decay have a common part. The record has a
/// second mode, which the law does not know.
#[test]
fn k3_does_not_depend_on_where_the_record_begins() {
    for quantity in [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration] {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let first = Decay {
            begin_s: 0.0,
            seconds: 6.0,
            high_pass_hz: 0.5,
            low_pass_hz: 300.0,
            noise: 1e-3,
            quantity,
            ..decay(&mut random)
        };
        let second = Decay {
            stiffness: 6.0 * first.stiffness,
            damping: 3.0 * first.damping,
            k3: 0.0,
            c3: 0.0,
            x0: 0.02 * first.x0,
            noise: 0.0,
            ..first
        };
        let other = second.record(&mut random);
        let samples: Vec<f64> = first
            .record(&mut random)
            .iter()
            .zip(other)
            .map(|(a, b)| a + b)
            .collect();
        let mut common = [f64::NEG_INFINITY, f64::INFINITY];
        for from in [0, 37, 90, 205, 410] {
            let surface = first.surface(&samples[from..]).unwrap();
            let (k3, half) = (surface.theta[2], surface.half_width(2));
            println!(
                "{quantity:?} from sample {from}: k3 = {k3:.4e} ± {half:.1e}, truth {:.4e}",
                first.k3
            );
            common = [common[0].max(k3 - half), common[1].min(k3 + half)];
            // The beginnings lie within the first 0.4 s of a decay over 6 s: all know k3 within a fifth.
            assert!(half < 0.2 * first.k3.abs(), "{half}");
        }
        // Intervals that overlap pairwise have a common part.
        assert!(common[0] <= common[1], "{quantity:?}: {common:?}");
    }
}

#[test]
fn a_record_too_short_for_its_law_says_how_long_it_must_be() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let decay = decay(&mut random);
    let samples = decay.record(&mut random);
    let Err(SurfaceError::TooShort { needed, .. }) = decay.surface(&samples[..300]) else {
        panic!("300 samples are refused")
    };
    assert!(decay.surface(&samples[..needed + 50]).is_ok(), "{needed}");
}

#[test]
fn a_negative_mass_is_refused() {
    // The motion of a mass on a spring under a random force, with the sign of the force reversed.
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut x, mut v) = (0.0, 0.0);
    let (mut force, mut motion) = (Vec::new(), Vec::new());
    for _ in 0..8192 {
        let normal: f64 = StandardNormal.sample(&mut random);
        force.push(-normal);
        motion.push(x);
        v += (normal - 305.0 * v - 2.26e6 * x) / 188.0 / RATE_HZ;
        x += v / RATE_HZ;
    }
    let record = Record {
        force: &force,
        motion: &motion,
        quantity: Quantity::Displacement,
        rate_hz: RATE_HZ,
    };
    let options = Options {
        terms: vec![ForceTerm::Mass, ForceTerm::Damping, ForceTerm::Stiffness],
        mass_kg: None,
        band_hz: Some([10.0, 30.0]),
        trim_s: 0.5,
    };
    match record.surface(&options) {
        Err(SurfaceError::NoMass { mass_kg }) => assert!((mass_kg / -188.0 - 1.0).abs() < 0.1, "{mass_kg}"),
        other => panic!("{other:?}"),
    }
}
