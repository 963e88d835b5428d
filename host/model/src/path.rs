//! Restoring force along a sampled motion, measured or computed.

use super::{MotionState, Regime, RestoringForce};

/// Displacement and velocity of the tool in the machine's axes, sampled at constant intervals. An axis with empty
/// vectors is at rest.
#[derive(Clone, Debug, Default)]
pub struct SampledMotion {
    /// Sampling interval, s.
    pub step_s: f64,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Displacement of the tool, m: for x, y and z, one value per sample or none.
    pub x: [Vec<f64>; 3],
    /// Velocity of the tool, m/s: for x, y and z, one value per sample or none.
    pub v: [Vec<f64>; 3],
    /// For x, y and z, the speed, m/s, below which the tool cannot be told from rest, such as the noise level of a
    /// measured velocity.
    pub rest_m_per_s: [f64; 3],
}

impl SampledMotion {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.x.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// True if the motion has no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Largest range of the displacement among the three axes, m; each range includes 0.
    pub fn peak_to_peak_m(&self) -> f64 {
        let peak_to_peak = |x: &Vec<f64>| {
            let ends = x
                .iter()
                .fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(*x), high.max(*x)));
            ends.1 - ends.0
        };
        self.x.iter().map(peak_to_peak).fold(0.0, f64::max)
    }

    /// Time, displacement and velocity of the tool at a sample; displacement and velocity are 0 where there is no
    /// value.
    pub fn at(&self, sample: usize) -> MotionState {
        let of = |signal: &[Vec<f64>; 3]| {
            std::array::from_fn(|axis| signal[axis].get(sample).copied().unwrap_or(0.0))
        };
        MotionState {
            t: self.start_s + sample as f64 * self.step_s,
            x: of(&self.x),
            v: of(&self.v),
        }
    }

    /// Shifts the motion along an axis to earlier times by `seconds`: sample k gets the [`interpolated`] value from
    /// `seconds` after it.
    pub fn advance(&mut self, axis: usize, seconds: f64) {
        let place = seconds / self.step_s;
        for signal in [&mut self.x[axis], &mut self.v[axis]] {
            *signal = (0..signal.len())
                .map(|sample| interpolated(signal, sample as f64 + place))
                .collect();
        }
    }

    /// Root mean square displacement along an axis, m.
    pub fn size_m(&self, axis: usize) -> f64 {
        let squares: f64 = self.x[axis].iter().map(|x| x * x).sum();
        (squares / self.x[axis].len().max(1) as f64).sqrt()
    }

    /// Largest absolute displacement along an axis, m.
    pub fn largest_m(&self, axis: usize) -> f64 {
        self.x[axis].iter().fold(0.0, |most, x| x.abs().max(most))
    }
}

/// Catmull–Rom (cubic) interpolation of a signal at `place`, counted in samples from 0; the first and the last sample
/// are repeated beyond the ends. Before the first sample the polynomial of the first interval is extrapolated, after
/// the last one that of the interval between the last sample and its repetition. 0 for a signal without samples.
pub fn interpolated(samples: &[f64], place: f64) -> f64 {
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

/// Restoring force f_r, N: for x, y and z, one value per sample of `motion`.
///
/// For a force with a locked regime and without internal states, such as dry friction, f_r is interpolated linearly
/// between its values in the two slip directions while the speed along its axis is below
/// [`SampledMotion::rest_m_per_s`]. Every other force is that of [`restoring_from`], with the initial states of
/// [`RestoringForce::begin`].
pub fn restoring_along(restoring_force: &dyn RestoringForce, motion: &SampledMotion) -> [Vec<f64>; 3] {
    if let Some(axis) = restoring_force.holds().filter(|_| restoring_force.states() == 0) {
        let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; motion.len()]);
        for sample in 0..motion.len() {
            let value = blended(
                restoring_force,
                axis,
                &motion.at(sample),
                motion.rest_m_per_s[axis],
            );
            for (signal, value) in force.iter_mut().zip(value) {
                signal[sample] = value;
            }
        }
        return force;
    }
    let mut own = vec![0.0; restoring_force.states()];
    restoring_force.begin(&motion.at(0), &mut own);
    restoring_from(restoring_force, motion, &mut own)
}

