//! The forces that rigs ask for.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A force over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Signal {
    /// Sum of a·cos(2πft + φ) over (f in Hz, φ in rad), with an amplitude that goes evenly from `first_n` to `last_n`.
    Tones {
        /// Frequencies and phases.
        tones: Vec<(f64, f64)>,
        /// Amplitude of each tone at the start, N.
        first_n: f64,
        /// Amplitude of each tone at the end, N.
        last_n: f64,
        /// Duration, s.
        seconds: f64,
    },
    /// One frequency after the other; each step begins at phase 0 and is followed by a pause.
    StepSine {
        /// The steps in their order.
        steps: Vec<Step>,
        /// How long each is excited, s.
        dwell_s: f64,
        /// How long nothing is done after each, s.
        pause_s: f64,
    },
    /// A frequency that glides evenly in time.
    Sweep {
        /// First frequency, Hz.
        first_hz: f64,
        /// Last frequency, Hz; below the first for a backward sweep.
        last_hz: f64,
        /// Amplitude, N.
        amplitude_n: f64,
        /// Duration, s.
        seconds: f64,
    },
    /// Blows of a hammer: half sines.
    Impacts {
        /// The blows in their order.
        impacts: Vec<Impact>,
        /// Duration of the record, s.
        seconds: f64,
    },
    /// Pulled slowly, then let go.
    Release {
        /// The pull, N.
        force_n: f64,
        /// How long the pull grows, as half a cosine, s; it is held for a fifth of that.
        pull_s: f64,
        /// How long the structure is watched after it was let go, s.
        seconds: f64,
    },
}

/// One step of a step-sine test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, N.
    pub amplitude_n: f64,
}

/// One blow of a hammer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// When it begins, s.
    pub start_s: f64,
    /// Its peak, N.
    pub peak_n: f64,
    /// How long it lasts, s.
    pub pulse_s: f64,
}

impl Signal {
    /// Tones of equal amplitude with phases drawn by `seed`; one tone alone has phase −π/2, a sine.
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

    /// Every frequency at every level, level after level.
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

    /// `count` blows with `spacing_s` between them, the first a tenth of that after the start. Peaks scatter by a fifth
    /// either way, as a hand's do.
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

    /// The force at `t`, N.
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
                let turns = first_hz * t + 0.5 * (last_hz - first_hz) / seconds * t * t;
                amplitude_n * (TAU * turns).sin()
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

    /// A quarter of the shortest period, s; knots say where pulses are.
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

    /// The first time after `t` at which the force or one of its lower derivatives jumps.
    pub fn next_knot_s(&self, t: f64) -> f64 {
        match self {
            Self::Tones { .. } | Self::Sweep { .. } => f64::INFINITY,
            Self::StepSine { dwell_s, pause_s, .. } => {
                let index = (t / (dwell_s + pause_s)).floor();
                // The next but one start too: rounding may put `index` on either side of a start.
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
