//! Linear equivalent of a restoring force on a forced orbit: spring, damper and constant force.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::periodic_orbit::{Orbit, SubintervalNodes};
use crate::criteria::{DISTURBANCE, DISTURBANCE_PERIODS};
use quietcut_model::RestoringForce;
use quietcut_model::path::{SampledMotion, restoring_along, restoring_from};

/// Mean number of samples of the orbit in a subinterval of the mesh, for forces of friction, backlash and hysteresis,
/// unless [`LEAST`] requires more. Over a subinterval the fastest motion rotates by a few radians. A choice.
const PER_SUBINTERVAL: usize = 128;

/// Least number of samples of the orbit in a period for the forces of friction, backlash and hysteresis. A choice.
const LEAST: usize = 1024;

/// Number of periods after which the hysteresis loop of a restoring force with internal states is taken as closed at
/// the latest. A choice.
const PERIODS: usize = 64;

/// Change of an internal state over a period, relative to the largest displacement of the orbit, at which a hysteresis
/// loop counts as closed.
const CLOSED: f64 = 1e-8;

/// Linear equivalent of the restoring forces along one axis: f_r = force + stiffness·x + damping·ẋ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spring {
    /// Constant force, N.
    pub(super) force_n: f64,
    /// Stiffness, N/m.
    pub(super) stiffness: f64,
    /// Damping, N s/m.
    pub(super) damping: f64,
}

/// Displacement and velocity of the tool on a forced orbit along the machine's axes, sampled at equal time steps over
/// one period of the orbit.
pub(super) struct Samples {
    step_s: f64,
    x: [Vec<f64>; 3],
    v: [Vec<f64>; 3],
}

