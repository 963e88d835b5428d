//! Frequency and damping over the amplitude of free decays, against closed forms of decays integrated here.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::nonlinear::decay_curve::{DecayCurve, DecayPoint, DecayRecord, decay_curve};
use quietcut_numerics::statistics::NINETY_PERCENT;
use quietcut_recording::Quantity;
use quietcut_testkit::rates::{assert_least_share, assert_pooled_share};

const RATE_HZ: f64 = 1000.0;

/// ẍ + 2ζω₀ẋ + ω₀²x + k x³ = 0 from x = x0 at rest.
#[derive(Clone, Copy)]
struct Oscillator {
    frequency_hz: f64,
    damping_ratio: f64,
    /// Cubic stiffness over mass, 1/(m²s²).
    cubic: f64,
}

impl Oscillator {
    /// Displacement, velocity and acceleration at the samples by the Runge–Kutta method of fourth order.
    fn decay(&self, x0: f64, seconds: f64) -> Vec<[f64; 3]> {
        let omega = TAU * self.frequency_hz;
        let over = 16;
        let h = 1.0 / (RATE_HZ * f64::from(over));
        let (mut x, mut v) = (x0, 0.0);
        let mut samples = Vec::new();
        let a = |x: f64, v: f64| {
            -omega * omega * x - self.cubic * x * x * x - 2.0 * self.damping_ratio * omega * v
        };
        for _ in 0..(seconds * RATE_HZ) as usize {
            samples.push([x, v, a(x, v)]);
            for _ in 0..over {
                let (k1, l1) = (v, a(x, v));
                let (k2, l2) = (v + 0.5 * h * l1, a(x + 0.5 * h * k1, v + 0.5 * h * l1));
                let (k3, l3) = (v + 0.5 * h * l2, a(x + 0.5 * h * k2, v + 0.5 * h * l2));
                let (k4, l4) = (v + h * l3, a(x + h * k3, v + h * l3));
                x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
        }
        samples
    }

    /// Frequency of the undamped Duffing oscillator at the amplitude A, Hz: ω = (π/2)·√(ω₀² + kA²)/K(m) with the
    /// complete elliptic integral K of the parameter m = kA²/(2(ω₀² + kA²)) (Kovacic and Brennan 2011), by the
    /// arithmetic-geometric mean: K(m) = π/(2·agm(1, √(1 − m))).
    fn exact_frequency_hz(&self, amplitude: f64) -> f64 {
        let omega = TAU * self.frequency_hz;
        let stiff = omega * omega + self.cubic * amplitude * amplitude;
        let parameter = self.cubic * amplitude * amplitude / (2.0 * stiff);
        let (mut a, mut b) = (1.0_f64, (1.0 - parameter).sqrt());
        for _ in 0..30 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let complete = PI / (2.0 * a);
        0.5 * PI * stiff.sqrt() / complete / TAU
    }
}

fn with_noise(samples: &[f64], deviation: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    samples
        .iter()
        .map(|x| {
            let normal: f64 = StandardNormal.sample(&mut random);
            x + deviation * normal
        })
        .collect()
}

fn curve_of(samples: &[f64], quantity: Quantity) -> DecayCurve {
    decay_curve(&DecayRecord {
        samples,
        quantity,
        rate_hz: RATE_HZ,
        band_hz: None,
    })
    .unwrap()
}

fn component(decay: &[[f64; 3]], at: usize) -> Vec<f64> {
    decay.iter().map(|motion| motion[at]).collect()
}

const LINEAR: Oscillator = Oscillator {
    frequency_hz: 31.7,
    damping_ratio: 0.012,
    cubic: 0.0,
};

#[test]
fn a_linear_decay_is_flat_and_exact_without_noise() {
    for damping_ratio in [0.002, 0.012, 0.04] {
        let linear = Oscillator {
            damping_ratio,
            ..LINEAR
        };
        let decay = linear.decay(1e-3, 3.0);
        for (at, quantity) in [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration]
            .into_iter()
            .enumerate()
        {
            let curve = curve_of(&component(&decay, at), quantity);
            println!(
                "zeta {damping_ratio} {quantity:?} {} points, average {:?}",
                curve.points.len(),
                curve.average
            );
            for point in &curve.points {
                let truth = 1e-3 * (-damping_ratio * TAU * 31.7 * point.time_s).exp();
                assert!((point.frequency_hz / 31.7 - 1.0).abs() < 2e-5, "{point:?}");
                assert!(
                    (point.damping_ratio / damping_ratio - 1.0).abs() < 5e-3,
                    "{point:?}"
                );
                // The closed form leaves out √(1 − ζ²) and the phase of the release.
                assert!(
                    (point.amplitude_m / truth - 1.0).abs() < 2e-3,
                    "{point:?} {truth}"
                );
            }
        }
    }
}

/// 90 % intervals of a linear mode hold the truth in 90 % of the windows, and 1 of 100 decays or fewer is said to
/// depend on the amplitude.
#[test]
fn intervals_of_linear_decays_hold_the_truth() {
    let decay = component(&LINEAR.decay(1e-3, 3.0), 0);
    let count = 400;
    let seeds = 7000..7000 + count;
    let found: Vec<([f64; 3], bool, bool)> = seeds
        .clone()
        .into_par_iter()
        .map(|seed| {
            let curve = curve_of(&with_noise(&decay, 1e-5, seed), Quantity::Displacement);
            let share = |held: &dyn Fn(&DecayPoint) -> bool| {
                curve.points.iter().filter(|point| held(point)).count() as f64 / curve.points.len() as f64
            };
            let of_points = [
                share(&|p| (p.frequency_hz - 31.7).abs() < NINETY_PERCENT * p.frequency_std_hz),
                share(&|p| (p.damping_ratio - 0.012).abs() < NINETY_PERCENT * p.damping_ratio_std),
                share(&|p| {
                    let truth =
                        1e-3 * (-0.012 * TAU * 31.7 * p.time_s).exp() / (1.0_f64 - 0.012 * 0.012).sqrt();
                    (p.amplitude_m - truth).abs() < NINETY_PERCENT * p.amplitude_std_m
                }),
            ];
            (of_points, curve.is_flat, curve.is_smooth)
        })
        .collect();
    let mean = |of: usize| found.iter().map(|(share, ..)| share[of]).sum::<f64>() / count as f64;
    let flat = found.iter().filter(|(_, flat, _)| *flat).count();
    let smooth = found.iter().filter(|(.., smooth)| *smooth).count();
    println!(
        "seeds {seeds:?}: {} {} {}, flat {flat}, smooth {smooth}",
        mean(0),
        mean(1),
        mean(2)
    );
    assert_pooled_share("frequency", 0.9, mean(0), count as usize);
    assert_pooled_share("damping", 0.9, mean(1), count as usize);
    assert_pooled_share("amplitude", 0.9, mean(2), count as usize);
    assert_least_share("flat", 0.995, flat, count as usize);
    assert_least_share("smooth", 0.995, smooth, count as usize);
}

/// Share of the points whose intervals hold the truth, over seeded noise, and whether each decay is said to depend on
/// the amplitude.
fn coverage(
    decay: &[f64],
    noise: f64,
    first_seed: u64,
    truth: impl Fn(f64) -> [f64; 2] + Sync,
) -> ([f64; 2], usize) {
    let count = 100;
    let found: Vec<([f64; 2], bool)> = (first_seed..first_seed + count)
        .into_par_iter()
        .map(|seed| {
            let curve = curve_of(&with_noise(decay, noise, seed), Quantity::Displacement);
            let mut held = [0.0; 2];
            for point in &curve.points {
                let [frequency_hz, damping_ratio] = truth(point.amplitude_m);
                if seed == first_seed {
                    println!(
                        "A {:.3e} f {:.4} ± {:.4} ({frequency_hz:.4}) zeta {:.5} ± {:.5} ({damping_ratio:.5})",
                        point.amplitude_m,
                        point.frequency_hz,
                        point.frequency_std_hz,
                        point.damping_ratio,
                        point.damping_ratio_std
                    );
                }
                held[0] += f64::from((point.frequency_hz - frequency_hz).abs() < NINETY_PERCENT * point.frequency_std_hz);
                held[1] +=
                    f64::from((point.damping_ratio - damping_ratio).abs() < NINETY_PERCENT * point.damping_ratio_std);
            }
            (held.map(|sum| sum / curve.points.len() as f64), !curve.is_flat && curve.is_smooth)
        })
        .collect();
    let mean = |of: usize| found.iter().map(|(held, _)| held[of]).sum::<f64>() / count as f64;
    println!("seeds from {first_seed}: {} {}", mean(0), mean(1));
    (
        [mean(0), mean(1)],
        found.iter().filter(|(_, dependent)| *dependent).count(),
    )
}

#[test]
fn a_duffing_decay_follows_the_elliptic_integral() {
    // Softening by 8 % of the frequency at the release, and hardening by 12 %.
    for (sign, first_seed) in [(-1.0, 8000), (1.0, 9000)] {
        let omega = TAU * 31.7;
        let duffing = Oscillator {
            damping_ratio: 0.004,
            cubic: sign * 0.4 * omega * omega / 1e-6,
            ..LINEAR
        };
        let x0 = if sign < 0.0 { 0.7e-3 } else { 0.9e-3 };
        let decay = component(&duffing.decay(x0, 6.0), 0);
        // Viscous damping: σ = ζω₀·(mean of v² over A²ω²/2) is ζω₀ to first order in the cubic term.
        let truth = |amplitude: f64| [duffing.exact_frequency_hz(amplitude), f64::NAN];
        let ([frequency, _], dependent) = coverage(&decay, 2e-6, first_seed, truth);
        assert_pooled_share("frequency", 0.9, frequency, 100);
        assert_eq!(dependent, 100, "sign {sign}");
    }
}

/// Decay with dry friction and viscous damping, ẍ + 2ζωẋ + ω²(x + x_f·sign ẋ) = 0 from x = x0 at rest, in closed form.
///
/// From one turning point to the next, half a period π/ω_d later, it is a linear decay about ±x_f; the mass sticks at the
/// first turning point within x_f.
struct DryDecay {
    /// ω_d, rad/s.
    damped: f64,
    /// σ = ζω, 1/s.
    sigma: f64,
    x0: f64,
    x_f: f64,
}

impl DryDecay {
    fn new(frequency_hz: f64, damping_ratio: f64, x0: f64, x_f: f64) -> Self {
        let omega = TAU * frequency_hz;
        let sigma = damping_ratio * omega;
        Self {
            damped: (omega * omega - sigma * sigma).sqrt(),
            sigma,
            x0,
            x_f,
        }
    }

