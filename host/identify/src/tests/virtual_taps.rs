//! Random machines with modes in x and y, and hammer tests of them in closed form.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use num_complex::Complex64;
use quietcut_model::case::Case;
use quietcut_model::structure::Mode;
use quietcut_recording::{Channel, Quantity, RecordedChannel, Recording, Sidecar, TestKind};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Samples per second of the virtual hammer tests.
const RATE: f64 = 25_600.0;

/// Time between impacts, s: longer than the time in which a second pulse counts as a bounce, 0.4 s.
const BETWEEN_S: f64 = 0.45;

/// A hidden machine: the modes of its structure, and the text of the sections of its cut.
pub(super) struct Machine {
    pub(super) modes: Vec<Mode>,
    pub(super) job: String,
}

/// Errors of a hammer test.
#[derive(Clone, Copy, Debug)]
pub(super) struct TapErrors {
    /// Standard deviation of the accelerometers' white noise, as a fraction of the largest acceleration.
    pub(super) noise: f64,
    /// Relative errors of the gains of the hammer and of the accelerometers in x and y.
    pub(super) gains: [f64; 3],
    /// Number of impacts in each direction.
    pub(super) impacts: usize,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A number between two bounds, uniform in its logarithm.
fn log_uniform(rng: &mut ChaCha8Rng, [low, high]: [f64; 2]) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

impl Machine {
    /// Two or three modes in each of x and y, real and nearly along the axis, and a random cut.
    pub(super) fn random(rng: &mut ChaCha8Rng) -> Self {
        let mut modes = Vec::new();
        for axis in 0..2 {
            let count = 2 + usize::from(rng.random::<f64>() < 0.5);
            let mut hertz = log_uniform(rng, [300.0, 900.0]);
            for _ in 0..count {
                let damping = log_uniform(rng, [0.01, 0.05]);
                let stiffness = log_uniform(rng, [5e6, 5e7]);
                let off = (8.0 * normal(rng)).to_radians();
                let angle = off + 0.5 * PI * f64::from(axis);
                modes.push(real_mode(hertz, damping, stiffness, angle));
                hertz *= 1.25 + 0.55 * rng.random::<f64>();
            }
        }
        modes.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        let ktc = 600.0 + 600.0 * rng.random::<f64>();
        let (start, exit) = match (3.0 * rng.random::<f64>()) as usize {
            0 => (0.0, 180.0),
            1 => (0.0, 30.0 + 90.0 * rng.random::<f64>()),
            _ => (60.0 + 90.0 * rng.random::<f64>(), 180.0),
        };
        let job = format!(
            "[tool]\nteeth = {}\nedge_angle_deg = 90.0\n[material]\nktc_mpa = {ktc}\nkrc_mpa = {}\nkac_mpa = 0.0\n\
             [cut]\nstart_deg = {start}\nexit_deg = {exit}\nfeed_per_tooth_mm = 0.1\n",
            2 + (3.0 * rng.random::<f64>()) as usize,
            ktc * (0.2 + 0.3 * rng.random::<f64>()),
        );
        Self { modes, job }
    }

    /// The case of the machine itself.
    pub(super) fn case(&self) -> Case {
        let mut text = String::from("[structure]\nkind = \"modes\"\ndirections = [\"x\", \"y\"]\n");
        for mode in &self.modes {
            let shape: Vec<[f64; 2]> = mode.right.iter().map(|z| [z.re, z.im]).collect();
            text += &format!(
                "[[structure.mode]]\nfrequency_hz = {}\ndamping_ratio = {}\nleft = {shape:?}\nright = {shape:?}\n",
                mode.frequency_hz, mode.damping_ratio
            );
        }
        Case::parse(Path::new("hidden.toml"), &(text + &self.job)).unwrap()
    }

    /// Hammer tests in x and in y.
    pub(super) fn taps(&self, errors: &TapErrors, rng: &mut ChaCha8Rng) -> Vec<Recording> {
        (0..2).map(|drive| self.tap(drive, errors, rng)).collect()
    }