impl Samples {
    /// Samples the orbit at the middles of equal time steps, by interpolation between the nodes; `seen` are the
    /// matrices from states to displacement and to velocity of the tool.
    pub(super) fn new(
        subintervals: &[SubintervalNodes<'_>],
        orbit: &Orbit,
        period_s: f64,
        seen: [&DMatrix<f64>; 2],
    ) -> Self {
        let count = (PER_SUBINTERVAL * subintervals.len()).max(LEAST);
        let step_s = period_s / count as f64;
        let (mut x, mut v) = ([(); 3].map(|()| Vec::new()), [(); 3].map(|()| Vec::new()));
        let mut index = 0;
        for (place, (subinterval, states)) in subintervals.iter().zip(&orbit.states).enumerate() {
            let at_nodes = seen.map(|seen| seen * states);
            let is_last = place + 1 == subintervals.len();
            let end_s = subinterval.start_s + subinterval.duration_s;
            while index < count && (is_last || (index as f64 + 0.5) * step_s <= end_s) {
                let share = ((index as f64 + 0.5) * step_s - subinterval.start_s) / subinterval.duration_s;
                let weights = subinterval.gauss.lagrange(share);
                for (signal, at_nodes) in [&mut x, &mut v].into_iter().zip(&at_nodes) {
                    for (signal, row) in signal.iter_mut().zip(at_nodes.row_iter()) {
                        signal.push(row.iter().zip(&weights).map(|(a, b)| a * b).sum());
                    }
                }
                index += 1;
            }
        }
        Self { step_s, x, v }
    }

    fn len(&self) -> usize {
        self.x[0].len()
    }

    /// Largest absolute displacement of the tool on the orbit along any axis, m.
    pub(super) fn largest_m(&self) -> f64 {
        self.x.iter().flatten().fold(0.0, |most, x| x.abs().max(most))
    }

    /// Sampled motion of the tool over `periods` periods of the orbit; `added` gives the disturbance of displacement
    /// and velocity along `axis` at a time, s.
    fn motion(&self, periods: usize, axis: usize, added: impl Fn(f64) -> [f64; 2]) -> SampledMotion {
        let count = self.len();
        let mut x: [Vec<f64>; 3] = std::array::from_fn(|axis| self.x[axis].repeat(periods));
        let mut v: [Vec<f64>; 3] = std::array::from_fn(|axis| self.v[axis].repeat(periods));
        for sample in 0..count * periods {
            let [by_x, by_v] = added((sample as f64 + 0.5) * self.step_s);
            x[axis][sample] += by_x;
            v[axis][sample] += by_v;
        }
        // Speed below which friction acts with its mean over a time step: half of the largest change of velocity from
        // one sample to the next, since the velocity may change sign within a step.
        let rest_m_per_s = std::array::from_fn(|axis| {
            let velocity = &self.v[axis];
            let steps = (0..count).map(|n| (velocity[(n + 1) % count] - velocity[n]).abs());
            0.5 * steps.fold(0.0, f64::max)
        });
        SampledMotion {
            step_s: self.step_s,
            start_s: 0.0,
            x,
            v,
            rest_m_per_s,
        }
    }

    /// Restoring force of a term along the orbit over one period, N, by axis of the machine, once its hysteresis loop
    /// is closed, or after [`PERIODS`] periods.
    ///
    /// The internal states are the fixed point of their map over a period, found by repetition; for a single state,
    /// secant steps shorten it.
    fn force_n(&self, term: &dyn RestoringForce) -> [Vec<f64>; 3] {
        if term.states() == 0 {
            return restoring_along(term, &self.motion(1, 0, |_| [0.0; 2]));
        }
        // The first sample of the next period is appended, so that the internal state at the end of the period is
        // known.
        let mut period = self.motion(1, 0, |_| [0.0; 2]);
        for signal in period.x.iter_mut().chain(&mut period.v) {
            signal.push(signal[0]);
        }
        let mut start = vec![0.0; term.states()];
        term.begin(&period.at(0), &mut start);
        let size_m = self.largest_m();
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..PERIODS {
            let mut own = start.clone();
            let mut force = restoring_from(term, &period, &mut own);
            let miss = own.iter().zip(&start).map(|(to, from)| (to - from).abs());
            if miss.fold(0.0, f64::max) <= CLOSED * size_m {
                for signal in &mut force {
                    signal.truncate(self.len());
                }
                return force;
            }
            let (from, to) = (start[0], own[0]);
            let slope = before.map_or(0.0, |(from_before, to_before)| {
                (to - to_before) / (from - from_before)
            });
            before = Some((from, to));
            start = own;
            // Secant step to the fixed point of the map over a period. It is taken only where the slope of the map is
            // at least 0 and below 0.999, as for a term with fading memory.
            if term.states() == 1 && (0.0..0.999).contains(&slope) {
                start[0] = from + (to - from) / (1.0 - slope);
            }
        }
        let mut own = start.clone();
        let mut force = restoring_from(term, &period, &mut own);
        for signal in &mut force {
            signal.truncate(self.len());
        }
        force
    }
}

fn mean(a: &[f64]) -> f64 {
    a.iter().sum::<f64>() / a.len().max(1) as f64
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Regression coefficient ⟨a b⟩/⟨b²⟩ of the signal a on the signal b; 0 if b vanishes.
fn share(a: &[f64], b: &[f64]) -> f64 {
    let whole = dot(b, b);
    if whole > 0.0 { dot(a, b) / whole } else { 0.0 }
}

/// Equivalent spring, damper and mean force, by axis, of all friction, backlash and hysteresis terms along the orbit. A
/// damper as large as `most_damping` means that friction sticks and holds the tool.
pub(super) fn equivalent(
    terms: &[Box<dyn RestoringForce>],
    samples: &Samples,
    most_damping: [f64; 3],
) -> [Spring; 3] {
    let mut force: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; samples.len()]);
    for term in terms {
        for (sum, added) in force.iter_mut().zip(samples.force_n(&**term)) {
            sum.iter_mut().zip(added).for_each(|(sum, added)| *sum += added);
        }
    }
    std::array::from_fn(|axis| {
        let middle_m = mean(&samples.x[axis]);
        let centered: Vec<f64> = samples.x[axis].iter().map(|x| x - middle_m).collect();
        let stiffness = share(&force[axis], &centered);
        let damping = share(&force[axis], &samples.v[axis]);
        if damping >= most_damping[axis] {
            return Spring {
                damping: most_damping[axis],
                ..Spring::default()
            };
        }
        Spring {
            force_n: mean(&force[axis]) - stiffness * middle_m,
            stiffness,
            damping: damping.max(0.0),
        }
    })
}