/// Restoring force f_r, N, for a force that has internal states or no locked regime: for x, y and z, one value per
/// sample of `motion`. `own` holds the internal states at the first sample before the call, and those at the last
/// sample after it. The holding force is taken as 0.
pub fn restoring_from(
    restoring_force: &dyn RestoringForce,
    motion: &SampledMotion,
    own: &mut [f64],
) -> [Vec<f64>; 3] {
    let count = motion.len();
    let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; count]);
    let mut regime = None;
    let mut before: Option<MotionState> = None;
    for sample in 0..count {
        let at = motion.at(sample);
        if let (Some(before), Some(regime)) = (before, regime)
            && !own.is_empty()
            && !restoring_force.follow(&at, own)
        {
            step(restoring_force, regime, (&before, &at), motion.step_s, own);
        }
        // The memory of a path knows its branch.
        let now = if restoring_force.remembers() {
            0
        } else {
            regime_at(restoring_force, regime, &at, own)
        };
        for (signal, value) in force.iter_mut().zip(restoring_force.restoring_n(now, &at, own)) {
            signal[sample] = value;
        }
        (regime, before) = (Some(now), Some(at));
    }
    force
}

/// The regime of a restoring force at the instant `at`, from its last `regime`; `None` before the first sample.
fn regime_at(
    restoring_force: &dyn RestoringForce,
    regime: Option<Regime>,
    at: &MotionState,
    own: &[f64],
) -> Regime {
    let mut now = regime.unwrap_or_else(|| restoring_force.next(None, at, own, 0.0));
    // Between two samples the motion may pass through several regimes of the restoring force; the loop follows at most
    // four changes.
    for _ in 0..4 {
        if restoring_force.margin(now, at, own, 0.0) >= 0.0 {
            break;
        }
        now = restoring_force.next(Some(now), at, own, 0.0);
    }
    now
}

/// Integrates the internal states from one sample to the next with two steps of Heun's method; displacement and
/// velocity are taken as linear between the samples.
fn step(
    restoring_force: &dyn RestoringForce,
    regime: Regime,
    (from, to): (&MotionState, &MotionState),
    step_s: f64,
    own: &mut [f64],
) {
    let mix = |share: f64| MotionState {
        t: from.t + share * step_s,
        x: std::array::from_fn(|axis| from.x[axis] + share * (to.x[axis] - from.x[axis])),
        v: std::array::from_fn(|axis| from.v[axis] + share * (to.v[axis] - from.v[axis])),
    };
    let (mut first, mut second) = (vec![0.0; own.len()], vec![0.0; own.len()]);
    let half = 0.5 * step_s;
    for share in [0.0, 0.5] {
        let now = regime_at(restoring_force, Some(regime), &mix(share), own);
        restoring_force.rate(now, &mix(share), own, &mut first);
        let ahead: Vec<f64> = own
            .iter()
            .zip(&first)
            .map(|(own, rate)| own + half * rate)
            .collect();
        restoring_force.rate(now, &mix(share + 0.5), &ahead, &mut second);
        for ((own, first), second) in own.iter_mut().zip(&first).zip(&second) {
            *own += 0.5 * half * (first + second);
        }
        restoring_force.confine(own);
    }
}

fn blended(
    restoring_force: &dyn RestoringForce,
    axis: usize,
    at: &MotionState,
    rest_m_per_s: f64,
) -> [f64; 3] {
    let moving = |sign: f64| {
        let mut at = *at;
        at.v[axis] = sign * at.v[axis].abs().max(f64::MIN_POSITIVE);
        restoring_force.restoring_n(restoring_force.next(None, &at, &[], 0.0), &at, &[])
    };
    let share = if rest_m_per_s > 0.0 {
        (at.v[axis] / rest_m_per_s).clamp(-1.0, 1.0)
    } else {
        at.v[axis].signum()
    };
    let (forward, backward) = (moving(1.0), moving(-1.0));
    std::array::from_fn(|i| 0.5 * ((1.0 + share) * forward[i] + (1.0 - share) * backward[i]))
}
