//! Excitation forces of a test rig over time.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The commanded excitation force of a test over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Signal {
    /// Multisine a(t)·Σ cos(2πft + φ); the amplitude a changes linearly from `first_n` to `last_n`.
    Tones {
        /// Frequency f, Hz, and phase φ, rad, of each tone of the multisine.
        tones: Vec<(f64, f64)>,
        /// Force amplitude of every tone at the start, N.
        first_n: f64,
        /// Force amplitude of every tone at the end, N.
        last_n: f64,
        /// Duration of the multisine, s.
        seconds: f64,
    },
    /// Step sine: one frequency after the other. Each step begins at phase 0 and is followed by a pause without force.
    StepSine {
        /// The steps of the step sine in the order of excitation.
        steps: Vec<Step>,
        /// Duration of the excitation in each step of the step sine, s.
        dwell_s: f64,
        /// Pause without force after each step of the step sine, s.
        pause_s: f64,
    },
    /// Linear sine sweep: the frequency changes linearly in time.
    Sweep {
        /// Frequency at the start, Hz.
        first_hz: f64,
        /// Frequency at the end of the sweep, Hz; below `first_hz` in a backward sweep.
        last_hz: f64,
        /// Force amplitude, N.
        amplitude_n: f64,
        /// Duration of the sweep, s.
        seconds: f64,
    },
    /// Hammer impacts: half-sine pulses.
    Impacts {
        /// The hammer impacts in the order of time.
        impacts: Vec<Impact>,
        /// Duration of the recording, s.
        seconds: f64,
    },
    /// Free decay after a slow static pull.
    Release {
        /// Static force at the end of the pull before the free decay, N.
        force_n: f64,
        /// Time in which the force grows as half a cosine, s; it is then held for a fifth of that time and removed.
        pull_s: f64,
        /// Duration of the recorded free decay after the force is removed, s.
        seconds: f64,
    },
}

/// One step of a step-sine test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Excitation frequency, Hz.
    pub frequency_hz: f64,
    /// Force amplitude, N.
    pub amplitude_n: f64,
}

/// One hammer impact: a half-sine force pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Start time of the impact, s.
    pub start_s: f64,
    /// Peak force of the impact, N.
    pub peak_n: f64,
    /// Duration of the pulse, s.
    pub pulse_s: f64,
}

impl Signal {
    /// A multisine with tones of equal amplitude and random phases from `seed`; a single tone gets the phase −π/2, a
    /// sine.
    pub fn tones(frequencies_hz: &[f64], [first_n, last_n]: [f64; 2], seconds: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let tones = match frequencies_hz {
            [only] => vec![(*only, -0.5 * PI)],
            _ => frequencies_hz
                .iter()
                .map(|frequency| (*frequency, random.random_range(0.0..TAU)))
                .collect(),
        };
        Self::Tones {
            tones,
            first_n,
            last_n,
            seconds,
        }
    }

    /// A step-sine test of all frequencies at the first force level, then at the next level, and so on.
    pub fn step_sine(frequencies_hz: &[f64], levels_n: &[f64], dwell_s: f64, pause_s: f64) -> Self {
        let steps = levels_n
            .iter()
            .flat_map(|&amplitude_n| {
                frequencies_hz.iter().map(move |&frequency_hz| Step {
                    frequency_hz,
                    amplitude_n,
                })
            })
            .collect();
        Self::StepSine {
            steps,
            dwell_s,
            pause_s,
        }
    }

    /// `count` impacts at intervals of `spacing_s`; the first is at 0.1·`spacing_s`. Peak forces are uniformly
    /// distributed within ± 20 % of `peak_n`, as those of a manual hammer test.
    pub fn impacts(count: usize, peak_n: f64, pulse_s: f64, spacing_s: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let impacts = (0..count)
            .map(|index| Impact {
                start_s: (0.1 + index as f64) * spacing_s,
                peak_n: peak_n * random.random_range(0.8..1.2),
                pulse_s,
            })
            .collect();
        Self::Impacts {
            impacts,
            seconds: (0.1 + count as f64) * spacing_s,
        }
    }