/// Incremental spring and damper that a small disturbance of a given frequency (Hz) sees on the orbit, by axis: the
/// parts of the force change in phase with its displacement and with its velocity. An axis that sticks or is at rest
/// keeps its spring from `springs`.
pub(super) fn incremental(
    terms: &[Box<dyn RestoringForce>],
    samples: &Samples,
    frequency_hz: f64,
    springs: &[Spring; 3],
    most_damping: [f64; 3],
) -> [Spring; 3] {
    let omega = TAU * frequency_hz;
    std::array::from_fn(|axis| {
        let middle_m = mean(&samples.x[axis]);
        let centered: Vec<f64> = samples.x[axis].iter().map(|x| x - middle_m).collect();
        let size_m = DISTURBANCE * (dot(&centered, &centered) / centered.len().max(1) as f64).sqrt();
        if size_m == 0.0 || springs[axis].damping >= most_damping[axis] {
            return springs[axis];
        }
        let disturbance = |t: f64| [size_m * (omega * t).sin(), size_m * omega * (omega * t).cos()];
        let mut spring = Spring::default();
        let first = DISTURBANCE_PERIODS / 2 * samples.len();
        for term in terms {
            let plain = restoring_along(&**term, &samples.motion(DISTURBANCE_PERIODS, axis, |_| [0.0; 2]));
            let disturbed = restoring_along(&**term, &samples.motion(DISTURBANCE_PERIODS, axis, disturbance));
            let change: Vec<f64> = (first..plain[axis].len())
                .map(|n| disturbed[axis][n] - plain[axis][n])
                .collect();
            let added: Vec<[f64; 2]> = (first..plain[axis].len())
                .map(|n| disturbance((n as f64 + 0.5) * samples.step_s))
                .collect();
            let part = |which: usize| added.iter().map(|added| added[which]).collect::<Vec<f64>>();
            spring.stiffness += share(&change, &part(0));
            spring.damping += share(&change, &part(1));
        }
        spring.damping = spring.damping.clamp(0.0, most_damping[axis]);
        spring
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use quietcut_model::effects::Effects;

    const SIZE_M: f64 = 3e-5;
    const OMEGA: f64 = 110.0;

    /// Harmonic orbit along y.
    fn harmonic() -> Samples {
        let count = 2048;
        let step_s = TAU / OMEGA / count as f64;
        let at = |sample: usize| OMEGA * (sample as f64 + 0.5) * step_s;
        Samples {
            step_s,
            x: [
                vec![0.0; count],
                (0..count).map(|n| SIZE_M * at(n).sin()).collect(),
                vec![0.0; count],
            ],
            v: [
                vec![0.0; count],
                (0..count).map(|n| SIZE_M * OMEGA * at(n).cos()).collect(),
                vec![0.0; count],
            ],
        }
    }

    fn terms(effects: &[&str]) -> Vec<Box<dyn RestoringForce>> {
        let case = quietcut_testkit::case("kuka-kr90-half");
        let effects = Effects::parse(effects.iter().copied()).unwrap();
        effects.dynamics(case.structure().unwrap()).unwrap().1
    }

    #[test]
    fn friction_on_a_harmonic_orbit_has_its_describing_function() {
        let friction = terms(&["coulomb-friction=2", "coulomb-friction.direction=y"]);
        let [_, spring, _] = equivalent(&friction, &harmonic(), [1e9; 3]);
        // Describing function of Coulomb friction, 4 f_c/(π A ω); a small disturbance sees half of it.
        let exact = 8.0 / (std::f64::consts::PI * SIZE_M * OMEGA);
        assert!((spring.damping / exact - 1.0).abs() < 1e-5, "{spring:?} {exact}");
        assert!(spring.stiffness.abs() < 1e-5 * exact * OMEGA);
        let springs = [spring; 3];
        // The frequency of the disturbance is no simple multiple of that of the orbit.
        let [_, small, _] = incremental(&friction, &harmonic(), OMEGA / TAU * 0.7236, &springs, [1e9; 3]);
        assert!((small.damping / exact - 0.5).abs() < 0.02, "{small:?} {exact}");
        // If the equivalent damping exceeds the limit, friction sticks.
        let [_, held, _] = equivalent(&friction, &harmonic(), [0.5 * exact; 3]);
        assert_eq!(held.damping, 0.5 * exact);
    }

    #[test]
    fn backlash_on_a_harmonic_orbit_has_its_describing_function() {
        let gap_mm = 0.02;
        let play = terms(&[
            "backlash=0.02",
            "backlash.stiffness_fraction=0.3",
            "backlash.direction=y",
        ]);
        let [_, spring, _] = equivalent(&play, &harmonic(), [1e9; 3]);
        let case = quietcut_testkit::case("kuka-kr90-half");
        let structure = case.structure().unwrap().first_order().unwrap();
        let stiffness = 0.3 / structure.receptance(0.0).unwrap()[(1, 1)].re;
        // Dead zone: no force within ±g, beyond it a spring that starts there.
        let share = 0.5e-3 * gap_mm / SIZE_M;
        let missing = 2.0 / std::f64::consts::PI * (share.asin() + share * (1.0 - share * share).sqrt());
        let exact = -stiffness * missing;
        assert!(
            (spring.stiffness / exact - 1.0).abs() < 1e-3,
            "{spring:?} {exact}"
        );
        assert!(spring.damping.abs() < 1e-6 * stiffness / OMEGA);
    }

    #[test]
    fn a_joint_on_a_harmonic_orbit_has_its_describing_function() {
        for slip in [
            &[][..],
            &["joint-friction.slip_m=1e-5", "joint-friction.beta=0.5"],
        ] {
            let first = [
                "joint-friction=2e5",
                "joint-friction.exponent=0.6",
                "joint-friction.reference_m=1e-5",
                "joint-friction.direction=y",
            ];
            let texts: Vec<&str> = first.iter().chain(slip).copied().collect();
            let joint = terms(&texts);
            let [_, spring, _] = equivalent(&joint, &harmonic(), [1e9; 3]);
            let exact = joint[0].describing_function(SIZE_M, OMEGA).unwrap();
            assert!(
                (spring.stiffness / exact.re - 1.0).abs() < 1e-4,
                "{spring:?} {exact}"
            );
            assert!(
                (spring.damping * OMEGA / exact.im - 1.0).abs() < 1e-4,
                "{spring:?} {exact}"
            );
        }
    }

    #[test]
    fn hysteresis_dissipates_the_area_of_its_loop() {
        let loops = terms(&[
            "hysteresis=2e5",
            "hysteresis.yield_m=1e-5",
            "hysteresis.direction=y",
        ]);
        let samples = harmonic();
        let [_, spring, _] = equivalent(&loops, &samples, [1e9; 3]);
        // Reference: the area of the last of forty loops from rest.
        let motion = samples.motion(40, 1, |_| [0.0; 2]);
        let force = &restoring_along(&*loops[0], &motion)[1];
        let work: f64 = (39 * samples.len()..40 * samples.len())
            .map(|n| force[n] * motion.v[1][n] * motion.step_s)
            .sum();
        let exact = work / (std::f64::consts::PI * SIZE_M * SIZE_M * OMEGA);
        assert!((spring.damping / exact - 1.0).abs() < 1e-5, "{spring:?} {exact}");
        assert!(spring.stiffness < 0.0 && spring.stiffness > -2e5, "{spring:?}");
    }
}