    fn samples(&self, seconds: f64) -> Vec<f64> {
        let half_s = PI / self.damped;
        let (mut turned_s, mut turned) = (0.0, self.x0);
        (0..(seconds * RATE_HZ) as usize)
            .map(|sample| {
                let t = sample as f64 / RATE_HZ;
                while turned.abs() > self.x_f && t > turned_s + half_s {
                    turned = self.about_rest(turned, half_s);
                    turned_s += half_s;
                }
                if turned.abs() > self.x_f {
                    self.about_rest(turned, t - turned_s)
                } else {
                    turned
                }
            })
            .collect()
    }

    /// Displacement the time `t` after the turning point at `turned`, before the next one.
    fn about_rest(&self, turned: f64, t: f64) -> f64 {
        let rest = self.x_f * turned.signum();
        let (sin, cos) = (self.damped * t).sin_cos();
        rest + (turned - rest) * (-self.sigma * t).exp() * (cos + self.sigma / self.damped * sin)
    }

    /// |p|/2π and −Re p/|p| of the local pole of the fundamental, where this has the amplitude `amplitude`.
    ///
    /// The velocity changes its sign every half period, so that the friction is a square wave, whose fundamental
    /// −(4i/π)ω²x_f·e^{iω_d t} drives a linear oscillator: z = e^{iω_d t}·(c·e^{−σt} + d) with
    /// d = −(4i/π)ω²x_f/(σ(σ + 2iω_d)), and c from x0 at rest less the periodic response at its turning point,
    /// −x_f(1 + e)/(1 − e) with e = e^{−σπ/ω_d}. The pole is z′/z. The square wave lags behind the fundamental, whose
    /// frequency is therefore below ω_d, by the part 6x_f²/(πA)² for ζ → 0.
    fn at(&self, amplitude: f64) -> [f64; 2] {
        let square = self.damped * self.damped + self.sigma * self.sigma;
        let half = (-self.sigma * PI / self.damped).exp();
        let turning = self.x_f * (1.0 + half) / (1.0 - half);
        let free = Complex64::new(1.0, -self.sigma / self.damped) * (self.x0 + turning);
        let driven = Complex64::new(0.0, -4.0 / PI * square * self.x_f)
            / (self.sigma * Complex64::new(self.sigma, 2.0 * self.damped));
        // |z| falls with e^{−σt} until c·e^{−σt} has about the magnitude of d.
        let (mut low, mut high) = (driven.norm() / free.norm(), 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (free * middle + driven).norm() > amplitude {
                high = middle;
            } else {
                low = middle;
            }
        }
        let of_free = free * low;
        let pole = Complex64::new(0.0, self.damped) - self.sigma * of_free / (of_free + driven);
        [pole.norm() / TAU, -pole.re / pole.norm()]
    }
}

#[test]
fn dry_friction_gives_damping_over_one_over_the_amplitude() {
    let dry = DryDecay::new(31.7, 0.002, 1e-3, 3e-6);
    // Energy balance over a period, at a large amplitude: −dA/dt = 2ωx_f/π + ζωA.
    let [_, damping] = dry.at(8e-4);
    let balance = 2.0 * 3e-6 / (PI * 8e-4) + 0.002;
    assert!((damping / balance - 1.0).abs() < 1e-4, "{damping} {balance}");
    let ([frequency, damping], dependent) =
        coverage(&dry.samples(4.0), 2e-6, 10_000, |amplitude| dry.at(amplitude));
    assert_pooled_share("frequency", 0.9, frequency, 100);
    assert_pooled_share("damping", 0.9, damping, 100);
    assert_eq!(dependent, 100);
}