    /// Duration of the test, s.
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Tones { seconds, .. } | Self::Sweep { seconds, .. } | Self::Impacts { seconds, .. } => {
                *seconds
            }
            Self::StepSine {
                steps,
                dwell_s,
                pause_s,
            } => steps.len() as f64 * (dwell_s + pause_s),
            Self::Release { pull_s, seconds, .. } => 1.2 * pull_s + seconds,
        }
    }

    /// The commanded excitation force at the time `t`, N.
    pub fn force_n(&self, t: f64) -> f64 {
        match self {
            Self::Tones {
                tones,
                first_n,
                last_n,
                seconds,
            } => {
                let amplitude = first_n + (last_n - first_n) * t / seconds;
                let sum: f64 = tones.iter().map(|(f, phase)| (TAU * f * t + phase).cos()).sum();
                amplitude * sum
            }
            Self::StepSine {
                steps,
                dwell_s,
                pause_s,
            } => {
                let index = (t / (dwell_s + pause_s)).floor();
                let into = t - index * (dwell_s + pause_s);
                match steps.get(index as usize) {
                    Some(step) if into < *dwell_s => {
                        step.amplitude_n * (TAU * step.frequency_hz * into).sin()
                    }
                    _ => 0.0,
                }
            }
            Self::Sweep {
                first_hz,
                last_hz,
                amplitude_n,
                seconds,
            } => {
                let cycles = first_hz * t + 0.5 * (last_hz - first_hz) / seconds * t * t;
                amplitude_n * (TAU * cycles).sin()
            }
            Self::Impacts { impacts, .. } => impacts
                .iter()
                .filter(|impact| (impact.start_s..impact.start_s + impact.pulse_s).contains(&t))
                .map(|impact| impact.peak_n * (PI * (t - impact.start_s) / impact.pulse_s).sin())
                .sum(),
            Self::Release { force_n, pull_s, .. } => match t / pull_s {
                share if share < 1.0 => 0.5 * force_n * (1.0 - (PI * share).cos()),
                share if share < 1.2 => *force_n,
                _ => 0.0,
            },
        }
    }

    /// The longest step that resolves the force, s: a quarter of the shortest period; infinite for impacts and release,
    /// which their knots resolve.
    pub fn longest_step_s(&self) -> f64 {
        let highest_hz = match self {
            Self::Tones { tones, .. } => tones
                .iter()
                .fold(0.0, |most: f64, (tone_hz, _)| most.max(*tone_hz)),
            Self::StepSine { steps, .. } => steps
                .iter()
                .fold(0.0, |most: f64, step| most.max(step.frequency_hz)),
            Self::Sweep {
                first_hz, last_hz, ..
            } => first_hz.max(*last_hz),
            Self::Impacts { .. } | Self::Release { .. } => 0.0,
        };
        0.25 / highest_hz
    }

    /// The first time after `t`, s, at which the excitation force or one of its low-order time derivatives may be
    /// discontinuous; infinite if there is none.
    pub fn next_knot_s(&self, t: f64) -> f64 {
        match self {
            Self::Tones { .. } | Self::Sweep { .. } => f64::INFINITY,
            Self::StepSine { dwell_s, pause_s, .. } => {
                let index = (t / (dwell_s + pause_s)).floor();
                // Starts and ends of excitation in this step of the step sine and in the next two: rounding may place
                // `index` on either side of a step's start.
                [0.0, 1.0, 2.0]
                    .iter()
                    .flat_map(|ahead| {
                        let start = (index + ahead) * (dwell_s + pause_s);
                        [start, start + dwell_s]
                    })
                    .filter(|knot| *knot > t)
                    .fold(f64::INFINITY, f64::min)
            }
            Self::Impacts { impacts, .. } => impacts
                .iter()
                .flat_map(|impact| [impact.start_s, impact.start_s + impact.pulse_s])
                .filter(|knot| *knot > t)
                .fold(f64::INFINITY, f64::min),
            Self::Release { pull_s, .. } => [*pull_s, 1.2 * pull_s]
                .into_iter()
                .filter(|knot| *knot > t)
                .fold(f64::INFINITY, f64::min),
        }
    }
}