    fn tap(&self, drive: usize, errors: &TapErrors, rng: &mut ChaCha8Rng) -> Recording {
        let samples = (RATE * BETWEEN_S * (errors.impacts as f64 + 0.3)) as usize;
        let mut force = vec![0.0; samples];
        let mut accelerations = [vec![0.0; samples], vec![0.0; samples]];
        for impact in 0..errors.impacts {
            let at_s = BETWEEN_S * (0.1 + impact as f64) + 0.02 * rng.random::<f64>();
            let pulse = Pulse {
                peak_n: log_uniform(rng, [100.0, 400.0]),
                seconds: 1e-3 * (0.25 + 0.15 * rng.random::<f64>()),
            };
            let first = (at_s * RATE).ceil() as usize;
            for (k, force) in force.iter_mut().enumerate().skip(first) {
                let t = k as f64 / RATE - at_s;
                if t >= pulse.seconds {
                    break;
                }
                *force += pulse.force(t);
            }
            for mode in &self.modes {
                add_response(mode, drive, &pulse, at_s, &mut accelerations);
            }
        }
        let largest = |signal: &[f64]| signal.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let noise_of_force = 1e-3 * largest(&force);
        let noise = errors.noise * largest(&accelerations[drive]);
        let mut noisy = |signal: Vec<f64>, gain: f64, std: f64| -> Vec<f64> {
            signal
                .into_iter()
                .map(|x| (1.0 + gain) * (x + std * normal(rng)))
                .collect()
        };
        let mut channels = vec![Channel {
            name: ["fx", "fy"][drive].into(),
            quantity: Quantity::Force,
            samples: noisy(force, errors.gains[0], noise_of_force),
        }];
        for ((name, signal), gain) in ["ax", "ay"]
            .into_iter()
            .zip(accelerations)
            .zip(&errors.gains[1..])
        {
            channels.push(Channel {
                name: name.into(),
                quantity: Quantity::Acceleration,
                samples: noisy(signal, *gain, noise),
            });
        }
        let filtered = RecordedChannel {
            anti_aliasing: Some(true),
            ..RecordedChannel::default()
        };
        let described = channels
            .iter()
            .map(|channel| (channel.name.clone(), filtered.clone()));
        Recording {
            path: ["taps-x.csv", "taps-y.csv"][drive].into(),
            sample_rate_hz: RATE,
            start_s: 0.0,
            since_s: 0.0,
            sidecar: Sidecar {
                kind: Some(TestKind::Hammer),
                channels: described.collect(),
                ..Sidecar::default()
            },
            channels,
        }
    }
}

/// Real mode of modal stiffness k along a direction at an angle to x: residue φφᵀ/(2iω_d m) with m = k/ω².
fn real_mode(hertz: f64, damping: f64, stiffness: f64, angle: f64) -> Mode {
    let omega = TAU * hertz;
    let damped = omega * (1.0 - damping * damping).sqrt();
    let factor = (2.0 * Complex64::i() * damped * stiffness / (omega * omega))
        .inv()
        .sqrt();
    let shape = vec![factor * angle.cos(), factor * angle.sin()];
    Mode {
        frequency_hz: hertz,
        damping_ratio: damping,
        left: shape.clone(),
        right: shape,
    }
}

/// Force of an impact, F(t) = F̂ (1 − cos(2πt/T))/2 for 0 ≤ t ≤ T. It is smooth: its spectrum falls as 1/f³, so that sampling folds
/// hardly anything into the band, as behind an anti-aliasing filter.
struct Pulse {
    peak_n: f64,
    seconds: f64,
}

impl Pulse {
    fn force(&self, t: f64) -> f64 {
        0.5 * self.peak_n * (1.0 - (TAU * t / self.seconds).cos())
    }

    /// I(t) = ∫₀ᵗ e^{λ(t − s)} F(s) ds within the pulse.
    fn convolved(&self, pole: Complex64, t: f64) -> Complex64 {
        let w = TAU / self.seconds;
        let growth = (pole * t).exp();
        let constant = (growth - 1.0) / pole;
        // ∫₀ᵗ e^{λ(t − s)} cos(ws) ds = (λ (e^{λt} − cos wt) + w sin wt)/(λ² + w²).
        let cosine = (pole * (growth - (w * t).cos()) + w * (w * t).sin()) / (pole * pole + w * w);
        0.5 * self.peak_n * (constant - cosine)
    }
}

/// Adds the accelerations in x and y of one mode after an impact: a = 2 Re[R (λ² I + λ F)] with the residue R, since
/// x = 2 Re[R I] and Σ 2 Re R = 0.
fn add_response(mode: &Mode, drive: usize, pulse: &Pulse, at_s: f64, accelerations: &mut [Vec<f64>; 2]) {
    let pole = mode.pole();
    let end = pulse.convolved(pole, pulse.seconds);
    let step = (pole / RATE).exp();
    let first = (at_s * RATE).ceil() as usize;
    let mut free: Option<Complex64> = None;
    for k in first..accelerations[0].len() {
        let t = k as f64 / RATE - at_s;
        let (integral, force) = if t <= pulse.seconds {
            (pulse.convolved(pole, t), pulse.force(t))
        } else {
            let next = free.map_or_else(|| end * (pole * (t - pulse.seconds)).exp(), |last| last * step);
            free = Some(next);
            (next, 0.0)
        };
        let driven = (pole * pole * integral + pole * force) * mode.left[drive];
        for (acceleration, right) in accelerations.iter_mut().zip(&mode.right) {
            acceleration[k] += 2.0 * (right * driven).re;
        }
        if integral.norm() < 1e-9 * end.norm() && t > pulse.seconds {
            break;
        }
    }
}
