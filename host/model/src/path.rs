//! What a term of the equation of motion does along a motion that is known.

use super::{At, Branch, Term};

/// Displacement and velocity of the tool in the machine's axes, finely sampled; an axis without motion is empty.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Time between samples, s.
    pub step_s: f64,
    /// Time of the first sample from the start of the record, s.
    pub start_s: f64,
    /// Displacement, m.
    pub x: [Vec<f64>; 3],
    /// Velocity, m/s.
    pub v: [Vec<f64>; 3],
    /// Speeds below this cannot be told from rest, m/s.
    pub rest_m_per_s: [f64; 3],
}

impl Motion {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.x.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// True where there is no motion.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How far it swings from end to end, along the axis along which that is most, m.
    pub fn swing_m(&self) -> f64 {
        let swing = |x: &Vec<f64>| {
            let ends = x
                .iter()
                .fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(*x), high.max(*x)));
            ends.1 - ends.0
        };
        self.x.iter().map(swing).fold(0.0, f64::max)
    }

    /// The tool at a sample.
    pub fn at(&self, sample: usize) -> At {
        let of = |signal: &[Vec<f64>; 3]| {
            std::array::from_fn(|axis| signal[axis].get(sample).copied().unwrap_or(0.0))
        };
        At {
            t: self.start_s + sample as f64 * self.step_s,
            x: of(&self.x),
            v: of(&self.v),
        }
    }

    /// Moves the motion along an axis so far towards its past.
    pub fn advance(&mut self, axis: usize, seconds: f64) {
        let place = seconds / self.step_s;
        for signal in [&mut self.x[axis], &mut self.v[axis]] {
            *signal = (0..signal.len())
                .map(|sample| between(signal, sample as f64 + place))
                .collect();
        }
    }

    /// Root mean square of the displacement along an axis, m.
    pub fn size_m(&self, axis: usize) -> f64 {
        let squares: f64 = self.x[axis].iter().map(|x| x * x).sum();
        (squares / self.x[axis].len().max(1) as f64).sqrt()
    }

    /// Largest displacement along an axis, m.
    pub fn largest_m(&self, axis: usize) -> f64 {
        self.x[axis].iter().fold(0.0, |most, x| x.abs().max(most))
    }
}

/// A signal between its samples, by a cubic through four of them; `place` counts samples.
pub fn between(samples: &[f64], place: f64) -> f64 {
    let Some(last) = samples.len().checked_sub(1) else {
        return 0.0;
    };
    let index = (place.max(0.0) as usize).min(last);
    let u = place - index as f64;
    let of = |index: usize| samples[index.min(last)];
    let (a, b, c, d) = (
        of(index.saturating_sub(1)),
        of(index),
        of(index + 1),
        of(index + 2),
    );
    b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
}

/// f_r of a term along `motion`, N, in the machine's axes.
///
/// Branches follow the motion as they do in a simulation. A term that can hold an axis and has no
/// state of its own (dry friction) is blended between its branches where the speed cannot be told from rest.
pub fn restoring_along(term: &dyn Term, motion: &Motion) -> [Vec<f64>; 3] {
    if let Some(axis) = term.holds().filter(|_| term.states() == 0) {
        let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; motion.len()]);
        for sample in 0..motion.len() {
            let value = blended(term, axis, &motion.at(sample), motion.rest_m_per_s[axis]);
            for (signal, value) in force.iter_mut().zip(value) {
                signal[sample] = value;
            }
        }
        return force;
    }
    let mut own = vec![0.0; term.states()];
    term.begin(&motion.at(0), &mut own);
    restoring_from(term, motion, &mut own)
}

/// The same for a term that cannot hold an axis by itself, from its own states at the first sample to those at the last.
pub fn restoring_from(term: &dyn Term, motion: &Motion, own: &mut [f64]) -> [Vec<f64>; 3] {
    let count = motion.len();
    let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; count]);
    let mut branch = None;
    let mut before: Option<At> = None;
    for sample in 0..count {
        let at = motion.at(sample);
        if let (Some(before), Some(branch)) = (before, branch)
            && !own.is_empty()
            && !term.follow(&at, own)
        {
            step(term, branch, (&before, &at), motion.step_s, own);
        }
        let now = settled(term, branch, &at, own);
        for (signal, value) in force.iter_mut().zip(term.restoring_n(now, &at, own)) {
            signal[sample] = value;
        }
        (branch, before) = (Some(now), Some(at));
    }
    force
}

/// The branch that holds at `at`, coming from another.
fn settled(term: &dyn Term, branch: Option<Branch>, at: &At, own: &[f64]) -> Branch {
    let mut now = branch.unwrap_or_else(|| term.next(None, at, own, 0.0));
    // A sampled motion may pass several ends of branches at once.
    for _ in 0..4 {
        if term.margin(now, at, own, 0.0) >= 0.0 {
            break;
        }
        now = term.next(Some(now), at, own, 0.0);
    }
    now
}

/// Heun's method from one sample to the next in two steps, with the motion even between them.
fn step(term: &dyn Term, branch: Branch, (from, to): (&At, &At), step_s: f64, own: &mut [f64]) {
    let mix = |share: f64| At {
        t: from.t + share * step_s,
        x: std::array::from_fn(|axis| from.x[axis] + share * (to.x[axis] - from.x[axis])),
        v: std::array::from_fn(|axis| from.v[axis] + share * (to.v[axis] - from.v[axis])),
    };
    let (mut first, mut second) = (vec![0.0; own.len()], vec![0.0; own.len()]);
    let half = 0.5 * step_s;
    for share in [0.0, 0.5] {
        let now = settled(term, Some(branch), &mix(share), own);
        term.rate(now, &mix(share), own, &mut first);
        let ahead: Vec<f64> = own
            .iter()
            .zip(&first)
            .map(|(own, rate)| own + half * rate)
            .collect();
        term.rate(now, &mix(share + 0.5), &ahead, &mut second);
        for ((own, first), second) in own.iter_mut().zip(&first).zip(&second) {
            *own += 0.5 * half * (first + second);
        }
        term.confine(own);
    }
}

fn blended(term: &dyn Term, axis: usize, at: &At, rest_m_per_s: f64) -> [f64; 3] {
    let moving = |sign: f64| {
        let mut at = *at;
        at.v[axis] = sign * at.v[axis].abs().max(f64::MIN_POSITIVE);
        term.restoring_n(term.next(None, &at, &[], 0.0), &at, &[])
    };
    let share = if rest_m_per_s > 0.0 {
        (at.v[axis] / rest_m_per_s).clamp(-1.0, 1.0)
    } else {
        at.v[axis].signum()
    };
    let (forward, backward) = (moving(1.0), moving(-1.0));
    std::array::from_fn(|i| 0.5 * ((1.0 + share) * forward[i] + (1.0 - share) * backward[i]))
}
